"""The randomness of a trained policy: each robot's from its own stream."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.kernels import gaussian, kernel, pair_key

FIRST_OF_OUTPUTS = 16  # streams below are those of the wandering inputs


@kernel
def wander(
    keys: NDArray[np.uint64],
    counts: NDArray[np.int64],
    forgets: float,
    noise: NDArray[np.float64],
) -> None:
    """Advance `noise` (N, k) by a step: Ornstein-Uhlenbeck processes of standard deviation 1.

    Args:
        keys: of the rows' streams, (N,).
        counts: steps taken in the row's episode so far, (N,); 0: it begins.
        forgets: the factor that is left of a value after a step.
    """
    for row in range(noise.shape[0]):
        for place in range(noise.shape[1]):
            fresh = gaussian(pair_key(keys[row], place), counts[row])
            if counts[row] == 0:
                noise[row, place] = fresh
            else:
                noise[row, place] *= forgets
                noise[row, place] += math.sqrt(1.0 - forgets * forgets) * fresh


@kernel
def explore(
    keys: NDArray[np.uint64],
    count: int,
    deviations: NDArray[np.float32],
    outputs: NDArray[np.float32],
) -> None:
    """Add Gaussian noise to `outputs` (N, k) of decision number `count`."""
    for row in range(outputs.shape[0]):
        for place in range(outputs.shape[1]):
            stream = pair_key(keys[row], FIRST_OF_OUTPUTS + place)
            outputs[row, place] += np.float32(deviations[place] * gaussian(stream, count))
