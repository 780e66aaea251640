"""Sensor errors: noise, rangers that fail, and what else turns a true row into a measured one."""

from __future__ import annotations

import math

import numpy as np

from swarm_logistics_env import observations as row
from swarm_logistics_env.kernels import gaussian, kernel, uniform

from .structs import Parameters, Sensed, World

_N_BEAMS = row.RANGE_ITEMS + row.N_BEAMS  # of all scans, which come first in a row
_ITEM_WIDTH, _NEIGHBOUR_WIDTH = len(row.ITEM_FEATURES), len(row.NEIGHBOUR_FEATURES)
# Things with a place: items, neighbours, and the teller of the lowest timer.
_N_THINGS = row.N_ITEMS_IN_VIEW + row.N_NEIGHBOURS + 1
# A robot draws in a step: an error for every beam, whether each is dropped, then errors of places.
_DROPPED, _PLACES, _DRAWS = _N_BEAMS, 2 * _N_BEAMS, 2 * _N_BEAMS + 2 * _N_THINGS


@kernel
def disturb(world: World, rows: Sensed) -> None:
    """Add the scenario's noise to rows (N, D) and drop beams, in place.

    What is measured stays within the column's range.
    """
    robots, able, parameters = world.robots, world.able, world.parameters
    is_exact = parameters.ranger_noise == 0.0 and parameters.position_noise == 0.0
    if is_exact and parameters.sensor_dropout == 0.0:
        return
    for robot in range(len(rows)):
        if robots.present[robot]:
            key, first = robots.sensor_key[robot], world.progress.step[0] * _DRAWS
            own_range = able.ranger_range[robot]
            reach = own_range if own_range > 0.0 else parameters.ranger_range
            disturb_beams(key, first, reach, parameters, rows[robot])
            if parameters.position_noise > 0.0:
                disturb_places(key, first + _PLACES, parameters, rows[robot])


@kernel
def disturb_beams(
    key: np.uint64, first: int, reach: float, parameters: Parameters, out: Sensed
) -> None:
    """Add noise to the beams of a row, from number `first` of the stream, and drop some.

    A beam that is dropped reports what one does that meets nothing within `reach` [m].
    """
    dropout, noise = parameters.sensor_dropout, parameters.ranger_noise
    for beam in range(_N_BEAMS):
        if dropout > 0.0 and uniform(key, 2 * (first + _DROPPED + beam)) < dropout:
            out[beam] = reach
        elif noise > 0.0 and out[beam] < np.float32(reach):
            noisy = out[beam] + noise * gaussian(key, first + beam)
            out[beam] = min(max(noisy, 0.0), reach)


@kernel
def disturb_places(key: np.uint64, first: int, parameters: Parameters, out: Sensed) -> None:
    """Add noise to the places of what is there in a row, from number `first` of the stream."""
    far = max(parameters.view_range, parameters.radio_range)
    for thing in range(_N_THINGS):
        if thing < row.N_ITEMS_IN_VIEW:
            column, limit = row.ITEMS + _ITEM_WIDTH * thing, parameters.view_range
        else:
            column = row.NEIGHBOURS + _NEIGHBOUR_WIDTH * (thing - row.N_ITEMS_IN_VIEW)
            limit = far
        if out[column] > 0.5:
            for axis in range(2):
                error = parameters.position_noise * gaussian(key, first + 2 * thing + axis)
                out[column + 1 + axis] = min(max(out[column + 1 + axis] + error, -limit), limit)


@kernel
def fail_rangers(world: World, rows: Sensed) -> None:
    """Make of the beams in rows (N, D) what rangers that have failed report, in place."""
    robots, able = world.robots, world.able
    for robot in range(len(rows)):
        if not robots.present[robot]:
            continue
        beams, frozen = rows[robot, :_N_BEAMS], robots.frozen_beams[robot]
        if able.ranger_bias[robot] != 0.0:
            own = able.ranger_range[robot]
            reach = own if own > 0.0 else world.parameters.ranger_range
            add_bias(beams, able.ranger_bias[robot], reach)
        if able.rangers_refresh[robot]:
            frozen[0] = math.nan
        elif math.isnan(frozen[0]):
            for beam in range(_N_BEAMS):
                frozen[beam] = beams[beam]
        else:
            for beam in range(_N_BEAMS):
                beams[beam] = frozen[beam]


@kernel
def add_bias(beams: Sensed, bias: float, reach: float) -> None:
    """Lengthen the beams that meet something by `bias` [m], at most to `reach` [m]."""
    for beam in range(len(beams)):
        if beams[beam] < np.float32(reach):
            beams[beam] = min(max(beams[beam] + bias, 0.0), reach)
