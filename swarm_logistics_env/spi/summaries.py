"""Raw performance P over seeds: intervals, and what pairing achieved."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .inputs import Numbers, between_0_and_1, performance, same_seeds


class Interval(NamedTuple):
    """A value and its interval; the limits are None at n = 1, where nothing is known of them."""

    value: float
    low: float | None
    high: float | None


def mean_interval(p: ArrayLike, confidence: float = 0.95) -> Interval:
    """Mean performance with its t-interval [items], n - 1 degrees of freedom, cut off at 0.

    Raises:
        IndicatorError: p empty, negative or not finite; confidence outside (0, 1).
    """
    return _not_negative(t_interval(performance("p", p), confidence))


def prediction_interval(p: ArrayLike, confidence: float = 0.95) -> Interval:
    """Mean performance with the interval of one further run [items]: mean -+ t sd sqrt(1 + 1/n).

    Cut off at 0: no run delivers less.
    A single published run is to be compared with this one, not with `mean_interval`.

    Raises:
        IndicatorError: p empty, negative or not finite; confidence outside (0, 1).
    """
    return _not_negative(t_interval(performance("p", p), confidence, of_one_run=True))


def pairing_correlation(p_a: ArrayLike, p_b: ArrayLike) -> float | None:
    """Pearson correlation of two samples over shared seeds, in [-1, 1]: what pairing achieved.

    None below three seeds (it is -1 or 1 at two) or where a sample is constant.

    Raises:
        IndicatorError: A sample empty, negative or not finite, or unequal seed sets.
    """
    a, b = performance("p_a", p_a), performance("p_b", p_b)
    same_seeds(p_a=a, p_b=b)
    if a.size < 3 or np.ptp(a) == 0.0 or np.ptp(b) == 0.0:
        return None
    return float(np.corrcoef(a, b)[0, 1])


def t_interval(sample: Numbers, confidence: float = 0.95, *, of_one_run: bool = False) -> Interval:
    """Mean of a sample (n,) of any sign with its t-interval, or with that of one further value.

    Raises:
        IndicatorError: confidence outside (0, 1).
    """
    from scipy.special import stdtrit

    between_0_and_1("confidence", confidence)
    n, mean = sample.size, float(sample.mean())
    if n == 1:
        return Interval(mean, None, None)
    spread = float(sample.std(ddof=1)) * math.sqrt(1 / n + of_one_run)
    half = float(stdtrit(n - 1, 0.5 + confidence / 2)) * spread
    return Interval(mean, mean - half, mean + half)


def _not_negative(interval: Interval) -> Interval:
    if interval.low is None or interval.high is None:
        return interval
    return Interval(interval.value, max(0.0, interval.low), interval.high)
