"""Inference on theta = mean(num) / mean(den) + offset over paired seeds.

Fieller's pivot mean(D)/se(D), D = num - (theta - offset) den, is judged by Student's distribution
and, from ten seeds on, by its studentised bootstrap too: p is the larger of the two, always, and
the interval holds every theta that this test keeps. A bootstrap only where the differences look
skewed would be a pretest, and err. Stalled runs that these seeds may hide raise p further; the
interval is that of the runs seen.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .bootstrap import MIN_SEEDS, critical_value, resampled_pivots, upper_p
from .inputs import Numbers
from .stalls import p_with_hidden

# Differences this far below the numbers they are taken from are rounding, not spread between seeds.
ROUNDING = 1e-12


class RatioTest(NamedTuple):
    """What the data say about one ratio, or about one ratio per study (arrays of one shape)."""

    value: Numbers
    low: Numbers
    high: Numbers
    probability: Numbers
    p_value: Numbers
    difference_sd: Numbers
    mean_denominator: Numbers
    degrees_of_freedom: float
    degenerate: NDArray[np.bool_]
    unbounded: NDArray[np.bool_]
    p_seen: Numbers  # p if no stalled run is hidden


def paired_ratio(
    num: Numbers,
    den: Numbers,
    *,
    offset: float = 0.0,
    threshold: float = 0.0,
    confidence: float = 0.95,
    at_stake: tuple[Numbers | float, Numbers | float] = (0.0, 0.0),
) -> RatioTest:
    """Interval and test of theta over paired seeds, for one study or many at once.

    Args:
        num: Numerators, shape (..., n), n >= 2.
        den: Denominators of the same shape, mean over the last axis > 0.
        offset: Added to the ratio of means.
        threshold: The theta that the test compares with.
        confidence: Of the Fieller interval, in (0, 1).
        at_stake: What stalls would take from mean(D) and add to it, shape (...), as
            `stalls.at_stake` gives it; from ten seeds on p holds for stalls that no run showed.

    Returns:
        Arrays of shape (...). The interval inverts the test of the runs seen: it excludes
        `threshold` exactly where p_seen < 1 - confidence, but where it is unbounded (limits -inf,
        inf). Differences without spread (`degenerate`) have p = 1 and no limits.
    """
    from scipy.special import stdtr, stdtrit

    n = num.shape[-1]
    df, alpha = n - 1, 1.0 - confidence
    value = num.mean(axis=-1) / den.mean(axis=-1)

    null = threshold - offset
    difference = num - null * den
    mean_difference = difference.mean(axis=-1)
    sd = difference.std(axis=-1, ddof=1)
    rounding = ROUNDING * (np.abs(num).max(axis=-1) + abs(null) * np.abs(den).max(axis=-1))
    degenerate = np.ptp(difference, axis=-1) <= rounding
    standard_error = np.where(degenerate, 1.0, sd) / np.sqrt(n)
    statistic = mean_difference / standard_error
    above, below = hidden_above, hidden_below = stdtr(df, -statistic), stdtr(df, statistic)
    t_low = t_high = np.full(value.shape, float(stdtrit(df, 0.5 + confidence / 2)))
    if n >= MIN_SEEDS:
        pivots = resampled_pivots(num - value[..., np.newaxis] * den)
        mirrored = -pivots[::-1]

        def larger_p(statistic: Numbers, pivots: Numbers) -> Numbers:
            return np.asarray(np.maximum(stdtr(df, -statistic), upper_p(pivots, statistic)))

        above, below = larger_p(statistic, pivots), larger_p(-statistic, mirrored)
        hidden_above, hidden_below = above, below
        if any(np.any(items) for items in at_stake):
            taken, added = (np.asarray(items) / standard_error for items in at_stake)
            hidden_above = p_with_hidden(lambda x: larger_p(x, pivots), statistic, taken, n)
            hidden_below = p_with_hidden(lambda x: larger_p(x, mirrored), -statistic, added, n)
        t_low = np.maximum(t_low, critical_value(pivots, alpha))
        t_high = np.maximum(t_high, critical_value(mirrored, alpha))
    low, high, unbounded = fieller_limits(num, den, t_low, t_high)
    # Seeds without spread between them are no evidence: equal counts come about by chance.
    p_seen, p_value = (
        np.where(degenerate, 1.0, np.minimum(1.0, 2.0 * np.minimum(*sides)))
        for sides in ((above, below), (hidden_above, hidden_below))
    )
    return RatioTest(
        value=value + offset,
        low=np.where(degenerate, -np.inf, low + offset),
        high=np.where(degenerate, np.inf, high + offset),
        probability=probability_of(p_value, mean_difference),
        p_value=p_value,
        difference_sd=np.where(degenerate, 0.0, sd),
        mean_denominator=den.mean(axis=-1),
        degrees_of_freedom=float(df),
        degenerate=degenerate,
        unbounded=unbounded & ~degenerate,
        p_seen=p_seen,
    )


def probability_of(p_value: Numbers, mean_difference: Numbers) -> Numbers:
    """Confidence that theta lies above the threshold, from the two-sided p and the side."""
    return np.where(mean_difference > 0.0, 1.0 - p_value / 2, p_value / 2)


def fieller_limits(
    num: Numbers, den: Numbers, t_low: Numbers, t_high: Numbers
) -> tuple[Numbers, Numbers, NDArray[np.bool_]]:
    """Limits of mean(num)/mean(den) and where they are unbounded, from arrays of shape (..., n).

    The lower limit solves mean(D) = t_low se(D) for D = num - theta den, the upper one
    mean(D) = -t_high se(D); the critical values, shape (...), are positive, inf for no limit.
    """
    n = num.shape[-1]
    mean_den = den.mean(axis=-1)
    value = num.mean(axis=-1) / mean_den
    # Fieller's quadratic around the estimate: with num replaced by num - value den its mean is 0,
    # so the discriminant is a sum of squares and nothing cancels.
    residual = num - value[..., np.newaxis] * den
    den_centred = den - mean_den[..., np.newaxis]
    scale = n * (n - 1)
    s_rr = np.square(residual).sum(axis=-1) / scale
    s_rd = (residual * den_centred).sum(axis=-1) / scale
    s_dd = np.square(den_centred).sum(axis=-1) / scale

    def limit(t: Numbers, side: int) -> tuple[Numbers, NDArray[np.bool_]]:
        finite = np.where(np.isfinite(t), t, 0.0)
        a = mean_den**2 - finite**2 * s_dd
        unbounded = (a <= 0.0) | ~np.isfinite(t)
        root = np.sqrt((finite**2 * s_rd) ** 2 + np.where(unbounded, 0.0, a) * finite**2 * s_rr)
        shift = (-(finite**2) * s_rd + side * root) / np.where(unbounded, 1.0, a)
        return value + shift, unbounded

    low, low_unbounded = limit(t_low, -1)
    high, high_unbounded = limit(t_high, 1)
    unbounded = low_unbounded | high_unbounded
    return np.where(unbounded, -np.inf, low), np.where(unbounded, np.inf, high), unbounded
