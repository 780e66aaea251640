"""The cameras: items in view, nearest first, and the nearest robots in view or heard."""

from __future__ import annotations

import math

from swarm_logistics_env import observations as row
from swarm_logistics_env.kernels import inlined_kernel

from .logistics import is_remembered
from .radio import ITEM_SEEN, ROBOT_SEEN, is_missed
from .rangers import Pose, in_frame
from .structs import Nearby, Sensed, World

_ITEM_WIDTH = len(row.ITEM_FEATURES)
_NEIGHBOUR_WIDTH = len(row.NEIGHBOUR_FEATURES)
_N_ITEMS, _N_NEIGHBOURS = row.N_ITEMS_IN_VIEW, row.N_NEIGHBOURS
_ITEMS, _NEIGHBOURS, _MESSAGES = row.ITEMS, row.NEIGHBOURS, row.MESSAGES


@inlined_kernel
def rank_nearest(nearby: Nearby, count: int, wanted: int) -> int:
    """List in `nearby.nearest` the `wanted` nearest of `count` chosen things, nearest first.

    If two are equally near, the one that comes first is chosen.

    Returns how many there are, at most `wanted`.
    """
    squares = nearby.chosen_square
    for one in range(count):
        # Counted without a branch: a few vector instructions for all the others.
        square, n_nearer = squares[one], 0
        for other in range(one):
            n_nearer += squares[other] <= square
        for other in range(one + 1, count):
            n_nearer += squares[other] < square
        if n_nearer < wanted:
            nearby.nearest[n_nearer] = one
    return min(count, wanted)


@inlined_kernel
def view_square(view_range: float) -> float:
    """Return the square of how far cameras see; without them not even what lies at the centre."""
    return view_range**2 if view_range > 0.0 else -1.0


@inlined_kernel
def see_items(me: int, pose: Pose, world: World, n_found: int, out: Sensed) -> None:
    """Fill the block of items in a row from the free items nearby."""
    robots, grid, nearby = world.robots, world.item_grid, world.nearby
    limit, dropout = view_square(world.able.view_range[me]), world.parameters.sensor_dropout
    n_seen, step = 0, world.progress.step[0]
    for index in range(n_found):
        item, square = grid.members[nearby.place[index]], nearby.square[index]
        is_seen = square <= limit
        if dropout > 0.0 and is_seen:
            is_seen = not is_missed(robots.sensor_key[me], item, step, ITEM_SEEN, dropout)
        nearby.chosen[n_seen], nearby.chosen_square[n_seen] = item, square
        n_seen += int(is_seen)
    for place in range(rank_nearest(nearby, n_seen, _N_ITEMS)):
        item = nearby.chosen[nearby.nearest[place]]
        position = world.items.position
        forward, left = in_frame(pose, position[item, 0], position[item, 1])
        column = _ITEMS + place * _ITEM_WIDTH
        out[column] = 1.0
        out[column + 1] = forward
        out[column + 2] = left
        out[column + 3] = 1.0 if item == world.progress.requested[0] else 0.0
        out[column + 4] = 1.0 if is_remembered(robots.memory, me, item) else 0.0


@inlined_kernel
def choose_neighbours(me: int, world: World, n_found: int) -> int:
    """List in `nearby.chosen` the robots that `me` sees or hears; returns how many."""
    robots, nearby, grid = world.robots, world.nearby, world.robot_grid
    limit = view_square(world.able.view_range[me])
    dropout, n_chosen, step = world.parameters.sensor_dropout, 0, world.progress.step[0]
    for index in range(n_found):
        other, square = grid.members[nearby.place[index]], nearby.square[index]
        is_heard, is_seen = nearby.is_heard[index], square <= limit
        if dropout > 0.0 and is_seen:
            is_seen = not is_missed(robots.sensor_key[me], other, step, ROBOT_SEEN, dropout)
        nearby.chosen[n_chosen], nearby.chosen_square[n_chosen] = other, square
        nearby.chosen_heard[n_chosen] = is_heard
        n_chosen += int(is_heard | is_seen)
    return n_chosen


@inlined_kernel
def tell_of_neighbours(pose: Pose, world: World, n_chosen: int, out: Sensed) -> None:
    """Fill the blocks of neighbours and of their messages in a row from the chosen neighbours."""
    robots, parameters = world.robots, world.parameters
    nearby, width = world.nearby, world.robots.message.shape[1]
    for place in range(rank_nearest(nearby, n_chosen, _N_NEIGHBOURS)):
        index = nearby.nearest[place]
        other, is_heard = nearby.chosen[index], nearby.chosen_heard[index]
        forward, left = in_frame(pose, robots.position[other, 0], robots.position[other, 1])
        tells = is_heard and not math.isnan(robots.told[other])
        column = _NEIGHBOURS + place * _NEIGHBOUR_WIDTH
        out[column] = 1.0
        out[column + 1] = forward
        out[column + 2] = left
        out[column + 3] = 1.0 if tells else 0.0
        out[column + 4] = robots.told[other] if tells else parameters.timer_limit
        if is_heard and width > 0:
            for part in range(width):
                out[_MESSAGES + place * width + part] = robots.message[other, part]
