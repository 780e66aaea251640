"""Errors of sensors: noise, what is missed, and rangers that fail.

They make the row that a robot measures of the one that is true.
"""

from __future__ import annotations

import math

import numpy as np

from swarm_logistics_env.compiler.kernels import gaussian, inlined_kernel, kernel, pair_key, uniform
from swarm_logistics_env.world import observations as row

from .rangers import N_RANGES, full_range
from .structs import Parameters, Sensed, World

# Purposes of the streams between a robot and another thing: numbers of one step.
RADIO, ROBOT_SEEN, ITEM_SEEN, N_PURPOSES = range(4)
# Things with a position: items, neighbours, and the teller of the lowest timer.
_N_THINGS = row.N_ITEMS_IN_VIEW + row.N_NEIGHBOURS + 1
# A robot draws in a step: an error for every beam, whether each is dropped, errors of positions.
_DROPPED = N_RANGES
_POSITIONS = 2 * N_RANGES
_DRAWS = 2 * N_RANGES + 2 * _N_THINGS


@inlined_kernel
def is_missed(key: np.uint64, other: int, step: int, purpose: int, probability: float) -> bool:
    """Return whether what `other` offers the robot of that key is lost in this step."""
    if probability == 0.0:
        return False
    return uniform(pair_key(key, other), N_PURPOSES * step + purpose) < probability


@kernel
def disturb(me: int, world: World, out: Sensed) -> None:
    """Add the scenario's noise to a row and drop beams, in place.

    What is measured stays within the column's range.
    """
    parameters = world.parameters
    key = world.robots.sensor_key[me]
    first = world.progress.step[0] * _DRAWS
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
    dropout = parameters.sensor_dropout
    noise = parameters.ranger_noise
    for beam in range(N_RANGES):
        if dropout > 0.0 and uniform(key, 2 * (first + _DROPPED + beam)) < dropout:
            out[beam] = reach
        elif noise > 0.0 and out[beam] < np.float32(reach):
            noisy = out[beam] + noise * gaussian(key, first + beam)
            out[beam] = min(max(noisy, 0.0), reach)


@kernel
def disturb_positions(key: np.uint64, first: int, parameters: Parameters, out: Sensed) -> None:
    """Add noise to the places of what is there in a row, from number `first` of the stream."""
    far = max(parameters.view_reach, parameters.radio_range)
    for thing in range(_N_THINGS):
        if thing < row.N_ITEMS_IN_VIEW:
            column = row.ITEMS + row.ITEM_WIDTH * thing
            limit = parameters.view_reach
        else:
            column = row.NEIGHBOURS + row.NEIGHBOUR_WIDTH * (thing - row.N_ITEMS_IN_VIEW)
            limit = far
        # An item and a neighbour begin with the same columns.
        if out[column + row.ITEM.present] > 0.5:
            for axis in range(2):
                error = parameters.position_noise * gaussian(key, first + 2 * thing + axis)
                at = column + row.ITEM.x + axis
                out[at] = min(max(out[at] + error, -limit), limit)


@kernel
def fail_rangers(me: int, world: World, out: Sensed) -> None:
    """Make of the beams in a row what rangers that have failed report, in place."""
    able = world.able
    frozen = world.robots.frozen_beams[me]
    bias = able.ranger_bias[me]
    reach = full_range(world, me)
    if bias != 0.0:
        for beam in range(N_RANGES):
            if out[beam] < np.float32(reach):
                out[beam] = min(max(out[beam] + bias, 0.0), reach)
    if able.rangers_refresh[me]:
        frozen[0] = math.nan
    elif math.isnan(frozen[0]):
        for beam in range(N_RANGES):
            frozen[beam] = out[beam]
    else:
        for beam in range(N_RANGES):
            out[beam] = frozen[beam]
