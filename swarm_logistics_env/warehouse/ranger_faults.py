"""Rangers that fail: they read too far, or repeat one reading."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import observations as row
from swarm_logistics_env.kernels import inlined_kernel
from swarm_logistics_env.warehouse.structs import Capabilities, Parameters, Robots

_N_BEAMS = row.RANGE_ITEMS + row.N_BEAMS  # of all scans, which come first in a row


@inlined_kernel
def fail_rangers(
    robots: Robots, able: Capabilities, parameters: Parameters, rows: NDArray[np.float32]
) -> None:
    """Make of the beams in rows (N, D) what rangers that have failed report, in place."""
    for robot in range(len(rows)):
        if not robots.present[robot]:
            continue
        beams, frozen = rows[robot, :_N_BEAMS], robots.frozen_beams[robot]
        if able.ranger_bias[robot] != 0.0:
            own = able.ranger_range[robot]
            add_bias(beams, able.ranger_bias[robot], own if own > 0.0 else parameters.ranger_range)
        if able.rangers_refresh[robot]:
            frozen[0] = math.nan
        elif math.isnan(frozen[0]):
            frozen[:] = beams
        else:
            beams[:] = frozen.astype(np.float32)


@inlined_kernel
def add_bias(beams: NDArray[np.float32], bias: float, reach: float) -> None:
    """Lengthen the beams that meet something by `bias` [m], at most to `reach` [m]."""
    for beam in range(len(beams)):
        if beams[beam] < np.float32(reach):
            beams[beam] = min(max(beams[beam] + bias, 0.0), reach)
