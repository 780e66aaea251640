"""StudyResults: what the finished runs of a study say, in cells and verdicts."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

from swarm_logistics_env.study.questions.comparison import Arm, Comparison
from swarm_logistics_env.study.questions.declaration import Declaration
from swarm_logistics_env.study.questions.plan import CellKey, Plan
from swarm_logistics_env.study.questions.specification import seeds_in_words
from swarm_logistics_env.study.tasks.outcome import Outcome
from swarm_logistics_env.study.tasks.task import Case, Outcomes
from swarm_logistics_env.study.tasks.warehouse_task import RecordedScenario

from .agreement import Agreement, agreements
from .cell import Cell
from .collapses import Collapse, Edge, collapses, edges, untestable
from .columns import CELL_COLUMNS, VERDICT_COLUMNS, frame
from .reference import PAPER, Reference
from .until_clear import LatestLook, latest_look
from .verdict import Verdict, adjust_families, judge_comparison, level_of

if TYPE_CHECKING:
    import pandas as pd


class Subject(NamedTuple):
    """Whose swarm a question is about.

    Attributes:
        policy: its label; empty: the trials name none.
        task: which of a file's tables the trials stand in; empty: it has one, or runs are played.
    """

    policy: str
    task: str

    @property
    def name(self) -> str:
        """Both, behind each other."""
        return ", ".join(filter(None, self))


@dataclass(frozen=True)
class StudyResults:
    """All that a report says.

    Attributes:
        plan: of the study; of one that runs until it is clear, over the seeds that all conditions
            share.
        reference: what the study is compared with; None: nothing.
        cells: P of every policy and condition, over all seeds that it has, in the order of the
            report.
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
    def cells_by_key(self) -> Mapping[CellKey, Cell]:
        """The cells by policy, table and arm."""
        return {(cell.policy, cell.table, cell.arm): cell for cell in self.cells}

    @property
    def policies(self) -> tuple[str, ...]:
        """Labels of the policies that are judged, the baseline first."""
        return tuple(dict.fromkeys(verdict.compared.policy for verdict in self.verdicts))

    @property
    def names_no_policy(self) -> bool:
        """Whether recorded trials name no policy, so that it is called as their file."""
        return bool(self.plan.origin) and self.policies == (self.plan.specification.name,)

    @cached_property
    def subjects(self) -> Mapping[Case, Subject]:
        """Whose swarm each case is about."""
        subjects = {}
        names_no_policy = self.names_no_policy
        for _, _, arm in self.plan.cells:
            scenario = arm.case.scenario
            task = scenario.table if isinstance(scenario, RecordedScenario) else ""
            policy = "" if task and names_no_policy else arm.case.policy.title
            subjects[arm.case] = Subject(policy, task)
        return subjects

    @cached_property
    def on_policies(self) -> tuple[Verdict, ...]:
        """The verdicts on P of a policy and of the first one."""
        return tuple(verdict for verdict in self.verdicts if verdict.compares_policies)

    @cached_property
    def succeeded(self) -> Outcomes:
        """The outcomes of the runs that did not fail, by the key of the case and the seed."""
        return {key: outcome for key, outcome in self.outcomes.items() if outcome.error is None}

    @cached_property
    def timed_outcomes(self) -> Mapping[Arm, tuple[Outcome, ...]]:
        """Outcomes of each arm by seed; none if one failed, is missing or has no times."""
        arms = [*(arm for _, _, arm in self.plan.cells), *self.plan.nulls.values()]
        return {arm: self._timed_outcomes(arm) for arm in dict.fromkeys(arms)}

    def _timed_outcomes(self, arm: Arm) -> tuple[Outcome, ...]:
        seeds = self.plan.seeds
        outcomes = [self.succeeded.get((arm.case.key, seed)) for seed in seeds]
        timed = tuple(
            outcome for outcome in outcomes if outcome is not None and outcome.untimed is None
        )
        # Unpaired results need not be equally many everywhere.
        is_complete = len(timed) == len(seeds) or not self.plan.paired
        return timed if is_complete else ()

    @cached_property
    def cell_table(self) -> pd.DataFrame:
        """The cells, a row each, with the columns `CELL_COLUMNS`."""
        return frame(self.cells, CELL_COLUMNS)

    @cached_property
    def verdict_table(self) -> pd.DataFrame:
        """The verdicts, a row each, with the columns `VERDICT_COLUMNS`."""
        return frame(self.verdicts, VERDICT_COLUMNS)

    @cached_property
    def agreements(self) -> tuple[Agreement, ...]:
        """How near each policy comes to the reference; none without one."""
        return agreements(self.cells)

    @cached_property
    def collapses(self) -> tuple[Collapse, ...]:
        """The conditions whose runs are of two phases."""
        return collapses(self.cells)

    @cached_property
    def untestable(self) -> Mapping[str, Sequence[Cell]]:
        """The conditions with enough runs that were not tested for two phases, by the reason."""
        return untestable(self.cells)

    @cached_property
    def edges(self) -> tuple[Edge, ...]:
        """How near each policy is to its critical size, where one can be told."""
        return tuple(edges(self.cells))

    @property
    def level(self) -> float:
        """The level of most intervals of its verdicts, in (0, 1)."""
        return level_of(self.verdicts)

    @property
    def seeds_text(self) -> str:
        """Over which seeds everything is, e.g. "20 paired seeds (0 to 19)"."""
        seeds = self.plan.seeds
        if not self.plan.paired:
            fewest = min(cell.n_seeds for cell in self.cells)
            count = f"{fewest} to {len(seeds)}" if fewest < len(seeds) else f"{fewest}"
            runs = "run" if count == "1" else "runs"
            return f"{count} unpaired {runs} a condition"
        blocks = self.plan.origin.blocks if self.plan.origin else ()
        if blocks:
            return f"{len(blocks)} paired blocks ({blocks[0]} to {blocks[-1]})"
        fewest = len(seeds)
        if self.looks:  # conditions have as many as were needed
            most = max([fewest, *(cell.n_seeds for cell in self.cells)])
            seeds = range(seeds[0], seeds[0] + most)
        count = "one seed" if len(seeds) == 1 else f"{len(seeds)} paired seeds"
        if fewest < len(seeds):
            count = f"{fewest} to {count}"
        return f"{count} ({seeds_in_words(seeds)})"


