"""The studentised bootstrap: the distribution of Fieller's pivot without assuming a normal one."""

from __future__ import annotations

import functools

import numpy as np

from .inputs import Numbers

MIN_SEEDS = 10  # below, too few distinct resamples to studentise
RESAMPLES = 9_999  # p is a whole number of ten-thousandths
# A resample whose variance is this far below the largest square is flat: the rest is rounding.
_FLAT = 1e-12


def resampled_pivots(residual: Numbers) -> Numbers:
    """Return sqrt(n) mean / sd of resampled seeds, in ascending order.

    Dividing by the deviation of each resample is what keeps the error at alpha at ten seeds;
    percentile and BCa intervals lose it. The same seeds are drawn at every call, so that equal
    data give equal verdicts.

    Args:
        residual: num - value den over seeds, mean 0, shape (..., n), n >= MIN_SEEDS.

    Returns:
        Shape (RESAMPLES, ...); -inf or inf where a resample shows no spread but a mean.
    """
    n = residual.shape[-1]
    drawn = _times_drawn(n)
    flattened = residual.reshape(-1, n).T
    mean = drawn @ flattened / n
    variance = (drawn @ flattened**2 - n * mean**2) / (n - 1)
    largest = np.abs(flattened).max(axis=0)
    flat = variance <= _FLAT * largest**2
    # A resample without spread is as far out as its sign says: leaving it out would narrow.
    sign_alone = np.where(np.abs(mean) <= _FLAT * largest, 0.0, np.copysign(np.inf, mean))
    pivots = np.where(flat, sign_alone, np.sqrt(n) * mean / np.sqrt(np.where(flat, 1.0, variance)))
    return np.sort(pivots, axis=0).reshape(RESAMPLES, *residual.shape[:-1])


def upper_p(pivots: Numbers, statistic: Numbers) -> Numbers:
    """Return the one-sided p of a statistic (...), from pivots of shape (RESAMPLES, ...)."""
    return np.asarray((1 + (pivots >= statistic).sum(axis=0)) / (RESAMPLES + 1))


def critical_value(pivots: Numbers, alpha: float) -> Numbers:
    """Return the statistic above which `upper_p` is below alpha / 2; inf: no statistic is.

    Args:
        pivots: Ascending along the first axis, shape (RESAMPLES, ...).
        alpha: Two-sided error of the test, in (0, 1).
    """
    # upper_p < alpha / 2 exactly where at most `most` pivots lie at or above the statistic.
    most = int(np.ceil(alpha * (RESAMPLES + 1) / 2 - 1)) - 1
    if most < 0:
        return np.full(pivots.shape[1:], np.inf)
    return np.asarray(pivots[RESAMPLES - 1 - most])


@functools.lru_cache(maxsize=8)
def _times_drawn(n: int) -> Numbers:
    """Return how often each resample holds each of n seeds, shape (RESAMPLES, n)."""
    generator = np.random.Generator(np.random.Philox(key=n))
    drawn = generator.multinomial(n, np.full(n, 1 / n), size=RESAMPLES)
    return np.asarray(drawn, dtype=np.float64)
