"""Inference on theta = mean(num) / mean(den) + offset over paired seeds, or over separate samples.

Fieller's pivot mean(D)/se(D), D = num - (theta - offset) den, is judged by Student's distribution
and, from ten seeds on, by its studentised bootstrap too: p is the larger of the two, always, and
the interval holds every theta that this test keeps. A bootstrap only where the differences look
skewed would be a pretest, and err. Stalled runs that these seeds may hide raise p further; the
interval is that of the runs seen. Samples that share no seeds, and those of several trainings, have
a t test that is inverted exactly.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from typing import Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from .inputs import Numbers
from .summaries import mean_over_trainings, p_with_hidden

MIN_SEEDS = 10  # below, too few distinct resamples to studentise
RESAMPLES = 9_999  # p is a whole number of ten-thousandths
# A resample whose variance is this far below the largest square is flat: the rest is rounding.
_FLAT = 1e-12
# Differences this far below the numbers they are taken from are rounding, not spread between seeds.
ROUNDING = 1e-12


Real = TypeVar("Real", float, Numbers)


class RatioTest(NamedTuple, Generic[Real]):
    """What the data say about one ratio, or about one ratio per study (arrays of one shape)."""

    value: Real
    low: Real
    high: Real
    mean_difference: Real  # above 0 where theta is estimated to lie above the threshold
    p_value: Real
    p_seen: Real  # p if no stalled run is hidden
    difference_sd: Real  # 0: the differences show no spread
    degrees_of_freedom: Real


def paired_ratio(
    num: Numbers,
    den: Numbers,
    *,
    offset: float = 0.0,
    threshold: float = 0.0,
    confidence: float = 0.95,
    at_stake: tuple[Numbers | float, Numbers | float] = (0.0, 0.0),
) -> RatioTest[Numbers]:
    """Interval and test of theta over paired seeds, for one study or many at once.

    Args:
        num: Numerators, shape (..., n), n >= 2.
        den: Denominators of the same shape, mean over the last axis > 0.
        offset: Added to the ratio of means.
        threshold: The theta that the test compares with.
        confidence: Of the Fieller interval, in (0, 1).
        at_stake: What stalls would take from mean(D) and add to it, shape (...), as
            `summaries.at_stake` gives it; from ten seeds on p holds for stalls that no run showed.

    Returns:
        Arrays of shape (...). The interval inverts the test of the runs seen: it excludes
        `threshold` exactly where p_seen < 1 - confidence, but where it is unbounded (limits -inf,
        inf). Differences without spread have p = 1 and no limits.
    """
    from scipy.special import stdtr, stdtrit

    n = num.shape[-1]
    df = n - 1
    value = num.mean(axis=-1) / den.mean(axis=-1)
    residual = num - value[..., None] * den

    null = threshold - offset
    difference = num - null * den
    mean_difference = difference.mean(axis=-1)
    rounding = ROUNDING * (np.abs(num).max(axis=-1) + abs(null) * np.abs(den).max(axis=-1))
    degenerate = np.ptp(difference, axis=-1) <= rounding
    sd = np.where(degenerate, 0.0, difference.std(axis=-1, ddof=1))
    standard_error = np.where(degenerate, 1.0, sd) / np.sqrt(n)
    statistic = mean_difference / standard_error
    p_seen = p_value = 2.0 * stdtr(df, -np.abs(statistic))
    t_low = t_high = np.full(value.shape, float(stdtrit(df, 0.5 + confidence / 2)))
    if n >= MIN_SEEDS:
        pivots = resampled_pivots(residual)
        mirrored = -pivots[::-1]

        def larger_p(statistic: Numbers, pivots: Numbers) -> Numbers:
            return np.asarray(np.maximum(stdtr(df, -statistic), upper_p(pivots, statistic)))

        taken, added = (np.asarray(items) / standard_error for items in at_stake)
        hidden_above = p_with_hidden(lambda x: larger_p(x, pivots), statistic, taken, n)
        hidden_below = p_with_hidden(lambda x: larger_p(x, mirrored), -statistic, added, n)
        p_seen = 2.0 * np.minimum(larger_p(statistic, pivots), larger_p(-statistic, mirrored))
        p_value = 2.0 * np.minimum(hidden_above, hidden_below)
        t_low = np.maximum(t_low, critical_value(pivots, 1.0 - confidence))
        t_high = np.maximum(t_high, critical_value(mirrored, 1.0 - confidence))
    low, high = fieller_limits(value, residual, den, t_low, t_high)
    return RatioTest(
        value=value + offset,
        low=np.where(degenerate, -np.inf, low + offset),
        high=np.where(degenerate, np.inf, high + offset),
        mean_difference=mean_difference,
        # Seeds without spread between them are no evidence: equal counts come about by chance.
        p_value=np.where(degenerate, 1.0, np.minimum(1.0, p_value)),
        p_seen=np.where(degenerate, 1.0, np.minimum(1.0, p_seen)),
        difference_sd=sd,
        degrees_of_freedom=np.full(value.shape, float(df)),
    )


def fieller_limits(
    value: Numbers, residual: Numbers, den: Numbers, t_low: Numbers, t_high: Numbers
) -> tuple[Numbers, Numbers]:
    """Limits of value = mean(num)/mean(den), -inf and inf where unbounded.

    The lower limit solves mean(D) = t_low se(D) for D = num - theta den, the upper one
    mean(D) = -t_high se(D); the critical values, shape (...), are positive, inf for no limit.

    Args:
        residual: num - value den, shape (..., n) as den. Its mean is 0, so the discriminant of
            Fieller's quadratic around the estimate is a sum of squares and nothing cancels.
    """
    n = den.shape[-1]
    mean_den = den.mean(axis=-1)
    den_centred = den - mean_den[..., None]
    scale = n * (n - 1)
    s_rr = np.square(residual).sum(axis=-1) / scale
    s_rd = (residual * den_centred).sum(axis=-1) / scale
    s_dd = np.square(den_centred).sum(axis=-1) / scale

    def limit(t: Numbers, side: int) -> Numbers:
        a = mean_den**2 - t**2 * s_dd
        root = np.sqrt((t**2 * s_rd) ** 2 + a * t**2 * s_rr)
        shift = (-(t**2) * s_rd + side * root) / a
        return np.where(a > 0.0, value + shift, np.inf)

    with np.errstate(all="ignore"):  # of what is unbounded
        low, high = limit(t_low, -1), limit(t_high, 1)
    unbounded = np.isinf(low) | np.isinf(high)
    return np.where(unbounded, -np.inf, low), np.where(unbounded, np.inf, high)


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
    flattened = residual.reshape(-1, n).T
    mean = _resampled_sums(flattened) / n
    variance = (_resampled_sums(flattened**2) - n * mean**2) / (n - 1)
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


# So many resamples are multiplied at once where all of them would fill the memory: a multiple of
# 64, for which the sums of one study have the same bits as those of all resamples at once.
_AT_ONCE = 512
_MOST_SEEDS_AT_ONCE = 1_000


def _resampled_sums(values: Numbers) -> Numbers:
    """Return the sums of values (n, k) over the seeds of each resample, shape (RESAMPLES, k)."""
    drawn = _times_drawn(len(values))
    rows = RESAMPLES if len(values) <= _MOST_SEEDS_AT_ONCE else _AT_ONCE
    parts = (drawn[start : start + rows] for start in range(0, RESAMPLES, rows))
    return np.concatenate([part.astype(np.float64) @ values for part in parts])


@functools.lru_cache(maxsize=4)
def _times_drawn(n: int) -> NDArray[np.uint8]:
    """Return how often each resample holds each of n seeds, shape (RESAMPLES, n)."""
    generator, even = np.random.Generator(np.random.Philox(key=n)), np.full(n, 1 / n)
    drawn = np.empty((RESAMPLES, n), np.uint8)  # more than 255 times is never drawn of ten or more
    for start in range(0, RESAMPLES, _AT_ONCE):
        part = drawn[start : start + _AT_ONCE]
        part[:] = generator.multinomial(n, even, size=len(part))
    return drawn


class Term(NamedTuple):
    """One sample of performances and its weights in numerator and denominator of the ratio.

    The last of several terms is the denominator: its weight there is 1, that of all others 0.
    """

    sample: Numbers
    in_num: float
    in_den: float

    def weight(self, theta: float) -> float:
        """Weight of the sample in D = num - theta den; what is but rounding counts as 0."""
        weight = self.in_num - theta * self.in_den
        return 0.0 if abs(weight) <= ROUNDING * (1.0 + abs(self.in_num)) else weight


# Mean(D), its squared standard error and degrees of freedom at one theta, D = num - theta den.
Difference = Callable[[Sequence[Term], float], tuple[float, float, float]]


def ratio_of_samples(
    terms: Sequence[Term],
    difference: Difference,
    *,
    offset: float,
    threshold: float,
    confidence: float,
) -> RatioTest[float]:
    """Interval and test of theta = mean(num) / mean(den) + offset by the t test of mean(D).

    The interval holds every theta that this test keeps (Fieller), so that verdict and interval
    agree at any threshold.

    Args:
        terms: samples, each of at least two seeds.
        difference: `welch` of independent samples, `over_trainings` of those with a row for each
            training.
    """
    from scipy.special import stdtr

    mean_den = float(terms[-1].sample.mean())
    value = sum(term.in_num * float(term.sample.mean()) for term in terms) / mean_den
    null = threshold - offset
    mean, variance, df = difference(terms, null)
    scale = sum(
        (abs(term.in_num) + abs(null * term.in_den)) * float(term.sample.max()) for term in terms
    )
    degenerate = math.sqrt(variance) <= ROUNDING * scale
    p_value, low, high = 1.0, -math.inf, math.inf
    if degenerate:
        # No spread leaves no Welch formula; the smallest sample bounds it from below.
        df = float(min(len(term.sample) for term in terms) - 1)
    else:
        p_value = 2.0 * float(stdtr(df, -abs(mean) / math.sqrt(variance)))
        low, high = _limits(terms, difference, value, mean_den, 0.5 + confidence / 2)
    n = min(term.sample.size for term in terms)
    return RatioTest(
        value=value + offset,
        low=low + offset,
        high=high + offset,
        mean_difference=mean,
        p_value=p_value,
        p_seen=p_value,
        difference_sd=0.0 if degenerate else math.sqrt(variance * n),
        degrees_of_freedom=df,
    )


def welch(terms: Sequence[Term], theta: float) -> tuple[float, float, float]:
    """Return a `Difference` of independent samples (n,), with Welch's degrees of freedom.

    D = sum over samples of (in_num - theta in_den) mean: the variance of each sample enters once,
    with its whole weight, which is Fieller's form with cov(num, den) = -var(P_o)/n_o times the
    numerator's weight (0 for fault tolerance).
    """
    mean, variance, freedom = 0.0, 0.0, 0.0
    for term in terms:
        sample, weight = term.sample, term.weight(theta)
        share = weight**2 * float(sample.var(ddof=1)) / sample.size
        mean += weight * float(sample.mean())
        variance += share
        freedom += share**2 / (sample.size - 1)
    return mean, variance, variance**2 / freedom if freedom > 0.0 else math.inf


def over_trainings(
    terms: Sequence[Term], theta: float, *, paired: bool
) -> tuple[float, float, float]:
    """Return a `Difference` of samples (K trainings, S seeds), K >= 2, S >= 2.

    K trainings of one recipe are played over the same S seeds. A value then varies with both, and
    an interval over seeds alone would only hold for the networks at hand. Simulated coverage of
    95 % intervals of R at 5 and 10 trainings is .93 or more, of 10 seeds whose counts are Poisson,
    overdispersed or geometric (`tests/spi/test_trainings.py`).

    Args:
        paired: whether column s of every term is the same seed. Row k is always one training.
    """
    return mean_over_trainings([term.weight(theta) * term.sample for term in terms], paired=paired)


def _limits(
    terms: Sequence[Term], difference: Difference, value: float, mean_den: float, quantile: float
) -> tuple[float, float]:
    """Return the ends of the interval of all theta that a t test keeps; infinite: it has none.

    Args:
        value: the estimate, where mean(D) = 0.
        mean_den: mean of the denominator, above 0.
        quantile: of Student's distribution, in (0.5, 1).
    """
    from scipy.optimize import brentq
    from scipy.special import stdtrit

    def outside(theta: float) -> float:
        """Positive where the test at theta rejects."""
        mean, variance, df = difference(terms, theta)
        if variance == 0.0:
            return abs(mean)
        return abs(mean) - float(stdtrit(df, quantile)) * math.sqrt(variance)

    # Far out only the denominator's sample is left.
    _, variance, df = difference([Term(terms[-1].sample, 1.0, 0.0)], 0.0)
    # The interval ends if the denominator's mean is clear of 0.
    if variance > 0.0 and mean_den <= float(stdtrit(df, quantile)) * math.sqrt(variance):
        return -math.inf, math.inf
    spread = math.sqrt(difference(terms, value)[1]) / mean_den
    if spread == 0.0:
        return value, value

    def limit(side: int) -> float:
        inner, step = value, spread
        while outside(value + side * step) <= 0.0:
            inner, step = value + side * step, 2.0 * step
        return float(brentq(outside, inner, value + side * step, xtol=1e-12))

    return limit(-1), limit(1)
