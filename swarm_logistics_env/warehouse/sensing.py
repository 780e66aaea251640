"""What every robot senses, one sense after the other: the observation rows.

Compiled, and over cell grids, so that the cost is linear in the number of robots.

It has what a robot knows of itself and touches, and the errors of sensors: noise, rangers that
fail, and what else turns a true row into a measured one. The rest stands in `surroundings`.
"""

from __future__ import annotations

import math

import numpy as np

from swarm_logistics_env import observations as row
from swarm_logistics_env.kernels import gaussian, inlined_kernel, kernel, uniform

from .demand import is_requested
from .grid import look_around
from .structs import NOBODY, Parameters, Sensed, World
from .surroundings import (
    ITEM_SEEN,
    ROBOT_SEEN,
    Pose,
    choose,
    describe_items,
    describe_neighbours,
    in_frame,
    listen,
    scan_discs,
    scan_solids,
)


@inlined_kernel
def feel_itself(me: int, pose: Pose, world: World, out: Sensed) -> None:
    """Fill the end of a row: load, delivery area, timer, velocity and contact."""
    robots, parameters = world.robots, world.parameters
    velocity_x, velocity_y = robots.velocity[me, 0], robots.velocity[me, 1]
    forward = velocity_x * pose.cosine + velocity_y * pose.sine
    left = velocity_y * pose.cosine - velocity_x * pose.sine
    limit = parameters.max_speed
    carried, timer = robots.item[me], robots.timer[me]
    runs = not math.isnan(timer)
    out[row.CARRYING] = 1.0 if carried != NOBODY else 0.0
    out[row.CARRYING_REQUESTED] = 1.0 if carried != NOBODY and is_requested(world, carried) else 0.0
    out[row.IN_DELIVERY_AREA] = 1.0 if robots.in_delivery[me] else 0.0
    out[row.TIMER_RUNS] = 1.0 if runs else 0.0
    out[row.TIMER] = timer if runs else parameters.timer_limit
    out[row.VELOCITY] = min(max(forward, -limit), limit)
    out[row.VELOCITY + 1] = min(max(left, -limit), limit)
    out[row.CONTACT] = 1.0 if robots.contact[me] else 0.0


GAP = 0.01  # [m], gap below which two things touch


@inlined_kernel
def touches_solid(pose: Pose, world: World) -> bool:
    """Return whether a robot touches a wall or an obstacle."""
    parameters, obstacles = world.parameters, world.obstacles
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
def touches_robots(me: int, world: World, n_found: int) -> tuple[bool, bool]:
    """Return whether `me` touches a robot, and whether it is sound and touches one that failed."""
    limit = (2.0 * world.parameters.robot_radius + GAP) ** 2
    failed = world.robots.failed
    touches = is_anchored = False
    for index in range(n_found):
        if world.nearby.square[index] < limit:
            other = world.robot_grid.members[world.nearby.slot[index]]
            touches = True
            is_anchored |= failed[other] and not failed[me]
    return touches, is_anchored


@inlined_kernel
def touches_items(world: World, n_found: int) -> bool:
    """Return whether a laden robot touches an item that is in its way."""
    limit = (world.parameters.robot_radius + GAP + world.parameters.item_radius) ** 2
    touches = False
    for index in range(n_found):
        if world.nearby.square[index] < limit:
            item = world.item_grid.members[world.nearby.slot[index]]
            touches |= world.items.covered[item] == 0
    return touches


_N_RANGES = row.RANGE_ITEMS + row.N_BEAMS  # of all scans, which come first in a row
# Things with a place: items, neighbours, and the teller of the lowest timer.
_N_THINGS = row.N_ITEMS_IN_VIEW + row.N_NEIGHBOURS + 1
# A robot draws in a step: an error for every beam, whether each is dropped, then errors of places.
_DROPPED, _POSITIONS, _DRAWS = _N_RANGES, 2 * _N_RANGES, 2 * _N_RANGES + 2 * _N_THINGS


@inlined_kernel
def full_range(world: World, robot: int) -> float:
    """Return what a robot's beams read that meet nothing [m], also where its rangers are blind."""
    reach = world.able.ranger_range[robot]
    return reach if reach > 0.0 else world.parameters.ranger_range


@kernel
def disturb(me: int, world: World, out: Sensed) -> None:
    """Add the scenario's noise to a row and drop beams, in place.

    What is measured stays within the column's range.
    """
    parameters = world.parameters
    key, first = world.robots.sensor_key[me], world.progress.step[0] * _DRAWS
    if parameters.ranger_noise > 0.0 or parameters.sensor_dropout > 0.0:
        disturb_beams(key, first, full_range(world, me), parameters, out)
    if parameters.position_noise > 0.0:
        disturb_positions(key, first + _POSITIONS, parameters, out)


@kernel
def disturb_beams(
    key: np.uint64, first: int, reach: float, parameters: Parameters, out: Sensed
) -> None:
    """Add noise to the beams of a row, from number `first` of the stream, and drop some.

    A beam that is dropped reports what one does that meets nothing within `reach` [m].
    """
    dropout, noise = parameters.sensor_dropout, parameters.ranger_noise
    for beam in range(_N_RANGES):
        if dropout > 0.0 and uniform(key, 2 * (first + _DROPPED + beam)) < dropout:
            out[beam] = reach
        elif noise > 0.0 and out[beam] < np.float32(reach):
            noisy = out[beam] + noise * gaussian(key, first + beam)
            out[beam] = min(max(noisy, 0.0), reach)


