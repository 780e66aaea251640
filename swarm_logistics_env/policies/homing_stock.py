"""Homing with a stock: items lie beside the delivery area, or are held in it, when asked for.

Robots sense and remember what those of `homing` do, and six simple mechanisms are added:

* Every `ROLE_TIME` a robot draws whether it holds or stocks.
* A robot that holds lifts any item and waits with it just inside the area, so that it is delivered
  at once when it is asked for. Where it sees the requested item, it swaps: out, drop, lift, in.
* A robot that stocks puts items down in front of the area, but only where no other item is near:
  laden robots have to get through between them. If it finds no gap, it takes the item away again.
* Laden robots go home by the direction that is held against the walls, and forget it where it is
  contradicted: inside although far away, or outside although they should be inside by now.
* A laden robot that stands still goes in a random direction, not away from home, for a moment.
* A robot that never entered the area goes to the lowest timer heard.

All constants are fitted, for the most deliveries in the paper's world with `restock` at N = 25.
Only seeds from 400,000 to 400,045 were used.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import observations as row
from swarm_logistics_env.kernels import kernel, uniform
from swarm_logistics_env.motion import memory as column
from swarm_logistics_env.motion.frame import RANDOM_HEADING_TIME, random_heading
from swarm_logistics_env.motion.memory import drive, length_of
from swarm_logistics_env.policies.homing import (
    AVOID_GAIN,
    AVOID_RANGE,
    Homing,
    away_from_neighbours,
    fetch,
    freest_direction,
    home_direction,
    requested_item,
    search_direction,
)

# Lengths in m; distances from the delivery area are as a robot reckons them.
ROLE_TIME = 40.0  # [s]
HOLDERS = 0.6  # the share of robots that hold; the others stock
FIRST_ROLE = 2_000_003  # number in the robot's stream
NEAR, FAR = 0.8, 1.2  # items are put down nearer than the one, lifted farther than the other
CARRIED_OFF = 1.0  # where an item is put down for which there is no gap
GAP = 0.6  # between the centres of items, so that laden robots get through
DEPTH = 0.3  # of robots that hold items inside
SPREAD_GAIN, SPREAD_RANGE = 0.3, 1.5  # along the border, away from neighbours
LOST = 0.8  # that a reckoned distance may be wrong
STUCK = 0.4  # a robot tries a random direction until the memory's 1 has fallen to this
PULL = 0.4  # home, beside a random direction of length 1


@kernel
def decide_homing_stock(
    rows: NDArray[np.float32],
    memory: NDArray[np.float64],
    keys: NDArray[np.uint64],
    random_headings: NDArray[np.int64],
    period: float,
    commands: NDArray[np.float64],
) -> None:
    """Fill the commands (N, 4) from rows (N, D), memories and the numbers of random headings."""
    for robot in range(rows.shape[0]):
        sensed, own = rows[robot], memory[robot]
        is_inside = sensed[row.IN_DELIVERY_AREA] > 0.5
        # Robots change their roles at different times.
        turns = random_headings[robot] * RANDOM_HEADING_TIME / ROLE_TIME
        turn = int(turns + uniform(keys[robot], FIRST_ROLE))
        role = uniform(keys[robot], FIRST_ROLE + 1 + turn)
        holds = role < HOLDERS and own[column.CANNOT_DELIVER] < 0.5
        forget_if_lost(own, is_inside)
        home_x, home_y, sure = column.kept_home(own)
        x, y = own[column.HEADING_X], own[column.HEADING_Y]
        push_x, push_y = away_from_neighbours(sensed, AVOID_RANGE, AVOID_GAIN)
        item = requested_item(sensed, own, False)
        speed, gripper = 1.0, -1.0
        stands = is_inside and sensed[row.CARRYING_REQUESTED] > 0.5  # to deliver
        if sensed[row.CARRYING] > 0.5 and own[column.STUCK] > STUCK and not stands:
            gripper = 0.0
            angle = random_heading(keys[robot], random_headings[robot])
            x, y = math.cos(angle) + PULL * home_x, math.sin(angle) + PULL * home_y
            x, y = freest_direction(sensed, own, x + push_x, y + push_y)
        elif sensed[row.CARRYING_REQUESTED] > 0.5:
            gripper = 1.0 if not is_inside or own[column.FAILED] < 0.5 else -1.0
            speed = 0.0 if stands and gripper > 0.0 else 1.0
            if not is_inside and sure > 0.0:
                x, y = home_x, home_y
            elif not is_inside:
                x, y = home_direction(sensed, own, x, y)
            x, y = freest_direction(sensed, own, x + push_x, y + push_y)
        elif sensed[row.CARRYING] > 0.5:
            if item >= 0:  # it lets go outside, and lifts that one
                x, y = sensed[item + 1], sensed[item + 2]
            elif sure == 0.0:
                x, y = search_direction(sensed, own, x, y, is_inside)
            elif not holds and is_gap(sensed, own, is_inside):
                pass  # it lets go here
            elif not holds and (is_inside or x * home_x + y * home_y < -0.3):
                gripper = -1.0 if own[column.AWAY] > CARRIED_OFF else 0.0
                x, y = freest_direction(sensed, own, push_x - home_x, push_y - home_y)
            else:
                gripper = 0.0
                x, y = hold_direction(sensed, own, home_x, home_y, is_inside, period)
                if is_inside:
                    speed = min(1.0, length_of(x, y))
                else:
                    x, y = freest_direction(sensed, own, x + push_x, y + push_y)
        else:
            if item >= 0 and is_inside and sensed[item + 4] > 0.5:
                item = -1  # it could not deliver it
            stocks = holds or role > HOLDERS
            if item < 0 and stocks and sure > 0.0 and own[column.CANNOT_LIFT] <= 0.0:
                item = item_to_stock(sensed, own, home_x, home_y, 0.0 if holds else FAR)
            if item >= 0:
                x, y, speed, gripper = fetch(sensed, item, push_x, push_y, period)
            else:
                if sure == 0.0 and sensed[row.LOWEST_TIMER] > 0.5:
                    x, y = home_direction(sensed, own, x, y)
                x, y = search_direction(sensed, own, x, y, is_inside)
                x, y = x + push_x, y + push_y
                speed = min(1.0, max(length_of(x, y), 0.3))
        drive(x, y, speed, gripper, commands[robot])


@kernel
def forget_if_lost(own: NDArray[np.float64], is_inside: bool) -> None:
    """Forget the kept direction home if the distance reckoned with it cannot be."""
    if (own[column.AWAY] > LOST) if is_inside else (own[column.AWAY] < -LOST):
        own[column.KEPT_X], own[column.KEPT_Y], own[column.AWAY] = 0.0, 0.0, 0.0


@kernel
def is_gap(sensed: NDArray[np.float32], own: NDArray[np.float64], is_inside: bool) -> bool:
    """Return whether an item may be put down here for stock: in front of the area, amid no others.

    The nearest item comes first in a row.
    """
    if is_inside or own[column.AWAY] >= NEAR:
        return False
    x, y = sensed[row.ITEMS + 1], sensed[row.ITEMS + 2]
    return bool(sensed[row.ITEMS] < 0.5 or length_of(x, y) > GAP)


@kernel
def hold_direction(
    sensed: NDArray[np.float32],
    own: NDArray[np.float64],
    home_x: float,
    home_y: float,
    is_inside: bool,
    period: float,
) -> tuple[float, float]:
    """Return the velocity, in top speeds, to where a robot holds its item inside the area."""
    least = -1.0 if is_inside else 0.5
    deeper = max(least, min(1.0, (own[column.AWAY] + DEPTH) / (2.0 * period)))
    far_x, far_y = away_from_neighbours(sensed, SPREAD_RANGE, 1.0)
    aside = max(-0.7, min(0.7, SPREAD_GAIN * (home_x * far_y - home_y * far_x)))
    return deeper * home_x - aside * home_y, deeper * home_y + aside * home_x


@kernel
def item_to_stock(
    sensed: NDArray[np.float32],
    own: NDArray[np.float64],
    home_x: float,
    home_y: float,
    least: float,
) -> int:
    """Return the column of the nearest item farther than `least` [m] from the area; -1: none."""
    for place in range(row.N_ITEMS_IN_VIEW):
        there = row.ITEMS + row.ITEM_WIDTH * place
        if sensed[there] < 0.5:
            break
        away = own[column.AWAY] - sensed[there + 1] * home_x - sensed[there + 2] * home_y
        if sensed[there + 4] < 0.5 and away > least:
            return there
    return -1


class HomingStock(Homing):
    """Homing that carries stock to the delivery area before anybody asks for it.

    Example:
        >>> policy = HomingStock()
        >>> policy.reset(n_robots=3, seed=0)
        >>> policy.act(np.zeros((3, row.N_COLUMNS), np.float32)).shape
        (3, 4)
    """

    _decide = staticmethod(decide_homing_stock)
