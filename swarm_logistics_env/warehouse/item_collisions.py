"""The item collision mask: items that are no obstacles until no laden robot stands above them.

An unladen robot may stand above items. Were those solid to it from the moment it lifts another,
they would shove it off, through its neighbours and walls where there is no room. So what it stands
above is masked (`Items.covered`), as is an item that is put down, and is solid again when robots
have left it.
"""

from __future__ import annotations

from swarm_logistics_env.kernels import kernel

from .engine import FREE_ITEM, LIFTED, NO_ONE, collide_with
from .grid import look_around
from .structs import NOBODY, STORED, World


@kernel
def mask_below_lifters(world: World, n_events: int) -> None:
    """Mask what stands below robots that lifted, by the events of this step."""
    events, items, grid, nearby = world.claims.events, world.items, world.item_grid, world.nearby
    for event in range(n_events):
        if events[event, 0] != LIFTED:
            continue
        position = world.robots.position[events[event, 1]]
        n_found = look_around(grid, position[0], position[1], reach_of(world), NOBODY, nearby)
        for index in range(n_found):
            item = grid.members[nearby.place[index]]
            if items.status[item] == STORED:
                items.covered[item] = 1
                collide_with(world.engine, world.engine.item_shapes[item], NO_ONE)


@kernel
def unmask_left(world: World) -> None:
    """Make those masked items solid that no laden robot stands above any more.

    Both grids hold where things stand now. An item that is in none yet waits for the next step.
    """
    grid, nearby = world.item_grid, world.nearby
    for place in range(grid.start[-1]):
        item = grid.members[place]
        if world.items.covered[item] == 0:
            continue
        x, y = grid.places[place, 0], grid.places[place, 1]
        n_found = look_around(world.robot_grid, x, y, reach_of(world), NOBODY, nearby)
        is_below_laden = False
        for index in range(n_found):
            robot = world.robot_grid.members[nearby.place[index]]
            is_below_laden |= world.robots.item[robot] != NOBODY
        if not is_below_laden:
            world.items.covered[item] = 0
            collide_with(world.engine, world.engine.item_shapes[item], FREE_ITEM)


@kernel
def reach_of(world: World) -> float:
    """Return the distance [m] between centres up to which a robot stands above an item."""
    return world.parameters.robot_radius + world.parameters.item_radius
