"""The two laws of performance against swarm size: curves, starting points, peaks."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

Law = Literal["usl", "power_exponential"]
Curve: TypeAlias = "Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]]"


def _usl(parameters: NDArray[np.float64], n: NDArray[np.float64]) -> NDArray[np.float64]:
    g, a, b = (float(value) for value in parameters)
    return n / (1.0 + a * (n - 1.0) + b * n * (n - 1.0)) * g


def _power_exponential(
    parameters: NDArray[np.float64], n: NDArray[np.float64]
) -> NDArray[np.float64]:
    k, p, q = (float(value) for value in parameters)
    return np.exp(-q * n) * n**p * k


CURVES: dict[Law, Curve] = {"usl": _usl, "power_exponential": _power_exponential}


def usl_start(n: NDArray[np.float64], observed: NDArray[np.float64]) -> NDArray[np.float64]:
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


def power_exponential_start(
    n: NDArray[np.float64], observed: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Values of k, p, q near the best ones, to start the search from."""
    positive = observed > 0.0
    n, observed = n[positive], observed[positive]
    design = np.stack([np.ones_like(n), np.log(n), -n], axis=1)
    weight = np.sqrt(observed)
    (log_k, p, q), *_ = np.linalg.lstsq(
        design * weight[:, np.newaxis], np.log(observed) * weight, rcond=None
    )
    return np.array([math.exp(log_k), p, q])


def peak_of(law: Law, parameters: NDArray[np.float64]) -> float | None:
    """N* [robots]: sqrt((1-a)/b) or p/q; None where the curve has no maximum."""
    _, second, third = (float(value) for value in parameters)
    if law == "usl":
        return math.sqrt((1.0 - second) / third) if third > 0.0 and second < 1.0 else None
    return second / third if third > 0.0 and second > 0.0 else None


def with_peak_at(law: Law, peak: float) -> Curve:
    """The law with its peak held: the two parameters left are the first, and b or p by its log."""

    def curve(free: NDArray[np.float64], n: NDArray[np.float64]) -> NDArray[np.float64]:
        first, rest = float(free[0]), float(np.exp(free[1]))
        if law == "usl":
            return _usl(np.array([first, 1.0 - rest * peak**2, rest]), n)
        return _power_exponential(np.array([first, rest, rest / peak]), n)

    return curve
