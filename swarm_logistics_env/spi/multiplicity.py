"""Error control over a declared family of verdicts, and over looks at a growing study."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .equivalence import Equivalence
from .estimate import DecisionWord, Estimate
from .inputs import IndicatorError, Numbers, between_0_and_1, count, numbers


def holm(p_values: ArrayLike) -> Numbers:
    """Holm's (1979) adjusted p-values, in the order given, shape (k,).

    Rejecting where the adjusted p < alpha keeps the chance of any false rejection in the family
    below alpha, whatever the dependence.

    Raises:
        IndicatorError: The input is not one-dimensional, or a p is outside [0, 1].
    """
    p = numbers("p_values", p_values)
    if p.ndim != 1 or not ((p >= 0.0) & (p <= 1.0)).all():
        raise IndicatorError(f"p_values = {p_values!r}: should be a p in [0, 1] per hypothesis")
    order = np.argsort(p, kind="stable")
    stepped = np.maximum.accumulate(p[order] * np.arange(p.size, 0, -1))
    adjusted = np.empty_like(p)
    adjusted[order] = np.minimum(stepped, 1.0)
    return adjusted


def adjust(estimates: Sequence[Estimate | Equivalence]) -> tuple[DecisionWord, ...]:
    """Verdicts of one declared family (all modes x m of one indicator, say) under Holm.

    In the order given. An estimate without a p (one seed) counts in the family and stays
    open. One of identical runs is no evidence and outside the family: it stays open
    on a threshold, and is equivalent. One that cannot fail is outside the family, too, and
    open; one that its runs make untestable counts in the family, as they might have told. The
    family-wise error is 1 - confidence, of equivalences their alpha.

    Raises:
        IndicatorError: The estimates' confidences differ.
    """
    confidences = sorted({estimate.confidence for estimate in estimates})
    if len(confidences) > 1:
        raise IndicatorError(f"confidence = {confidences} in one family: should be one number")
    return tuple(
        estimate.verdict_for(p) for estimate, p in zip(estimates, adjusted_p_values(estimates))
    )


def adjusted_p_values(estimates: Sequence[Estimate | Equivalence]) -> tuple[float | None, ...]:
    """Holm-adjusted p of every estimate, in the order given; None where there is nothing to test.

    That is so of identical runs, and of an indicator that cannot lie below its threshold.
    """
    tested = [not (e.identical or "cannot_fail" in e.flags) for e in estimates]
    p_values = [1.0 if e.p_value is None else e.p_value for e in estimates]
    adjusted = iter(holm([p for p, is_tested in zip(p_values, tested) if is_tested]))
    return tuple(float(next(adjusted)) if is_tested else None for is_tested in tested)


_REACH = 9.0  # standard deviations that the integration grid covers
_GRID = 801  # its points: the boundaries are then right to five digits


def look_alphas(looks: Sequence[int], alpha: float = 0.05) -> tuple[float, ...]:
    """Two-sided p below which to stop at each declared look, in order.

    Lan and DeMets' (1983) spending of alpha on both sides, in proportion to the seeds (Kim and
    DeMets 1987), so that clear cases stop early. A single look gives (alpha,).

    Args:
        looks: Numbers of seeds at which the study is looked at, rising.
        alpha: Chance of any false verdict over all looks, in (0, 1).

    Raises:
        IndicatorError: No looks, one below 1, not rising; alpha outside (0, 1).
    """
    between_0_and_1("alpha", alpha)
    seeds = [count("look", look) for look in looks]
    if not seeds or any(later <= earlier for earlier, later in pairwise(seeds)):
        raise IndicatorError(f"looks = {tuple(looks)}: should be rising numbers of seeds")
    return _boundaries(tuple(seeds), alpha)


@functools.lru_cache(maxsize=256)
def _boundaries(seeds: tuple[int, ...], alpha: float) -> tuple[float, ...]:
    from scipy.special import ndtr

    # The sum process is Brownian motion on [0, 1]; `mass` is that of paths not stopped so far, on
    # the points of the last look, where they start.
    start = np.zeros(1)
    mass = np.ones(1)
    alphas = []
    information = 0.0
    spent = 0.0
    for look in seeds:
        now = look / seeds[-1]
        step = math.sqrt(now - information)
        to_spend = alpha * now - spent
        boundary = _boundary(start, mass, step, to_spend, _REACH * math.sqrt(now))
        alphas.append(2.0 * float(ndtr(-boundary / math.sqrt(now))))
        points = np.linspace(-boundary, boundary, _GRID)
        steps = (points[:, None] - start) / step
        density = np.exp(-0.5 * steps**2) @ mass / (step * math.sqrt(2.0 * math.pi))
        start = points
        mass = _simpson(points) * density
        information = now
        spent += to_spend
    return tuple(alphas)


def _boundary(start: Numbers, mass: Numbers, step: float, to_spend: float, reach: float) -> float:
    """Where paths are stopped, so that the chance of it is `to_spend`; `reach` where it is less."""
    from scipy.optimize import brentq
    from scipy.special import ndtr

    def excess(boundary: float) -> float:
        """Chance of a first crossing here, over both sides, less what may be spent."""
        return 2.0 * float((mass * ndtr((start - boundary) / step)).sum()) - to_spend

    return reach if excess(reach) >= 0.0 else float(brentq(excess, 0.0, reach))


def _simpson(points: Numbers) -> Numbers:
    weights = np.full(points.size, 2.0)
    weights[1::2] = 4.0
    weights[[0, -1]] = 1.0
    return weights * (float(points[1] - points[0]) / 3.0)


class FaultBudget(NamedTuple):
    """Robots that may fail by one mode, and the m that ended the search.

    At `limit` R > 0 is not supported: refuted, open or not tested. It is None where every m up to
    the largest was supported. The budget is a lower bound but where R is refuted at `limit`.
    """

    robots: int
    limit: int | None


def fault_budget(robustness_by_m: Mapping[int, Estimate]) -> FaultBudget:
    """Largest m with R > 0 supported at every m' <= m, for one failure mode.

    Tested in the order m = 1, 2, 3, ... and stopped at the first that is not supported, or not
    there: a fixed sequence, so the unadjusted verdicts keep the family's error. A swarm that a
    fault does not reach (identical runs) is robust to it exactly: R = m/N.

    Args:
        robustness_by_m: Number of faulty robots m to its estimate of R.

    Raises:
        IndicatorError: No estimates, m below 1, or an estimate of another indicator.
    """
    if not robustness_by_m:
        raise IndicatorError("robustness_by_m is empty: should hold R at m = 1 at least")
    for m, estimate in robustness_by_m.items():
        if m < 1:
            raise IndicatorError(f"m = {m}: should be at least 1")
        if estimate.indicator != "R":
            raise IndicatorError(f"indicator at m = {m} is {estimate.indicator}: should be R")
    robots = 0
    while robots + 1 in robustness_by_m and robustness_by_m[robots + 1].answer == "supported":
        robots += 1
    return FaultBudget(robots, robots + 1 if robots < max(robustness_by_m) else None)
