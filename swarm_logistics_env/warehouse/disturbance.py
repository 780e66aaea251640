"""Sensor noise: what turns a true observation row into a measured one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import observations as row
from swarm_logistics_env.kernels import gaussian, kernel, uniform

_SCANS = row.RANGE_ITEMS + row.N_BEAMS  # the beams come first in a row
_POSITIONS = 2 * (row.N_ITEMS_IN_VIEW + row.N_NEIGHBOURS + 1)


@kernel
def disturb(
    present: NDArray[np.bool_],
    keys: NDArray[np.uint64],
    step: int,
    ranger_noise: float,
    position_noise: float,
    dropout: float,
    ranger_range: NDArray[np.float64],
    full_range: float,
    view_range: float,
    far: float,
    rows: NDArray[np.float32],
) -> None:
    """Add Gaussian noise to beams and positions of rows (N, D), and drop beams, in place.

    A beam that is dropped reports what one does that meets nothing: the robot's own range (N,), or
    `full_range` if that is 0. What is measured stays within the column's range.
    """
    for robot in range(rows.shape[0]):
        if not present[robot]:
            continue
        out = rows[robot]
        reach = ranger_range[robot] if ranger_range[robot] > 0.0 else full_range
        first = step * (2 * _SCANS + _POSITIONS)
        for beam in range(_SCANS):
            if dropout > 0.0 and uniform(keys[robot], 2 * (first + _SCANS + beam)) < dropout:
                out[beam] = reach
            elif ranger_noise > 0.0 and out[beam] < np.float32(reach):
                noisy = out[beam] + ranger_noise * gaussian(keys[robot], first + beam)
                out[beam] = min(max(noisy, 0.0), reach)
        if position_noise > 0.0:
            first += 2 * _SCANS
            for thing in range(row.N_ITEMS_IN_VIEW + row.N_NEIGHBOURS + 1):
                column = row.ITEMS + 5 * thing
                limit = view_range if thing < row.N_ITEMS_IN_VIEW else far
                if out[column] > 0.5:
                    for axis in range(2):
                        error = position_noise * gaussian(keys[robot], first + 2 * thing + axis)
                        noisy = out[column + 1 + axis] + error
                        out[column + 1 + axis] = min(max(noisy, -limit), limit)
