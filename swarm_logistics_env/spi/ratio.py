"""Inference on theta = mean(num) / mean(den) + offset over paired seeds: Fieller and its t-test."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

# Differences this far below the numbers they are taken from are rounding, not spread between seeds.
ROUNDING = 1e-12


class RatioTest(NamedTuple):
    """What the data say about one ratio, or about one ratio per study (arrays of one shape)."""

    value: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    probability: NDArray[np.float64]
    p_value: NDArray[np.float64]
    difference_sd: NDArray[np.float64]
    mean_denominator: NDArray[np.float64]
    degrees_of_freedom: float
    degenerate: NDArray[np.bool_]
    unbounded: NDArray[np.bool_]


def paired_ratio(
    num: NDArray[np.float64],
    den: NDArray[np.float64],
    *,
    offset: float = 0.0,
    threshold: float = 0.0,
    level: float = 0.95,
) -> RatioTest:
    """Interval and test of theta over paired seeds, for one study or many at once.

    Args:
        num: Numerators, shape (..., n), n >= 2.
        den: Denominators of the same shape, mean over the last axis > 0.
        offset: Added to the ratio of means.
        threshold: The theta that the test compares with.
        level: Confidence level of the Fieller interval, in (0, 1).

    Returns:
        Arrays of shape (...). The interval inverts the test: it excludes `threshold` exactly where
        p_value < 1 - level, but where it is unbounded (limits -inf, inf).
    """
    from scipy.special import stdtr, stdtrit

    df = num.shape[-1] - 1
    value = num.mean(axis=-1) / den.mean(axis=-1)
    t = float(stdtrit(df, 0.5 + level / 2))
    low, high, unbounded = fieller_limits(num, den, t, t)

    null = threshold - offset
    difference = num - null * den
    mean_difference = difference.mean(axis=-1)
    sd = difference.std(axis=-1, ddof=1)
    rounding = ROUNDING * (np.abs(num).max(axis=-1) + abs(null) * np.abs(den).max(axis=-1))
    degenerate = np.ptp(difference, axis=-1) <= rounding
    sd = np.where(degenerate, 0.0, sd)
    # Without spread only the sign of the difference is left, and a difference of rounding is none.
    sign_alone = np.where(
        np.abs(mean_difference) <= rounding, 0.0, np.copysign(np.inf, mean_difference)
    )
    standard_error = np.where(degenerate, 1.0, sd) / np.sqrt(df + 1)
    statistic = np.where(degenerate, sign_alone, mean_difference / standard_error)
    return RatioTest(
        value=value + offset,
        low=np.where(degenerate, value, low) + offset,
        high=np.where(degenerate, value, high) + offset,
        probability=stdtr(df, statistic),
        p_value=2.0 * stdtr(df, -np.abs(statistic)),
        difference_sd=sd,
        mean_denominator=den.mean(axis=-1),
        degrees_of_freedom=float(df),
        degenerate=degenerate,
        unbounded=unbounded & ~degenerate,
    )


def fieller_limits(
    num: NDArray[np.float64],
    den: NDArray[np.float64],
    t_low: float,
    t_high: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """Limits of mean(num)/mean(den) and where they are unbounded, from arrays of shape (..., n).

    The lower limit solves mean(D) = t_low se(D) for D = num - theta den, the upper one
    mean(D) = -t_high se(D); the two quantiles differ only in the bootstrap.
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

    def limit(t: float, side: int) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        a = mean_den**2 - t**2 * s_dd
        unbounded = a <= 0.0
        root = np.sqrt((t**2 * s_rd) ** 2 + np.where(unbounded, 0.0, a) * t**2 * s_rr)
        shift = (-(t**2) * s_rd + side * np.sign(t) * root) / np.where(unbounded, 1.0, a)
        return value + shift, unbounded

    low, low_unbounded = limit(t_low, -1)
    high, high_unbounded = limit(t_high, 1)
    unbounded = low_unbounded | high_unbounded
    return np.where(unbounded, -np.inf, low), np.where(unbounded, np.inf, high), unbounded