def judge(
    plan: Plan,
    outcomes: Outcomes,
    declared: Declaration | None = None,
    look: LatestLook | None = None,
) -> StudyResults:
    """Judge a plan by the outcomes of its runs.

    Args:
        plan: of the study.
        outcomes: of its runs, by the key of the case and the seed.
        declared: what was declared before the first run; None: what the plan says.
        look: the latest look at these outcomes, of a study until it is clear; None: it is computed.
    """
    specification = plan.specification
    # What is published is of the items delivered.
    is_compared = specification.reference and specification.performance is None
    reference = PAPER if is_compared else None
    declared = declared or Declaration.model_validate(specification)
    is_exploratory = not declared.covers(plan)
    verdicts: Iterable[Verdict] = ()
    all_seeds = plan.seeds
    seeds_of = dict[str, int]()
    if specification.until_clear:
        look = look or latest_look(plan, outcomes)
        seeds_of |= look.seeds_of
        plan = replace(plan, specification=specification.replace(seeds=look.shared_seeds))
        verdicts = look.verdicts
    # Recorded conditions need not have the same seeds.
    is_even = plan.paired and plan.origin is None
    cells: dict[CellKey, Cell] = {}
    for policy, table, arm in plan.cells:
        seeds = all_seeds[: seeds_of.get(arm.case.key, len(all_seeds))]
        runs = [outcomes.get((case.key, seed)) for case in arm.case.trainings for seed in seeds]
        cells[policy, table, arm] = Cell.of(
            policy, table, arm, runs, paired=is_even, reference=reference
        )
    if not specification.until_clear:
        verdicts = adjust_families(
            [
                judge_comparison(
                    comparison,
                    _shared_cells(plan, outcomes, comparison)
                    if plan.origin and plan.paired
                    else {
                        arm: cells[comparison.policy, comparison.table, arm]
                        for arm in comparison.arms
                    },
                    paired=plan.paired,
                    margin=specification.margin,
                )
                for comparison in plan.comparisons
            ]
        )
    return StudyResults(
        plan,
        reference,
        tuple(cells.values()),
        tuple(_with_claim(verdict, reference) for verdict in verdicts),
        is_exploratory,
        outcomes,
        declared.looks,
        late_margin=declared.margin != specification.margin,
    )


def _shared_cells(plan: Plan, outcomes: Outcomes, comparison: Comparison) -> dict[Arm, Cell]:
    """Return the cells of a comparison over the seeds that all its arms have."""
    keys = [arm.case.key for arm in comparison.arms]
    shared = [seed for seed in plan.seeds if all((key, seed) in outcomes for key in keys)]
    return {
        arm: Cell.of(
            comparison.policy,
            comparison.table,
            arm,
            [outcomes.get((arm.case.key, seed)) for seed in shared or plan.seeds],
        )
        for arm in comparison.arms
    }


def _with_claim(verdict: Verdict, reference: Reference | None) -> Verdict:
    """Return a verdict with what the study or its reference claims, and what was published."""
    claimed = verdict.compared.claim
    published = None
    if reference:
        estimate = reference.estimate(verdict.compared)
        published = estimate.value if estimate else None
        if claimed is None:
            claimed = reference.claims.get(verdict.compared.question)
    return replace(verdict, claimed=claimed, published=published)
