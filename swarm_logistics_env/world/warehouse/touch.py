"""Touch: whether a robot touches what is solid to it."""

from __future__ import annotations

from swarm_logistics_env.compiler.kernels import inlined_kernel

from .contacts import count_overlap
from .floor_cells import is_near_solid
from .pose import Pose
from .structs import World

TOUCHING_GAP = 0.01  # [m], gap below which two things touch


@inlined_kernel
def touches_solid(me: int, pose: Pose, world: World) -> bool:
    """Return whether `me` touches a wall, an obstacle or a rack."""
    parameters = world.parameters
    obstacles = world.obstacles
    reach = world.robots.radius[me] + TOUCHING_GAP
    away_x = min(pose.x, parameters.warehouse_width - pose.x)
    away_y = min(pose.y, parameters.warehouse_height - pose.y)
    touches = bool(min(away_x, away_y) < reach)
    if world.floor.n_columns > 0:
        touches |= is_near_solid(world.floor, pose.x, pose.y, reach)
    limit = (reach + parameters.obstacle_radius) ** 2
    for obstacle in range(len(obstacles)):
        dx = obstacles[obstacle, 0] - pose.x
        dy = obstacles[obstacle, 1] - pose.y
        touches |= dx * dx + dy * dy < limit
    return touches


@inlined_kernel
def touches_robots(me: int, world: World, n_found: int) -> tuple[bool, bool]:
    """Return whether `me` touches a robot, and whether it is sound and touches one that failed.

    Counts those of higher numbers that it overlaps.
    """
    radius = world.robots.radius
    limit = (radius[me] + world.parameters.robot_radius + TOUCHING_GAP) ** 2
    failed = world.robots.failed
    touches = is_anchored = False
    for index in range(n_found):
        square = world.nearby.square[index]
        if square < limit:
            other = world.robot_grid.members[world.nearby.slot[index]]
            apart = radius[me] + radius[other]
            if square >= (apart + TOUCHING_GAP) ** 2:
                continue
            touches = True
            if other > me and square < apart**2:
                count_overlap(me, other, square, world)
            is_anchored |= failed[other] and not failed[me]
    return touches, is_anchored


@inlined_kernel
def touches_items(me: int, world: World, n_found: int) -> bool:
    """Return whether `me`, a laden robot, touches an item that is in its way."""
    limit = (world.robots.radius[me] + TOUCHING_GAP + world.parameters.item_radius) ** 2
    touches = False
    for index in range(n_found):
        if world.nearby.square[index] < limit:
            item = world.item_grid.members[world.nearby.slot[index]]
            touches |= world.items.covered[item] == 0
    return touches
