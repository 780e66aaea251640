"""Keeping a stock, for `HomingStock`: who holds or stocks which items, where, and until when.

Lengths are in m; distances from the delivery area are as a robot reckons them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.compiler.kernels import kernel
from swarm_logistics_env.policies.driving import away_from_neighbours
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.motion.memory import CLEARING_TIME, MEMORY, length_of

ITEM_SPACING = 0.6  # between the centres of items, so that laden robots get through
DEPTH = 0.3  # of robots that hold items inside
SPREAD_GAIN = 0.3  # along the border, away from neighbours
SPREAD_RANGE = 1.5
LOST = 0.8  # that a reckoned distance may be wrong


@kernel
def forget_if_lost(memory: NDArray[np.float64], is_inside: bool) -> None:
    """Forget the kept direction home if the distance reckoned with it cannot be."""
    is_lost = memory[MEMORY.away] > LOST if is_inside else memory[MEMORY.away] < -LOST
    if is_lost:
        memory[MEMORY.kept_x] = 0.0
        memory[MEMORY.kept_y] = 0.0
        memory[MEMORY.away] = 0.0


@kernel
def has_lost_patience(
    observation: NDArray[np.float32],
    memory: NDArray[np.float64],
    is_inside: bool,
    period: float,
    patience: float,
) -> bool:
    """Return whether a robot leaves the requested item to others; takes note of how long it tried.

    It does so for as long as its patience lasted, and at first clears the way of who comes next.
    """
    if patience == 0.0:
        return False
    if memory[MEMORY.tried] < 0.0:
        memory[MEMORY.tried] = min(0.0, memory[MEMORY.tried] + period)
        return True
    if is_inside or observation[row.CARRYING_REQUESTED] < 0.5:
        memory[MEMORY.tried] = 0.0
        return False
    memory[MEMORY.tried] += period
    if memory[MEMORY.tried] < patience:
        return False
    memory[MEMORY.tried] = -patience
    memory[MEMORY.clearing] = CLEARING_TIME
    return True


@kernel
def is_gap(
    observation: NDArray[np.float32],
    memory: NDArray[np.float64],
    is_inside: bool,
    near: float,
) -> bool:
    """Return whether an item may be put down here for stock: near the area, amid no others.

    Near is less than `near` [m] from it. The nearest item comes first in a row.
    """
    if is_inside or memory[MEMORY.away] >= near:
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
        x = np.float64(observation[start + row.ITEM.x])
        y = np.float64(observation[start + row.ITEM.y])
        distance = memory[MEMORY.away] - x * home_x - y * home_y
        if observation[start + row.ITEM.recently_held] < 0.5 and distance > least:
            return start
    return -1
