"""What every robot senses, one sense after the other: the observation rows.

Compiled, and over cell grids, so that the cost is linear in the number of robots. Each sense has a
file of its own: `rangers`, `radio`, `cameras` and `touch`; `sensor_errors` makes of a true row a
measured one. What a robot knows of itself is filled here.
"""

from __future__ import annotations

import math

from swarm_logistics_env.compiler.kernels import inlined_kernel, kernel
from swarm_logistics_env.world import observations as row

from .batteries import sense_battery
from .cameras import choose, describe_items, describe_neighbours
from .demand import is_known_request
from .grid import look_around
from .pose import Pose, in_frame
from .radio import listen
from .rangers import (
    N_RANGES,
    full_range,
    hide_behind_solids,
    scan_discs,
    scan_robots,
    scan_solids,
)
from .sensor_errors import ITEM_SEEN, ROBOT_SEEN, disturb, fail_rangers
from .structs import NOBODY, Sensed, World
from .touch import TOUCHING_GAP, touches_items, touches_robots, touches_solid


@kernel
def sense(world: World, rows: Sensed) -> int:
    """Fill the observation rows (N, D), who touches what, and what was heard.

    Returns how many robots that have not failed touch one that has.
    """
    robots = world.robots
    n_anchored = 0
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
        scans = rows[me, :N_RANGES]
        scans[:] = full_range(world, me)
        if reach > 0.0:
            scan = rows[me, row.RANGE_WALLS : row.RANGE_WALLS + row.N_BEAMS]
            scan_solids(pose, reach, world, scan)
        n_anchored += int(sense_robots(me, pose, world, rows[me]))
        sense_items(me, pose, world, rows[me])
        if reach > 0.0 and world.floor.n_columns > 0:
            hide_behind_solids(scans, full_range(world, me))
        robots.contact[me] |= touches_solid(me, pose, world)
        feel_itself(me, pose, world, rows[me])
        sense_battery(me, pose, world, rows[me])
        disturb(me, world, rows[me])
        fail_rangers(me, world, rows[me])
    return n_anchored


@kernel
def sense_robots(me: int, pose: Pose, world: World, out: Sensed) -> bool:
    """Sense robots: by touch, in the beams, heard on the radio, in view.

    Returns whether `me` is sound and touches one that failed.
    """
    robots = world.robots
    able = world.able
    parameters = world.parameters
    grid = world.robot_grid
    nearby = world.nearby
    radius = parameters.robot_radius  # of the largest
    ranger_range = able.ranger_range[me]
    view_range = able.view_range[me]
    reach = max(
        ranger_range + radius, view_range, parameters.radio_range, 2.0 * radius + TOUCHING_GAP
    )
    n_found = look_around(grid, pose.x, pose.y, reach, me, nearby)
    touches, is_anchored = touches_robots(me, world, n_found)
    robots.contact[me] |= touches
    if ranger_range > 0.0:
        scan = out[row.RANGE_ROBOTS : row.RANGE_ROBOTS + row.N_BEAMS]
        if parameters.has_smaller_robots:
            scan_robots(pose, ranger_range, world, n_found, scan)
        else:
            scan_discs(pose, ranger_range, radius, grid, nearby, n_found, scan)
    lowest, timer = listen(me, world, n_found)
    if lowest != NOBODY:
        robots.heard[me] = timer
        forward, left = in_frame(pose, robots.position[lowest, 0], robots.position[lowest, 1])
        out[row.LOWEST_TIMER] = 1.0
        out[row.LOWEST_TIMER_X] = forward
        out[row.LOWEST_TIMER_Y] = left
        out[row.LOWEST_TIMER_TIME] = timer
    n_chosen = choose(me, pose, world, grid, n_found, ROBOT_SEEN)
    describe_neighbours(pose, world, n_chosen, out)
    return is_anchored


@kernel
def sense_items(me: int, pose: Pose, world: World, out: Sensed) -> None:
    """Sense free items: in the beams, in view, and by touch when laden."""
    parameters = world.parameters
    grid = world.item_grid
    nearby = world.nearby
    radius = parameters.item_radius
    ranger_range = world.able.ranger_range[me]
    view_range = world.able.view_range[me]
    touch = world.robots.radius[me] + TOUCHING_GAP + radius
    reach = max(ranger_range + radius, view_range, touch)
    n_found = look_around(grid, pose.x, pose.y, reach, NOBODY, nearby)
    if ranger_range > 0.0:
        scan = out[row.RANGE_ITEMS : row.RANGE_ITEMS + row.N_BEAMS]
        scan_discs(pose, ranger_range, radius, grid, nearby, n_found, scan)
    if world.robots.item[me] != NOBODY:
        world.robots.contact[me] |= touches_items(me, world, n_found)
    n_chosen = choose(me, pose, world, grid, n_found, ITEM_SEEN)
    describe_items(me, pose, world, n_chosen, out)


@inlined_kernel
def feel_itself(me: int, pose: Pose, world: World, out: Sensed) -> None:
    """Fill the end of a row: load, delivery area, timer, velocity, contact and turn rate."""
    robots = world.robots
    parameters = world.parameters
    velocity_x = robots.velocity[me, 0]
    velocity_y = robots.velocity[me, 1]
    forward = velocity_x * pose.cosine + velocity_y * pose.sine
    left = velocity_y * pose.cosine - velocity_x * pose.sine
    limit = parameters.highest_speed
    carried = robots.item[me]
    timer = robots.timer[me]
    runs = not math.isnan(timer)
    out[row.CARRYING] = 1.0 if carried != NOBODY else 0.0
    knows = carried != NOBODY and is_known_request(world, me, carried)
    out[row.CARRYING_REQUESTED] = 1.0 if knows else 0.0
    out[row.IN_DELIVERY_AREA] = 1.0 if robots.in_delivery[me] else 0.0
    out[row.TIMER_RUNS] = 1.0 if runs else 0.0
    out[row.TIMER] = timer if runs else parameters.timer_limit
    out[row.VELOCITY_X] = min(max(forward, -limit), limit)
    out[row.VELOCITY_Y] = min(max(left, -limit), limit)
    out[row.CONTACT] = 1.0 if robots.contact[me] else 0.0
    limit = parameters.highest_turn_rate
    out[row.TURN_RATE] = min(max(robots.turn_rate[me], -limit), limit)
