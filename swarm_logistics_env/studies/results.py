"""StudyResults: what the finished runs of a study say, in cells and verdicts, and as tables."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, TypeAlias

from swarm_logistics_env.spi.inputs import Numbers
from swarm_logistics_env.tasks.task import Outcome

from .comparison import Arm, Comparison
from .declaration import Declaration
from .plan import Place, Plan
from .presets import PAPER, Reference
from .runs import Outcomes
from .until_clear import standing
from .verdict import Cell, Verdict, judge_one, under_holm

if TYPE_CHECKING:
    import pandas as pd

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


# Name to type, where the value stands in the record, and what it means. A number that is missing
# is NaN, a text None.
Columns: TypeAlias = Mapping[str, tuple[type, str, str]]
CELL_COLUMNS: Columns = {
    "policy": (str, "policy", "label of the policy"),
    "table": (str, "table", "heading of the report's table"),
    "cell": (str, "words", "the condition in words, e.g. N = 10"),
    "kind": (str, "arm.setting.kind", "what is varied: size, fault, parameter or policy"),
    "factor": (str, "arm.setting.name", "n_robots, a failure mode, a parameter, or a policy"),
    "value": (float, "arm.setting.value", "N, faulty robots m, or the parameter in its unit"),
    "onset": (float, "arm.setting.onset", "when the fault begins [s]"),
    "n_robots": (int, "arm.case.scenario.n_robots", "swarm size N"),
    "published": (float, "published", "P of the reference"),
    "counted": (bool, "counted", "whether it is one of the cells of the reference's tables"),
    "n_seeds": (int, "n_seeds", "number of runs that succeeded; of several trainings all together"),
    "mean": (float, "mean.value", "mean P, in the unit of the task: items in the warehouse"),
    "low": (float, "mean.low", "lower limit of its interval; missing at one seed"),
    "high": (float, "mean.high", "upper limit of it"),
    "prediction_low": (float, "one_run.low", "lower limit of the interval of a further run"),
    "prediction_high": (float, "one_run.high", "upper limit of it"),
    "confidence": (float, "confidence", "level of both intervals"),
    "published_inside": (bool, "published_inside", "whether the latter holds the published P"),
    "saturated": (bool, "saturated", "whether a run delivered every item, so that P is capped"),
    "stalled": (float, "stalled", "share of runs with less than a quarter of the median P"),
    "problem": (str, "problem", "why runs are missing; missing: they are complete"),
}
VERDICT_COLUMNS: Columns = {
    "policy": (str, "compared.policy", "label of the policy"),
    "table": (str, "compared.table", "heading of the report's table"),
    "indicator": (str, "compared.indicator", "its symbol, e.g. FT"),
    "comparison": (str, "compared.label", "the step in words, e.g. N 5 -> 10"),
    "kind": (str, "after.kind", "what differs: size, fault, parameter or policy"),
    "factor": (str, "after.name", "n_robots, a failure mode, a parameter, or a policy"),
    "before": (float, "compared.original.setting.value", "its value in the original condition"),
    "after": (float, "after.value", "its value in the changed condition"),
    "onset": (float, "after.onset", "when the fault begins [s]"),
    "n_robots": (int, "compared.n_robots", "swarm size N of the original condition"),
    "threshold": (float, "compared.threshold", "what the indicator is tested against"),
    "value": (float, "value", "the estimate; missing: undefined"),
    "low": (float, "estimate.low", "lower limit of its interval"),
    "high": (float, "estimate.high", "upper limit of its interval"),
    "confidence": (float, "estimate.confidence", "level of the interval and the verdict"),
    "probability": (float, "estimate.probability", "confidence that it is above the threshold"),
    "p_value": (float, "estimate.p_value", "two-sided p, unadjusted"),
    "p_holm": (float, "p_holm", "p adjusted after Holm within the family"),
    "verdict": (str, "plain", "on the threshold; unaffected: same runs; untestable: never below"),
    "verdict_holm": (str, "holm", "the same after Holm"),
    "n_seeds": (float, "estimate.n_seeds", "number of seeds; missing: undefined"),
    "n_trainings": (float, "estimate.n_trainings", "trainings over these seeds; missing: one"),
    "stopped_at": (float, "stopped_at", "number of seeds at which it was clear; missing: open"),
    "pairing_correlation": (float, "estimate.pairing_correlation", "of the two P over seeds"),
    "flags": (str, "flags", "marks on the verdict, see `Estimate`, with blanks between"),
    "saturated": (bool, "saturated", "whether it rests on a P that is capped"),
    "property": (str, "asked", "what is asked, e.g. tolerant, FT > 0.5 or P falls"),
    "answer": (str, "answer", "verdict on the property"),
    "answer_holm": (str, "answer_holm", "the same after Holm"),
    "conclusion": (str, "conclusion", "answer_holm; equivalent if inconclusive and P unchanged"),
    "claim": (str, "claim", "what is claimed, e.g. not tolerant; missing: nothing"),
    "published": (float, "published", "the reference's value of the indicator"),
    "claim_verdict": (str, "claim_verdict", "verdict on the claim"),
    "claim_verdict_holm": (str, "claim_verdict_holm", "the same after Holm"),
    "unchanged": (str, "unchanged", "what is tested for equivalence, e.g. P_F within 10 % of P_o"),
    "margin": (float, "equivalence.margin", "the largest change that counts as none"),
    "change": (float, "equivalence.change.value", "P_F / P_o - 1; of FT (P_F - P_S) / P_o"),
    "change_low": (float, "equivalence.change.low", "lower limit of its interval"),
    "change_high": (float, "equivalence.change.high", "upper limit of it"),
    "change_confidence": (float, "equivalence.confidence", "level of it, 1 - 2 alpha"),
    "p_unchanged": (float, "equivalence.p_value", "p of equivalence, or of a change beyond it"),
    "equivalence": (str, "equivalence.verdict", "equivalent, refuted or inconclusive"),
    "equivalence_holm": (str, "equivalence_holm", "the same after Holm"),
    "detectable": (float, "detectable", "distance that these seeds find with 80 % power"),
    "seeds_for_power_80": (float, "seeds_needed", "seeds for 80 % power at the published value"),
    "problem": (str, "problem", "why the comparison is undefined, e.g. by a failed run"),
}


def frame(rows: Sequence[Cell] | Sequence[Verdict], columns: Columns) -> pd.DataFrame:
    """Return cells or verdicts as a table with these columns, for CSV and for users."""
    import pandas as pd

    return pd.DataFrame(
        {
            # Missing texts stay None, which pandas would turn into NaN.
            name: pd.Series([_at(row, path) for row in rows], dtype=kind if kind is float else "O")
            for name, (kind, path, _) in columns.items()
        }
    )


def _at(record: object, path: str) -> object:
    """Return what stands at a path; None where a part of it is missing, as an estimate may be."""
    for name in path.split("."):
        if record is None:
            return None
        record = getattr(record, name)
    return " ".join(record) if isinstance(record, tuple) else record
