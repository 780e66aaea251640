"""Laws of performance against swarm size, and the size N* beyond which robots cost deliveries."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .inputs import IndicatorError, Numbers, between_0_and_1, performance
from .scaling_laws import (
    CURVES,
    Curve,
    Law,
    peak_of,
    power_exponential_start,
    shapes_with_peak_at,
    sharpness_of,
    usl_start,
)

Weighting = Literal["1/P", "none"]

_FARTHEST = 1e6  # an upper limit of N* this many times the estimate is none
_SHARPNESS = 15.0  # the search for the best sharpness goes so far to either side of 0


@dataclass(frozen=True, slots=True)
class ScalingFit:
    """One law fitted to performance against swarm size.

    Attributes:
        law: "usl", P = g N / (1 + a (N-1) + b N (N-1)), or "power_exponential",
            P = k N^p exp(-q N).
        parameters: g, a, b or k, p, q; P in items.
        peak: N* [robots], where P is largest; None where the fitted law has no peak.
        peak_low: Lower limit of N* from the profile of the residual sum; None without a peak,
            0 where the data set no lower limit.
        peak_high: Its upper limit; inf where the data set none.
        confidence: Of that interval.
        weighting: "1/P" minimises the sum of residual^2 / P, "none" that of residual^2. N* moves
            with it, so it is never to be quoted without.
        residual_sum: The sum that was minimised.
        aicc: Corrected Akaike criterion, comparable between laws on the same data and weighting;
            None at five sizes or fewer, where the correction is undefined.
    """

    law: Law
    parameters: dict[str, float]
    peak: float | None
    peak_low: float | None
    peak_high: float | None
    confidence: float
    weighting: Weighting
    residual_sum: float
    aicc: float | None

    def predict(self, sizes: ArrayLike) -> Numbers:
        """Performance [items] that the law gives at swarm sizes [robots]."""
        values = np.array(list(self.parameters.values()))
        return CURVES[self.law](values, np.asarray(sizes, dtype=np.float64))


def fit_scaling(
    sizes: ArrayLike,
    p: ArrayLike,
    *,
    law: Law = "usl",
    weighting: Weighting = "1/P",
    confidence: float = 0.95,
) -> ScalingFit:
    """Fit one law to mean performance at each swarm size (Gunther 2007 for the USL).

    Args:
        sizes: Swarm sizes N [robots], shape (k,), k >= 4, distinct, positive.
        p: Performance at each size [items], mean over seeds, shape (k,).
        law: Which law.
        weighting: Weight of each squared residual: 1/P (counts: their variance grows with them) or
            none.
        confidence: Of the interval of N*, in (0, 1).

    Raises:
        IndicatorError: Unequal lengths, fewer than four sizes, a size not positive or repeated, a P
            not finite or negative, P = 0 under 1/P, an unknown law or weighting, or no convergence.
    """
    between_0_and_1("confidence", confidence)
    if law not in CURVES:
        raise IndicatorError(f"law = {law!r}: should be one of {', '.join(CURVES)}")
    points = _checked(sizes, p, weighting)
    start = (usl_start if law == "usl" else power_exponential_start)(points.n, points.p)
    fitted, residual_sum = _least_squares(CURVES[law], start, points)
    peak = peak_of(law, fitted)
    low, high = None, None
    if peak is not None:
        # The search starts below the sharpness of the fit, which may be nearly flat.
        bluntest = min(-_SHARPNESS, sharpness_of(law, fitted, peak) - 5.0)
        low, high = _peak_limits(law, peak, bluntest, residual_sum, points, confidence)
    names = ("g", "a", "b") if law == "usl" else ("k", "p", "q")
    return ScalingFit(
        law=law,
        parameters=dict(zip(names, fitted.tolist(), strict=True)),
        peak=peak,
        peak_low=low,
        peak_high=high,
        confidence=confidence,
        weighting=weighting,
        residual_sum=residual_sum,
        aicc=_aicc(residual_sum, points.n.size),
    )


def compare_scaling(
    sizes: ArrayLike, p: ArrayLike, *, weighting: Weighting = "1/P", confidence: float = 0.95
) -> tuple[ScalingFit, ...]:
    """Both laws on the same data, the one with the smaller AICc (or residual sum) first.

    Raises:
        IndicatorError: As `fit_scaling`.
    """
    fits = [
        fit_scaling(sizes, p, law=law, weighting=weighting, confidence=confidence) for law in CURVES
    ]
    # Both laws have three parameters, so the residual sum gives the order of AICc, defined or not.
    return tuple(sorted(fits, key=lambda fit: fit.residual_sum))


class _Points(NamedTuple):
    """Swarm sizes, performances there, and the square roots of their weights, shapes (k,)."""

    n: Numbers
    p: Numbers
    root_weights: Numbers


def _checked(sizes: ArrayLike, p: ArrayLike, weighting: Weighting) -> _Points:
    n, observed = performance("sizes", sizes), performance("p", p)
    if n.size != observed.size:
        raise IndicatorError(f"{n.size} sizes, {observed.size} performances: should be as many")
    if n.size < 4:
        raise IndicatorError(f"{n.size} sizes: should be at least 4 to fit three parameters")
    if n.min() <= 0.0 or np.unique(n).size < n.size:
        raise IndicatorError(f"sizes = {n.tolist()}: should be positive, each once")
    if weighting not in ("1/P", "none"):
        raise IndicatorError(f"weighting = {weighting!r}: should be one of 1/P, none")
    if weighting == "1/P" and observed.min() == 0.0:
        raise IndicatorError('p holds 0 under weighting "1/P": its weight is infinite; use "none"')
    if not observed.any():
        raise IndicatorError("p = 0 at every size: should hold some delivery")
    weighted = weighting == "1/P"
    return _Points(n, observed, 1.0 / np.sqrt(observed) if weighted else np.ones_like(observed))


def _least_squares(curve: Curve, start: Numbers, points: _Points) -> tuple[Numbers, float]:
    from scipy.optimize import least_squares

    def residuals(parameters: Numbers) -> Numbers:
        with np.errstate(all="ignore"):  # the search may step where the law has no value
            predicted = curve(parameters, points.n)
        misses = (points.p - predicted) * points.root_weights
        return np.where(np.isfinite(predicted), misses, 1e6)

    tight = 1e-12
    found = least_squares(
        residuals, start, x_scale="jac", xtol=tight, ftol=tight, gtol=tight, max_nfev=5_000
    )
    if not found.success:
        raise IndicatorError(f"no law fits sizes {points.n.tolist()}, p {points.p.tolist()}")
    return np.asarray(found.x), 2.0 * float(found.cost)


def _peak_limits(
    law: Law, peak: float, bluntest: float, residual_sum: float, points: _Points, confidence: float
) -> tuple[float, float]:
    """Every N* whose best fit is not worse than the best of all by an F-test at `confidence`."""
    from scipy.optimize import brentq
    from scipy.special import stdtrit

    total = float(np.square(points.p * points.root_weights).sum())
    if residual_sum <= 1e-12 * total:  # the law fits exactly
        return peak, peak
    df = points.n.size - 3
    allowed = residual_sum * (1.0 + float(stdtrit(df, 0.5 + confidence / 2)) ** 2 / df)

    def excess(log_peak: float) -> float:
        return _residual_sum_at(law, math.exp(log_peak), bluntest, points) - allowed

    def limit(side: int, farthest: float) -> float | None:
        inner, step = math.log(peak), 0.05
        # Nothing to look at where the peak itself lies beyond the farthest.
        while side * (farthest - inner) > 1e-9:
            outer = math.log(peak) + side * min(step, abs(farthest - math.log(peak)))
            if excess(outer) > 0.0:
                return math.exp(float(brentq(excess, inner, outer, xtol=1e-6)))
            inner, step = outer, 2.0 * step
        return None

    if excess(math.log(peak)) > 0.0:  # the fit has a pole (or all but): it is none of those
        return 0.0, math.inf
    low, high = limit(-1, math.log1p(1e-3)), limit(1, math.log(peak * _FARTHEST))
    return 0.0 if low is None else low, math.inf if high is None else high


def _residual_sum_at(law: Law, peak: float, bluntest: float, points: _Points) -> float:
    """Least weighted sum of squares with N* held: the factor in closed form, the rest searched."""
    low, high = bluntest, _SHARPNESS
    weighted = points.p * points.root_weights
    for _ in range(4):  # each grid spans two steps of the one before
        sharpness = np.linspace(low, high, 121)
        shapes = shapes_with_peak_at(law, peak, sharpness, points.n) * points.root_weights
        sums = np.square(weighted).sum() - (shapes @ weighted) ** 2 / np.square(shapes).sum(axis=1)
        best = int(np.argmin(sums))
        low, high = sharpness[max(best - 1, 0)], sharpness[min(best + 1, 120)]
    return float(sums[best])


def _aicc(residual_sum: float, points: int) -> float | None:
    parameters = 4  # three of the law and the residual variance
    if points <= parameters + 1:
        return None
    if residual_sum == 0.0:
        return -math.inf
    correction = 2.0 * parameters * (parameters + 1) / (points - parameters - 1)
    return points * math.log(residual_sum / points) + 2.0 * parameters + correction
