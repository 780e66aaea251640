"""What every robot senses, one sense after the other: the observation rows.

Compiled, and over cell grids, so that the cost is linear in the number of robots.
"""

from __future__ import annotations

import math

from swarm_logistics_env import observations as row
from swarm_logistics_env.kernels import kernel

from . import contact, rangers
from .cameras import choose_neighbours, see_items, tell_of_neighbours
from .grid import look_around
from .own_state import feel_itself
from .radio import listen, lowest_timer_heard
from .rangers import Pose
from .structs import NOBODY, Sensed, World

_N_BEAMS = row.N_BEAMS
_ROBOTS, _WALLS, _ITEMS, _LOWEST = (
    row.RANGE_ROBOTS, row.RANGE_WALLS, row.RANGE_ITEMS, row.LOWEST_TIMER,
)  # fmt: skip


@kernel
def sense(world: World, rows: Sensed) -> int:
    """Fill the observation rows (N, D), who touches what, and what was heard.

    Returns how many robots that have not failed touch one that has.
    """
    robots, n_anchored = world.robots, 0
    for me in range(len(rows)):
        rows[me, :] = 0.0
        robots.contact[me] = False
        robots.heard[me] = math.nan
        if not robots.present[me]:
            continue
        heading = robots.heading[me]
        pose = Pose(
            robots.position[me, 0], robots.position[me, 1], math.cos(heading), math.sin(heading)
        )
        reach = world.able.ranger_range[me]
        scans = rows[me, : 3 * _N_BEAMS]
        scans[:] = reach if reach > 0.0 else world.parameters.ranger_range
        if reach > 0.0:
            scan = rows[me, _WALLS : _WALLS + _N_BEAMS]
            rangers.scan_solids(pose, reach, world, scan)
        n_anchored += int(sense_robots(me, pose, world, rows[me]))
        sense_items(me, pose, world, rows[me])
        if contact.touches_solid(pose, world):
            robots.contact[me] = True
        feel_itself(me, pose, world, rows[me])
    return n_anchored


@kernel
def sense_robots(me: int, pose: Pose, world: World, out: Sensed) -> bool:
    """Sense robots: by touch, in the beams, heard on the radio, in view.

    Returns whether `me` is sound and touches one that failed.
    """
    robots, able, parameters = world.robots, world.able, world.parameters
    grid, nearby, radius = world.robot_grid, world.nearby, world.parameters.robot_radius
    ranger_range, view_range = able.ranger_range[me], able.view_range[me]
    reach = max(
        ranger_range + radius, view_range, parameters.radio_range, 2.0 * radius + contact.GAP
    )
    n_found = look_around(grid, pose.x, pose.y, reach, me, nearby)
    touches, is_anchored = contact.touches_robots(me, world, n_found)
    robots.contact[me] |= touches
    if ranger_range > 0.0:
        scan = out[_ROBOTS : _ROBOTS + _N_BEAMS]
        rangers.scan_discs(pose, ranger_range, radius, grid, nearby, n_found, scan)
    listen(me, world, n_found)
    lowest, timer = lowest_timer_heard(world, n_found)
    if lowest != NOBODY:
        robots.heard[me] = timer
        forward, left = rangers.in_frame(
            pose, robots.position[lowest, 0], robots.position[lowest, 1]
        )
        out[_LOWEST] = 1.0
        out[_LOWEST + 1] = forward
        out[_LOWEST + 2] = left
        out[_LOWEST + 3] = timer
    n_chosen = choose_neighbours(me, world, n_found)
    tell_of_neighbours(pose, world, n_chosen, out)
    return is_anchored


@kernel
def sense_items(me: int, pose: Pose, world: World, out: Sensed) -> None:
    """Sense free items: in the beams, in view, and by touch when laden."""
    parameters, grid, nearby = world.parameters, world.item_grid, world.nearby
    radius = parameters.item_radius
    ranger_range, view_range = world.able.ranger_range[me], world.able.view_range[me]
    touch = parameters.robot_radius + contact.GAP + radius
    reach = max(ranger_range + radius, view_range, touch)
    n_found = look_around(grid, pose.x, pose.y, reach, NOBODY, nearby)
    if ranger_range > 0.0:
        scan = out[_ITEMS : _ITEMS + _N_BEAMS]
        rangers.scan_discs(pose, ranger_range, radius, grid, nearby, n_found, scan)
    if world.robots.item[me] != NOBODY:
        world.robots.contact[me] |= contact.touches_items(world, n_found)
    see_items(me, pose, world, n_found, out)
