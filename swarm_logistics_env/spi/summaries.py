"""Raw performance P over seeds: intervals, and what pairing achieved."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .inputs import IndicatorError, Numbers, between_0_and_1, numbers, performance, same_seeds


class Interval(NamedTuple):
    """A value and its interval; the limits are None at n = 1, where nothing is known of them."""

    value: float
    low: float | None
    high: float | None


def mean_interval(p: ArrayLike, confidence: float = 0.95) -> Interval:
    """Mean performance with its t-interval [items], n - 1 degrees of freedom, cut off at 0.

    Args:
        p: Performance over seeds, shape (n,); or over trainings and seeds, shape (K, n): the
            interval then holds for further trainings as well.

    Raises:
        IndicatorError: p empty, negative or not finite; confidence outside (0, 1).
    """
    return interval_of_mean(performance("p", p, or_trainings=True), confidence, least=0.0)


def interval_of_mean(
    sample: Numbers, confidence: float = 0.95, *, least: float = -math.inf
) -> Interval:
    """Mean of numbers that may be negative, with its interval, as `mean_interval`.

    Args:
        sample: shape (n,) or (K, n).
        least: where the interval is cut off, as no value lies below.

    Raises:
        IndicatorError: confidence outside (0, 1).
    """
    if sample.ndim == 1 or 1 in sample.shape:
        return t_interval(sample.ravel(), confidence, least=least)
    from scipy.special import stdtrit

    between_0_and_1("confidence", confidence)
    mean, variance, df = map(float, mean_over_trainings([sample], paired=True))
    half = float(stdtrit(df, 0.5 + confidence / 2)) * math.sqrt(variance)
    return Interval(mean, max(least, mean - half), mean + half)


def prediction_interval(p: ArrayLike, confidence: float = 0.95) -> Interval:
    """Mean performance with the interval of one further run [items]: mean -+ t sd sqrt(1 + 1/n).

    Cut off at 0: no run delivers less.
    A single published run is to be compared with this one, not with `mean_interval`.

    Raises:
        IndicatorError: p empty, negative or not finite; confidence outside (0, 1).
    """
    return t_interval(performance("p", p), confidence, of_one_run=True, least=0.0)


def median_interval(times: ArrayLike, confidence: float = 0.95) -> Interval:
    """Median of times [s] with its interval by the sign test, which assumes no distribution.

    Args:
        times: shape (n,), above 0; infinite: the event did not come in time (censored).
        confidence: in (0, 1); the interval has at least that. Limits are infinite where too few
            events are known, and None below six times at 95 %, which give no interval.

    Raises:
        IndicatorError: no times, one of them negative or NaN; confidence outside (0, 1).
    """
    from scipy.special import bdtr

    between_0_and_1("confidence", confidence)
    seconds = numbers("times", times)
    if seconds.ndim != 1 or not seconds.size or not (seconds >= 0.0).all():
        raise IndicatorError(f"times: should be a sequence of times from 0 on, got {times!r}")
    ascending = np.sort(seconds)
    n = seconds.size
    value = float(np.median(seconds))
    # The k-th time from either end is a limit where at most so few are expected beyond it.
    k = int(np.count_nonzero(bdtr(np.arange(n // 2), n, 0.5) <= (1.0 - confidence) / 2))
    if not k:
        return Interval(value, None, None)
    return Interval(value, float(ascending[k - 1]), float(ascending[n - k]))


def pairing_correlation(p_a: ArrayLike, p_b: ArrayLike) -> float | None:
    """Pearson correlation of two samples over shared seeds, in [-1, 1]: what pairing achieved.

    None below three seeds (it is -1 or 1 at two) or where a sample is constant.

    Raises:
        IndicatorError: A sample empty, negative or not finite, or unequal seed sets.
    """
    a = performance("p_a", p_a)
    b = performance("p_b", p_b)
    same_seeds(p_a=a, p_b=b)
    if a.size < 3 or np.ptp(a) == 0.0 or np.ptp(b) == 0.0:
        return None
    return float(np.corrcoef(a, b)[0, 1])


def t_interval(
    sample: Numbers,
    confidence: float = 0.95,
    *,
    of_one_run: bool = False,
    least: float = -math.inf,
) -> Interval:
    """Mean of a sample (n,) with its t-interval, or with that of one further value.

    Args:
        least: where the interval is cut off, as no value lies below.

    Raises:
        IndicatorError: confidence outside (0, 1).
    """
    from scipy.special import stdtrit

    between_0_and_1("confidence", confidence)
    n = sample.size
    mean = float(sample.mean())
    if n == 1:
        return Interval(mean, None, None)
    spread = float(sample.std(ddof=1)) * math.sqrt(1 / n + of_one_run)
    half = float(stdtrit(n - 1, 0.5 + confidence / 2)) * spread
    return Interval(mean, max(least, mean - half), mean + half)


def mean_over_trainings(
    weighted: Sequence[Numbers], *, paired: bool
) -> tuple[Numbers, Numbers, Numbers]:
    """Return the mean of the sum, its squared standard error and degrees of freedom, shape (...).

    Trainings and seeds are crossed factors without replication, so the variance of the mean is
    (MS_k + MS_s - MS_e) / KS of the two-way analysis of variance (Searle, Casella and McCulloch
    1992), its degrees of freedom after Satterthwaite (1946).

    Args:
        weighted: shape (..., K, S) each, K >= 2. Unless paired, the seeds of each are others.
    """
    parts = [np.asarray(sum(weighted))] if paired else weighted
    by_training = np.asarray(sum(part.mean(axis=-1) for part in parts))
    count = by_training.shape[-1]
    of_trainings = by_training.var(axis=-1, ddof=1) / count
    # The residual is in both mean squares: that of the seeds counts without it.
    of_seeds = np.zeros(())
    without_residual = np.zeros(())
    freedom = of_trainings**2 / (count - 1)
    for part in parts:
        seeds = part.shape[-1]
        over_trainings = part.mean(axis=-2)
        over_seeds = part.mean(axis=-1)
        middle = over_seeds.mean(axis=-1)[..., None, None]
        residual = part - over_trainings[..., None, :] - over_seeds[..., None] + middle
        square = over_trainings.var(axis=-1, ddof=1) / seeds
        error = np.square(residual).sum(axis=(-2, -1)) / ((count - 1) * (seeds - 1))
        of_seeds = of_seeds + square
        without_residual = without_residual + square - error / (count * seeds)
        freedom = freedom + square**2 / (seeds - 1)
    variance = np.maximum(np.maximum(of_trainings + without_residual, of_trainings), of_seeds)
    with np.errstate(all="ignore"):
        df = np.where(freedom > 0.0, np.maximum(variance**2 / freedom, 1.0), np.inf)
    return np.asarray(by_training.mean(axis=-1)), variance, df
