"""The item collision mask: items that are no obstacles until no laden robot stands above them.

An unladen robot may stand above items. Were those solid to it from the moment it lifts another,
they would shove it off, through its neighbours and walls where there is no room. So what it stands
above is masked (`Items.covered`), as is an item that is put down, and is solid again when robots
have left it.
"""

from __future__ import annotations

from swarm_logistics_env.kernels import inlined_kernel
from swarm_logistics_env.warehouse.engine import FREE_ITEM, LIFTED, NO_ONE, collide_with
from swarm_logistics_env.warehouse.grid import cells_around, run_of
from swarm_logistics_env.warehouse.structs import (
    NOBODY,
    STORED,
    Engine,
    Grid,
    IntegerRows,
    Items,
    Robots,
)


@inlined_kernel
def mask_below_lifters(
    engine: Engine,
    events: IntegerRows,
    n_events: int,
    reach: float,
    robots: Robots,
    items: Items,
    item_grid: Grid,
) -> None:
    """Mask what stands within `reach` [m] of robots that lifted, by events (kind, robot, item)."""
    for event in range(n_events):
        if events[event, 0] != LIFTED:
            continue
        x, y = robots.position[events[event, 1], 0], robots.position[events[event, 1], 1]
        left, right, bottom, top = cells_around(item_grid, x, y, reach)
        for row in range(bottom, top + 1):
            first, end = run_of(item_grid, row, left, right)
            for place in range(first, end):
                item = item_grid.members[place]
                dx, dy = items.position[item, 0] - x, items.position[item, 1] - y
                if items.status[item] == STORED and dx * dx + dy * dy < reach * reach:
                    items.covered[item] = 1
                    collide_with(engine, engine.item_shapes[item], NO_ONE)


@inlined_kernel
def unmask_left(
    engine: Engine, reach: float, robots: Robots, items: Items, robot_grid: Grid, item_grid: Grid
) -> None:
    """Make those masked items solid that no laden robot has within its `reach` [m] any more.

    Both grids hold where things stand now. An item that is in none yet waits for the next step.
    """
    for place in range(item_grid.start[-1]):
        item = item_grid.members[place]
        if items.covered[item] == 0:
            continue
        x, y = item_grid.places[place, 0], item_grid.places[place, 1]
        if not is_below_laden(robots, robot_grid, x, y, reach):
            items.covered[item] = 0
            collide_with(engine, engine.item_shapes[item], FREE_ITEM)


@inlined_kernel
def is_below_laden(robots: Robots, robot_grid: Grid, x: float, y: float, reach: float) -> bool:
    """Return whether a laden robot stands within `reach` [m] of (x, y)."""
    left, right, bottom, top = cells_around(robot_grid, x, y, reach)
    for row in range(bottom, top + 1):
        first, end = run_of(robot_grid, row, left, right)
        for place in range(first, end):
            robot = robot_grid.members[place]
            dx, dy = robot_grid.places[place, 0] - x, robot_grid.places[place, 1] - y
            is_above = dx * dx + dy * dy < reach * reach
            if is_above and robots.present[robot] and robots.item[robot] != NOBODY:
                return True
    return False
