"""What robots sense of others and of things: by rangers, radio and cameras.

The rangers are 16 beams that measure distances. By radio every robot broadcasts its timer and a
message to those in range that hear. Cameras tell of items in view, and of the nearest robots.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarm_logistics_env import observations as row
from swarm_logistics_env.kernels import inlined_kernel, kernel, pair_key, uniform

from .demand import is_requested
from .logistics import MESSAGE, is_remembered
from .structs import NOBODY, Grid, Nearby, Sensed, World

_N_BEAMS = row.N_BEAMS
_BEAM_X = np.cos(2.0 * np.pi * np.arange(_N_BEAMS) / _N_BEAMS)
_BEAM_Y = np.sin(2.0 * np.pi * np.arange(_N_BEAMS) / _N_BEAMS)
# Tangents of the angles half-way between the beams of the first quarter.
_BORDERS = tuple(math.tan((beam + 0.5) * 2.0 * math.pi / _N_BEAMS) for beam in range(_N_BEAMS // 4))
# Beyond so many squares of its radius a disc meets only the beam nearest to its centre: it looks
# less wide than the beams stand apart. A little more, so that rounding decides nothing.
_ONE_BEAM = 1.001 / math.sin(math.pi / _N_BEAMS) ** 2


class Pose(NamedTuple):
    """The position and the direction of a robot."""

    x: float  # [m]
    y: float  # [m]
    cosine: float  # of its heading
    sine: float


@inlined_kernel
def in_frame(pose: Pose, x: float, y: float) -> tuple[float, float]:
    """Return how far (x, y) [m] lies forward and to the left of the robot."""
    dx, dy = x - pose.x, y - pose.y
    return dx * pose.cosine + dy * pose.sine, dy * pose.cosine - dx * pose.sine


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
    abs_left, abs_forward = abs(left), abs(forward)
    beam = 0
    for border in _BORDERS:
        beam += abs_left > border * abs_forward
    if forward < 0.0:
        beam = _N_BEAMS // 2 - beam
    if left < 0.0:
        beam = _N_BEAMS - beam
    return beam % _N_BEAMS


@kernel
def scan_walls(pose: Pose, width: float, height: float, scan: Sensed) -> None:
    """Shorten the beams of `scan` (N_BEAMS,) [m] that meet a wall of the arena."""
    reach = scan[0]
    for axis in range(2):
        if axis == 0:
            back, front, axis_forward, axis_left = pose.x, width - pose.x, pose.cosine, -pose.sine
        else:
            back, front, axis_forward, axis_left = pose.y, height - pose.y, pose.sine, pose.cosine
        if min(back, front) >= reach:
            continue
        back, front = max(back, 0.0), max(front, 0.0)
        for beam in range(_N_BEAMS):
            towards = _BEAM_X[beam] * axis_forward + _BEAM_Y[beam] * axis_left
            # Without a branch: all beams together are a few vector instructions.
            distance = np.float32((front if towards > 0.0 else back) / abs(towards))
            scan[beam] = distance if distance < scan[beam] else scan[beam]


@inlined_kernel
def scan_solids(pose: Pose, reach: float, world: World, scan: Sensed) -> None:
    """Shorten the beams of `scan` (N_BEAMS,) [m] that meet walls, or obstacles within `reach`."""
    parameters, obstacles = world.parameters, world.obstacles
    scan_walls(pose, parameters.warehouse_width, parameters.warehouse_height, scan)
    radius = parameters.obstacle_radius
    for obstacle in range(len(obstacles)):
        forward, left = in_frame(pose, obstacles[obstacle, 0], obstacles[obstacle, 1])
        dx, dy = obstacles[obstacle, 0] - pose.x, obstacles[obstacle, 1] - pose.y
        square = dx * dx + dy * dy
        if square < (reach + radius) ** 2:
            scan_disc(forward, left, square, radius, scan)


@kernel
def scan_discs(
    pose: Pose, reach: float, radius: float, grid: Grid, nearby: Nearby, n_found: int, scan: Sensed
) -> None:
    """Shorten the beams of `scan` (N_BEAMS,) [m] that meet discs nearby, within `reach` [m]."""
    limit, n_scanned = (reach + radius) ** 2, 0
    # Written always and counted only if near: no branch to mispredict.
    for index in range(n_found):
        nearby.scanned[n_scanned] = index
        n_scanned += int(nearby.square[index] < limit)
    for number in range(n_scanned):
        index = nearby.scanned[number]
        slot = nearby.slot[index]
        nearby.forward[number], nearby.left[number] = in_frame(
            pose, grid.position[slot, 0], grid.position[slot, 1]
        )
        nearby.scanned_square[number] = nearby.square[index]
    meet_middle_beams(nearby, n_scanned, radius)
    for number in range(n_scanned):
        square = nearby.scanned_square[number]
        if square > _ONE_BEAM * radius * radius:
            beam, distance = nearby.beam[number], nearby.distance[number]
            scan[beam] = distance if distance < scan[beam] else scan[beam]
        else:
            scan_disc(nearby.forward[number], nearby.left[number], square, radius, scan)


@inlined_kernel
def meet_middle_beams(nearby: Nearby, n_scanned: int, radius: float) -> None:
    """Fill the beams nearest to the centres of discs, and where these meet them [m].

    Infinitely far where they do not. Without branches: several discs are one vector instruction.
    """
    for number in range(n_scanned):
        forward, left = nearby.forward[number], nearby.left[number]
        beam = nearest_beam(forward, left)
        along = forward * _BEAM_X[beam] + left * _BEAM_Y[beam]
        inside = along * along - (nearby.scanned_square[number] - radius * radius)
        distance = along - math.sqrt(max(inside, 0.0))
        nearby.beam[number] = beam
        nearby.distance[number] = distance if inside > 0.0 else math.inf


# Purposes of the streams between a robot and another thing: numbers of one step.
RADIO, ROBOT_SEEN, ITEM_SEEN, N_PURPOSES = range(4)


@inlined_kernel
def is_missed(key: np.uint64, other: int, step: int, purpose: int, probability: float) -> bool:
    """Return whether what `other` offers the robot of that key is lost in this step."""
    if probability == 0.0:
        return False
    return uniform(pair_key(key, other), N_PURPOSES * step + purpose) < probability


@kernel
def send_messages(world: World) -> None:
    """Broadcast the rest of the commands of those who obey, cut to [-1, 1]; of others, zeros."""
    robots, able, step = world.robots, world.able, world.progress.step[0]
    message, before = robots.message, robots.message_before
    n, n_kept = len(message), len(robots.told_before)
    for robot in range(n):
        sends = robots.present[robot] and able.obeys[robot]
        for part in range(message.shape[1]):
            number = world.commands.now[robot, MESSAGE + part] if sends else 0.0
            number = min(max(number, -1.0), 1.0)
            before[(step % n_kept) * n + robot, part] = number
            if able.radio_delay[robot] > 0:
                sent_step = step - able.radio_delay[robot]
                number = before[(sent_step % n_kept) * n + robot, part] if sent_step >= 0 else 0.0
            message[robot, part] = number


@kernel
def run_timers(world: World) -> None:
    """Advance every robot's timer and what it tells (NaN: silent) [s].

    Counted in steps, so that rounding never adds up. With gossip a robot tells the lowest of its
    own timer and of what it heard one period ago, aged. If the radio is delayed, the broadcast
    comes late. One that is not honest tells 0.
    """
    robots, able, step = world.robots, world.able, world.progress.step[0]
    parameters = world.parameters
    period, limit = parameters.control_period, parameters.timer_limit - 1e-9
    n_kept = len(robots.told_before)
    for robot in range(len(robots.timer)):
        if robots.in_delivery[robot]:
            robots.last_in_delivery[robot] = step
        timer, is_present = math.nan, robots.present[robot]
        if is_present and robots.last_in_delivery[robot] >= 0:
            elapsed = (step - robots.last_in_delivery[robot]) * period
            timer = elapsed if elapsed < limit else timer
        robots.timer[robot] = timer
        broadcast = timer
        aged_timer = robots.heard[robot] + period
        if parameters.is_gossip and is_present and aged_timer < limit:
            broadcast = aged_timer if math.isnan(broadcast) else min(broadcast, aged_timer)
        robots.told_before[step % n_kept, robot] = broadcast
        if is_present and able.radio_delay[robot] > 0:
            sent_step = step - able.radio_delay[robot]
            broadcast = (
                robots.told_before[sent_step % n_kept, robot] if sent_step >= 0 else math.nan
            )
            # The limit may have fallen since it was told.
            broadcast = broadcast if broadcast < limit else math.nan
        robots.told[robot] = 0.0 if is_present and not able.honest[robot] else broadcast


@inlined_kernel
def listen(me: int, world: World, n_found: int) -> tuple[int, float]:
    """Note in `nearby.is_heard` which of the robots found nearby `me` hears.

    Returns who of them tells the lowest timer, or NOBODY, and it [s]. If several broadcast the same
    timer, it is the nearest of them.
    """
    robots, able, nearby = world.robots, world.able, world.nearby
    limit, loss = world.parameters.radio_range**2, world.parameters.radio_loss
    lowest, lowest_square, lowest_timer = NOBODY, 0.0, math.inf
    for index in range(n_found):
        other, square = world.robot_grid.members[nearby.slot[index]], nearby.square[index]
        is_heard = (square <= limit) & able.sends[other] & able.hears[me]
        if loss > 0.0 and is_heard:
            step = world.progress.step[0]
            is_heard = not is_missed(robots.sensor_key[me], other, step, RADIO, loss)
        nearby.is_heard[index] = is_heard
        # Without branches, as what they hang on cannot be predicted.
        timer = robots.told[other]
        is_lower = (timer < lowest_timer) | ((timer == lowest_timer) & (square < lowest_square))
        is_lower &= is_heard
        lowest = other if is_lower else lowest
        lowest_square = square if is_lower else lowest_square
        lowest_timer = timer if is_lower else lowest_timer
    return lowest, lowest_timer


@inlined_kernel
def rank_nearest(nearby: Nearby, count: int, n_wanted: int) -> int:
    """List in `nearby.nearest` the `n_wanted` nearest of `count` chosen things, nearest first.

    If two are equally near, the one that comes first is chosen.

    Returns how many there are, at most `n_wanted`.
    """
    squares = nearby.chosen_square
    for index in range(count):
        # Counted without a branch: a few vector instructions for all the others.
        square, n_nearer = squares[index], 0
        for other in range(index):
            n_nearer += squares[other] <= square
        for other in range(index + 1, count):
            n_nearer += squares[other] < square
        if n_nearer < n_wanted:
            nearby.nearest[n_nearer] = index
    return min(count, n_wanted)


@inlined_kernel
def describe_items(me: int, pose: Pose, world: World, n_chosen: int, out: Sensed) -> None:
    """Fill the block of items in a row from the chosen items."""
    robots, nearby = world.robots, world.nearby
    for rank in range(rank_nearest(nearby, n_chosen, row.N_ITEMS_IN_VIEW)):
        item = nearby.chosen[nearby.nearest[rank]]
        position = world.items.position
        forward, left = in_frame(pose, position[item, 0], position[item, 1])
        column = row.ITEMS + rank * row.ITEM_WIDTH
        out[column] = 1.0
        out[column + 1] = forward
        out[column + 2] = left
        out[column + 3] = 1.0 if is_requested(world, item) else 0.0
        out[column + 4] = 1.0 if is_remembered(robots.memory, me, item) else 0.0


@inlined_kernel
def choose(me: int, world: World, grid: Grid, n_found: int, purpose: int) -> int:
    """List in `nearby.chosen` what `me` sees, and of robots whom it hears; returns how many."""
    nearby, view_range = world.nearby, world.able.view_range[me]
    # Without cameras it does not even see what lies at its centre.
    limit = view_range**2 if view_range > 0.0 else -1.0
    dropout, n_chosen, step = world.parameters.sensor_dropout, 0, world.progress.step[0]
    for index in range(n_found):
        other, square = grid.members[nearby.slot[index]], nearby.square[index]
        is_heard, is_seen = purpose == ROBOT_SEEN and nearby.is_heard[index], square <= limit
        if dropout > 0.0 and is_seen:
            is_seen = not is_missed(world.robots.sensor_key[me], other, step, purpose, dropout)
        nearby.chosen[n_chosen], nearby.chosen_square[n_chosen] = other, square
        nearby.chosen_heard[n_chosen] = is_heard
        n_chosen += int(is_heard | is_seen)
    return n_chosen


@inlined_kernel
def describe_neighbours(pose: Pose, world: World, n_chosen: int, out: Sensed) -> None:
    """Fill the blocks of neighbours and of their messages in a row from the chosen neighbours."""
    robots, parameters = world.robots, world.parameters
    nearby, width = world.nearby, world.robots.message.shape[1]
    for rank in range(rank_nearest(nearby, n_chosen, row.N_NEIGHBOURS)):
        index = nearby.nearest[rank]
        other, is_heard = nearby.chosen[index], nearby.chosen_heard[index]
        forward, left = in_frame(pose, robots.position[other, 0], robots.position[other, 1])
        tells = is_heard and not math.isnan(robots.told[other])
        column = row.NEIGHBOURS + rank * row.NEIGHBOUR_WIDTH
        out[column] = 1.0
        out[column + 1] = forward
        out[column + 2] = left
        out[column + 3] = 1.0 if tells else 0.0
        out[column + 4] = robots.told[other] if tells else parameters.timer_limit
        if is_heard and width > 0:
            for part in range(width):
                out[row.MESSAGES + rank * width + part] = robots.message[other, part]
