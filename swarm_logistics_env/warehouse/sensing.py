"""What every robot senses: range scans, items in view, neighbours and the timers they tell.

Compiled, and over cell grids, so that the cost is linear in the number of robots.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import observations as row
from swarm_logistics_env.kernels import kernel, pair_key, uniform
from swarm_logistics_env.warehouse.grid import look_around
from swarm_logistics_env.warehouse.piles import join
from swarm_logistics_env.warehouse.state import NOBODY

_TOUCH = 0.01  # [m], gap below which two things touch
_ITEM_WIDTH = len(row.ITEM_FEATURES)
_NEIGHBOUR_WIDTH = len(row.NEIGHBOUR_FEATURES)
_BEAM_X = np.cos(2.0 * np.pi * np.arange(row.N_BEAMS) / row.N_BEAMS)
_BEAM_Y = np.sin(2.0 * np.pi * np.arange(row.N_BEAMS) / row.N_BEAMS)
# Tangents of the angles half-way between the beams of the first quarter.
_BORDERS = tuple(math.tan((beam + 0.5) * 2.0 * math.pi / row.N_BEAMS) for beam in range(4))
# Beyond so many squares of its radius a disc meets only the beam nearest to its centre: it looks
# less wide than the beams stand apart. A little more, so that rounding decides nothing.
_ONE_BEAM = 1.001 / math.sin(math.pi / row.N_BEAMS) ** 2
_RANGE_ROBOTS, _RANGE_WALLS, _RANGE_ITEMS = row.RANGE_ROBOTS, row.RANGE_WALLS, row.RANGE_ITEMS
_N_BEAMS, _N_ITEMS, _N_NEIGHBOURS = row.N_BEAMS, row.N_ITEMS_IN_VIEW, row.N_NEIGHBOURS
_RADIO, _ROBOT_SEEN, _ITEM_SEEN = 0, 1, 2  # purposes of the streams between two things
_ITEMS, _NEIGHBOURS, _LOWEST = row.ITEMS, row.NEIGHBOURS, row.LOWEST_TIMER


@kernel
def scan_disc(
    x: float,
    y: float,
    square: float,
    radius: float,
    scan: NDArray[np.float32],
) -> None:
    """Shorten the beams of `scan` (N_BEAMS,) [m] that meet a disc at (x, y) in robot frame."""
    clearance = square - radius * radius
    middle = nearest_beam(x, y)
    if square > _ONE_BEAM * radius * radius:
        # Without a branch: whether it is met cannot be predicted.
        along = x * _BEAM_X[middle] + y * _BEAM_Y[middle]
        inside = along * along - clearance
        distance = along - math.sqrt(max(inside, 0.0))
        met = inside > 0.0 and distance < scan[middle]
        scan[middle] = distance if met else scan[middle]
        return
    if clearance <= 0.0:
        scan[:] = 0.0
        return
    # Outwards from the beam that looks nearest to its centre: if that one misses, all do.
    for way in (1, -1):
        for turned in range(_N_BEAMS // 2):
            beam = (middle + way * (turned if way > 0 else turned + 1)) % _N_BEAMS
            along = x * _BEAM_X[beam] + y * _BEAM_Y[beam]
            if along <= 0.0 or along * along <= clearance:
                break
            distance = along - math.sqrt(along * along - clearance)
            if distance < scan[beam]:
                scan[beam] = distance


@kernel
def nearest_beam(x: float, y: float) -> int:
    """Return the number of the beam that looks nearest to the direction (x, y) in robot frame."""
    across, ahead = abs(y), abs(x)
    beam = 0
    for border in _BORDERS:
        beam += across > border * ahead
    if x < 0.0:
        beam = _N_BEAMS // 2 - beam
    if y < 0.0:
        beam = _N_BEAMS - beam
    return beam % _N_BEAMS


@kernel
def scan_walls(
    x: float,
    y: float,
    cosine: float,
    sine: float,
    width: float,
    height: float,
    scan: NDArray[np.float32],
) -> None:
    """Shorten the beams of `scan` (N_BEAMS,) [m] that meet a wall, for a robot at (x, y)."""
    reach = scan[0]
    for axis in range(2):
        if axis == 0:
            back, front, ahead, aside = x, width - x, cosine, -sine
        else:
            back, front, ahead, aside = y, height - y, sine, cosine
        if min(back, front) >= reach:
            continue
        back, front = max(back, 0.0), max(front, 0.0)
        for beam in range(_N_BEAMS):
            towards = _BEAM_X[beam] * ahead + _BEAM_Y[beam] * aside
            # Without a branch: all beams together are a few vector instructions.
            found = np.float32((front if towards > 0.0 else back) / abs(towards))
            scan[beam] = found if found < scan[beam] else scan[beam]


@kernel
def nearest_first(
    squares: NDArray[np.float64], indices: NDArray[np.int64], count: int, wanted: int
) -> int:
    """Bring the `wanted` nearest of `count` things to the front, nearest first.

    Returns how many there are, at most `wanted`.
    """
    for place in range(min(count, wanted)):
        nearest, square = place, squares[place]
        for index in range(place + 1, count):
            # Both without a branch: which of them is nearer cannot be predicted.
            nearest = index if squares[index] < square else nearest
            square = squares[index] if squares[index] < square else square
        squares[nearest], squares[place] = squares[place], square
        indices[nearest], indices[place] = indices[place], indices[nearest]
    return min(count, wanted)


@kernel
def is_missed(key: np.uint64, other: int, step: int, purpose: int, probability: float) -> bool:
    """Return whether what `other` offers the robot of that key is lost in this step."""
    return uniform(pair_key(key, other), 3 * step + purpose) < probability


@kernel
def sense(
    width: float,
    height: float,
    robot_radius: float,
    item_radius: float,
    obstacle_radius: float,
    radio_range: float,
    max_speed: float,
    timer_limit: float,
    requested: int,
    present: NDArray[np.bool_],
    position: NDArray[np.float64],
    velocity: NDArray[np.float64],
    heading: NDArray[np.float64],
    robot_item: NDArray[np.int64],
    memory: NDArray[np.int64],
    timer: NDArray[np.float64],
    told: NDArray[np.float64],
    in_delivery: NDArray[np.bool_],
    item_position: NDArray[np.float64],
    item_covered: NDArray[np.int64],
    obstacle_position: NDArray[np.float64],
    ranger_range: NDArray[np.float64],
    view_range: NDArray[np.float64],
    sends: NDArray[np.bool_],
    hears: NDArray[np.bool_],
    failed: NDArray[np.bool_],
    robot_cell: float,
    robot_size: NDArray[np.int64],
    robot_start: NDArray[np.int64],
    robot_members: NDArray[np.int64],
    robot_places: NDArray[np.float64],
    item_cell: float,
    item_size: NDArray[np.int64],
    item_start: NDArray[np.int64],
    item_members: NDArray[np.int64],
    item_places: NDArray[np.float64],
    full_range: float,
    contact: NDArray[np.bool_],
    leader: NDArray[np.int64],
    heard: NDArray[np.float64],
    keys: NDArray[np.uint64],
    step: int,
    radio_loss: float,
    dropout: float,
    message: NDArray[np.float64],
    rows: NDArray[np.float32],
) -> int:
    """Fill the observation rows (N, D), who touches something, the piles and what was heard.

    Returns how many robots that have not failed touch one that has.
    """
    n_things = max(position.shape[0], item_position.shape[0]) + 1
    found, squares = np.empty(n_things, np.int64), np.empty(n_things)
    near, near_squares = np.empty(n_things, np.int64), np.empty(n_things)
    scanned = np.empty(n_things, np.int64)
    rows[:, :] = 0.0
    n_anchored = 0
    for me in range(position.shape[0]):
        leader[me] = me
    for me in range(position.shape[0]):
        contact[me] = False
        heard[me] = math.nan
        if not present[me]:
            continue
        x, y = position[me, 0], position[me, 1]
        cosine, sine = math.cos(heading[me]), math.sin(heading[me])
        out = rows[me]
        scan_robots = out[_RANGE_ROBOTS : _RANGE_ROBOTS + _N_BEAMS]
        scan_solid = out[_RANGE_WALLS : _RANGE_WALLS + _N_BEAMS]
        scan_items = out[_RANGE_ITEMS : _RANGE_ITEMS + _N_BEAMS]
        sees_ranges = ranger_range[me] > 0.0
        scan_robots[:] = ranger_range[me] if sees_ranges else full_range
        scan_solid[:] = scan_robots[0]
        scan_items[:] = scan_robots[0]

        # Walls and obstacles.
        touch = robot_radius + _TOUCH
        touches = min(min(x, width - x), min(y, height - y)) < touch
        if sees_ranges:
            scan_walls(x, y, cosine, sine, width, height, scan_solid)
        for other in range(obstacle_position.shape[0]):
            dx, dy = obstacle_position[other, 0] - x, obstacle_position[other, 1] - y
            square = dx * dx + dy * dy
            touches = touches or square < (touch + obstacle_radius) ** 2
            if sees_ranges and square < (ranger_range[me] + obstacle_radius) ** 2:
                scan_disc(
                    dx * cosine + dy * sine, dy * cosine - dx * sine,
                    square, obstacle_radius, scan_solid,
                )  # fmt: skip

        # Robots: in the beams, heard on the radio, in view.
        scan_square = (ranger_range[me] + robot_radius) ** 2 if sees_ranges else 0.0
        # Without cameras not even what lies at its very centre is seen.
        view_square = view_range[me] ** 2 if view_range[me] > 0.0 else -1.0
        radio_square = radio_range**2
        touch_square = (robot_radius + touch) ** 2
        reach = max(
            ranger_range[me] + robot_radius, view_range[me], radio_range, robot_radius + touch
        )
        lowest, lowest_square, lowest_timer = NOBODY, 0.0, math.inf
        n_near, n_scanned, anchored = 0, 0, False
        n_found = look_around(
            x, y, reach, me, robot_cell, robot_size, robot_start, robot_members, robot_places,
            found, squares,
        )  # fmt: skip
        # Without branches, where what they hang on cannot be predicted.
        for index in range(n_found):
            other, square = robot_members[found[index]], squares[index]
            if square < touch_square:
                touches = True
                anchored |= failed[other] & (not failed[me])
                join(leader, me, other)
            scanned[n_scanned] = index
            n_scanned += int(square < scan_square)
            is_heard = (square <= radio_square) & sends[other] & hears[me]
            if radio_loss > 0.0 and is_heard:
                is_heard = not is_missed(keys[me], other, step, _RADIO, radio_loss)
            lower = (told[other] < lowest_timer) | (
                (told[other] == lowest_timer) & (square < lowest_square)
            )
            lower &= is_heard
            lowest = other if lower else lowest
            lowest_square = square if lower else lowest_square
            lowest_timer = told[other] if lower else lowest_timer
            is_seen = square <= view_square
            if dropout > 0.0 and is_seen:
                is_seen = not is_missed(keys[me], other, step, _ROBOT_SEEN, dropout)
            near[n_near], near_squares[n_near] = other, square
            n_near += int(is_heard | is_seen)
        for index in range(n_scanned):
            place, square = found[scanned[index]], squares[scanned[index]]
            dx, dy = robot_places[place, 0] - x, robot_places[place, 1] - y
            scan_disc(
                dx * cosine + dy * sine, dy * cosine - dx * sine, square, robot_radius, scan_robots
            )
        n_anchored += anchored
        for place in range(nearest_first(near_squares, near, n_near, _N_NEIGHBOURS)):
            other = near[place]
            dx, dy = position[other, 0] - x, position[other, 1] - y
            column = _NEIGHBOURS + place * _NEIGHBOUR_WIDTH
            out[column] = 1.0
            out[column + 1] = dx * cosine + dy * sine
            out[column + 2] = dy * cosine - dx * sine
            is_heard = near_squares[place] <= radio_square and sends[other] and hears[me]
            if is_heard and radio_loss > 0.0:
                is_heard = not is_missed(keys[me], other, step, _RADIO, radio_loss)
            tells = is_heard and not math.isnan(told[other])
            out[column + 3] = 1.0 if tells else 0.0
            out[column + 4] = told[other] if tells else timer_limit
            if is_heard and message.shape[1] > 0:
                first = row.MESSAGES + place * message.shape[1]
                out[first : first + message.shape[1]] = message[other]
        if lowest != NOBODY:
            dx, dy = position[lowest, 0] - x, position[lowest, 1] - y
            heard[me] = lowest_timer
            out[_LOWEST] = 1.0
            out[_LOWEST + 1] = dx * cosine + dy * sine
            out[_LOWEST + 2] = dy * cosine - dx * sine
            out[_LOWEST + 3] = lowest_timer

        # Free items: in the beams, in view, and in the way of a laden robot.
        scan_square = (ranger_range[me] + item_radius) ** 2 if sees_ranges else 0.0
        touch_square = (touch + item_radius) ** 2
        reach = max(ranger_range[me] + item_radius, view_range[me], touch + item_radius)
        n_items, is_laden = 0, robot_item[me] != NOBODY
        n_found = look_around(
            x, y, reach, NOBODY, item_cell, item_size, item_start, item_members, item_places,
            found, squares,
        )  # fmt: skip
        for index in range(n_found):
            place, square = found[index], squares[index]
            if square < scan_square:
                dx, dy = item_places[place, 0] - x, item_places[place, 1] - y
                scan_disc(
                    dx * cosine + dy * sine, dy * cosine - dx * sine,
                    square, item_radius, scan_items,
                )  # fmt: skip
            touches |= is_laden & (square < touch_square) & (item_covered[item_members[place]] == 0)
            is_seen = square <= view_square
            if dropout > 0.0 and is_seen:
                item = item_members[place]
                is_seen = not is_missed(keys[me], item, step, _ITEM_SEEN, dropout)
            near[n_items], near_squares[n_items] = item_members[place], square
            n_items += int(is_seen)
        for place in range(nearest_first(near_squares, near, n_items, _N_ITEMS)):
            item = near[place]
            dx, dy = item_position[item, 0] - x, item_position[item, 1] - y
            column = _ITEMS + place * _ITEM_WIDTH
            out[column] = 1.0
            out[column + 1] = dx * cosine + dy * sine
            out[column + 2] = dy * cosine - dx * sine
            out[column + 3] = 1.0 if item == requested else 0.0
            for held in range(memory.shape[1]):
                if memory[me, held] == item:
                    out[column + 4] = 1.0

        # Itself.
        contact[me] = touches
        forward = velocity[me, 0] * cosine + velocity[me, 1] * sine
        leftward = velocity[me, 1] * cosine - velocity[me, 0] * sine
        runs = not math.isnan(timer[me])
        carried = robot_item[me]
        out[row.CARRYING] = 1.0 if carried != NOBODY else 0.0
        out[row.CARRYING_REQUESTED] = 1.0 if carried != NOBODY and carried == requested else 0.0
        out[row.IN_DELIVERY_AREA] = 1.0 if in_delivery[me] else 0.0
        out[row.TIMER_RUNS] = 1.0 if runs else 0.0
        out[row.TIMER] = timer[me] if runs else timer_limit
        out[row.VELOCITY] = min(max(forward, -max_speed), max_speed)
        out[row.VELOCITY + 1] = min(max(leftward, -max_speed), max_speed)
        out[row.CONTACT] = 1.0 if touches else 0.0
    return n_anchored
