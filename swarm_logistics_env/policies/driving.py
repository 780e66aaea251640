"""Driving by what a robot senses and remembers: the kernels that scripts which drive home share.

Each returns a direction in a robot's own frame, or a motion: direction (x, y), speed and gripper.
"""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, NonNegativeFloat, PositiveFloat

from swarm_logistics_env.compiler.kernels import kernel
from swarm_logistics_env.policies.policy import ScriptParameters
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.motion.memory import MEMORY, has_failed, length_of

N_DIRECTIONS = 32
KNOWN = 0.5  # entries lately; with fewer a robot knows no direction home
LIFT = 1.0  # commands of the gripper
HOLD = 0.0
LET_GO = -1.0


# Of these each script has values of its own.
SpreadGain = Annotated[
    NonNegativeFloat,
    Field(description="away from each neighbour while it searches, in top speeds at distance 0"),
]
SpreadRange = Annotated[PositiveFloat, Field(description="where that push has fallen to 0 [m]")]
AvoidGain = Annotated[
    NonNegativeFloat,
    Field(description="away from each near neighbour, always, in top speeds at distance 0"),
]
AvoidRange = Annotated[PositiveFloat, Field(description="where that push has fallen to 0 [m]")]
WallGain = Annotated[
    NonNegativeFloat,
    Field(description="away from the nearest wall while it searches, in top speeds at distance 0"),
]
WallRange = Annotated[PositiveFloat, Field(description="where that push has fallen to 0 [m]")]
Sure = Annotated[
    NonNegativeFloat,
    Field(description="entries lately, from which on it listens to no timer"),
]
Clearance = Annotated[
    PositiveFloat, Field(description="a laden robot's centre from an item that it passes [m]")
]
ObstacleRange = Annotated[
    PositiveFloat,
    Field(description="how far it looks ahead for items when laden, beyond where they touch [m]"),
]


class DrivingParameters(ScriptParameters):
    """The gains and ranges of the kernels that `Homing` and `HomingStock` share.

    All are fitted: they were tried for the most deliveries, those without a value here in the
    search of `research/tune.py`.
    """

    spread_gain: SpreadGain
    spread_range: SpreadRange
    avoid_gain: AvoidGain
    avoid_range: AvoidRange
    wall_gain: WallGain
    wall_range: WallRange
    mirror_range: NonNegativeFloat = Field(
        0.2, description="reflects its direction at a wall nearer than this while it searches [m]"
    )
    grip_range: NonNegativeFloat = Field(
        0.4, description="closes its gripper nearer than this to the item that it fetches [m]"
    )
    home_share: NonNegativeFloat = Field(
        0.8, description="of the direction home in a laden robot's, the rest is its heading"
    )
    sure: Sure
    clearance: Clearance
    obstacle_range: ObstacleRange


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
            share = 1.0 - np.float64(distance) / reach
            push_x -= share * x / distance
            push_y -= share * y / distance
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
    distance = np.float64(max(length_of(x, y), 1e-6))
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
        push = parameters.wall_gain * (1.0 - np.float64(walls[nearest]) / parameters.wall_range)
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
            x += trust * np.float64(lead_x) / distance
            y += trust * np.float64(lead_y) / distance
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
            item_x = np.float64(observation[start + row.ITEM.x])
            item_y = np.float64(observation[start + row.ITEM.y])
            along = item_x * go_x + item_y * go_y
            aside = abs(item_x * go_y - item_y * go_x)
            if aside < parameters.clearance and 0.0 < along < parameters.obstacle_range + 0.25:
                near = 1.0 - max(0.0, along - 0.25) / parameters.obstacle_range
                worth -= 2.0 * near * min(1.0, (parameters.clearance - aside) / 0.05)
        beam = direction // 2
        wall = np.float64(observation[row.RANGE_WALLS + beam])
        if direction % 2:  # between two beams
            wall = min(wall, np.float64(observation[row.RANGE_WALLS + (beam + 1) % row.N_BEAMS]))
        if wall < 0.35:
            worth -= 2.0 * (1.0 - max(0.0, wall - 0.13) / 0.22)
        if worth > best_worth:
            best_worth = worth
            best_x = go_x
            best_y = go_y
    return best_x, best_y
