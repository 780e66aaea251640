"""Rangers: 16 beams that measure how far a robot is from walls, obstacles, robots and items."""

from __future__ import annotations

import math

import numpy as np

from swarm_logistics_env.compiler.kernels import inlined_kernel, kernel
from swarm_logistics_env.world import observations as row

from .floor_cells import index_along, is_all_free
from .pose import Pose, in_frame
from .structs import Grid, Nearby, Sensed, World

N_RANGES = row.RANGE_ITEMS + row.N_BEAMS  # of all scans, which come first in a row
_N_BEAMS = row.N_BEAMS
_BEAM_X = np.cos(2.0 * np.pi * np.arange(_N_BEAMS) / _N_BEAMS)
_BEAM_Y = np.sin(2.0 * np.pi * np.arange(_N_BEAMS) / _N_BEAMS)
# Tangents of the angles half-way between the beams of the first quarter.
_BORDERS = tuple(math.tan((beam + 0.5) * 2.0 * math.pi / _N_BEAMS) for beam in range(_N_BEAMS // 4))
_TINY = 1e-300
# Beyond so many squares of its radius a disc meets only the beam nearest to its centre: it looks
# less wide than the beams stand apart. A little more, so that rounding decides nothing.
_ONE_BEAM = 1.001 / math.sin(math.pi / _N_BEAMS) ** 2


@inlined_kernel
def full_range(world: World, robot: int) -> float:
    """Return the reading of beams that meet nothing [m], also where its rangers are blind."""
    reach = world.able.ranger_range[robot]
    return reach if reach > 0.0 else world.parameters.ranger_reach


@inlined_kernel
def scan_solids(pose: Pose, reach: float, world: World, scan: Sensed) -> None:
    """Shorten the beams of `scan` (N_BEAMS,) [m] that meet walls, racks or obstacles."""
    parameters = world.parameters
    obstacles = world.obstacles
    scan_walls(pose, parameters.warehouse_width, parameters.warehouse_height, scan)
    if world.floor.n_columns > 0:
        scan_boxes(pose, reach, world, scan)
    radius = parameters.obstacle_radius
    for obstacle in range(len(obstacles)):
        forward, left = in_frame(pose, obstacles[obstacle, 0], obstacles[obstacle, 1])
        dx = obstacles[obstacle, 0] - pose.x
        dy = obstacles[obstacle, 1] - pose.y
        square = dx * dx + dy * dy
        if square < (reach + radius) ** 2:
            scan_disc(forward, left, square, radius, scan)


@kernel
def scan_walls(pose: Pose, width: float, height: float, scan: Sensed) -> None:
    """Shorten the beams of `scan` (N_BEAMS,) [m] that meet a wall of the arena."""
    reach = scan[0]
    for axis in range(2):
        if axis == 0:
            back = pose.x
            front = width - pose.x
            axis_forward = pose.cosine
            axis_left = -pose.sine
        else:
            back = pose.y
            front = height - pose.y
            axis_forward = pose.sine
            axis_left = pose.cosine
        if min(back, front) >= reach:
            continue
        back = max(back, 0.0)
        front = max(front, 0.0)
        for beam in range(_N_BEAMS):
            towards = _BEAM_X[beam] * axis_forward + _BEAM_Y[beam] * axis_left
            # Without a branch: all beams together are a few vector instructions.
            distance = np.float32((front if towards > 0.0 else back) / abs(towards))
            scan[beam] = distance if distance < scan[beam] else scan[beam]


@kernel
def scan_boxes(pose: Pose, reach: float, world: World, scan: Sensed) -> None:
    """Shorten the beams of `scan` (N_BEAMS,) [m] that meet a wall or a rack of the plan.

    Without branches in the loops over beams (Kay and Kajiya 1986): several are one instruction.
    """
    floor = world.floor
    if is_all_free(floor, pose.x, pose.y, reach):
        return
    per_x = world.nearby.per_x
    per_y = world.nearby.per_y
    free = world.nearby.free
    for beam in range(_N_BEAMS):
        step_x = _BEAM_X[beam] * pose.cosine - _BEAM_Y[beam] * pose.sine
        step_y = _BEAM_X[beam] * pose.sine + _BEAM_Y[beam] * pose.cosine
        # Not infinity for a beam along an axis, as 0 times infinity is no number.
        per_x[beam] = 1.0 / (step_x if step_x != 0.0 else _TINY)
        per_y[beam] = 1.0 / (step_y if step_y != 0.0 else _TINY)
        free[beam] = math.inf
    block = floor.n_block_columns * index_along(pose.y, floor.block, floor.n_block_rows)
    block += index_along(pose.x, floor.block, floor.n_block_columns)
    for index in range(floor.first_near[block], floor.first_near[block + 1]):
        low = 4 * floor.near[index]  # its lowest corner; the highest one is two farther
        left = floor.corners[low, 0] - pose.x
        bottom = floor.corners[low, 1] - pose.y
        right = floor.corners[low + 2, 0] - pose.x
        top = floor.corners[low + 2, 1] - pose.y
        away_x = max(left, -right, 0.0)
        away_y = max(bottom, -top, 0.0)
        if away_x * away_x + away_y * away_y > reach * reach:
            continue
        for beam in range(_N_BEAMS):
            to_left = left * per_x[beam]
            to_right = right * per_x[beam]
            to_bottom = bottom * per_y[beam]
            to_top = top * per_y[beam]
            enters = max(min(to_left, to_right), min(to_bottom, to_top), 0.0)
            leaves = min(max(to_left, to_right), max(to_bottom, to_top))
            distance = enters if enters <= leaves else math.inf
            free[beam] = min(free[beam], distance)
    for beam in range(_N_BEAMS):
        distance = np.float32(free[beam])
        scan[beam] = distance if distance < scan[beam] else scan[beam]


@inlined_kernel
def hide_behind_solids(scans: Sensed, full: float) -> None:
    """Lengthen to `full` [m] those beams to robots and items that something solid stops before."""
    hidden = np.float32(full)
    for first in (row.RANGE_ROBOTS, row.RANGE_ITEMS):
        for beam in range(_N_BEAMS):
            distance = scans[first + beam]
            scans[first + beam] = hidden if distance > scans[row.RANGE_WALLS + beam] else distance


@kernel
def scan_discs(
    pose: Pose, reach: float, radius: float, grid: Grid, nearby: Nearby, n_found: int, scan: Sensed
) -> None:
    """Shorten the beams of `scan` (N_BEAMS,) [m] that meet discs nearby, within `reach` [m]."""
    limit = (reach + radius) ** 2
    n_scanned = 0
    # Written always and counted only if near: no branch to mispredict.
    for index in range(n_found):
        nearby.scanned[n_scanned] = index
        n_scanned += int(nearby.square[index] < limit)
    for number in range(n_scanned):
        index = nearby.scanned[number]
        slot = nearby.slot[index]
        nearby.forward[number], nearby.left[number] = in_frame(
            pose, grid.position[0, slot], grid.position[1, slot]
        )
        nearby.scanned_square[number] = nearby.square[index]
    meet_middle_beams(nearby, n_scanned, radius)
    for number in range(n_scanned):
        square = nearby.scanned_square[number]
        if square > _ONE_BEAM * radius * radius:
            beam = nearby.beam[number]
            distance = nearby.distance[number]
            scan[beam] = distance if distance < scan[beam] else scan[beam]
        else:
            scan_disc(nearby.forward[number], nearby.left[number], square, radius, scan)


@kernel
def scan_robots(pose: Pose, reach: float, world: World, n_found: int, scan: Sensed) -> None:
    """Do as `scan_discs` with the robots nearby, each of its own radius."""
    grid = world.robot_grid
    nearby = world.nearby
    for index in range(n_found):
        slot = nearby.slot[index]
        square = nearby.square[index]
        radius = world.robots.radius[grid.members[slot]]
        if square < (reach + radius) ** 2:
            forward, left = in_frame(pose, grid.position[0, slot], grid.position[1, slot])
            scan_disc(forward, left, square, radius, scan)


@inlined_kernel
def meet_middle_beams(nearby: Nearby, n_scanned: int, radius: float) -> None:
    """Fill the beams nearest to the centres of discs, and where these meet them [m].

    Infinitely far where they do not. Without branches: several discs are one vector instruction.
    """
    for number in range(n_scanned):
        forward = nearby.forward[number]
        left = nearby.left[number]
        beam = nearest_beam(forward, left)
        along = forward * _BEAM_X[beam] + left * _BEAM_Y[beam]
        inside = along * along - (nearby.scanned_square[number] - radius * radius)
        distance = along - math.sqrt(max(inside, 0.0))
        nearby.beam[number] = beam
        nearby.distance[number] = distance if inside > 0.0 else math.inf


@kernel
def scan_disc(forward: float, left: float, square: float, radius: float, scan: Sensed) -> None:
    """Shorten the beams of `scan` (N_BEAMS,) [m] that meet a disc.

    Args:
        forward, left: its centre in the robot's frame [m]; `square` is their squares' sum [m^2].
        radius: the disc's radius [m].
        scan: is changed.
    """
    clearance = square - radius * radius
    if clearance <= 0.0:
        scan[:] = 0.0
        return
    middle = nearest_beam(forward, left)
    # Outwards from the beam that looks nearest to its centre: if that one misses, all do.
    for direction in (1, -1):
        for turn in range(_N_BEAMS // 2):
            beam = (middle + direction * (turn if direction > 0 else turn + 1)) % _N_BEAMS
            along = forward * _BEAM_X[beam] + left * _BEAM_Y[beam]
            if along <= 0.0 or along * along <= clearance:
                break
            distance = along - math.sqrt(along * along - clearance)
            if distance < scan[beam]:
                scan[beam] = distance


@inlined_kernel
def nearest_beam(forward: float, left: float) -> int:
    """Return the number of the beam that looks nearest to a direction in the robot's frame."""
    abs_left = abs(left)
    abs_forward = abs(forward)
    beam = 0
    for border in _BORDERS:
        beam += abs_left > border * abs_forward
    if forward < 0.0:
        beam = _N_BEAMS // 2 - beam
    if left < 0.0:
        beam = _N_BEAMS - beam
    return beam % _N_BEAMS
