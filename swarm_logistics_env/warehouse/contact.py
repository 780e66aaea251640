"""The contact sensor: what a robot touches."""

from __future__ import annotations

from swarm_logistics_env.kernels import inlined_kernel
from swarm_logistics_env.warehouse.rangers import Pose
from swarm_logistics_env.warehouse.structs import (
    Grid,
    Items,
    Nearby,
    Numbers,
    Parameters,
    Robots,
)

GAP = 0.01  # [m], gap below which two things touch


@inlined_kernel
def touches_solid(pose: Pose, parameters: Parameters, obstacles: Numbers) -> bool:
    """Return whether a robot touches a wall or an obstacle."""
    reach = parameters.robot_radius + GAP
    away_x = min(pose.x, parameters.warehouse_width - pose.x)
    away_y = min(pose.y, parameters.warehouse_height - pose.y)
    touches = min(away_x, away_y) < reach
    limit = (reach + parameters.obstacle_radius) ** 2
    for obstacle in range(len(obstacles)):
        dx, dy = obstacles[obstacle, 0] - pose.x, obstacles[obstacle, 1] - pose.y
        touches |= dx * dx + dy * dy < limit
    return touches


@inlined_kernel
def touches_robots(
    me: int, robots: Robots, parameters: Parameters, grid: Grid, nearby: Nearby, n_found: int
) -> tuple[bool, bool]:
    """Return whether `me` touches a robot, and whether it is sound and touches one that failed."""
    limit = (2.0 * parameters.robot_radius + GAP) ** 2
    touches = is_anchored = False
    for index in range(n_found):
        if nearby.square[index] < limit:
            other = grid.members[nearby.place[index]]
            touches = True
            is_anchored |= robots.failed[other] and not robots.failed[me]
    return touches, is_anchored


@inlined_kernel
def touches_items(
    parameters: Parameters, items: Items, grid: Grid, nearby: Nearby, n_found: int
) -> bool:
    """Return whether a laden robot touches an item that is in its way."""
    limit = (parameters.robot_radius + GAP + parameters.item_radius) ** 2
    touches = False
    for index in range(n_found):
        if nearby.square[index] < limit:
            touches |= items.covered[grid.members[nearby.place[index]]] == 0
    return touches
