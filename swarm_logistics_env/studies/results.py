"""StudyResults: what the finished runs of a study say, as two tables; the seeds it would need."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import spi
from swarm_logistics_env.tasks.task import Outcome

from .comparisons import Arm, Reference, load_reference
from .indicator_table import Finding, findings_of, indicator_table
from .judged_comparisons import CONFIDENCE, CellKey, judge_all
from .metadata import Declaration
from .performance_table import Cell, cells_of, performance_table
from .plan import Plan
from .until_clear import standing

if TYPE_CHECKING:
    import pandas as pd

Times = tuple[NDArray[np.float64], ...]


@dataclass(frozen=True)
class StudyResults:
    """All that a report says.

    Attributes:
        plan: of the study; of one that runs until it is clear, over the seeds that all conditions
            share.
        reference: what the study is compared with; None: nothing.
        performance: P of every policy and condition; its columns are those of
            `performance_table.PERFORMANCE`, with P seed by seed in `by_seed`.
        indicators: every comparison; its columns are those of `indicator_table.INDICATORS`.
        exploratory: whether the seeds are not those that were declared at the study's start, or the
            look is none of them, so that the verdicts' error level is not the nominal one.
        outcomes: of the plan's runs, by key: delivery times and what else P does not tell.
        confidence: confidence level of the indicators' intervals and verdicts; above 0.95 at a
            declared look, so that all looks together err in 5 %.
        looks: numbers of seeds at which comparisons may stop, of a study that runs until it is
            clear.
        late_margin: whether another margin of equivalence was declared before the first run, so
            that the verdicts on it are exploratory.
    """

    plan: Plan
    reference: Reference | None
    performance: pd.DataFrame
    indicators: pd.DataFrame
    exploratory: bool
    outcomes: Mapping[str, Outcome]
    confidence: float = CONFIDENCE
    looks: tuple[int, ...] = ()
    late_margin: bool = False

    @cached_property
    def by_arm(self) -> dict[CellKey, Cell]:
        """The rows of `performance` by policy, table and arm."""
        return _by_arm(self.performance)

    def outcome(self, arm: Arm, seed: int) -> Outcome | None:
        """Return what an arm's run at a seed gave; None: it failed, or is missing."""
        found = self.outcomes.get(arm.condition.run(self.plan.code, seed).key)
        return None if found is None or found.error is not None else found

    def outcomes_of(self, arm: Arm) -> tuple[Outcome, ...] | None:
        """Return an arm's outcomes by seed, or None if one failed, is missing or has no times."""
        found = [self.outcome(arm, seed) for seed in self.plan.seeds]
        complete = tuple(one for one in found if one is not None and one.untimed is None)
        # Unpaired results need not be equally many everywhere.
        is_whole = len(complete) == len(found) or not self.plan.paired
        return complete if complete and is_whole else None

    def times_of(self, arm: Arm) -> Times | None:
        """Return an arm's delivery times [s] seed by seed; None as `outcomes_of`."""
        outcomes = self.outcomes_of(arm)
        return None if outcomes is None else tuple(outcome.delivery_times for outcome in outcomes)


def judge(
    plan: Plan,
    outcomes: Mapping[str, Outcome],
    declared: Declaration | None = None,
) -> StudyResults:
    """Judge a plan by the outcomes of its runs, keyed by run.

    Args:
        plan: of the study.
        outcomes: of its runs, by key.
        declared: what was declared before the first run; None: what the plan says.
    """
    margin = plan.specification.margin
    reference = load_reference(plan.specification.reference)
    exploratory = declared is not None and not declared.covers(plan)
    looks = declared.looks if declared else plan.specification.looks
    found = None
    if plan.specification.until_clear:
        found = standing(plan, outcomes)
        plan = replace(plan, specification=plan.specification.replace(seeds=found.shared_seeds))
    performance = performance_table(plan, outcomes, reference)
    judged = found.judged if found else judge_all(plan, _by_arm(performance))
    return StudyResults(
        plan,
        reference,
        performance,
        indicator_table(judged, reference, margin),
        exploratory=exploratory,
        outcomes=outcomes,
        looks=looks,
        late_margin=declared is not None and declared.margin != margin,
    )


def _by_arm(performance: pd.DataFrame) -> dict[CellKey, Cell]:
    return {(row.policy, row.table, row.arm): row for row in cells_of(performance)}


class Demand(NamedTuple):
    """The number of seeds that one comparison needs.

    Attributes:
        test: the row of the pilot's table of indicators.
        effect: assumed true value of the indicator: the one named, or the published one.
        seeds: for a verdict at that effect with the wanted power on average; None: `problem` says
            why.
        least_power: power that so many seeds reach in nine pilots of ten; None as `seeds`.
        detectable: distance from the threshold that the pilot's own seeds would find.
        problem: why there is no number of seeds.
        unchanged: seeds for the verdict "equivalent" with the wanted power, if the change truly is
            0; None: it is not asked, or the pilot shows no spread.
    """

    test: Finding
    effect: float | None
    seeds: int | None = None
    least_power: float | None = None
    detectable: float | None = None
    problem: str | None = None
    unchanged: int | None = None


def demands(
    results: StudyResults, effect: float | None = None, power: float = 0.8
) -> tuple[Demand, ...]:
    """Return what every comparison of a study needs, from the spread that its runs show.

    Only the spread is taken from them. The effect is to come from elsewhere: the least that
    matters, or the published value; never the one that the pilot itself happened to show.

    Args:
        results: the results of the pilot, from at least two seeds.
        effect: assumed true value of every indicator, in its units; None: the published one.
        power: wanted probability of a verdict, in (0, 1).

    Raises:
        IndicatorError: effect not finite, power outside (0, 1).
    """
    return tuple(_demand(test, effect, power) for test in findings_of(results.indicators))


def _demand(test: Finding, effect: float | None, power: float) -> Demand:
    estimate = test.estimate
    if effect is None and not math.isnan(test.published):
        effect = test.published
    if estimate is None:
        return Demand(test, effect, problem=test.problem)
    detectable = spi.minimum_detectable_effect(estimate, power)
    equivalence = test.equivalence_test
    unchanged = spi.seeds_for_equivalence(equivalence, power) if equivalence else None
    if effect is None:
        no_effect = "no effect is named"
        return Demand(test, None, detectable=detectable, problem=no_effect, unchanged=unchanged)
    seeds = spi.seeds_for_power(estimate, effect, power)
    least = None if seeds is None else spi.lower_decile_of_power(estimate, effect, seeds)
    problem = spi.no_plan_because(estimate, effect)
    return Demand(test, effect, seeds, least, detectable, problem, unchanged)
