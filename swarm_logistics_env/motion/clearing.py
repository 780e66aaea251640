"""The way out for a caged robot: it stands amid items with gaps that are narrower than it is.

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
