"""Few real runs and many simulated ones: the control-variate estimate of a real indicator.

The real set-ups are replayed in simulation. What simulation says of these set-ups, against what it
says of all, tells how lucky the real ones were, and a regression takes that luck out of the real
runs (Badithela et al. 2025, SureSim, arXiv:2510.04354; Cochran 1977, Sampling Techniques, 12.6).
Nothing is taken from simulation itself: a simulator that is wrong everywhere costs no bias, one
that is unlike reality gains nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .inputs import IndicatorError, Numbers, between_0_and_1, performance, same_seeds
from .ratio import ROUNDING, RatioTest, limits_from_moments, probability_of
from .summaries import Interval

LEAST_REAL_RUNS = 10  # below, the regression on so few runs is no control


class Simulation(NamedTuple):
    """Simulated performances beside real ones, by the names of the indicator's arguments.

    Attributes:
        replayed: of the real runs' own set-ups, in their order, e.g. {"p_o": [...], "p_f": [...]}.
        further: of other set-ups drawn alike, at least two; all conditions over the same seeds.
    """

    replayed: Mapping[str, ArrayLike]
    further: Mapping[str, ArrayLike]


Sample = tuple[Numbers, Numbers]  # numerators, denominators


def simulated_samples(
    name: str, samples: Mapping[str, ArrayLike], weights: Mapping[str, tuple[float, float]]
) -> Sample:
    """Return numerators and denominators of simulated runs, each of shape (n,).

    Args:
        name: "replayed" or "further", for errors.
        samples: performances by the names of the indicator's arguments.
        weights: those names to their weights in numerator and denominator.

    Raises:
        IndicatorError: other names, or performances that cannot be or are not paired.
    """
    if set(samples) != set(weights):
        raise IndicatorError(
            f"simulation.{name} has {', '.join(samples) or 'nothing'}: should have "
            f"{', '.join(weights)}"
        )
    checked = {key: performance(f"{name}.{key}", sample) for key, sample in samples.items()}
    same_seeds(**checked)
    num, den = (sum(checked[key] * weights[key][part] for key in weights) for part in (0, 1))
    return np.asarray(num), np.asarray(den)


def mean_with_simulation(
    p: ArrayLike, replayed: ArrayLike, further: ArrayLike, confidence: float = 0.95
) -> Interval:
    """Mean performance of few real runs, with the interval that simulated runs narrow.

    Args:
        p: Of r >= 10 real runs, shape (r,).
        replayed: Of the same set-ups in simulation, in the same order, shape (r,).
        further: Of n >= 2 other set-ups in simulation, shape (n,).
        confidence: Of the interval, in (0, 1).

    Raises:
        IndicatorError: Too few runs, unequally many real and replayed ones, or performances that
            are negative or not finite; confidence outside (0, 1).
    """
    between_0_and_1("confidence", confidence)
    samples = [
        performance(name, sample)
        for name, sample in (("p", p), ("replayed", replayed), ("further", further))
    ]
    # A mean is a ratio whose denominator is always 1.
    test = combined_ratio(*((s, np.ones_like(s)) for s in samples), confidence=confidence)
    value = float(test.value)
    if test.degenerate:
        return Interval(value, None, None)
    return Interval(value, max(0.0, float(test.low)), float(test.high))


def combined_ratio(
    real: Sample,
    replayed: Sample,
    further: Sample,
    *,
    offset: float = 0.0,
    threshold: float = 0.0,
    confidence: float = 0.95,
) -> RatioTest:
    """Interval and test of the real theta, for one study or many at once.

    Numerator and denominator of the real runs are regressed on the simulated residual
    num - theta_sim den of the same set-up, and read off at its mean over all set-ups. Fieller's
    limits of their ratio follow, with Student's t at r - 2 degrees of freedom.

    Args:
        real: of r >= 10 set-ups, shapes (..., r).
        replayed: of the same set-ups in simulation, shapes (..., r).
        further: of n >= 2 other set-ups in simulation, shapes (..., n).
        offset: Added to the ratio of means.
        threshold: The theta that the test compares with.
        confidence: Of the interval, in (0, 1).

    Returns:
        Arrays of shape (...), as `paired_ratio` gives them.

    Raises:
        IndicatorError: r below 10, unequal numbers of real and replayed runs, n below 2.
    """
    from scipy.special import stdtr, stdtrit

    r, n = real[0].shape[-1], further[0].shape[-1]
    if r < LEAST_REAL_RUNS:
        raise IndicatorError(f"{r} real runs: should be at least {LEAST_REAL_RUNS}")
    if replayed[0].shape != real[0].shape:
        raise IndicatorError(
            f"{replayed[0].shape[-1]} replayed runs of {r} real ones: should be one of each"
        )
    if n < 2:
        raise IndicatorError(f"{n} further simulated runs: should be at least 2")
    num, den, s_nn, s_nd, s_dd = _adjusted(real, *_control(replayed, further))
    df = r - 2
    value, null = num / den, threshold - offset
    variance = s_nn - 2.0 * null * s_nd + null**2 * s_dd
    scale = np.abs(real[0]).max(axis=-1) + abs(null) * np.abs(real[1]).max(axis=-1)
    degenerate = variance <= (ROUNDING * scale) ** 2
    error = np.sqrt(np.where(degenerate, 1.0, variance))
    difference = num - null * den
    p_value = np.where(degenerate, 1.0, 2.0 * stdtr(df, -np.abs(difference / error)))
    t = np.full(value.shape, float(stdtrit(df, 0.5 + confidence / 2)))
    low, high, unbounded = limits_from_moments(
        value,
        den,
        # Of the residual num - value den, as Fieller's limits lie around the estimate.
        s_nn - 2.0 * value * s_nd + value**2 * s_dd,
        s_nd - value * s_dd,
        s_dd,
        (t, t),
    )
    return RatioTest(
        value=value + offset,
        low=np.where(degenerate, -np.inf, low + offset),
        high=np.where(degenerate, np.inf, high + offset),
        probability=probability_of(p_value, difference),
        p_value=p_value,
        difference_sd=np.where(degenerate, 0.0, np.sqrt(np.abs(variance) * r)),
        mean_denominator=den,
        degrees_of_freedom=float(df),
        degenerate=degenerate,
        unbounded=unbounded & ~degenerate,
        p_seen=p_value,
    )


class _Moments(NamedTuple):
    """Adjusted means of numerator and denominator, their squared errors and covariance."""

    num: Numbers
    den: Numbers
    s_nn: Numbers
    s_nd: Numbers
    s_dd: Numbers


def _adjusted(real: Sample, control: Numbers, everywhere: Numbers) -> _Moments:
    """Regress the real runs on the control, and read them off at its mean over all set-ups."""
    r = control.shape[-1]
    centred = control - control.mean(axis=-1, keepdims=True)
    spread = np.square(centred).sum(axis=-1)
    # A simulator that gives the same in every set-up controls nothing.
    spread = np.where(spread > 0.0, spread, 1.0)
    luck = control.mean(axis=-1) - everywhere.mean(axis=-1)
    num_slope, den_slope = ((centred * part).sum(axis=-1) / spread for part in real)
    num_left, den_left = (
        part - part.mean(axis=-1, keepdims=True) - slope[..., np.newaxis] * centred
        for part, slope in zip(real, (num_slope, den_slope), strict=True)
    )
    leverage = (1.0 / r + luck**2 / spread) / (r - 2)
    shared = everywhere.var(axis=-1, ddof=1) / everywhere.shape[-1]
    return _Moments(
        real[0].mean(axis=-1) - num_slope * luck,
        real[1].mean(axis=-1) - den_slope * luck,
        np.square(num_left).sum(axis=-1) * leverage + num_slope**2 * shared,
        (num_left * den_left).sum(axis=-1) * leverage + num_slope * den_slope * shared,
        np.square(den_left).sum(axis=-1) * leverage + den_slope**2 * shared,
    )


def _control(replayed: Sample, further: Sample) -> tuple[Numbers, Numbers]:
    """Return the simulated residuals num - theta_sim den of the replayed set-ups, and of all."""
    num, den = (np.concatenate(parts, axis=-1) for parts in zip(replayed, further, strict=True))
    mean_den = den.mean(axis=-1)
    if not (mean_den > 0.0).all():
        raise IndicatorError("simulation: the mean of the reference = 0: nothing was delivered")
    theta = (num.mean(axis=-1) / mean_den)[..., np.newaxis]
    return replayed[0] - theta * replayed[1], num - theta * den
