"""How a differential robot drives where it wants to: its body turns, and its memory with it.

And the way out for a caged robot, which stands amid items with gaps that are narrower than it is.

It lets the requested item go, lifts one of those that stand around it, which an empty robot can
drive under, and carries it away. Then the way is open for whoever lifts the requested item next.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import observations as row
from swarm_logistics_env.kernels import kernel
from swarm_logistics_env.motion import memory as known


@kernel
def steer(widest: float, memory: NDArray[np.float64], commands: NDArray[np.float64]) -> None:
    """Turn commands (N, 4) to drive in a direction into turns and motion ahead or back.

    Args:
        widest: the largest turn of a control period [rad].
        memory: (N, N_COLUMNS); its directions are turned back by the robot's own turn.
        commands: forward and left as if the drive were holonomic; left becomes 0.
    """
    for robot in range(commands.shape[0]):
        x, y = commands[robot, 0], commands[robot, 1]
        speed = math.sqrt(x * x + y * y)
        if speed < 1e-6:
            continue
        angle, way = math.atan2(y, x), 1.0
        if abs(angle) > 0.5 * math.pi:
            # It drives as well backwards, so that it never turns by more than a quarter.
            angle, way = angle - math.copysign(math.pi, angle), -1.0
        turn = min(max(angle, -widest), widest)
        # It drives along its mean direction in the period, and slower the more that is off.
        commands[robot, 0] = way * speed * max(0.0, math.cos(angle - 0.5 * turn))
        commands[robot, 1] = 0.0
        commands[robot, 2] = turn / widest
        turn_back(turn, memory[robot])


@kernel
def turn_back(turn: float, own: NDArray[np.float64]) -> None:
    """Turn the directions in one memory by -turn [rad], as the body turns by `turn`."""
    cos, sin = math.cos(turn), math.sin(turn)
    for column in (known.HEADING_X, known.HOME_X):
        x, y = own[column], own[column + 1]
        own[column], own[column + 1] = cos * x + sin * y, cos * y - sin * x
    own[known.WALL] -= turn


# Ranges in m, beside the pick-up range of 0.25: hold lifts the requested item first if in reach.
_IN_REACH, _OUT_OF_REACH = 0.2, 0.28
_PUT_DOWN_TIME = 0.5  # [s] before the end, at which the item that was in the way is put down


@kernel
def clear_the_way(
    rows: NDArray[np.float32], memory: NDArray[np.float64], commands: NDArray[np.float64]
) -> None:
    """Replace the commands (N, 4) of caged robots, which their memories (N, N_COLUMNS) tell."""
    for robot in range(rows.shape[0]):
        left = memory[robot, known.CLEARING]
        if left <= 0.0:
            continue
        sensed = rows[robot]
        requested, other = nearest_items(sensed)
        x, y, speed, gripper = 0.0, 0.0, 0.0, -1.0
        if sensed[row.CARRYING_REQUESTED] < 0.5 and sensed[row.CARRYING] > 0.5:
            x, y = memory[robot, known.HEADING_X], memory[robot, known.HEADING_Y]
            if requested >= 0:
                x, y = -sensed[requested + 1], -sensed[requested + 2]
            speed = 1.0
            gripper = 1.0 if left > _PUT_DOWN_TIME else -1.0
        elif sensed[row.CARRYING] < 0.5 and other >= 0:
            x, y = sensed[other + 1], sensed[other + 2]
            away = math.sqrt(x * x + y * y)
            speed = min(1.0, 2.0 * away)
            alone = requested < 0 or (
                sensed[requested + 1] ** 2 + sensed[requested + 2] ** 2 > _OUT_OF_REACH**2
            )
            gripper = 1.0 if alone and away < _IN_REACH else -1.0
        length = max(math.sqrt(x * x + y * y), 1e-9)
        commands[robot, 0], commands[robot, 1] = speed * x / length, speed * y / length
        commands[robot, 2], commands[robot, 3] = 0.0, gripper


@kernel
def nearest_items(sensed: NDArray[np.float32]) -> tuple[int, int]:
    """Return the columns of the requested item in view and of the nearest other; -1: none."""
    requested, other, nearest = -1, -1, math.inf
    for place in range(row.N_ITEMS_IN_VIEW):
        there = row.ITEMS + row.ITEM_WIDTH * place
        if sensed[there] < 0.5:
            continue
        if sensed[there + 3] > 0.5:
            requested = there
        else:
            away = sensed[there + 1] ** 2 + sensed[there + 2] ** 2
            if away < nearest:
                other, nearest = there, away
    return requested, other
