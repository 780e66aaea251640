"""From where a robot wants to go to its command, with what it remembers.

How a differential robot drives where it wants to; and the way out for a robot that is caged by
items with gaps narrower than it is. That one lets the requested item go, lifts one of those that
stand around it, and carries it away. Then the way is open for whoever lifts the requested item
next.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.compiler.kernels import inlined_kernel, kernel
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.motion.memory import MEMORY, length_of

# Ranges in m, beside the pick-up range of 0.25: hold lifts the requested item first if in reach.
_IN_REACH = 0.2
_OUT_OF_REACH = 0.28
_PUT_DOWN_TIME = 0.5  # [s] before the end, at which the item that was in the way is put down


@kernel
def steer(memory: NDArray[np.float64], command: NDArray[np.float64]) -> None:
    """Turn a command (4,) to drive in a direction into a turn and motion ahead or back.

    Of a robot that drives in every direction it stays as it is.

    Args:
        command: forward and left as if the drive were holonomic; left becomes 0.
    """
    widest = memory[MEMORY.widest_turn]
    speed = length_of(command[0], command[1])
    if widest <= 0.0 or speed < 1e-6:
        return
    angle = math.atan2(command[1], command[0])
    forwards = 1.0
    if abs(angle) > 0.5 * math.pi:
        # It drives as well backwards, so that it never turns by more than a quarter.
        angle -= math.copysign(math.pi, angle)
        forwards = -1.0
    turn = min(max(angle, -widest), widest)
    # It drives along its mean direction in the period, and slower the more that is off.
    command[0] = forwards * speed * max(0.0, math.cos(angle - 0.5 * turn))
    command[1] = 0.0
    command[2] = turn / widest


@kernel
def clear_the_way(
    sensed: NDArray[np.float32], memory: NDArray[np.float64], command: NDArray[np.float64]
) -> None:
    """Replace the command (4,) of a caged robot, which its memory tells."""
    if memory[MEMORY.clearing] <= 0.0:
        return
    requested, other = nearest_items(sensed)
    x = 0.0
    y = 0.0
    speed = 0.0
    gripper = -1.0
    if sensed[row.CARRYING_REQUESTED] < 0.5 and sensed[row.CARRYING] > 0.5:
        x = memory[MEMORY.heading_x]
        y = memory[MEMORY.heading_y]
        if requested >= 0:
            x = -np.float64(sensed[requested + row.ITEM.x])
            y = -np.float64(sensed[requested + row.ITEM.y])
        speed = 1.0
        gripper = 1.0 if memory[MEMORY.clearing] > _PUT_DOWN_TIME else -1.0
    elif sensed[row.CARRYING] < 0.5 and other >= 0:
        x = np.float64(sensed[other + row.ITEM.x])
        y = np.float64(sensed[other + row.ITEM.y])
        away = np.float64(length_of(sensed[other + row.ITEM.x], sensed[other + row.ITEM.y]))
        speed = min(1.0, 2.0 * away)
        alone = requested < 0 or square_to(sensed, requested) > _OUT_OF_REACH**2
        gripper = 1.0 if alone and away < _IN_REACH else -1.0
    set_velocity(x, y, speed, gripper, command)


@kernel
def set_velocity(
    x: float, y: float, speed: float, gripper: float, command: NDArray[np.float64]
) -> None:
    """Fill one robot's command (4,): `speed` in the direction (x, y), of any length; no turn."""
    length = max(length_of(x, y), 1e-9)
    command[0] = speed * x / length
    command[1] = speed * y / length
    command[2] = 0.0
    command[3] = gripper


@kernel
def nearest_items(sensed: NDArray[np.float32]) -> tuple[int, int]:
    """Return the columns of the nearest requested item in view and of the nearest other; -1: none.

    The nearest thing comes first in a row.
    """
    requested = -1
    other = -1
    nearest = math.inf
    for index in range(row.N_ITEMS_IN_VIEW):
        item = row.ITEMS + row.ITEM_WIDTH * index
        if sensed[item + row.ITEM.present] < 0.5:
            continue
        if sensed[item + row.ITEM.requested] > 0.5:
            requested = item if requested < 0 else requested
        else:
            square = square_to(sensed, item)
            if square < nearest:
                other = item
                nearest = square
    return requested, other


@inlined_kernel
def square_to(sensed: NDArray[np.float32], item: int) -> float:
    """Return the square of the distance to an item whose columns begin at `item` [m2]."""
    x = sensed[item + row.ITEM.x]
    y = sensed[item + row.ITEM.y]
    square: float = x * x + y * y
    return square
