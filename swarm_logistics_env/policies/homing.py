"""Homing: a scripted swarm whose robots remember in which direction the delivery area lies.

SEARCH: straight ahead, away from neighbours; lifts nothing but the requested item. DELIVER: in the
direction in which the robot itself entered the delivery area before, and towards the lowest timer
heard as long as it has entered rarely; of 32 directions it takes the one that fits best and is
free. A robot that stands still drives in a random direction for a moment. One that has met a
failure of its own leaves requested items to others, and lets go inside the area.

What it leans on: the remembered direction is kept in the robot's own frame, which drifts, so the
memory fades within ten seconds. Swarm D-T remembers no direction and does not need it. This policy
commands no turn; a robot of the differential drive turns to where it wants to go, see
`world.motion.steering.steer`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, NonNegativeFloat, PositiveFloat

from swarm_logistics_env.compiler.kernels import kernel
from swarm_logistics_env.core.streams import row_keys
from swarm_logistics_env.policies.policy import Scripted, ScriptParameters
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.motion.frame import MotionView, command_own_frames
from swarm_logistics_env.world.motion.memory import MEMORY, has_failed, length_of
from swarm_logistics_env.world.motion.network_inputs import random_heading, turn_frames
from swarm_logistics_env.world.motion.steering import set_velocity
from swarm_logistics_env.world.scenario import Scenario

N_DIRECTIONS = 32
KNOWN = 0.5  # entries lately; with fewer a robot knows no direction home
LIFT = 1.0  # commands of the gripper
HOLD = 0.0
LET_GO = -1.0


class DrivingParameters(ScriptParameters):
    """The gains and ranges of the kernels that `Homing` and `HomingStock` share.

    All are fitted: they were tried for the most deliveries.
    """

    spread_gain: NonNegativeFloat = Field(
        0.8, description="away from each neighbour while it searches, in top speeds at distance 0"
    )
    spread_range: PositiveFloat = Field(2.0, description="where that push has fallen to 0 [m]")
    avoid_gain: NonNegativeFloat = Field(
        2.0, description="away from each near neighbour, always, in top speeds at distance 0"
    )
    avoid_range: PositiveFloat = Field(0.5, description="where that push has fallen to 0 [m]")
    wall_gain: NonNegativeFloat = Field(
        1.5, description="away from the nearest wall while it searches, in top speeds at distance 0"
    )
    wall_range: PositiveFloat = Field(0.6, description="where that push has fallen to 0 [m]")
    mirror_range: NonNegativeFloat = Field(
        0.2, description="reflects its direction at a wall nearer than this while it searches [m]"
    )
    grip_range: NonNegativeFloat = Field(
        0.4, description="closes its gripper nearer than this to the item that it fetches [m]"
    )
    home_share: NonNegativeFloat = Field(
        0.8, description="of the direction home in a laden robot's, the rest is its heading"
    )
    sure: NonNegativeFloat = Field(
        3.0, description="entries lately, from which on it listens to no timer"
    )
    clearance: PositiveFloat = Field(
        0.28, description="a laden robot's centre from an item that it passes [m]"
    )
    obstacle_range: PositiveFloat = Field(
        0.5, description="how far it looks ahead for items when laden, beyond where they touch [m]"
    )


class HomingParameters(DrivingParameters):
    """The parameters of `Homing`."""


Parameters = HomingParameters.for_kernels()


@kernel
def act_homing(
    rows: NDArray[np.float32],
    memories: NDArray[np.float64],
    keys: NDArray[np.uint64],
    counts: NDArray[np.int64],
    turned: NDArray[np.float64],
    period: float,
    values: tuple[float, ...],
    commands: NDArray[np.float64],
) -> None:
    """Fill the commands (N, 4) of a step of `Homing`; memories and counts go on.

    One kernel a step, because each call of a kernel costs more than a microsecond.

    Args:
        values: of the fields of `HomingParameters`.
    """
    turn_frames(rows, period, memories, turned)
    counts += 1
    decide_homing(rows, memories, keys, counts, period, Parameters(*values), commands)
    command_own_frames(commands, turned, rows, memories)


@kernel
def decide_homing(
    rows: NDArray[np.float32],
    memories: NDArray[np.float64],
    keys: NDArray[np.uint64],
    counts: NDArray[np.int64],
    period: float,
    parameters: HomingParameters,
    commands: NDArray[np.float64],
) -> None:
    """Fill the commands (N, 4), in the robots' own frames, from rows (N, D) and memories.

    `counts` (N,) are the decisions of each robot, this one among them.
    """
    for robot in range(rows.shape[0]):
        observation = rows[robot]
        memory = memories[robot]
        is_inside = observation[row.IN_DELIVERY_AREA] > 0.5
        x = memory[MEMORY.heading_x]
        y = memory[MEMORY.heading_y]
        push_x, push_y = avoid_neighbours(observation, parameters)
        speed = 1.0
        gripper = LET_GO
        if observation[row.CARRYING_REQUESTED] > 0.5:
            # Inside it stands, and lets go only once it takes its delivery for broken.
            if not is_inside or not has_failed(memory):
                gripper = LIFT
            speed = 0.0 if is_inside and gripper == LIFT else 1.0
            if memory[MEMORY.stuck] > 0.0:
                angle = random_heading(keys[robot], counts[robot] - 1, period)
                x = math.cos(angle)
                y = math.sin(angle)
            elif not is_inside:
                x, y = home_direction(observation, memory, x, y, parameters)
            x, y = freest_direction(observation, memory, x + push_x, y + push_y, parameters)
        else:
            item = requested_item(observation, memory, is_inside)
            if item >= 0 and observation[row.CARRYING] < 0.5:
                x, y, speed, gripper = fetch(observation, item, push_x, push_y, period, parameters)
            else:
                x, y, speed, gripper = search(
                    observation, memory, x, y, push_x, push_y, is_inside, parameters
                )
        set_velocity(x, y, speed, gripper, commands[robot])


@kernel
def avoid_neighbours(
    observation: NDArray[np.float32], parameters: DrivingParameters
) -> tuple[float, float]:
    """Return the push away from near neighbours."""
    return away_from_neighbours(observation, parameters.avoid_range, parameters.avoid_gain)


@kernel
def away_from_neighbours(
    observation: NDArray[np.float32], reach: float, gain: float
) -> tuple[float, float]:
    """Return the sum of directions away from neighbours, `gain` .. 0 at distance 0 .. `reach`."""
    push_x = 0.0
    push_y = 0.0
    for neighbour in range(row.N_NEIGHBOURS):
        start = row.NEIGHBOURS + row.NEIGHBOUR_WIDTH * neighbour
        x = observation[start + row.NEIGHBOUR.x]
        y = observation[start + row.NEIGHBOUR.y]
        distance = length_of(x, y)
        if 0.0 < distance < reach:
            push_x -= (1.0 - distance / reach) * x / distance
            push_y -= (1.0 - distance / reach) * y / distance
    return gain * push_x, gain * push_y


@kernel
def requested_item(
    observation: NDArray[np.float32], memory: NDArray[np.float64], is_inside: bool
) -> int:
    """Return the column of the nearest requested item for a robot that has not failed; -1: none.

    Not one that a robot inside held itself a moment ago.
    """
    if has_failed(memory):
        return -1
    for item in range(row.N_ITEMS_IN_VIEW):
        start = row.ITEMS + row.ITEM_WIDTH * item
        is_present = observation[start + row.ITEM.present] > 0.5
        is_requested = observation[start + row.ITEM.requested] > 0.5
        was_held_inside = is_inside and observation[start + row.ITEM.recently_held] > 0.5
        if is_present and is_requested and not was_held_inside:
            return start
    return -1


@kernel
def fetch(
    observation: NDArray[np.float32],
    item: int,
    push_x: float,
    push_y: float,
    period: float,
    parameters: DrivingParameters,
) -> tuple[float, float, float, float]:
    """Return the direction, speed and gripper of a robot on its way to the item in a column."""
    x = observation[item + row.ITEM.x]
    y = observation[item + row.ITEM.y]
    distance = max(length_of(x, y), 1e-6)
    speed = min(1.0, distance / (2.0 * period))
    gripper = LIFT if distance < parameters.grip_range else LET_GO
    return x / distance + 0.5 * push_x, y / distance + 0.5 * push_y, speed, gripper


@kernel
def search(
    observation: NDArray[np.float32],
    memory: NDArray[np.float64],
    x: float,
    y: float,
    push_x: float,
    push_y: float,
    is_inside: bool,
    parameters: DrivingParameters,
) -> tuple[float, float, float, float]:
    """Return the direction, speed and gripper of a robot on its search, see `search_direction`."""
    x, y = search_direction(observation, memory, x, y, is_inside, parameters)
    x = x + push_x
    y = y + push_y
    speed = min(1.0, max(length_of(x, y), 0.3))
    return x, y, speed, LET_GO


@kernel
def search_direction(
    observation: NDArray[np.float32],
    memory: NDArray[np.float64],
    x: float,
    y: float,
    is_inside: bool,
    parameters: DrivingParameters,
) -> tuple[float, float]:
    """Return the direction in which a robot searches that drives in direction (x, y)."""
    walls = observation[row.RANGE_WALLS : row.RANGE_WALLS + row.N_BEAMS]
    nearest = np.argmin(walls)
    wall_x = 0.0
    wall_y = 0.0
    if walls[nearest] < parameters.wall_range:
        angle = 2.0 * math.pi * nearest / row.N_BEAMS
        towards_x = math.cos(angle)
        towards_y = math.sin(angle)
        approach = x * towards_x + y * towards_y
        if walls[nearest] < parameters.mirror_range and approach > 0.0:
            x -= 2.0 * approach * towards_x
            y -= 2.0 * approach * towards_y
        push = parameters.wall_gain * (1.0 - walls[nearest] / parameters.wall_range)
        wall_x = -push * towards_x
        wall_y = -push * towards_y
    reach = parameters.spread_range
    gain = parameters.spread_gain
    spread_x, spread_y = away_from_neighbours(observation, reach, gain)
    x += wall_x + spread_x
    y += wall_y + spread_y
    home = length_of(memory[MEMORY.home_x], memory[MEMORY.home_y])
    if is_inside and home > KNOWN:
        x -= memory[MEMORY.home_x] / home
        y -= memory[MEMORY.home_y] / home
    return x, y


@kernel
def home_direction(
    observation: NDArray[np.float32],
    memory: NDArray[np.float64],
    x: float,
    y: float,
    parameters: DrivingParameters,
) -> tuple[float, float]:
    """Return the direction in which a laden robot goes that drives in direction (x, y)."""
    home = length_of(memory[MEMORY.home_x], memory[MEMORY.home_y])
    trust = 1.0
    if home > KNOWN:
        share = parameters.home_share
        x = share * memory[MEMORY.home_x] / home + (1.0 - share) * x
        y = share * memory[MEMORY.home_y] / home + (1.0 - share) * y
        trust = 1.0 / home if home < parameters.sure else 0.0
    if observation[row.LOWEST_TIMER] > 0.5:
        lead_x = observation[row.LOWEST_TIMER_X]
        lead_y = observation[row.LOWEST_TIMER_Y]
        distance = length_of(lead_x, lead_y)
        if distance > 0.0:
            x += trust * lead_x / distance
            y += trust * lead_y / distance
    return x, y


@kernel
def freest_direction(
    observation: NDArray[np.float32],
    memory: NDArray[np.float64],
    x: float,
    y: float,
    parameters: DrivingParameters,
) -> tuple[float, float]:
    """Return the direction that is nearest to (x, y) and meets no item or wall."""
    length = max(length_of(x, y), 1e-9)
    x = x / length
    y = y / length
    best_worth = -1e9
    best_x = x
    best_y = y
    for direction in range(N_DIRECTIONS):
        angle = 2.0 * math.pi * direction / N_DIRECTIONS
        go_x = math.cos(angle)
        go_y = math.sin(angle)
        worth = go_x * x + go_y * y
        worth += 0.3 * (go_x * memory[MEMORY.heading_x] + go_y * memory[MEMORY.heading_y])
        for item in range(row.N_ITEMS_IN_VIEW):
            start = row.ITEMS + row.ITEM_WIDTH * item
            if observation[start + row.ITEM.present] < 0.5:
                break
            item_x = observation[start + row.ITEM.x]
            item_y = observation[start + row.ITEM.y]
            along = item_x * go_x + item_y * go_y
            aside = abs(item_x * go_y - item_y * go_x)
            if aside < parameters.clearance and 0.0 < along < parameters.obstacle_range + 0.25:
                near = 1.0 - max(0.0, along - 0.25) / parameters.obstacle_range
                worth -= 2.0 * near * min(1.0, (parameters.clearance - aside) / 0.05)
        beam = direction // 2
        wall = observation[row.RANGE_WALLS + beam]
        if direction % 2:  # between two beams
            wall = min(wall, observation[row.RANGE_WALLS + (beam + 1) % row.N_BEAMS])
        if wall < 0.35:
            worth -= 2.0 * (1.0 - max(0.0, wall - 0.13) / 0.22)
        if worth > best_worth:
            best_worth = worth
            best_x = go_x
            best_y = go_y
    return best_x, best_y


class Homing(Scripted):
    """Every robot remembers for some ten seconds where it last entered the delivery area.

    Its keyword arguments are the fields of `HomingParameters`.

    Raises:
        PolicyError: a parameter is unknown or out of range.

    Example:
        >>> policy = Homing()
        >>> policy.reset(n_robots=3, seed=0)
        >>> policy.act(np.zeros((3, row.N_COLUMNS), np.float32)).shape
        (3, 4)
    """

    parameters_type: ClassVar[type[DrivingParameters]] = HomingParameters
    parameters: DrivingParameters
    _fill_commands: ClassVar[Callable[..., None]] = staticmethod(act_homing)

    def configure(self, scenario: Scenario) -> None:
        """Take what a robot's maker knows: the control period."""
        self._values = self.parameters.values()
        self._period = scenario.control_period
        self._frame = MotionView(scenario)

    def reset(self, n_robots: int, seed: int) -> None:
        """Begin an episode with random headings and empty memories."""
        self._frame.begin(row_keys(seed, "homing", n_robots))

    def act(self, observations: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return commands (N, 4) for observation rows (N, D).

        Raises:
            PolicyError: there are more or fewer rows than robots at `reset`.
        """
        self._frame.check(observations)
        commands = np.empty((len(observations), 4))
        frame = self._frame
        self._fill_commands(
            observations, frame.memory, frame.keys, frame.counts, frame.turned, self._period,
            self._values, commands,
        )  # fmt: skip
        return commands
