"""The two laws of performance against swarm size: curves, starting points, peaks."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal, TypeAlias

import numpy as np

from .inputs import Numbers

Law = Literal["usl", "power_exponential"]
Curve: TypeAlias = "Callable[[Numbers, Numbers], Numbers]"


def _usl(parameters: Numbers, n: Numbers) -> Numbers:
    g, a, b = parameters
    return np.asarray(g * _shape_usl(a, b, n))


def _shape_usl(a: Numbers, b: Numbers, n: Numbers) -> Numbers:
    return n / (1.0 + a * (n - 1.0) + b * n * (n - 1.0))


def _power_exponential(parameters: Numbers, n: Numbers) -> Numbers:
    k, p, q = (float(value) for value in parameters)
    return np.exp(-q * n) * n**p * k


CURVES: dict[Law, Curve] = {"usl": _usl, "power_exponential": _power_exponential}


def usl_start(n: Numbers, observed: Numbers) -> Numbers:
    """Values of g, a, b near the best ones, to start the search from."""
    # N/P is linear in 1/g, a/g, b/g; weighted back to the scale of P.
    positive = observed > 0.0
    n, observed = n[positive], observed[positive]
    design = np.stack([np.ones_like(n), n - 1.0, n * (n - 1.0)], axis=1)
    weight = observed**1.5 / n
    inverse, *_ = np.linalg.lstsq(design * weight[:, np.newaxis], n / observed * weight, rcond=None)
    if inverse[0] <= 0.0:
        return np.array([observed[0] / n[0], 0.01, 1e-4])
    scale = float(inverse[0])
    return np.array([1.0 / scale, inverse[1] / scale, inverse[2] / scale])


def power_exponential_start(n: Numbers, observed: Numbers) -> Numbers:
    """Values of k, p, q near the best ones, to start the search from."""
    positive = observed > 0.0
    n, observed = n[positive], observed[positive]
    design = np.stack([np.ones_like(n), np.log(n), -n], axis=1)
    weight = np.sqrt(observed)
    (log_k, p, q), *_ = np.linalg.lstsq(
        design * weight[:, np.newaxis], np.log(observed) * weight, rcond=None
    )
    return np.array([math.exp(log_k), p, q])


def peak_of(law: Law, parameters: Numbers) -> float | None:
    """N* [robots]: sqrt((1-a)/b) or p/q; None where the curve has no maximum beyond one robot."""
    _, second, third = (float(value) for value in parameters)
    if third <= 0.0:
        return None
    peak = math.sqrt(max(0.0, 1.0 - second) / third) if law == "usl" else second / third
    return peak if peak > 1.0 else None


def sharpness_of(law: Law, parameters: Numbers, peak: float) -> float:
    """Sharpness at which `shapes_with_peak_at` gives the fitted curve, whose N* is `peak` > 1.

    inf where the fitted law has a pole.
    """
    _, second, third = (float(value) for value in parameters)
    if law == "power_exponential":
        return math.log(second)
    share = third * (peak - 1.0) ** 2
    return math.log(share / (1.0 - share)) if share < 1.0 else math.inf


def shapes_with_peak_at(law: Law, peak: float, sharpness: Numbers, n: Numbers) -> Numbers:
    """Return the law at sizes n without its factor (g or k), for a fixed peak N* > 1.

    With a fixed peak one parameter is left besides the factor: the sharpness, any real number. The
    larger it is, the more steeply the curve falls on both sides of N*; it is always positive. The
    result has one row for each sharpness.
    """
    if law == "usl":
        # a = 1 - b N*^2; below this b the denominator has no zero
        b = 1.0 / (1.0 + np.exp(-sharpness[:, np.newaxis])) / (peak - 1.0) ** 2
        return _shape_usl(1.0 - b * peak**2, b, n)
    exponent = np.log(n) - n / peak
    steepness: Numbers = np.exp(sharpness[:, np.newaxis])
    return np.asarray(np.exp(steepness * (exponent - exponent.max())))
