"""The cameras: items in view, nearest first, and the nearest robots in view or heard."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import observations as row
from swarm_logistics_env.kernels import inlined_kernel
from swarm_logistics_env.warehouse.logistics import is_remembered
from swarm_logistics_env.warehouse.radio import ITEM_SEEN, ROBOT_SEEN, hears, is_missed
from swarm_logistics_env.warehouse.rangers import Pose, in_frame
from swarm_logistics_env.warehouse.structs import Integers, Numbers, World

_ITEM_WIDTH = len(row.ITEM_FEATURES)
_NEIGHBOUR_WIDTH = len(row.NEIGHBOUR_FEATURES)
_N_ITEMS, _N_NEIGHBOURS = row.N_ITEMS_IN_VIEW, row.N_NEIGHBOURS
_ITEMS, _NEIGHBOURS, _MESSAGES = row.ITEMS, row.NEIGHBOURS, row.MESSAGES


@inlined_kernel
def nearest_first(squares: Numbers, indices: Integers, count: int, wanted: int) -> int:
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


@inlined_kernel
def view_square(view_range: float) -> float:
    """Return the square of how far cameras see; without them not even what lies at the centre."""
    return view_range**2 if view_range > 0.0 else -1.0


@inlined_kernel
def see_items(
    me: int, pose: Pose, world: World, step: int, n_found: int, out: NDArray[np.float32]
) -> None:
    """Fill the block of items in a row from the free items nearby."""
    robots, grid, nearby = world.robots, world.item_grid, world.nearby
    limit, dropout = view_square(world.able.view_range[me]), world.parameters.sensor_dropout
    n_seen = 0
    for index in range(n_found):
        item, square = grid.members[nearby.place[index]], nearby.square[index]
        is_seen = square <= limit
        if dropout > 0.0 and is_seen:
            is_seen = not is_missed(robots.sensor_key[me], item, step, ITEM_SEEN, dropout)
        nearby.chosen[n_seen], nearby.chosen_square[n_seen] = item, square
        n_seen += int(is_seen)
    for place in range(nearest_first(nearby.chosen_square, nearby.chosen, n_seen, _N_ITEMS)):
        item = nearby.chosen[place]
        position = world.items.position
        forward, left = in_frame(pose, position[item, 0], position[item, 1])
        column = _ITEMS + place * _ITEM_WIDTH
        out[column] = 1.0
        out[column + 1] = forward
        out[column + 2] = left
        out[column + 3] = 1.0 if item == world.progress.requested[0] else 0.0
        out[column + 4] = 1.0 if is_remembered(robots.memory, me, item) else 0.0


@inlined_kernel
def choose_neighbours(me: int, world: World, step: int, n_found: int) -> int:
    """List in `nearby.chosen` the robots that `me` sees or hears; returns how many."""
    robots, able, parameters = world.robots, world.able, world.parameters
    nearby, grid = world.nearby, world.robot_grid
    limit, dropout, n_chosen = view_square(able.view_range[me]), parameters.sensor_dropout, 0
    for index in range(n_found):
        other, square = grid.members[nearby.place[index]], nearby.square[index]
        is_heard = hears(me, other, square, robots, able, parameters, step)
        is_seen = square <= limit
        if dropout > 0.0 and is_seen:
            is_seen = not is_missed(robots.sensor_key[me], other, step, ROBOT_SEEN, dropout)
        nearby.chosen[n_chosen], nearby.chosen_square[n_chosen] = other, square
        n_chosen += int(is_heard | is_seen)
    return n_chosen


@inlined_kernel
def tell_of_neighbours(
    me: int, pose: Pose, world: World, step: int, n_chosen: int, out: NDArray[np.float32]
) -> None:
    """Fill the blocks of neighbours and of their messages in a row from those chosen."""
    robots, able, parameters = world.robots, world.able, world.parameters
    nearby, width = world.nearby, world.robots.message.shape[1]
    n_told = nearest_first(nearby.chosen_square, nearby.chosen, n_chosen, _N_NEIGHBOURS)
    for place in range(n_told):
        other, square = nearby.chosen[place], nearby.chosen_square[place]
        forward, left = in_frame(pose, robots.position[other, 0], robots.position[other, 1])
        is_heard = hears(me, other, square, robots, able, parameters, step)
        tells = is_heard and not math.isnan(robots.told[other])
        column = _NEIGHBOURS + place * _NEIGHBOUR_WIDTH
        out[column] = 1.0
        out[column + 1] = forward
        out[column + 2] = left
        out[column + 3] = 1.0 if tells else 0.0
        out[column + 4] = robots.told[other] if tells else parameters.timer_limit
        if is_heard and width > 0:
            first = _MESSAGES + place * width
            out[first : first + width] = robots.message[other]
