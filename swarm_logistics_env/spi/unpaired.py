"""The same ratio from samples that share no seeds: Welch's degrees of freedom, inverted exactly."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .inputs import Numbers
from .ratio import ROUNDING, RatioTest, probability_of


class Term(NamedTuple):
    """One sample of performances and its weights in numerator and denominator of the ratio."""

    sample: Numbers
    in_num: float
    in_den: float

    def weight(self, theta: float) -> float:
        """Weight of the sample in D = num - theta den; what is but rounding counts as 0."""
        weight = self.in_num - theta * self.in_den
        return 0.0 if abs(weight) <= ROUNDING * (1.0 + abs(self.in_num)) else weight


class _Difference(NamedTuple):
    """mean(D), its squared standard error and Welch's degrees of freedom at one value of theta."""

    mean: float
    variance: float
    degrees_of_freedom: float


def unpaired_ratio(
    terms: Sequence[Term], *, offset: float = 0.0, threshold: float = 0.0, confidence: float = 0.95
) -> RatioTest:
    """Interval and test of theta from independent samples of at least two seeds each.

    D = sum over samples of (in_num - theta in_den) mean: the variance of each sample enters once,
    with its whole weight, which is Fieller's form with cov(num, den) = -var(P_o)/n_o times the
    numerator's weight (0 for fault tolerance). The interval holds every theta that the Welch test
    at theta keeps, so that verdict and interval agree at any threshold.
    """
    from scipy.special import stdtr

    mean_den = sum(term.in_den * float(term.sample.mean()) for term in terms)
    value = sum(term.in_num * float(term.sample.mean()) for term in terms) / mean_den
    null = threshold - offset
    at_null = _difference(terms, null)
    scale = sum(
        (abs(term.in_num) + abs(null * term.in_den)) * float(term.sample.max()) for term in terms
    )
    degenerate = math.sqrt(at_null.variance) <= ROUNDING * scale
    if degenerate:
        p_value, low, high = 1.0, -math.inf, math.inf
        # No spread leaves no Welch formula; the smallest sample bounds it from below.
        df = float(min(term.sample.size for term in terms) - 1)
    else:
        df = at_null.degrees_of_freedom
        p_value = 2.0 * float(stdtr(df, -abs(at_null.mean) / math.sqrt(at_null.variance)))
        low, high = _limits(terms, value, mean_den, 0.5 + confidence / 2)
    n = min(term.sample.size for term in terms)
    return RatioTest(
        value=np.asarray(value + offset),
        low=np.asarray(low + offset),
        high=np.asarray(high + offset),
        probability=probability_of(np.asarray(p_value), np.asarray(at_null.mean)),
        p_value=np.asarray(p_value),
        difference_sd=np.asarray(0.0 if degenerate else math.sqrt(at_null.variance * n)),
        mean_denominator=np.asarray(mean_den),
        degrees_of_freedom=df,
        degenerate=np.asarray(degenerate),
        unbounded=np.asarray(math.isinf(low) and not degenerate),
        p_seen=np.asarray(p_value),
    )


def _difference(terms: Sequence[Term], theta: float) -> _Difference:
    mean, variance, welch = 0.0, 0.0, 0.0
    for term in terms:
        sample, weight = term.sample, term.weight(theta)
        share = weight**2 * float(sample.var(ddof=1)) / sample.size
        mean += weight * float(sample.mean())
        variance += share
        welch += share**2 / (sample.size - 1)
    return _Difference(mean, variance, variance**2 / welch if welch > 0.0 else math.inf)


def _limits(
    terms: Sequence[Term], value: float, mean_den: float, quantile: float
) -> tuple[float, float]:
    from scipy.optimize import brentq
    from scipy.special import stdtrit

    def outside(theta: float) -> float:
        """Positive where the test at theta rejects."""
        mean, variance, df = _difference(terms, theta)
        if variance == 0.0:
            return abs(mean)
        return abs(mean) - float(stdtrit(df, quantile)) * math.sqrt(variance)

    # Far out only the denominator's sample is left; the interval ends if its mean is clear of 0.
    far = _difference([Term(sample, in_den, 0.0) for sample, _, in_den in terms], 0.0)
    if far.variance > 0.0 and mean_den <= float(
        stdtrit(far.degrees_of_freedom, quantile)
    ) * math.sqrt(far.variance):
        return -math.inf, math.inf
    spread = math.sqrt(_difference(terms, value).variance) / mean_den
    if spread == 0.0:
        return value, value

    def limit(side: int) -> float:
        inner, step = value, spread
        while outside(value + side * step) <= 0.0:
            inner, step = value + side * step, 2.0 * step
        return float(brentq(outside, inner, value + side * step, xtol=1e-12))

    return limit(-1), limit(1)
