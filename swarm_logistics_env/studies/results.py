"""StudyResults: what the finished runs of a study say, in cells and verdicts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.tasks.task import Outcome

from .comparison import Arm, Reference, load_reference
from .declaration import Declaration
from .plan import Plan
from .runs import Outcomes
from .until_clear import standing
from .verdict import Cell, Verdict, judge_one, under_holm

Times = tuple[NDArray[np.float64], ...]
Place = tuple[str, str, Arm]  # of a cell: policy, table, arm


@dataclass(frozen=True)
class StudyResults:
    """All that a report says.

    Attributes:
        plan: of the study; of one that runs until it is clear, over the seeds that all conditions
            share.
        reference: what the study is compared with; None: nothing.
        cells: P of every policy and condition, in the order of the report.
        verdicts: on every comparison, in the order of the plan.
        exploratory: whether the seeds are not those that were declared at the study's start, or the
            look is none of them, so that the verdicts' error level is not the nominal one.
        outcomes: of the plan's runs: delivery times and what else P does not tell.
        looks: numbers of seeds at which comparisons may stop, of a study that runs until it is
            clear.
        late_margin: whether another margin of equivalence was declared before the first run, so
            that the verdicts on it are exploratory.
    """

    plan: Plan
    reference: Reference | None
    cells: tuple[Cell, ...]
    verdicts: tuple[Verdict, ...]
    exploratory: bool
    outcomes: Outcomes = field(repr=False)
    looks: tuple[int, ...] = ()
    late_margin: bool = False

    @cached_property
    def by_place(self) -> dict[Place, Cell]:
        """The cells by policy, table and arm."""
        return {(one.policy, one.table, one.arm): one for one in self.cells}

    @property
    def policies(self) -> tuple[str, ...]:
        """Labels of the policies that are judged, the baseline first."""
        return tuple(dict.fromkeys(one.compared.policy for one in self.verdicts))

    def outcome(self, arm: Arm, seed: int) -> Outcome | None:
        """Return what an arm's run at a seed gave; None: it failed, or is missing."""
        found = self.outcomes.get((arm.case.key, seed))
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


def judge(plan: Plan, outcomes: Outcomes, declared: Declaration | None = None) -> StudyResults:
    """Judge a plan by the outcomes of its runs.

    Args:
        plan: of the study.
        outcomes: of its runs, by the key of the case and the seed.
        declared: what was declared before the first run; None: what the plan says.
    """
    margin = plan.specification.margin
    reference = load_reference(plan.specification.reference)
    looks = declared.looks if declared else plan.specification.looks
    exploratory = declared is not None and not declared.covers(plan)
    verdicts: Sequence[Verdict] = ()
    if plan.specification.until_clear:
        found = standing(plan, outcomes)
        plan = replace(plan, specification=plan.specification.replace(seeds=found.shared_seeds))
        verdicts = found.verdicts
    cells = tuple(
        Cell.of(
            policy,
            table,
            arm,
            [outcomes.get((arm.case.key, seed)) for seed in plan.seeds],
            paired=plan.paired,
            reference=reference,
        )
        for policy, table, arm in plan.cells
    )
    by_table: dict[tuple[str, str], dict[Arm, Cell]] = {}
    for one in cells:
        by_table.setdefault((one.policy, one.table), {})[one.arm] = one
    verdicts = verdicts or [
        *under_holm(
            [
                judge_one(
                    each, by_table[each.policy, each.table], paired=plan.paired, margin=margin
                )
                for each in plan.comparisons
            ]
        )
    ]
    return StudyResults(
        plan,
        reference,
        cells,
        tuple(_beside(reference, one) for one in verdicts),
        exploratory=exploratory,
        outcomes=outcomes,
        looks=looks,
        late_margin=declared is not None and declared.margin != margin,
    )


def _beside(reference: Reference | None, verdict: Verdict) -> Verdict:
    """Return a verdict with what the study or its reference claims, and what was published."""
    claimed, published = verdict.compared.claim, None
    if reference:
        known = reference.estimate(verdict.compared)
        published = known.value if known else None
        if claimed is None:
            claimed = reference.claims.get(verdict.compared.question)
    return replace(verdict, claimed=claimed, published=published)
