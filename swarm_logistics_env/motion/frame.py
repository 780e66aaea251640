"""The inputs and outputs of a network, in the frame of its robot's motion.

A swarm has no compass, so what is to the left of a robot's motion matters, not what is to the
left of its body. The frame is turned by whole beams, so that scans need no interpolation.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import observations as row
from swarm_logistics_env.errors import PolicyError
from swarm_logistics_env.kernels import inlined_kernel, kernel, uniform
from swarm_logistics_env.motion import memory as known
from swarm_logistics_env.motion.memory import in_frame, length_of
from swarm_logistics_env.scenario import Scenario

N_FAR, N_NEAR, N_OBSTACLES = 8, 3, 6  # neighbours, near ones, items that a laden robot avoids
WALL_REACH, FAR, NEAR = 0.7, 2.0, 0.5  # [m], where nearness 1 .. 0 ends
RANDOM_HEADING_TIME = 0.8  # [s] that a random direction lasts
FARTHEST = 8.0  # [m] from the delivery area, as far as a network is told
FIRST_RANDOM_HEADING = 1_000_003  # number in the robot's stream

OUTPUTS = ("along", "aside", "gripper")


_VECTOR = ("along", "aside")
INPUTS: tuple[str, ...] = (
    *(f"wall_{beam}" for beam in range(row.N_BEAMS)),
    *(f"neighbour_{n}_{part}" for n in range(N_FAR) for part in _VECTOR),
    *(f"near_neighbour_{n}_{part}" for n in range(N_NEAR) for part in _VECTOR),
    *(f"obstacle_{n}_{part}" for n in range(N_OBSTACLES) for part in ("present", *_VECTOR)),
    "requested_present", "requested_along", "requested_aside", "requested_distance",
    "requested_nearness", "requested_recently_held",
    "lead_present", "lead_along", "lead_aside", "lead_distance", "lead_timer",
    "carrying", "carrying_requested", "in_delivery_area", "timer_runs", "timer", "contact",
    "velocity_along", "velocity_aside", "heading_along", "heading_aside",
    "home_along", "home_aside", "home_certainty", "failed", "stuck",
    "whim_along", "whim_aside",
    "kept_home_along", "kept_home_aside", "kept_home_distance",
    "cannot_deliver", "cannot_lift", "delivering_in_vain", "items_in_view",
    "top_speed", "handling_time", "turns_to_drive",
)  # fmt: skip
LEAD = slice(INPUTS.index("lead_present"), INPUTS.index("lead_timer") + 1)


class MotionView:
    """Makes network inputs from observation rows, and commands from outputs, row by row.

    Each row has a memory of its own (see `memory`), begun anew by `begin`.

    Args:
        scenario: for its control period and for what robots know of their bodies.
        listens: whether the lowest timer heard is read; zeros if not, so that no liar leads.

    Attributes:
        keys: of each row's stream (N,).
        counts: the decisions of each row in its episode so far (N,).
        rows: the observations last read (N, D).
        turned: how far each row's frame is turned from its robot's body (N,) [rad].
    """

    def __init__(self, scenario: Scenario, listens: bool = True) -> None:
        self._period = scenario.control_period
        self._body = known.body_of(scenario)
        self._listens = listens
        self.begin(np.empty(0, np.uint64))

    def begin(self, keys: NDArray[np.uint64], bodies: NDArray[np.float64] | None = None) -> None:
        """Begin an episode of as many rows as there are keys, which are those of their streams.

        Args:
            bodies: (N, 3) of robots that are not all as the scenario has them (`memory.body_of`).
        """
        n = len(keys)
        self.keys, self.counts = np.empty(n, np.uint64), np.empty(n, np.int64)
        self.memory, self.turned = np.empty((n, known.N_COLUMNS)), np.zeros(n)
        self.begin_rows(np.arange(n), keys, bodies)

    def begin_rows(
        self,
        rows: NDArray[np.int64],
        keys: NDArray[np.uint64],
        bodies: NDArray[np.float64] | None = None,
    ) -> None:
        """Begin an episode in these rows alone."""
        self.keys[rows], self.counts[rows] = keys, 0
        fresh = np.zeros((len(rows), known.N_COLUMNS))
        fresh[:, known.BODY :] = self._body if bodies is None else bodies
        known.face_anywhere(keys, fresh)
        self.memory[rows] = fresh

    def read(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the inputs (N, len(INPUTS)) of the next decision; memories and time go on.

        Raises:
            PolicyError: there are more or fewer rows than keys at `begin`.
        """
        if len(observations) != len(self.keys):
            raise PolicyError(
                f"observations of {len(observations)} robots: reset was told {len(self.keys)}"
            )
        inputs = self._inputs(observations, self.memory, slice(None), self.turned)
        self.counts += 1
        self.rows = observations
        return inputs

    def peek(
        self, observations: NDArray[np.float32], rows: NDArray[np.int64]
    ) -> NDArray[np.float32]:
        """Return the inputs that observations of these rows would make, without going on."""
        return self._inputs(observations, self.memory[rows], rows, np.empty(len(rows)))

    def _inputs(
        self,
        observations: NDArray[np.float32],
        memory: NDArray[np.float64],
        rows: slice | NDArray[np.int64],
        turned: NDArray[np.float64],
    ) -> NDArray[np.float32]:
        known.remember(observations, self._period, memory)
        inputs = np.empty((len(observations), len(INPUTS)), np.float32)
        headings = self.random_headings()[rows]
        read_rows(observations, memory, self.keys[rows], headings, inputs, turned)
        if not self._listens:
            inputs[:, LEAD] = 0.0
        return inputs

    def random_headings(self) -> NDArray[np.int64]:
        """Return the number of the random direction that each row's next decision has (N,)."""
        return (self.counts * self._period / RANDOM_HEADING_TIME + 1e-9).astype(np.int64)

    def command(self, outputs: NDArray[np.floating]) -> NDArray[np.float64]:
        """Return the commands (N, 4) that outputs (N, 3) ask for upon the rows last read.

        A robot that is caged by items clears its way instead, and one that handles an item stands.
        A differential robot turns its body to where it wants to drive.
        """
        commands = np.zeros((len(outputs), 4))
        given = outputs.astype(np.float64)
        command_rows(given, self.turned, self.rows, self._period, self.memory, commands)
        return commands

    def outputs_for(self, commands: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the outputs (N, 3) that ask for these commands (N, 4); turns are left out."""
        cos, sin = np.cos(self.turned), np.sin(self.turned)
        x, y = commands[:, 0], commands[:, 1]
        return np.stack([cos * x + sin * y, cos * y - sin * x, commands[:, 3]], axis=1)


@kernel
def read_rows(
    rows: NDArray[np.float32],
    memory: NDArray[np.float64],
    keys: NDArray[np.uint64],
    random_headings: NDArray[np.int64],
    inputs: NDArray[np.float32],
    turned: NDArray[np.float64],
) -> None:
    """Fill inputs (N, len(INPUTS)) and how far each frame is turned from the body's (N,) [rad]."""
    for robot in range(rows.shape[0]):
        sensed, own, read = rows[robot], memory[robot], inputs[robot]
        heading = math.atan2(own[known.HEADING_Y], own[known.HEADING_X])
        beams = round(heading / (2.0 * math.pi / row.N_BEAMS)) % row.N_BEAMS
        turned[robot] = 2.0 * math.pi * beams / row.N_BEAMS
        frame = math.cos(turned[robot]), math.sin(turned[robot])
        for beam in range(row.N_BEAMS):
            away = sensed[row.RANGE_WALLS + (beam + beams) % row.N_BEAMS]
            read[beam] = max(0.0, 1.0 - away / WALL_REACH)
        at = read_neighbours(sensed, frame, read, row.N_BEAMS)
        at = read_items(sensed, frame, read, at)
        # The robot that tells the lowest timer may lie: it counts less the more this robot knows.
        sure = length_of(own[known.HOME_X], own[known.HOME_Y])
        at = read_lead(sensed, frame, 1.0 - math.tanh(sure), read, at)
        read[at] = sensed[row.CARRYING]
        read[at + 1] = sensed[row.CARRYING_REQUESTED]
        read[at + 2] = sensed[row.IN_DELIVERY_AREA]
        read[at + 3], read[at + 4] = sensed[row.TIMER_RUNS], sensed[row.TIMER] / 10.0
        read[at + 5] = sensed[row.CONTACT]
        at = put(read, at + 6, 0.5, frame, sensed[row.VELOCITY], sensed[row.VELOCITY + 1])
        at = put(read, at, 1.0, frame, own[known.HEADING_X], own[known.HEADING_Y])
        # The heading is at most half a beam aside, so it is doubled to be as large as other inputs.
        read[at - 1] *= 2.0
        unit = math.tanh(sure) / sure if sure > 0.0 else 0.0
        at = put(read, at, unit, frame, own[known.HOME_X], own[known.HOME_Y])
        read[at] = math.tanh(sure / 3.0)
        read[at + 1], read[at + 2] = own[known.FAILED], own[known.STUCK]
        angle = random_heading(keys[robot], random_headings[robot]) - turned[robot]
        read[at + 3], read[at + 4] = math.cos(angle), math.sin(angle)
        x, y, sure = known.kept_home(own)
        sure = math.tanh(sure)
        at = put(read, at + 5, sure, frame, x, y)
        read[at] = sure * min(max(own[known.AWAY], -FARTHEST), FARTHEST) / FARTHEST
        read[at + 1], read[at + 2] = own[known.CANNOT_DELIVER], own[known.CANNOT_LIFT]
        surely = own[known.HANDLING_TIME] + known.SURELY_IN_VAIN
        read[at + 3] = min(1.0, own[known.DELIVERING] / surely)
        in_view = 0.0
        for place in range(row.N_ITEMS_IN_VIEW):
            in_view += sensed[row.ITEMS + row.ITEM_WIDTH * place]
        read[at + 4] = in_view / row.N_ITEMS_IN_VIEW
        read[at + 5] = own[known.TOP_SPEED] / 2.0
        read[at + 6] = own[known.HANDLING_TIME] / 2.0
        read[at + 7] = 1.0 if own[known.WIDEST_TURN] > 0.0 else 0.0


@inlined_kernel
def put(
    read: NDArray[np.float32], at: int, scale: float, frame: tuple[float, float], x: float, y: float
) -> int:
    """Fill two inputs with a vector in the frame, times `scale`; return the column after them."""
    along, aside = in_frame(frame, x, y)
    read[at], read[at + 1] = scale * along, scale * aside
    return at + 2


@kernel
def read_neighbours(
    sensed: NDArray[np.float32], frame: tuple[float, float], read: NDArray[np.float32], at: int
) -> int:
    """Fill the inputs of neighbours, from column `at` on; return the column after them."""
    for place in range(N_FAR + N_NEAR):
        is_far = place < N_FAR
        reach = FAR if is_far else NEAR
        there = row.NEIGHBOURS + row.NEIGHBOUR_WIDTH * (place if is_far else place - N_FAR)
        x, y = float(sensed[there + 1]), float(sensed[there + 2])
        away = length_of(x, y)
        near = max(0.0, 1.0 - away / reach) / away if away > 0.0 else 0.0
        at = put(read, at, near, frame, x, y)
    return at


@kernel
def read_items(
    sensed: NDArray[np.float32], frame: tuple[float, float], read: NDArray[np.float32], at: int
) -> int:
    """Fill the inputs of obstacles and the requested item; return the column after them."""
    carries = sensed[row.CARRYING] > 0.5
    for place in range(N_OBSTACLES):
        there = row.ITEMS + row.ITEM_WIDTH * place
        read[at] = 1.0 if carries and sensed[there] > 0.5 else 0.0
        at = put(read, at + 1, read[at], frame, sensed[there + 1], sensed[there + 2])
    read[at : at + 6] = 0.0
    for place in range(row.N_ITEMS_IN_VIEW):
        there = row.ITEMS + row.ITEM_WIDTH * place
        if sensed[there] > 0.5 and sensed[there + 3] > 0.5:
            x, y = float(sensed[there + 1]), float(sensed[there + 2])
            away = max(length_of(x, y), 1e-9)
            along, aside = in_frame(frame, x, y)
            read[at], read[at + 1], read[at + 2] = 1.0, along / away, aside / away
            read[at + 3] = away
            read[at + 4] = max(0.0, 1.0 - away / NEAR)
            read[at + 5] = sensed[there + 4]
            break  # the nearest one comes first
    return at + 6


@kernel
def read_lead(
    sensed: NDArray[np.float32],
    frame: tuple[float, float],
    trust: float,
    read: NDArray[np.float32],
    at: int,
) -> int:
    """Fill the inputs of the lowest timer heard, times `trust`; return the column after them."""
    heard = sensed[row.LOWEST_TIMER] * trust
    x, y = float(sensed[row.LOWEST_TIMER + 1]), float(sensed[row.LOWEST_TIMER + 2])
    away = length_of(x, y)
    unit = heard / away if away > 0.0 else 0.0
    read[at] = heard
    at = put(read, at + 1, unit, frame, x, y)
    read[at] = heard * away / 4.0
    read[at + 1] = heard * sensed[row.LOWEST_TIMER + 3] / 10.0
    return at + 2


@kernel
def random_heading(key: np.uint64, number: int) -> float:
    """Return a robot's random direction number `number`, in its own frame [rad]."""
    return 2.0 * math.pi * uniform(key, FIRST_RANDOM_HEADING + number)


@kernel
def command_rows(
    outputs: NDArray[np.float64],
    turned: NDArray[np.float64],
    rows: NDArray[np.float32],
    period: float,
    memory: NDArray[np.float64],
    commands: NDArray[np.float64],
) -> None:
    """Fill the commands (N, 4) of outputs (N, 3) upon rows; memories take note of them."""
    for robot in range(outputs.shape[0]):
        sensed, own, command = rows[robot], memory[robot], commands[robot]
        turn_outputs(outputs[robot], turned[robot], command)
        known.clear_the_way(sensed, own, command)
        known.stand_to_handle(sensed, period, own, command)
        known.note_command(sensed, command, own)
        known.steer(own, command)


@kernel
def turn_outputs(outputs: NDArray[np.float64], turned: float, command: NDArray[np.float64]) -> None:
    """Fill the command (4,) of outputs (3,): along, aside, gripper; clipped, no turn."""
    along, aside = min(max(outputs[0], -1.0), 1.0), min(max(outputs[1], -1.0), 1.0)
    longer = max(length_of(along, aside), 1.0)
    x, y = in_frame((math.cos(turned), -math.sin(turned)), along, aside)
    command[0], command[1], command[2] = x / longer, y / longer, 0.0
    command[3] = min(max(outputs[2], -1.0), 1.0)
