"""Error control over a declared family of verdicts (Holm 1979)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from .equivalence import Equivalence
from .estimate import Estimate, Verdict
from .inputs import IndicatorError, Numbers, numbers


def holm(p_values: ArrayLike) -> Numbers:
    """Holm's adjusted p-values, in the order given, shape (k,).

    Rejecting where the adjusted p < alpha keeps the chance of any false rejection in the family
    below alpha, whatever the dependence.

    Raises:
        IndicatorError: The input is not one-dimensional, or a p is outside [0, 1].
    """
    p = numbers("p_values", p_values)
    if p.ndim != 1:
        raise IndicatorError(f"p_values has shape {p.shape}: should be one p per hypothesis")
    for value in p.tolist():
        if not 0.0 <= value <= 1.0:
            raise IndicatorError(f"p_values holds {value}: should lie in [0, 1]")
    order = np.argsort(p, kind="stable")
    stepped = np.maximum.accumulate(p[order] * np.arange(p.size, 0, -1))
    adjusted = np.empty_like(p)
    adjusted[order] = np.minimum(stepped, 1.0)
    return adjusted


def adjust(estimates: Sequence[Estimate | Equivalence]) -> tuple[Verdict, ...]:
    """Verdicts of one declared family (all modes x m of one indicator, say) under Holm.

    In the order given. An estimate without a p (one seed) counts in the family and stays
    inconclusive. One of identical runs is no evidence and outside the family: it stays inconclusive
    on a threshold, and is equivalent. The family-wise error is 1 - confidence, of equivalences
    their alpha.

    Raises:
        IndicatorError: The estimates' confidences differ.
    """
    confidences = sorted({estimate.confidence for estimate in estimates})
    if len(confidences) > 1:
        raise IndicatorError(f"confidence = {confidences} in one family: should be one number")
    return tuple(
        estimate.verdict_for(p)
        for estimate, p in zip(estimates, adjusted_p_values(estimates), strict=True)
    )


def adjusted_p_values(estimates: Sequence[Estimate | Equivalence]) -> tuple[float | None, ...]:
    """Holm-adjusted p of every estimate, in the order given; None for identical runs."""
    adjusted = iter(
        holm([1.0 if e.p_value is None else e.p_value for e in estimates if not e.identical])
    )
    return tuple(None if e.identical else float(next(adjusted)) for e in estimates)
