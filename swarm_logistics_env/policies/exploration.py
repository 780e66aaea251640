"""The randomness of a trained policy's outputs: each robot's from its own stream."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.kernels import gaussian, kernel, pair_key


@kernel
def explore(
    keys: NDArray[np.uint64],
    count: int,
    deviations: NDArray[np.float32],
    outputs: NDArray[np.float32],
) -> None:
    """Add Gaussian noise to `outputs` (N, k) of decision number `count`."""
    for robot in range(outputs.shape[0]):
        for place in range(outputs.shape[1]):
            drawn = gaussian(pair_key(keys[robot], place), count)
            outputs[robot, place] += np.float32(deviations[place] * drawn)
