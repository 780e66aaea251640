"""StudyResults: what the finished runs of a study say, as two tables."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import spi
from swarm_logistics_env.studies.comparisons import Arm, Reference, load_reference
from swarm_logistics_env.studies.indicator_table import CONFIDENCE, CellKey, indicator_table
from swarm_logistics_env.studies.metadata import Declaration
from swarm_logistics_env.studies.performance_table import Row, performance_table, rows_of
from swarm_logistics_env.studies.plan import Plan
from swarm_logistics_env.tasks.task import Outcome

if TYPE_CHECKING:
    import pandas as pd

Times = tuple[NDArray[np.float64], ...]
# A float cannot hold a confidence level much nearer to 1, and an early look may ask for one.
_LEAST_ALPHA = 1e-12


@dataclass(frozen=True)
class StudyResults:
    """All that a report says.

    Attributes:
        plan: of the study.
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
    """

    plan: Plan
    reference: Reference | None
    performance: pd.DataFrame
    indicators: pd.DataFrame
    exploratory: bool
    outcomes: Mapping[str, Outcome]
    confidence: float = CONFIDENCE
    looks: tuple[int, ...] = ()

    @cached_property
    def by_arm(self) -> dict[CellKey, Row]:
        """The rows of `performance` by policy, table and arm."""
        return _by_arm(self.performance)

    def outcomes_of(self, arm: Arm) -> tuple[Outcome, ...] | None:
        """Return an arm's outcomes by seed; None where one failed, is missing or has no times."""
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
    declared_seeds: int,
    declared_looks: tuple[int, ...] = (),
    declared_first_seed: int = 0,
) -> StudyResults:
    """Judge a plan by the outcomes of its runs, keyed by run.

    Args:
        plan: of the study.
        outcomes: of its runs, by key.
        declared_seeds: how many seeds were declared before the first run.
        declared_looks: at how many seeds the study was then declared to be judged.
        declared_first_seed: the smallest of the declared seeds.
    """
    reference = load_reference(plan.specification.reference)
    declared = range(declared_first_seed, declared_first_seed + declared_seeds)
    confidence, exploratory = _confidence(plan, Declaration(declared, declared_looks))
    performance = performance_table(plan, outcomes, reference)
    return StudyResults(
        plan,
        reference,
        performance,
        indicator_table(plan, _by_arm(performance), reference, confidence),
        exploratory=exploratory,
        outcomes=outcomes,
        confidence=confidence,
        looks=declared_looks,
    )


def _by_arm(performance: pd.DataFrame) -> dict[CellKey, Row]:
    return {(row.policy, row.table, row.arm): row for row in rows_of(performance)}


def _confidence(plan: Plan, declared: Declaration) -> tuple[float, bool]:
    """Return the confidence level of the verdicts, and whether they are exploratory."""
    if not declared.covers(plan):
        return CONFIDENCE, True
    if not declared.looks:
        return CONFIDENCE, False
    alphas = spi.look_alphas(declared.looks, 1 - CONFIDENCE)
    return 1 - max(alphas[declared.looks.index(len(plan.seeds))], _LEAST_ALPHA), False
