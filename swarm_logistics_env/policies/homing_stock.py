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

Parameters go with the radius of the robots, see `ScriptParameters.scaled_to`. Three of them keep
the swarm going where lifting takes time:

* `density`: the more items there are, the deeper is the stock. A shallow one of many items is a
  wall: laden robots do not get through, least in the corners beside the area. Where lifting takes
  no time, robots make their way, and the stock is `near`, less half the distance in which they
  brake: those that brake slowly get through a shallower one alone. Where several items are asked
  for at a time more of the stock is wanted, and it is `near`.
* `patience`: a robot that carries the requested item for too long, because it is caged by the stock
  or takes a wrong way for the way home, puts it down, clears the way (`clear_the_way`), and leaves
  the item to others for as long.
* `holders`: the fewer robots there are for the items, the fewer of them hold, so that enough of
  them search.

Messages are not used. A voice was tried: robots told each other how far the way to the requested
item is, and the nearest one or two free ones went. On 30 seeds from 431,000 on no gain was shown.
The likely reason: who sees an item fetches it anyway, and nobody can tell of one that nobody sees.

Constants of the code are fitted, for the most deliveries, on seeds from 400,000 to 400,045 in the
paper's world and from 430,000 to 430,707 in `realistic`, both with `restock`; the parameters are
those of the searches that docs/research/tuning.md tells of.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, NonNegativeFloat, PositiveFloat

from swarm_logistics_env.compiler.kernels import kernel
from swarm_logistics_env.policies.driving import (
    HOLD,
    LET_GO,
    LIFT,
    AvoidGain,
    AvoidRange,
    Clearance,
    DrivingParameters,
    ObstacleRange,
    SpreadGain,
    SpreadRange,
    Sure,
    WallGain,
    WallRange,
    avoid_neighbours,
    fetch,
    freest_direction,
    home_direction,
    requested_item,
    search,
    search_direction,
)
from swarm_logistics_env.policies.homing import Homing
from swarm_logistics_env.policies.stocking import (
    forget_if_lost,
    has_lost_patience,
    hold_direction,
    is_gap,
    item_to_stock,
)
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.motion.frame import command_own_frames
from swarm_logistics_env.world.motion.memory import MEMORY, has_failed, kept_home, length_of
from swarm_logistics_env.world.motion.network_inputs import (
    random_heading,
    random_heading_number,
    role_of,
    turn_frames,
)
from swarm_logistics_env.world.motion.steering import set_velocity
from swarm_logistics_env.world.scenario import Scenario

# Lengths in m; distances from the delivery area are as a robot reckons them.
CARRIED_OFF = 1.0  # where an item is put down for which there is no gap
LEAST_CERTAINTY = 0.3  # of a direction home that was taken once, after 72 s
BAND = 0.5  # behind the stock, in which items stay where they are
STUCK = 0.4  # a robot tries a random direction until the memory's 1 has fallen to this
TRIES_AGAIN = 0.5  # of `cannot_deliver`: below it a robot holds items inside again
PULL = 0.4  # home, beside a random direction of length 1


