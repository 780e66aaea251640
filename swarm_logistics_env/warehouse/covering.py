"""Covered items: those that are no obstacles until no laden robot stands above them.

An unladen robot may stand above items. Were those solid to it from the moment it lifts another,
they would shove it off, through its neighbours and walls where there is no room. So what it stands
above is covered, as is an item that is put down, and is solid again when robots have left it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.kernels import kernel
from swarm_logistics_env.warehouse.engine import FREE_ITEM, NO_ONE, SHAPES, collide_with
from swarm_logistics_env.warehouse.grid import cell_along
from swarm_logistics_env.warehouse.logistics import LIFTED
from swarm_logistics_env.warehouse.state import NOBODY, STORED


@kernel
def cover(
    engine: NDArray[np.int64],
    events: NDArray[np.int64],
    n_events: int,
    reach: float,
    position: NDArray[np.float64],
    item_position: NDArray[np.float64],
    status: NDArray[np.int64],
    covered: NDArray[np.int64],
    cell: float,
    size: NDArray[np.int64],
    start: NDArray[np.int64],
    members: NDArray[np.int64],
) -> None:
    """Cover what stands within `reach` [m] of robots that lifted, by events (kind, robot, item)."""
    for event in range(n_events):
        if events[event, 0] != LIFTED:
            continue
        x, y = position[events[event, 1], 0], position[events[event, 1], 1]
        left = cell_along(x - reach, cell, size[0])
        right = cell_along(x + reach, cell, size[0])
        top = cell_along(y + reach, cell, size[1])
        for row in range(cell_along(y - reach, cell, size[1]), top + 1):
            for index in range(start[row * size[0] + left], start[row * size[0] + right + 1]):
                item = members[index]
                dx, dy = item_position[item, 0] - x, item_position[item, 1] - y
                if status[item] == STORED and dx * dx + dy * dy < reach * reach:
                    covered[item] = 1
                    collide_with(engine, engine[SHAPES + len(position) + item], engine[NO_ONE])


@kernel
def uncover(
    engine: NDArray[np.int64],
    reach: float,
    present: NDArray[np.bool_],
    robot_item: NDArray[np.int64],
    covered: NDArray[np.int64],
    item_start: NDArray[np.int64],
    item_members: NDArray[np.int64],
    item_places: NDArray[np.float64],
    cell: float,
    size: NDArray[np.int64],
    start: NDArray[np.int64],
    members: NDArray[np.int64],
    places: NDArray[np.float64],
) -> None:
    """Make those covered items solid that no laden robot has within its `reach` [m] any more.

    Both grids hold where things stand now. An item that is in none yet waits for the next step.
    """
    for place in range(item_start[-1]):
        item = item_members[place]
        if covered[item] == 0:
            continue
        x, y = item_places[place, 0], item_places[place, 1]
        left = cell_along(x - reach, cell, size[0])
        right = cell_along(x + reach, cell, size[0])
        top = cell_along(y + reach, cell, size[1])
        is_free = True
        for row in range(cell_along(y - reach, cell, size[1]), top + 1):
            for index in range(start[row * size[0] + left], start[row * size[0] + right + 1]):
                robot = members[index]
                dx, dy = places[index, 0] - x, places[index, 1] - y
                is_above = dx * dx + dy * dy < reach * reach
                if is_above and present[robot] and robot_item[robot] != NOBODY:
                    is_free = False
        if is_free:
            covered[item] = 0
            collide_with(engine, engine[SHAPES + len(present) + item], engine[FREE_ITEM])