@kernel
def disturb_positions(key: np.uint64, first: int, parameters: Parameters, out: Sensed) -> None:
    """Add noise to the places of what is there in a row, from number `first` of the stream."""
    far = max(parameters.view_range, parameters.radio_range)
    for thing in range(_N_THINGS):
        if thing < row.N_ITEMS_IN_VIEW:
            column, limit = row.ITEMS + row.ITEM_WIDTH * thing, parameters.view_range
        else:
            column = row.NEIGHBOURS + row.NEIGHBOUR_WIDTH * (thing - row.N_ITEMS_IN_VIEW)
            limit = far
        if out[column] > 0.5:
            for axis in range(2):
                error = parameters.position_noise * gaussian(key, first + 2 * thing + axis)
                out[column + 1 + axis] = min(max(out[column + 1 + axis] + error, -limit), limit)


@kernel
def fail_rangers(me: int, world: World, out: Sensed) -> None:
    """Make of the beams in a row what rangers that have failed report, in place."""
    able, frozen = world.able, world.robots.frozen_beams[me]
    bias, reach = able.ranger_bias[me], full_range(world, me)
    if bias != 0.0:
        for beam in range(_N_RANGES):
            if out[beam] < np.float32(reach):
                out[beam] = min(max(out[beam] + bias, 0.0), reach)
    if able.rangers_refresh[me]:
        frozen[0] = math.nan
    elif math.isnan(frozen[0]):
        for beam in range(_N_RANGES):
            frozen[beam] = out[beam]
    else:
        for beam in range(_N_RANGES):
            out[beam] = frozen[beam]


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
        scans = rows[me, :_N_RANGES]
        scans[:] = full_range(world, me)
        if reach > 0.0:
            scan = rows[me, row.RANGE_WALLS : row.RANGE_WALLS + row.N_BEAMS]
            scan_solids(pose, reach, world, scan)
        n_anchored += int(sense_robots(me, pose, world, rows[me]))
        sense_items(me, pose, world, rows[me])
        robots.contact[me] |= touches_solid(pose, world)
        feel_itself(me, pose, world, rows[me])
        disturb(me, world, rows[me])
        fail_rangers(me, world, rows[me])
    return n_anchored


@kernel
def sense_robots(me: int, pose: Pose, world: World, out: Sensed) -> bool:
    """Sense robots: by touch, in the beams, heard on the radio, in view.

    Returns whether `me` is sound and touches one that failed.
    """
    robots, able, parameters = world.robots, world.able, world.parameters
    grid, nearby, radius = world.robot_grid, world.nearby, world.parameters.robot_radius
    ranger_range, view_range = able.ranger_range[me], able.view_range[me]
    reach = max(ranger_range + radius, view_range, parameters.radio_range, 2.0 * radius + GAP)
    n_found = look_around(grid, pose.x, pose.y, reach, me, nearby)
    touches, is_anchored = touches_robots(me, world, n_found)
    robots.contact[me] |= touches
    if ranger_range > 0.0:
        scan = out[row.RANGE_ROBOTS : row.RANGE_ROBOTS + row.N_BEAMS]
        scan_discs(pose, ranger_range, radius, grid, nearby, n_found, scan)
    lowest, timer = listen(me, world, n_found)
    if lowest != NOBODY:
        robots.heard[me] = timer
        forward, left = in_frame(pose, robots.position[lowest, 0], robots.position[lowest, 1])
        out[row.LOWEST_TIMER] = 1.0
        out[row.LOWEST_TIMER + 1] = forward
        out[row.LOWEST_TIMER + 2] = left
        out[row.LOWEST_TIMER + 3] = timer
    n_chosen = choose(me, world, grid, n_found, ROBOT_SEEN)
    describe_neighbours(pose, world, n_chosen, out)
    return is_anchored


@kernel
def sense_items(me: int, pose: Pose, world: World, out: Sensed) -> None:
    """Sense free items: in the beams, in view, and by touch when laden."""
    parameters, grid, nearby = world.parameters, world.item_grid, world.nearby
    radius = parameters.item_radius
    ranger_range, view_range = world.able.ranger_range[me], world.able.view_range[me]
    touch = parameters.robot_radius + GAP + radius
    reach = max(ranger_range + radius, view_range, touch)
    n_found = look_around(grid, pose.x, pose.y, reach, NOBODY, nearby)
    if ranger_range > 0.0:
        scan = out[row.RANGE_ITEMS : row.RANGE_ITEMS + row.N_BEAMS]
        scan_discs(pose, ranger_range, radius, grid, nearby, n_found, scan)
    if world.robots.item[me] != NOBODY:
        world.robots.contact[me] |= touches_items(world, n_found)
    n_chosen = choose(me, world, grid, n_found, ITEM_SEEN)
    describe_items(me, pose, world, n_chosen, out)
