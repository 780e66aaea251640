"""IndicatorTest: what the finished runs say about every cell and every comparison of a plan."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import spi
from swarm_logistics_env.spi.estimate import Estimate, Verdict
from swarm_logistics_env.spi.summaries import Interval
from swarm_logistics_env.studies.comparisons import Arm, Comparison, Reference, load_reference
from swarm_logistics_env.studies.metadata import Declaration
from swarm_logistics_env.studies.plan import Plan
from swarm_logistics_env.tasks.task import Outcome

CellKey = tuple[str, str, Arm]  # policy, table, arm
Value = str | float | int | bool | list[float] | None
Times = tuple[NDArray[np.float64], ...]
POWER = 0.8
CONFIDENCE = 0.95
_LEAST_ALPHA = (
    1e-12  # a float cannot hold a confidence much nearer to 1, and an early look may ask for one
)


@dataclass(frozen=True)
class Cell:
    """P of one arm over the seeds that succeeded.

    Attributes:
        performance: P [items], shape (n,), seed by seed.
        problem: why the runs are not complete; None: they are.
        saturated: whether any seed delivered every item, so that P is capped.
        digests: of the runs, seed by seed; equal: the same run.
        published: P of the reference; counted: whether it is one of the reference's cells.
    """

    policy: str
    table: str
    arm: Arm
    performance: NDArray[np.float64]
    problem: str | None
    saturated: bool
    digests: tuple[str | None, ...]
    published: float | None
    counted: bool

    @property
    def mean(self) -> Interval | None:
        """Mean P with its 95 % interval; None without any run."""
        return spi.mean_interval(self.performance) if self.performance.size else None

    @property
    def prediction(self) -> Interval | None:
        """Mean P with the 95 % interval of one further run; None without any run."""
        return spi.prediction_interval(self.performance) if self.performance.size else None

    @property
    def published_inside(self) -> bool | None:
        """Whether the published run lies within the prediction interval; None: cannot be said."""
        prediction = self.prediction
        if self.published is None or prediction is None:
            return None
        if prediction.low is None or prediction.high is None:
            return None
        return prediction.low <= self.published <= prediction.high

    def record(self) -> dict[str, Value]:
        """Return a row of the table of performances; intervals are at 95 %, P in items."""
        setting, mean, prediction = self.arm.setting, self.mean, self.prediction
        return {
            "policy": self.policy,
            "table": self.table,
            "cell": str(setting),
            "factor": setting.name,
            "value": setting.value,
            "onset": setting.onset,
            "published": self.published,
            "counted": self.counted,
            "n_seeds": len(self.performance),
            "mean": mean.value if mean else None,
            "low": mean.low if mean else None,
            "high": mean.high if mean else None,
            "prediction_low": prediction.low if prediction else None,
            "prediction_high": prediction.high if prediction else None,
            "published_inside": self.published_inside,
            "saturated": self.saturated,
            "problem": self.problem,
        }


@dataclass(frozen=True)
class IndicatorTest:
    """The verdict on one comparison.

    Attributes:
        estimate: with the unadjusted verdict; None: blocked.
        adjusted_p, adjusted_verdict: under Holm within the family; None: blocked, or unaffected.
        problem: why it is blocked, e.g. a failed run.
        saturated: it rests on a cell whose P is capped.
        claim: what is claimed: above the threshold (True), not above (False), nothing (None).
        published: the reference's value of the indicator.
        seeds_needed: for 80 % power at the published value; else `no_plan` says why there is none.
    """

    comparison: Comparison
    estimate: Estimate | None
    problem: str | None
    saturated: bool
    claim: bool | None
    published: float | None
    seeds_needed: int | None = None
    no_plan: str | None = None
    adjusted_p: float | None = None
    adjusted_verdict: Verdict | None = None

    @property
    def unaffected(self) -> bool:
        """Whether both conditions gave the same runs: the value is exact, and no evidence."""
        return self.estimate is not None and self.estimate.identical

    @property
    def policy(self) -> str:
        """Label of the policy that is tested."""
        return self.comparison.policy

    @property
    def table(self) -> str:
        """Heading of the report's table that it stands in."""
        return self.comparison.table

    @property
    def indicator(self) -> str:
        """Symbol of the indicator."""
        return self.comparison.indicator

    @property
    def _asks_for_fall(self) -> bool:
        return self.comparison.definition.compares == "policy" and self.claim is False

    @property
    def property_name(self) -> str:
        """What is asked: whether the swarm is scalable, tolerant, ...; whether P falls."""
        return self.comparison.definition.property_name(
            self.comparison.threshold, claimed_below=self.claim is False
        )

    @property
    def claim_text(self) -> str | None:
        """The claim in words; None: nothing is claimed."""
        if self.claim is None:
            return None
        negated = self.claim is False and not self._asks_for_fall
        return f"not {self.property_name}" if negated else self.property_name

    @property
    def decided(self) -> bool:
        """Whether the Holm-adjusted verdict is either way."""
        return self.adjusted_verdict in ("supported", "refuted")

    def on_property(self, verdict: Verdict | None) -> Verdict | None:
        """Turn a verdict on "above the threshold" into one on the property that is named."""
        return self.on_claim(verdict) if self._asks_for_fall else verdict

    def on_claim(self, verdict: Verdict | None) -> Verdict | None:
        """Turn a verdict on "above the threshold" into one on what is claimed."""
        if verdict is None or self.claim is None:
            return None
        if self.claim or verdict == "inconclusive":
            return verdict
        return "supported" if verdict == "refuted" else "refuted"

    def record(self) -> dict[str, Value]:
        """Return a row of the table of indicators."""
        comparison, estimate = self.comparison, self.estimate
        unaffected = "unaffected" if self.unaffected else None
        return {
            "policy": comparison.policy,
            "table": comparison.table,
            "indicator": comparison.indicator,
            "comparison": comparison.label,
            "threshold": comparison.threshold,
            "value": estimate.value if estimate else None,
            "low": estimate.low if estimate else None,
            "high": estimate.high if estimate else None,
            "confidence": estimate.confidence if estimate else None,
            "probability": estimate.probability if estimate else None,
            "p_value": estimate.p_value if estimate else None,
            "p_holm": self.adjusted_p,
            "verdict": unaffected or (estimate.verdict if estimate else None),
            "verdict_holm": unaffected or self.adjusted_verdict,
            "n_seeds": estimate.n_seeds if estimate else None,
            "pairing_correlation": estimate.pairing_correlation if estimate else None,
            "flags": " ".join(estimate.flags) if estimate else None,
            "saturated": self.saturated,
            "claim": self.claim_text,
            "published": self.published,
            "claim_verdict": self._claim_verdict(estimate.verdict if estimate else None),
            "claim_verdict_holm": self._claim_verdict(self.adjusted_verdict),
            "seeds_for_power_80": self.seeds_needed,
            "no_plan": self.no_plan,
            "problem": self.problem,
        }

    def _claim_verdict(self, verdict: Verdict | None) -> str | None:
        if self.claim is not None and self.unaffected:
            return "unaffected"
        return self.on_claim(verdict)


