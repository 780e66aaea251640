"""The inputs and outputs of a network, in the frame of its robot's motion.

A swarm has no compass, so what is to the left of a robot's motion matters, not what is to the
left of its body. The frame is turned by whole beams, so that scans need no interpolation.
"""

from __future__ import annotations

import math
from collections import namedtuple
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import observations as row
from swarm_logistics_env.errors import PolicyError
from swarm_logistics_env.kernels import inlined_kernel, kernel, uniform
from swarm_logistics_env.motion import memory as column
from swarm_logistics_env.motion.memory import length_of, to_frame
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
_Columns = namedtuple("_Columns", INPUTS)  # type: ignore[misc]  # by their names, as above
INPUT: Any = _Columns(*range(len(INPUTS)))  # the column of each input
LEAD = slice(INPUT.lead_present, INPUT.lead_timer + 1)


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
        self._body = column.body_of(scenario)
        self._listens = listens
        self.begin(np.empty(0, np.uint64))

    def begin(self, keys: NDArray[np.uint64], bodies: NDArray[np.float64] | None = None) -> None:
        """Begin an episode of as many rows as there are keys, which are those of their streams.

        Args:
            bodies: (N, 3) of robots that are not all as the scenario has them (`memory.body_of`).
        """
        n = len(keys)
        self.keys, self.counts = np.empty(n, np.uint64), np.empty(n, np.int64)
        self.memory, self.turned = np.empty((n, column.N_COLUMNS)), np.zeros(n)
        self.begin_rows(np.arange(n), keys, bodies)

    def begin_rows(
        self,
        rows: NDArray[np.int64],
        keys: NDArray[np.uint64],
        bodies: NDArray[np.float64] | None = None,
    ) -> None:
        """Begin an episode in these rows alone."""
        self.keys[rows], self.counts[rows] = keys, 0
        fresh = np.zeros((len(rows), column.N_COLUMNS))
        fresh[:, column.BODY] = self._body if bodies is None else bodies
        column.face_anywhere(keys, fresh)
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
        column.remember_observation(observations, self._period, memory)
        inputs = np.empty((len(observations), len(INPUTS)), np.float32)
        headings = self.random_headings()[rows]
        read_observations(observations, memory, self.keys[rows], headings, inputs, turned)
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
        command_rows(
            outputs.astype(np.float64), self.turned, self.rows, self._period, self.memory, commands
        )
        return commands

    def outputs_for(self, commands: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the outputs (N, 3) that ask for these commands (N, 4); turns are left out."""
        cos, sin = np.cos(self.turned), np.sin(self.turned)
        x, y = commands[:, 0], commands[:, 1]
        return np.stack([cos * x + sin * y, cos * y - sin * x, commands[:, 3]], axis=1)


@kernel
def read_observations(
    rows: NDArray[np.float32],
    memories: NDArray[np.float64],
    keys: NDArray[np.uint64],
    random_headings: NDArray[np.int64],
    inputs: NDArray[np.float32],
    turned: NDArray[np.float64],
) -> None:
    """Fill inputs (N, len(INPUTS)) and how far each frame is turned from the body's (N,) [rad]."""
    for robot in range(rows.shape[0]):
        sensed, memory, read = rows[robot], memories[robot], inputs[robot]
        heading = math.atan2(memory[column.HEADING_Y], memory[column.HEADING_X])
        beams = round(heading / (2.0 * math.pi / row.N_BEAMS)) % row.N_BEAMS
        turned[robot] = 2.0 * math.pi * beams / row.N_BEAMS
        frame = math.cos(turned[robot]), math.sin(turned[robot])
        for beam in range(row.N_BEAMS):
            distance = sensed[row.RANGE_WALLS + (beam + beams) % row.N_BEAMS]
            read[INPUT.wall_0 + beam] = max(0.0, 1.0 - distance / WALL_REACH)
        read_neighbours(sensed, frame, read)
        read_items(sensed, frame, read)
        # The robot that tells the lowest timer may lie: it counts less the more this robot knows.
        certainty = length_of(memory[column.HOME_X], memory[column.HOME_Y])
        read_lead(sensed, frame, 1.0 - math.tanh(certainty), read)
        read_robot(sensed, memory, frame, read)
        angle = random_heading(keys[robot], random_headings[robot]) - turned[robot]
        read[INPUT.whim_along], read[INPUT.whim_aside] = math.cos(angle), math.sin(angle)
        read_memory(memory, certainty, frame, read)


@inlined_kernel
def put(
    read: NDArray[np.float32],
    along: int,
    scale: float,
    frame: tuple[float, float],
    x: float,
    y: float,
) -> None:
    """Fill two inputs, from column `along` on, with a vector in the frame, times `scale`."""
    vector = to_frame(frame, x, y)
    read[along], read[along + 1] = scale * vector[0], scale * vector[1]


@kernel
def read_neighbours(
    sensed: NDArray[np.float32], frame: tuple[float, float], read: NDArray[np.float32]
) -> None:
    """Fill the inputs of neighbours: near they are larger."""
    for index in range(N_FAR + N_NEAR):
        is_far = index < N_FAR
        reach = FAR if is_far else NEAR
        first = INPUT.neighbour_0_along if is_far else INPUT.near_neighbour_0_along
        rank = index if is_far else index - N_FAR
        neighbour = row.NEIGHBOURS + row.NEIGHBOUR_WIDTH * rank
        x, y = float(sensed[neighbour + 1]), float(sensed[neighbour + 2])
        distance = length_of(x, y)
        nearness = max(0.0, 1.0 - distance / reach) / distance if distance > 0.0 else 0.0
        put(read, first + 2 * rank, nearness, frame, x, y)


@kernel
def read_items(
    sensed: NDArray[np.float32], frame: tuple[float, float], read: NDArray[np.float32]
) -> None:
    """Fill the inputs of obstacles, the requested item, and how full the view is of items."""
    carries = sensed[row.CARRYING] > 0.5
    for index in range(N_OBSTACLES):
        item = row.ITEMS + row.ITEM_WIDTH * index
        present = INPUT.obstacle_0_present + 3 * index
        read[present] = 1.0 if carries and sensed[item] > 0.5 else 0.0
        put(read, present + 1, read[present], frame, sensed[item + 1], sensed[item + 2])
    read[INPUT.requested_present : INPUT.requested_recently_held + 1] = 0.0
    for index in range(row.N_ITEMS_IN_VIEW):
        item = row.ITEMS + row.ITEM_WIDTH * index
        if sensed[item] > 0.5 and sensed[item + 3] > 0.5:
            x, y = float(sensed[item + 1]), float(sensed[item + 2])
            distance = max(length_of(x, y), 1e-9)
            along, aside = to_frame(frame, x, y)
            read[INPUT.requested_present] = 1.0
            read[INPUT.requested_along] = along / distance
            read[INPUT.requested_aside] = aside / distance
            read[INPUT.requested_distance] = distance
            read[INPUT.requested_nearness] = max(0.0, 1.0 - distance / NEAR)
            read[INPUT.requested_recently_held] = sensed[item + 4]
            break  # the nearest one comes first
    n_in_view = 0.0
    for index in range(row.N_ITEMS_IN_VIEW):
        n_in_view += sensed[row.ITEMS + row.ITEM_WIDTH * index]
    read[INPUT.items_in_view] = n_in_view / row.N_ITEMS_IN_VIEW


@kernel
def read_lead(
    sensed: NDArray[np.float32], frame: tuple[float, float], trust: float, read: NDArray[np.float32]
) -> None:
    """Fill the inputs of the lowest timer heard, times `trust`."""
    heard = sensed[row.LOWEST_TIMER] * trust
    x, y = float(sensed[row.LOWEST_TIMER + 1]), float(sensed[row.LOWEST_TIMER + 2])
    distance = length_of(x, y)
    unit = heard / distance if distance > 0.0 else 0.0
    read[INPUT.lead_present] = heard
    put(read, INPUT.lead_along, unit, frame, x, y)
    read[INPUT.lead_distance] = heard * distance / 4.0
    read[INPUT.lead_timer] = heard * sensed[row.LOWEST_TIMER + 3] / 10.0


@kernel
def read_robot(
    sensed: NDArray[np.float32],
    memory: NDArray[np.float64],
    frame: tuple[float, float],
    read: NDArray[np.float32],
) -> None:
    """Fill the inputs of what a robot feels of itself, and of its body."""
    read[INPUT.carrying] = sensed[row.CARRYING]
    read[INPUT.carrying_requested] = sensed[row.CARRYING_REQUESTED]
    read[INPUT.in_delivery_area] = sensed[row.IN_DELIVERY_AREA]
    read[INPUT.timer_runs] = sensed[row.TIMER_RUNS]
    read[INPUT.timer] = sensed[row.TIMER] / 10.0
    read[INPUT.contact] = sensed[row.CONTACT]
    velocity_x, velocity_y = sensed[row.VELOCITY], sensed[row.VELOCITY + 1]
    put(read, INPUT.velocity_along, 0.5, frame, velocity_x, velocity_y)
    heading_x, heading_y = memory[column.HEADING_X], memory[column.HEADING_Y]
    put(read, INPUT.heading_along, 1.0, frame, heading_x, heading_y)
    # The heading is at most half a beam aside, so it is doubled to be as large as other inputs.
    read[INPUT.heading_aside] *= 2.0
    read[INPUT.top_speed] = memory[column.TOP_SPEED] / 2.0
    read[INPUT.handling_time] = memory[column.HANDLING_TIME] / 2.0
    read[INPUT.turns_to_drive] = 1.0 if memory[column.WIDEST_TURN] > 0.0 else 0.0


@kernel
def read_memory(
    memory: NDArray[np.float64],
    certainty: float,
    frame: tuple[float, float],
    read: NDArray[np.float32],
) -> None:
    """Fill the inputs of what a robot remembers: the way home, and failures of its own.

    Args:
        certainty: length of the sum of its directions home.
    """
    unit = math.tanh(certainty) / certainty if certainty > 0.0 else 0.0
    put(read, INPUT.home_along, unit, frame, memory[column.HOME_X], memory[column.HOME_Y])
    read[INPUT.home_certainty] = math.tanh(certainty / 3.0)
    read[INPUT.failed], read[INPUT.stuck] = memory[column.FAILED], memory[column.STUCK]
    home_x, home_y, kept_certainty = column.kept_home(memory)
    kept_certainty = math.tanh(kept_certainty)
    put(read, INPUT.kept_home_along, kept_certainty, frame, home_x, home_y)
    distance = min(max(memory[column.AWAY], -FARTHEST), FARTHEST)
    read[INPUT.kept_home_distance] = kept_certainty * distance / FARTHEST
    read[INPUT.cannot_deliver] = memory[column.CANNOT_DELIVER]
    read[INPUT.cannot_lift] = memory[column.CANNOT_LIFT]
    longest = memory[column.HANDLING_TIME] + column.SURELY_IN_VAIN
    read[INPUT.delivering_in_vain] = min(1.0, memory[column.DELIVERING] / longest)


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
    memories: NDArray[np.float64],
    commands: NDArray[np.float64],
) -> None:
    """Fill the commands (N, 4) of outputs (N, 3) upon rows; memories take note of them."""
    for robot in range(outputs.shape[0]):
        sensed, memory, command = rows[robot], memories[robot], commands[robot]
        turn_outputs(outputs[robot], turned[robot], command)
        column.clear_the_way(sensed, memory, command)
        column.stand_to_handle(sensed, period, memory, command)
        column.note_command(sensed, command, memory)
        column.steer(memory, command)


@kernel
def turn_outputs(outputs: NDArray[np.float64], turned: float, command: NDArray[np.float64]) -> None:
    """Fill the command (4,) of outputs (3,): along, aside, gripper; clipped, no turn."""
    along, aside = min(max(outputs[0], -1.0), 1.0), min(max(outputs[1], -1.0), 1.0)
    longer = max(length_of(along, aside), 1.0)
    x, y = to_frame((math.cos(turned), -math.sin(turned)), along, aside)
    command[0], command[1], command[2] = x / longer, y / longer, 0.0
    command[3] = min(max(outputs[2], -1.0), 1.0)
