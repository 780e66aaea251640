"""Measures of faults besides P: how many robots may fail, how long others stay by the failed."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from swarm_logistics_env import spi
from swarm_logistics_env.spi import Verdict
from swarm_logistics_env.spi.fault_budget import FaultBudget
from swarm_logistics_env.spi.summaries import Interval
from swarm_logistics_env.studies.comparisons import Comparison
from swarm_logistics_env.studies.results import IndicatorTest, StudyResults


@dataclass(frozen=True)
class ModeBudget:
    """How many robots may fail by one mode; `budget` None: blocked.

    `verdict` is that on the m which ended the search; None: none did, or it was not tested.
    """

    comparison: Comparison
    tested: tuple[int, ...]
    budget: FaultBudget | None
    verdict: Verdict | None


@dataclass(frozen=True)
class AnchoringLoad:
    """Time that working robots spent in contact range of failed ones.

    In the paired run with the robots removed there is no failed robot, so it is 0.

    Attributes:
        comparison: of the fault with the robots removed.
        load: mean over seeds with 95 % interval [robot-seconds a run].
        neighbours: the same per failed robot and second of failure: how many working robots stand
            by a failed one at any time.
    """

    comparison: Comparison
    load: Interval
    neighbours: Interval


def fault_budgets(results: StudyResults) -> Iterator[ModeBudget]:
    """Yield the fault budget of every policy, failure mode and onset."""
    groups: dict[object, list[IndicatorTest]] = {}
    for test in results.tests:
        comparison, setting = test.comparison, test.comparison.changed.setting
        if comparison.indicator == "R":
            key = comparison.policy, comparison.table, setting.name, setting.onset
            groups.setdefault(key, []).append(test)
    for tests in groups.values():
        tested = tuple(int(j.comparison.changed.setting.value) for j in tests)
        estimates = {
            m: test.estimate for m, test in zip(tested, tests) if test.estimate is not None
        }
        complete = len(estimates) == len(tests)
        budget = spi.fault_budget(estimates) if complete else None
        last = estimates.get(budget.limit) if budget and budget.limit else None
        yield ModeBudget(tests[0].comparison, tested, budget, last.answer if last else None)


def anchoring_loads(results: StudyResults) -> Iterator[AnchoringLoad]:
    """Yield the anchoring load of every fault whose runs are complete and tell it."""
    for comparison in results.plan.comparisons:
        # Nobody recorded how long robots stood by each other in trials from elsewhere.
        if comparison.removed is None or results.plan.imported_from is not None:
            continue
        outcomes = results.outcomes_of(comparison.changed)
        if outcomes is None:
            continue
        if any(outcome.anchoring_seconds is None for outcome in outcomes):
            continue  # the task does not tell
        seconds = np.array([outcome.anchoring_seconds for outcome in outcomes], dtype=np.float64)
        (fault,) = comparison.changed.condition.faults
        lasted = np.array(
            [
                max(0.0, min(o.ended_at, fault.onset + (fault.duration or math.inf)) - fault.onset)
                for o in outcomes
            ]
        )
        failed = comparison.changed.setting.value * lasted
        shares = np.divide(seconds, failed, out=np.zeros_like(seconds), where=failed > 0)
        yield AnchoringLoad(comparison, spi.mean_interval(seconds), spi.mean_interval(shares))