@dataclass(frozen=True)
class StudyResults:
    """All that a report says.

    Attributes:
        plan: of the study.
        cells: every P, in the order of the tables.
        tests: every comparison, in the order of the tables.
        exploratory: seeds that were not declared at the study's start, or a look that was not,
            so the verdicts' error level is not the nominal one.
        outcomes: of the plan's runs, by key, for what P alone does not tell.
        confidence: of the indicators' intervals and verdicts; above 0.95 at a
            declared look, so that all looks together err in 5 %.
        looks: numbers of seeds at which the study was declared to be judged, before its first run.
    """

    plan: Plan
    reference: Reference | None
    cells: tuple[Cell, ...]
    tests: tuple[IndicatorTest, ...]
    exploratory: bool
    outcomes: Mapping[str, Outcome]
    confidence: float = CONFIDENCE
    looks: tuple[int, ...] = ()

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

    @cached_property
    def by_arm(self) -> dict[CellKey, Cell]:
        """Every cell by policy, table and arm."""
        return _by_arm(self.cells)

    def performance_table(self) -> list[dict[str, Value]]:
        """Return P of every cell, one row each."""
        return [cell.record() for cell in self.cells]

    def indicator_table(self) -> list[dict[str, Value]]:
        """Return every comparison with its verdicts, one row each."""
        return [test.record() for test in self.tests]


def judge(
    plan: Plan,
    outcomes: Mapping[str, Outcome],
    declared_seeds: int,
    declared_looks: tuple[int, ...] = (),
    declared_first_seed: int = 0,
) -> StudyResults:
    """Judge a plan by the outcomes of its runs, keyed by run.

    Args:
        declared_seeds: how many seeds were declared before the first run.
        declared_looks: at how many seeds the study was then declared to be judged.
        declared_first_seed: the smallest of the declared seeds.

    A comparison that needs a run which failed or is missing is blocked, and with it the adjusted
    verdicts of its family, whose size would else be too small.
    """
    reference = load_reference(plan.specification.reference)
    cells = tuple(_cell(*key, plan, outcomes, reference) for key in plan.cells)
    by_arm = _by_arm(cells)
    declared = range(declared_first_seed, declared_first_seed + declared_seeds)
    confidence, exploratory = _confidence(plan, Declaration(declared, declared_looks))
    tests = [
        _indicator_test(comparison, by_arm, reference, confidence=confidence, paired=plan.paired)
        for comparison in plan.comparisons
    ]
    return StudyResults(
        plan,
        reference,
        cells,
        _adjusted(tests),
        exploratory=exploratory,
        outcomes=outcomes,
        confidence=confidence,
        looks=declared_looks,
    )


