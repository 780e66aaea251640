"""StudyResults: what the finished runs of a study say, as two tables."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.studies.comparisons import Arm, Reference, load_reference
from swarm_logistics_env.studies.indicator_table import indicator_table
from swarm_logistics_env.studies.judged_comparisons import (
    CONFIDENCE,
    CellKey,
    Level,
    judge_all,
    level_at,
)
from swarm_logistics_env.studies.metadata import Declaration
from swarm_logistics_env.studies.performance_table import Row, performance_table, rows_of
from swarm_logistics_env.studies.plan import Plan
from swarm_logistics_env.studies.until_clear import standing
from swarm_logistics_env.tasks.task import Outcome

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
        exploratory: whether seeds were added that were not declared at the study's start, or a
            look that was not, so that the verdicts' error level is not the nominal one.
        outcomes: of the plan's runs, by key: delivery times and what else P does not tell.
        confidence: confidence level of the indicators' intervals and verdicts; above 0.95 at a
            declared look, so that all looks together err in 5 %.
        looks: numbers of seeds at which the study was declared to be judged, before its first run.
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
    def by_arm(self) -> dict[CellKey, Row]:
        """The rows of `performance` by policy, table and arm."""
        return _by_arm(self.performance)

    def outcomes_of(self, arm: Arm) -> tuple[Outcome, ...] | None:
        """Return an arm's outcomes by seed, or None if one failed, is missing or has no times."""
        runs = (arm.condition.run(self.plan.code, seed) for seed in self.plan.seeds)
        found = [self.outcomes.get(run.key) for run in runs]
        if not self.plan.paired:  # such results need not be equally many everywhere
            found = [outcome for outcome in found if outcome is not None]
        complete = tuple(
            outcome
            for outcome in found
            if outcome is not None and outcome.error is None and outcome.untimed is None
        )
        return complete if complete and len(complete) == len(found) else None

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
    looks = declared.looks if declared else ()
    level, found = Level(), None
    if plan.specification.until_clear:
        found = standing(plan, outcomes)
        plan = replace(plan, specification=plan.specification.replace(seeds=found.shared_seeds))
    elif looks and not exploratory:
        level = level_at(looks.index(len(plan.seeds)), looks)
    performance = performance_table(plan, outcomes, reference)
    judged = found.judged if found else judge_all(plan, _by_arm(performance), level)
    return StudyResults(
        plan,
        reference,
        performance,
        indicator_table(judged, reference, margin),
        exploratory=exploratory,
        outcomes=outcomes,
        confidence=level.confidence,
        looks=looks,
        late_margin=declared is not None and declared.margin != margin,
    )


def _by_arm(performance: pd.DataFrame) -> dict[CellKey, Row]:
    return {(row.policy, row.table, row.arm): row for row in rows_of(performance)}
