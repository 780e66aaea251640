"""Cameras: the nearest items in view, and the nearest robots, seen or heard on the radio."""

from __future__ import annotations

import math

from swarm_logistics_env.compiler.kernels import inlined_kernel
from swarm_logistics_env.world import observations as row

from .demand import is_known_request
from .floor_cells import is_in_sight
from .logistics import is_remembered
from .pose import Pose, in_frame
from .sensor_errors import ROBOT_SEEN, is_missed
from .structs import RANKED_AT_ONCE, Grid, Nearby, Sensed, World


@inlined_kernel
def choose(me: int, pose: Pose, world: World, grid: Grid, n_found: int, purpose: int) -> int:
    """List in `nearby.chosen` what `me` sees, and of robots whom it hears; returns how many."""
    nearby = world.nearby
    view_range = world.able.view_range[me]
    # Without cameras it does not even see what lies at its centre.
    limit = view_range**2 if view_range > 0.0 else -1.0
    dropout = world.parameters.sensor_dropout
    n_chosen = 0
    step = world.progress.step[0]
    for index in range(n_found):
        other = grid.members[nearby.slot[index]]
        square = nearby.square[index]
        is_heard = purpose == ROBOT_SEEN and nearby.is_heard[index]
        is_seen = square <= limit
        if world.floor.n_columns > 0 and is_seen:
            slot = nearby.slot[index]
            is_seen = is_in_sight(
                world, pose.x, pose.y, grid.position[0, slot], grid.position[1, slot]
            )
        if dropout > 0.0 and is_seen:
            is_seen = not is_missed(world.robots.sensor_key[me], other, step, purpose, dropout)
        nearby.chosen[n_chosen] = other
        nearby.chosen_square[n_chosen] = square
        nearby.chosen_heard[n_chosen] = is_heard
        n_chosen += int(is_heard | is_seen)
    return n_chosen


@inlined_kernel
def rank_nearest(nearby: Nearby, count: int, n_wanted: int) -> int:
    """List in `nearby.nearest` the `n_wanted` nearest of `count` chosen things, nearest first.

    If two are equally near, the one that comes first is chosen.

    Returns how many there are, at most `n_wanted`.
    """
    squares = nearby.chosen_square
    # Filled up with some that are far, so that all are counted in whole vectors.
    n_counted = (count + RANKED_AT_ONCE - 1) & -RANKED_AT_ONCE
    squares[count:n_counted] = math.inf
    for index in range(count):
        square = squares[index]
        n_nearer = 0
        for other in range(n_counted):
            is_nearer = squares[other] < square
            n_nearer += is_nearer | ((squares[other] == square) & (other < index))
        if n_nearer < n_wanted:
            nearby.nearest[n_nearer] = index
    return min(count, n_wanted)


@inlined_kernel
def describe_items(me: int, pose: Pose, world: World, n_chosen: int, out: Sensed) -> None:
    """Fill the block of items in a row from the chosen items."""
    robots = world.robots
    nearby = world.nearby
    for rank in range(rank_nearest(nearby, n_chosen, row.N_ITEMS_IN_VIEW)):
        item = nearby.chosen[nearby.nearest[rank]]
        position = world.items.position
        forward, left = in_frame(pose, position[item, 0], position[item, 1])
        column = row.ITEMS + rank * row.ITEM_WIDTH
        out[column + row.ITEM.present] = 1.0
        out[column + row.ITEM.x] = forward
        out[column + row.ITEM.y] = left
        out[column + row.ITEM.requested] = 1.0 if is_known_request(world, me, item) else 0.0
        is_recent = is_remembered(robots.memory, me, item)
        out[column + row.ITEM.recently_held] = 1.0 if is_recent else 0.0


@inlined_kernel
def describe_neighbours(pose: Pose, world: World, n_chosen: int, out: Sensed) -> None:
    """Fill the blocks of neighbours and of their messages in a row from the chosen neighbours."""
    robots = world.robots
    parameters = world.parameters
    nearby = world.nearby
    width = world.robots.message.shape[1]
    for rank in range(rank_nearest(nearby, n_chosen, row.N_NEIGHBOURS)):
        index = nearby.nearest[rank]
        other = nearby.chosen[index]
        is_heard = nearby.chosen_heard[index]
        forward, left = in_frame(pose, robots.position[other, 0], robots.position[other, 1])
        tells = is_heard and not math.isnan(robots.told[other])
        column = row.NEIGHBOURS + rank * row.NEIGHBOUR_WIDTH
        out[column + row.NEIGHBOUR.present] = 1.0
        out[column + row.NEIGHBOUR.x] = forward
        out[column + row.NEIGHBOUR.y] = left
        out[column + row.NEIGHBOUR.timer_heard] = 1.0 if tells else 0.0
        timer = robots.told[other] if tells else parameters.timer_limit
        out[column + row.NEIGHBOUR.timer] = timer
        if is_heard and width > 0:
            for part in range(width):
                out[row.MESSAGES + rank * width + part] = robots.message[other, part]
