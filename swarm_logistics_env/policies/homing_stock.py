"""Homing with a stock: items lie beside the delivery area, or are held in it, when asked for.

Robots sense and remember what those of `homing` do, and six simple mechanisms are added:

* Every `ROLE_TIME` a robot draws whether it holds or stocks.
* A robot that holds lifts any item and waits with it just inside the area, so that it is delivered
  at once when it is asked for. Where it sees the requested item, it swaps: out, drop, lift, in.
* A robot that stocks puts items down in front of the area, but only where no other item is near:
  laden robots have to get through between them. If it finds no gap, it takes the item away again.
* Laden robots go home by the direction that is held against the walls, and forget it where it is
  contradicted: inside although far away, or outside although they should be inside by now. They do
  not trust it long after it was last taken.
* A laden robot that stands still goes in a random direction, not away from home, for a moment.
* A robot that never entered the area goes to the lowest timer heard.

All constants are fitted, for the most deliveries in the paper's world with `restock` at N = 25.
Only seeds from 400,000 to 400,045 were used. In `realistic` a stock pays with `near` 1.2 and `far`
1.6, tried on seeds from 430,000 to 430,169, as was `LEAST_CERTAINTY`.
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, PositiveFloat, ValidationInfo, field_validator

from swarm_logistics_env.compiler.kernels import kernel, uniform
from swarm_logistics_env.policies.driving import (
    HOLD,
    LET_GO,
    LIFT,
    DrivingParameters,
    avoid_neighbours,
    away_from_neighbours,
    fetch,
    freest_direction,
    home_direction,
    requested_item,
    search,
    search_direction,
)
from swarm_logistics_env.policies.homing import Homing
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.motion.frame import command_own_frames
from swarm_logistics_env.world.motion.memory import MEMORY, has_failed, kept_home, length_of
from swarm_logistics_env.world.motion.network_inputs import (
    RANDOM_HEADING_TIME,
    random_heading,
    random_heading_number,
    turn_frames,
)
from swarm_logistics_env.world.motion.steering import set_velocity

# Lengths in m; distances from the delivery area are as a robot reckons them.
ROLE_TIME = 40.0  # [s]
HOLDERS = 0.6  # the share of robots that hold; the others stock
FIRST_ROLE = 2_000_003  # number in the robot's stream
CARRIED_OFF = 1.0  # where an item is put down for which there is no gap
ITEM_SPACING = 0.6  # between the centres of items, so that laden robots get through
DEPTH = 0.3  # of robots that hold items inside
SPREAD_GAIN = 0.3  # along the border, away from neighbours
SPREAD_RANGE = 1.5
LOST = 0.8  # that a reckoned distance may be wrong
LEAST_CERTAINTY = 0.3  # of a direction home that was taken once, after 72 s
STUCK = 0.4  # a robot tries a random direction until the memory's 1 has fallen to this
TRIES_AGAIN = 0.5  # of `cannot_deliver`: below it a robot holds items inside again
PULL = 0.4  # home, beside a random direction of length 1


class HomingStockParameters(DrivingParameters):
    """Those that `HomingStock` shares with `Homing`, and its distances, both fitted, see above."""

    near: PositiveFloat = Field(
        0.8, description="robots put items down nearer to the area than this [m]; fitted"
    )
    far: PositiveFloat = Field(
        1.2, description="robots that stock lift items farther from it than this [m]; fitted"
    )

    @field_validator("far")
    @classmethod
    def _check_far(cls, far: float, about: ValidationInfo) -> float:
        near = about.data.get("near", far)
        if far < near:
            raise ValueError(f"should be at least near = {near:g} [m]")
        return far


Parameters = HomingStockParameters.for_kernels()
Home: TypeAlias = tuple[float, float, float]  # the direction, and how often it was taken lately
Push: TypeAlias = tuple[float, float]  # away from near neighbours
Motion: TypeAlias = tuple[float, float, float, float]  # direction (x, y), speed, gripper


@kernel
def act_homing_stock(
    rows: NDArray[np.float32],
    memories: NDArray[np.float64],
    keys: NDArray[np.uint64],
    counts: NDArray[np.int64],
    turned: NDArray[np.float64],
    period: float,
    values: tuple[float, ...],
    commands: NDArray[np.float64],
) -> None:
    """Fill the commands (N, 4) of a step of `HomingStock`, see `act_homing`."""
    turn_frames(rows, period, memories, turned)
    counts += 1
    decide_homing_stock(rows, memories, keys, counts, period, Parameters(*values), commands)
    command_own_frames(commands, turned, rows, memories)


@kernel
def decide_homing_stock(
    rows: NDArray[np.float32],
    memories: NDArray[np.float64],
    keys: NDArray[np.uint64],
    counts: NDArray[np.int64],
    period: float,
    parameters: HomingStockParameters,
    commands: NDArray[np.float64],
) -> None:
    """Fill the commands (N, 4) from rows (N, D), memories and counts, see `decide_homing`."""
    for robot in range(rows.shape[0]):
        observation = rows[robot]
        memory = memories[robot]
        is_inside = observation[row.IN_DELIVERY_AREA] > 0.5
        carries = observation[row.CARRYING] > 0.5
        carries_requested = observation[row.CARRYING_REQUESTED] > 0.5
        role = role_of(keys[robot], random_heading_number(counts[robot] - 1, period))
        holds = role < HOLDERS and memory[MEMORY.cannot_deliver] < TRIES_AGAIN
        forget_if_lost(memory, is_inside)
        home = kept_home(memory)
        if home[2] < LEAST_CERTAINTY:
            home = 0.0, 0.0, 0.0
        push = avoid_neighbours(observation, parameters)
        # A robot stands in the area to deliver: that is not to be stuck.
        is_stuck = memory[MEMORY.stuck] > STUCK and not (is_inside and carries_requested)
        if carries and is_stuck:
            angle = random_heading(keys[robot], counts[robot] - 1, period)
            motion = break_free(observation, memory, home, push, angle, parameters)
        elif carries_requested:
            motion = drive_home(observation, memory, home, push, is_inside, parameters)
        elif carries:
            motion = carry_stock(
                observation, memory, home, push, is_inside, holds, period, parameters
            )
        else:
            stocks = holds or role > HOLDERS
            least = 0.0 if holds else parameters.far
            motion = search_items(
                observation, memory, home, push, is_inside, stocks, least, period, parameters
            )
        x, y, speed, gripper = motion
        set_velocity(x, y, speed, gripper, commands[robot])


@kernel
def role_of(key: np.uint64, heading_number: int) -> float:
    """Return the number in [0, 1) that decides a robot's role at present.

    Robots change their roles at different times.
    """
    n_roles = heading_number * RANDOM_HEADING_TIME / ROLE_TIME
    role = int(n_roles + uniform(key, FIRST_ROLE))
    return uniform(key, FIRST_ROLE + 1 + role)


@kernel
def break_free(
    observation: NDArray[np.float32],
    memory: NDArray[np.float64],
    home: Home,
    push: Push,
    angle: float,
    parameters: HomingStockParameters,
) -> Motion:
    """Return the motion of a laden robot that is stuck: in a random direction, not from home."""
    x = math.cos(angle) + PULL * home[0]
    y = math.sin(angle) + PULL * home[1]
    x, y = freest_direction(observation, memory, x + push[0], y + push[1], parameters)
    return x, y, 1.0, HOLD


@kernel
def drive_home(
    observation: NDArray[np.float32],
    memory: NDArray[np.float64],
    home: Home,
    push: Push,
    is_inside: bool,
    parameters: HomingStockParameters,
) -> Motion:
    """Return the motion of a robot with the requested item: home, and to a stand inside."""
    home_x, home_y, certainty = home
    x = memory[MEMORY.heading_x]
    y = memory[MEMORY.heading_y]
    # Inside it lets go only once it takes its delivery for broken.
    lets_go = is_inside and has_failed(memory)
    gripper = LET_GO if lets_go else LIFT
    speed = 0.0 if is_inside and not lets_go else 1.0
    if not is_inside and certainty > 0.0:
        x = home_x
        y = home_y
    elif not is_inside:
        x, y = home_direction(observation, memory, x, y, parameters)
    x, y = freest_direction(observation, memory, x + push[0], y + push[1], parameters)
    return x, y, speed, gripper


@kernel
def carry_stock(
    observation: NDArray[np.float32],
    memory: NDArray[np.float64],
    home: Home,
    push: Push,
    is_inside: bool,
    holds: bool,
    period: float,
    parameters: HomingStockParameters,
) -> Motion:
    """Return the motion of a robot with an item that nobody asks for: to hold or to stock it."""
    home_x, home_y, certainty = home
    x = memory[MEMORY.heading_x]
    y = memory[MEMORY.heading_y]
    item = requested_item(observation, memory, False)
    if item >= 0:  # it lets go outside, and lifts that one
        return observation[item + row.ITEM.x], observation[item + row.ITEM.y], 1.0, LET_GO
    if certainty == 0.0:
        x, y = search_direction(observation, memory, x, y, is_inside, parameters)
        return x, y, 1.0, LET_GO
    if not holds and is_gap(observation, memory, is_inside, parameters):
        return x, y, 1.0, LET_GO
    if not holds and (is_inside or x * home_x + y * home_y < -0.3):
        gripper = LET_GO if memory[MEMORY.away] > CARRIED_OFF else HOLD
        x, y = freest_direction(observation, memory, push[0] - home_x, push[1] - home_y, parameters)
        return x, y, 1.0, gripper
    x, y = hold_direction(observation, memory, home_x, home_y, is_inside, period)
    if is_inside:
        return x, y, min(1.0, length_of(x, y)), HOLD
    x, y = freest_direction(observation, memory, x + push[0], y + push[1], parameters)
    return x, y, 1.0, HOLD


@kernel
def search_items(
    observation: NDArray[np.float32],
    memory: NDArray[np.float64],
    home: Home,
    push: Push,
    is_inside: bool,
    stocks: bool,
    least: float,
    period: float,
    parameters: HomingStockParameters,
) -> Motion:
    """Return the motion of an unladen robot: to an item in view, or on its search.

    `stocks`: whether it lifts items that nobody asks for, if they lie farther than `least` [m] from
    the area.
    """
    home_x, home_y, certainty = home
    item = requested_item(observation, memory, False)
    if item >= 0 and is_inside and observation[item + row.ITEM.recently_held] > 0.5:
        item = -1  # it could not deliver it
    if item < 0 and stocks and certainty > 0.0 and memory[MEMORY.cannot_lift] <= 0.0:
        item = item_to_stock(observation, memory, home_x, home_y, least)
    if item >= 0:
        return fetch(observation, item, push[0], push[1], period, parameters)
    x = memory[MEMORY.heading_x]
    y = memory[MEMORY.heading_y]
    if certainty == 0.0 and observation[row.LOWEST_TIMER] > 0.5:
        x, y = home_direction(observation, memory, x, y, parameters)
    return search(observation, memory, x, y, push[0], push[1], is_inside, parameters)


@kernel
def forget_if_lost(memory: NDArray[np.float64], is_inside: bool) -> None:
    """Forget the kept direction home if the distance reckoned with it cannot be."""
    is_lost = memory[MEMORY.away] > LOST if is_inside else memory[MEMORY.away] < -LOST
    if is_lost:
        memory[MEMORY.kept_x] = 0.0
        memory[MEMORY.kept_y] = 0.0
        memory[MEMORY.away] = 0.0


@kernel
def is_gap(
    observation: NDArray[np.float32],
    memory: NDArray[np.float64],
    is_inside: bool,
    parameters: HomingStockParameters,
) -> bool:
    """Return whether an item may be put down here for stock: near the area, amid no others.

    The nearest item comes first in a row.
    """
    if is_inside or memory[MEMORY.away] >= parameters.near:
        return False
    x = observation[row.ITEMS + row.ITEM.x]
    y = observation[row.ITEMS + row.ITEM.y]
    return bool(observation[row.ITEMS + row.ITEM.present] < 0.5 or length_of(x, y) > ITEM_SPACING)


@kernel
def hold_direction(
    observation: NDArray[np.float32],
    memory: NDArray[np.float64],
    home_x: float,
    home_y: float,
    is_inside: bool,
    period: float,
) -> tuple[float, float]:
    """Return the velocity, in top speeds, to where a robot holds its item inside the area."""
    least = -1.0 if is_inside else 0.5
    deeper = max(least, min(1.0, (memory[MEMORY.away] + DEPTH) / (2.0 * period)))
    far_x, far_y = away_from_neighbours(observation, SPREAD_RANGE, 1.0)
    aside = max(-0.7, min(0.7, SPREAD_GAIN * (home_x * far_y - home_y * far_x)))
    return deeper * home_x - aside * home_y, deeper * home_y + aside * home_x


@kernel
def item_to_stock(
    observation: NDArray[np.float32],
    memory: NDArray[np.float64],
    home_x: float,
    home_y: float,
    least: float,
) -> int:
    """Return the column of the nearest item farther than `least` [m] from the area; -1: none."""
    for item in range(row.N_ITEMS_IN_VIEW):
        start = row.ITEMS + row.ITEM_WIDTH * item
        if observation[start + row.ITEM.present] < 0.5:
            break
        x = observation[start + row.ITEM.x]
        y = observation[start + row.ITEM.y]
        distance = memory[MEMORY.away] - x * home_x - y * home_y
        if observation[start + row.ITEM.recently_held] < 0.5 and distance > least:
            return start
    return -1


class HomingStock(Homing):
    """Homing that carries stock to the delivery area before anybody asks for it.

    Its keyword arguments are the fields of `HomingStockParameters`.

    Raises:
        PolicyError: it is not 0 < near <= far.

    Example:
        >>> policy = HomingStock()
        >>> policy.reset(n_robots=3, seed=0)
        >>> policy.act(np.zeros((3, row.N_COLUMNS), np.float32)).shape
        (3, 4)
    """

    parameters_type = HomingStockParameters
    parameters: HomingStockParameters

    _fill_commands = staticmethod(act_homing_stock)
