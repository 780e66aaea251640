"""How many robots may fail: the largest m up to which robustness is supported throughout."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from .estimate import Estimate
from .inputs import IndicatorError


class FaultBudget(NamedTuple):
    """Robots that may fail by one mode, and the m that ended the search.

    `limit` is None where every m tested was supported: the budget is then a lower bound.
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
    while robots + 1 in robustness_by_m:
        if robustness_by_m[robots + 1].answer != "supported":
            return FaultBudget(robots, robots + 1)
        robots += 1
    untested = robots < max(robustness_by_m)
    return FaultBudget(robots, robots + 1 if untested else None)