class HomingStockParameters(DrivingParameters):
    """Those that `HomingStock` shares with `Homing`, and those of its stock, all fitted."""

    spread_gain: SpreadGain = 0.6066
    spread_range: SpreadRange = 2.875
    avoid_gain: AvoidGain = 1.136
    avoid_range: AvoidRange = 0.5739
    wall_gain: WallGain = 1.5
    wall_range: WallRange = 0.6
    sure: Sure = 3.0
    clearance: Clearance = 0.2094
    obstacle_range: ObstacleRange = 1.809

    near: PositiveFloat = Field(
        0.6898,
        description="robots put items down nearer to the area than this, where one item is asked "
        "for at a time less half the distance in which they brake from top speed, and lift for the "
        "stock those that lie 0.5 m farther [m]",
    )
    density: NonNegativeFloat = Field(
        0.8709,
        description="where lifting takes time, this distance is what makes all items, put down "
        "before the area over the whole height of the warehouse, as dense as this [1/m2]; 0: it "
        "stays",
    )
    holders: PositiveFloat = Field(
        0.5341,
        description="share of the robots that hold where there are as many robots as items; it "
        "goes with the root of robots by items, and the others stock",
    )
    patience: NonNegativeFloat = Field(
        22.39,
        description="for how long it carries the requested item outside, and then leaves it to "
        "others [s]; 0: for ever",
    )

    # What the search of `research/search_again.py` found in `dotbots`.
    of_small_robots: ClassVar[Mapping[str, float]] = {
        "near": 2.2, "density": 1.264, "holders": 1.323, "patience": 0.967, "spread_gain": 0.417,
        "spread_range": 0.921, "avoid_gain": 0.351, "avoid_range": 0.394, "clearance": 0.938,
        "obstacle_range": 0.554,
    }  # fmt: skip


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
        holds = role < parameters.holders and memory[MEMORY.cannot_deliver] < TRIES_AGAIN
        forget_if_lost(memory, is_inside)
        gives_up = has_lost_patience(observation, memory, is_inside, period, parameters.patience)
        home = kept_home(memory)
        if home[2] < LEAST_CERTAINTY:
            home = 0.0, 0.0, 0.0
        push = avoid_neighbours(observation, parameters)
        # A robot stands in the area to deliver: that is not to be stuck.
        is_stuck = memory[MEMORY.stuck] > STUCK and not (is_inside and carries_requested)
        # One that gives up stands until its gripper is open; then it clears the way.
        if carries_requested and gives_up:
            motion = memory[MEMORY.heading_x], memory[MEMORY.heading_y], 0.0, LET_GO
        elif carries and is_stuck:
            angle = random_heading(keys[robot], counts[robot] - 1, period)
            motion = break_free(observation, memory, home, push, angle, parameters)
        elif carries_requested:
            motion = drive_home(observation, memory, home, push, is_inside, parameters)
        elif carries:
            item = -1 if gives_up else requested_item(observation, memory, False)
            motion = carry_stock(
                observation, memory, home, push, item, is_inside, holds, period, parameters
            )
        else:
            stocks = holds or role > parameters.holders
            least = 0.0 if holds else parameters.near + BAND
            item = -1 if gives_up else requested_item(observation, memory, False)
            motion = search_items(
                observation, memory, home, push, item, is_inside, stocks, least, period, parameters
            )
        x, y, speed, gripper = motion
        set_velocity(x, y, speed, gripper, commands[robot])


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
    item: int,
    is_inside: bool,
    holds: bool,
    period: float,
    parameters: HomingStockParameters,
) -> Motion:
    """Return the motion of a robot with an item that nobody asks for: to hold or to stock it.

    `item`: the column of the requested one in view; -1: none.
    """
    home_x, home_y, certainty = home
    x = memory[MEMORY.heading_x]
    y = memory[MEMORY.heading_y]
    if item >= 0:  # it lets go outside, and lifts that one
        x = np.float64(observation[item + row.ITEM.x])
        y = np.float64(observation[item + row.ITEM.y])
        return x, y, 1.0, LET_GO
    if certainty == 0.0:
        x, y = search_direction(observation, memory, x, y, is_inside, parameters)
        return x, y, 1.0, LET_GO
    if not holds and is_gap(observation, memory, is_inside, parameters.near):
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
    item: int,
    is_inside: bool,
    stocks: bool,
    least: float,
    period: float,
    parameters: HomingStockParameters,
) -> Motion:
    """Return the motion of an unladen robot: to an item in view, or on its search.

    `item`: as in `carry_stock`. `stocks`: whether it lifts items that nobody asks for, if they lie
    farther than `least` [m] from the area.
    """
    home_x, home_y, certainty = home
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


class HomingStock(Homing):
    """Homing that carries stock to the delivery area before anybody asks for it.

    Its keyword arguments are the fields of `HomingStockParameters`.

    Raises:
        PolicyError: a parameter is unknown or out of range.

    Example:
        >>> policy = HomingStock()
        >>> policy.reset(n_robots=3, seed=0)
        >>> policy.act(np.zeros((3, row.N_COLUMNS), np.float32)).shape
        (3, 4)
    """

    parameters_type = HomingStockParameters
    parameters: HomingStockParameters

    _fill_commands = staticmethod(act_homing_stock)

    def fit_to(self, swarm: Scenario) -> None:
        """Take how many robots and items there are, how large robots are, and how they brake."""
        parameters = self.parameters.scaled_to(swarm)
        share = math.sqrt(swarm.n_robots / swarm.n_items)
        changes = {"holders": min(1.0, parameters.holders * share)}
        if swarm.n_requests == 1:
            braking_distance = swarm.max_speed**2 / (2.0 * swarm.max_acceleration)
            changes["near"] = max(parameters.near - 0.5 * braking_distance, 0.0)
        if parameters.density > 0.0 and swarm.handling_time > 0.0:
            changes["near"] = swarm.n_items / (parameters.density * swarm.warehouse_height)
        self._values = parameters.model_copy(update=changes).values()
