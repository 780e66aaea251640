"""Differences over paired seeds."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.spi.summaries import Interval, t_interval


def difference_interval(before: NDArray[np.float64], after: NDArray[np.float64]) -> Interval:
    """Return mean(after - before) with its 95 % t-interval, paired by seed; shapes (n,)."""
    return t_interval(after - before)


def jackknife_interval(n_seeds: int, statistic: Callable[[NDArray[np.intp]], float]) -> Interval:
    """Return a statistic of seeds with the 95 % t-interval of its jackknife pseudo-values.

    For differences of two ratios over the same seeds, which have no Fieller interval (Tukey 1958).

    Args:
        n_seeds: number of seeds.
        statistic: its value from the seeds of these indices, shape (k,).
    """
    seeds = np.arange(n_seeds)
    value = statistic(seeds)
    if n_seeds == 1:
        return Interval(value, None, None)
    left_out = np.array([statistic(np.delete(seeds, seed)) for seed in seeds])
    pseudo = t_interval(n_seeds * value - (n_seeds - 1) * left_out)
    if pseudo.low is None or pseudo.high is None:
        return Interval(value, None, None)
    return Interval(value, pseudo.low - pseudo.value + value, pseudo.high - pseudo.value + value)