def _confidence(plan: Plan, declared: Declaration) -> tuple[float, bool]:
    if not declared.covers(plan):
        return CONFIDENCE, True
    if not declared.looks:
        return CONFIDENCE, False
    alphas = spi.look_alphas(declared.looks, 1 - CONFIDENCE)
    return 1 - max(alphas[declared.looks.index(len(plan.seeds))], _LEAST_ALPHA), False


def _by_arm(cells: Iterable[Cell]) -> dict[CellKey, Cell]:
    return {(cell.policy, cell.table, cell.arm): cell for cell in cells}


def _cell(
    policy: str,
    table: str,
    arm: Arm,
    plan: Plan,
    outcomes: Mapping[str, Outcome],
    reference: Reference | None,
) -> Cell:
    found = [outcomes.get(arm.condition.run(plan.code, seed).key) for seed in plan.seeds]
    finished = [outcome for outcome in found if outcome is not None]
    succeeded = [outcome for outcome in finished if outcome.error is None]
    failed, missing = len(finished) - len(succeeded), len(found) - len(finished)
    if not plan.paired and finished:
        missing = 0  # such results need not be equally many everywhere
    parts = [
        f"{count} of {len(found)} runs {what}"
        for count, what in ((failed, "failed"), (missing, "missing"))
        if count
    ]
    return Cell(
        policy,
        table,
        arm,
        np.array([outcome.delivered for outcome in succeeded], dtype=np.float64),
        ", ".join(parts) or None,
        any(outcome.all_delivered for outcome in succeeded),
        tuple(outcome.digest for outcome in succeeded),
        published=reference.performance.get(arm.setting) if reference else None,
        counted=reference is not None and arm.setting in reference.cells,
    )


def same_runs(before: Sequence[str | None], after: Sequence[str | None]) -> bool:
    """Return whether two conditions gave the same run at every seed, by the digests of the runs."""
    return list(before) == list(after) and None not in before


def estimate_of(
    comparison: Comparison,
    cells: Mapping[CellKey, Cell],
    *,
    paired: bool,
    confidence: float = CONFIDENCE,
) -> Estimate | str:
    """Return the estimate of a comparison from a study's cells, or why there is none."""
    used = {arm: cells[comparison.policy, comparison.table, arm] for arm in comparison.arms}
    problems = [f"{arm.setting}: {cell.problem}" for arm, cell in used.items() if cell.problem]
    if problems:
        return "; ".join(problems)
    before, after = used[comparison.original], used[comparison.changed]
    try:
        return comparison.estimate(
            lambda arm: used[arm].performance,
            confidence=confidence,
            paired=paired,
            saturated=[arm for arm, cell in used.items() if cell.saturated],
            identical=comparison.removed is None and same_runs(before.digests, after.digests),
        )
    except spi.IndicatorError as error:
        return str(error)


def _indicator_test(
    comparison: Comparison,
    cells: Mapping[CellKey, Cell],
    reference: Reference | None,
    *,
    confidence: float,
    paired: bool,
) -> IndicatorTest:
    found = estimate_of(comparison, cells, paired=paired, confidence=confidence)
    estimate = None if isinstance(found, str) else found
    published = reference.estimate(comparison) if reference else None
    claim = comparison.claim
    if claim is None and reference:
        claim = reference.claims.get(comparison.question)
    test = IndicatorTest(
        comparison,
        estimate,
        found if isinstance(found, str) else None,
        any(cells[comparison.policy, comparison.table, a].saturated for a in comparison.arms),
        claim,
        published.value if published else None,
    )
    if estimate is None or test.published is None:
        return test
    return replace(
        test,
        seeds_needed=spi.seeds_for_power(estimate, test.published, POWER),
        no_plan=spi.no_plan_because(estimate, test.published),
    )


def _adjusted(tests: list[IndicatorTest]) -> tuple[IndicatorTest, ...]:
    families: dict[tuple[str, str], list[int]] = defaultdict(list)
    for index, test in enumerate(tests):
        families[test.comparison.family].append(index)
    adjusted = list(tests)
    for members in families.values():
        estimates = [e for e in (tests[index].estimate for index in members) if e is not None]
        if len(estimates) < len(members):
            continue
        p_values = spi.adjusted_p_values(estimates)
        for index, p, verdict in zip(members, p_values, spi.adjust(estimates)):
            if not tests[index].unaffected:
                adjusted[index] = replace(tests[index], adjusted_p=p, adjusted_verdict=verdict)
    return tuple(adjusted)
