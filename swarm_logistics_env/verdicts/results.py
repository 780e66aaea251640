"""StudyResults: what the finished runs of a study say, in cells and verdicts."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property

from swarm_logistics_env.questions.comparison import Arm, Comparison
from swarm_logistics_env.questions.declaration import Declaration
from swarm_logistics_env.questions.plan import Place, Plan
from swarm_logistics_env.spi.inputs import Numbers
from swarm_logistics_env.tasks.task import Outcome, Outcomes

from .cell import Cell
from .reference import PAPER, Reference
from .until_clear import standing
from .verdict import Verdict, judge_one, under_holm

Times = tuple[Numbers, ...]


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
        damage: which stored runs are damaged and left out, in a sentence; None: none.
    """

    plan: Plan
    reference: Reference | None
    cells: tuple[Cell, ...]
    verdicts: tuple[Verdict, ...]
    exploratory: bool
    outcomes: Outcomes = field(repr=False)
    looks: tuple[int, ...] = ()
    late_margin: bool = False
    damage: str | None = None

    @cached_property
    def by_place(self) -> dict[Place, Cell]:
        """The cells by policy, table and arm."""
        return {(one.policy, one.table, one.arm): one for one in self.cells}

    def cells_of(self, comparison: Comparison) -> dict[Arm, Cell]:
        """Return the cells of a comparison's arms."""
        where = comparison.policy, comparison.table
        return {arm: self.by_place[*where, arm] for arm in comparison.arms}

    @property
    def policies(self) -> tuple[str, ...]:
        """Labels of the policies that are judged, the baseline first."""
        return tuple(dict.fromkeys(one.compared.policy for one in self.verdicts))

    def outcome(self, arm: Arm, seed: int) -> Outcome | None:
        """Return what an arm's run at a seed gave; None: it failed, or is missing."""
        found = self.outcomes.get((arm.case.key, seed))
        return None if found is None or found.error is not None else found

    def outcomes_of(self, arm: Arm) -> tuple[Outcome, ...]:
        """Return an arm's outcomes by seed; none if one failed, is missing or has no times."""
        found = [self.outcome(arm, seed) for seed in self.plan.seeds]
        complete = tuple(one for one in found if one is not None and one.untimed is None)
        # Unpaired results need not be equally many everywhere.
        is_whole = len(complete) == len(found) or not self.plan.paired
        return complete if is_whole else ()

    def times_of(self, arm: Arm) -> Times:
        """Return an arm's delivery times [s] seed by seed; none as `outcomes_of`."""
        return tuple(outcome.delivery_times for outcome in self.outcomes_of(arm))


def judge(plan: Plan, outcomes: Outcomes, declared: Declaration | None = None) -> StudyResults:
    """Judge a plan by the outcomes of its runs.

    Args:
        plan: of the study.
        outcomes: of its runs, by the key of the case and the seed.
        declared: what was declared before the first run; None: what the plan says.
    """
    margin = plan.specification.margin
    reference = PAPER if plan.specification.reference else None
    declared = declared or Declaration.model_validate(plan.specification)
    exploratory = not declared.covers(plan)
    verdicts: Iterable[Verdict] = ()
    if plan.specification.until_clear:
        found = standing(plan, outcomes)
        plan = replace(plan, specification=plan.specification.replace(seeds=found.shared_seeds))
        verdicts = found.verdicts
    cells: dict[Place, Cell] = {}
    for place in plan.cells:
        cases = place[-1].case.trainings
        runs = [outcomes.get((one.key, seed)) for one in cases for seed in plan.seeds]
        cells[place] = Cell.of(*place, runs, paired=plan.paired, reference=reference)
    if not plan.specification.until_clear:
        judged = []
        for each in plan.comparisons:
            of_arms = {arm: cells[each.policy, each.table, arm] for arm in each.arms}
            judged.append(judge_one(each, of_arms, paired=plan.paired, margin=margin))
        verdicts = under_holm(judged)
    return StudyResults(
        plan,
        reference,
        tuple(cells.values()),
        tuple(_beside(reference, one) for one in verdicts),
        exploratory,
        outcomes,
        declared.looks,
        late_margin=declared.margin != margin,
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
