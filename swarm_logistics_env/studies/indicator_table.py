"""The table of indicators: one row for each comparison of a study, with its verdicts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from swarm_logistics_env import spi
from swarm_logistics_env.spi.estimate import Estimate
from swarm_logistics_env.studies.comparisons import Arm, Comparison, Reference
from swarm_logistics_env.studies.performance_table import Columns, Row, table_of
from swarm_logistics_env.studies.plan import Plan

if TYPE_CHECKING:
    import pandas as pd

POWER = 0.8
CONFIDENCE = 0.95
UNAFFECTED = "unaffected"
CellKey = tuple[str, str, Arm]  # policy, table, arm

INDICATORS: Columns = {
    "policy": (object, "label of the policy"),
    "table": (object, "heading of the report's table"),
    "indicator": (object, "its symbol, e.g. FT"),
    "comparison": (object, "the step in words, e.g. N 5 -> 10"),
    "kind": (object, "what differs between the conditions: size, fault, parameter or policy"),
    "factor": (object, "its name: n_robots, a failure mode, a parameter, or a policy"),
    "before": (float, "its value in the original condition, as in the table of performances"),
    "after": (float, "its value in the changed condition"),
    "onset": (float, "when the fault begins [s]"),
    "n_robots": (int, "swarm size N of the original condition"),
    "threshold": (float, "what the indicator is tested against"),
    "value": (float, "the estimate; missing: blocked"),
    "low": (float, "lower limit of its interval"),
    "high": (float, "upper limit of its interval"),
    "confidence": (float, "confidence level of the interval and the verdict"),
    "probability": (float, "confidence that the indicator lies above the threshold, in [0, 1]"),
    "p_value": (float, "two-sided p, unadjusted"),
    "p_holm": (float, "p adjusted after Holm within the family; missing: blocked or unaffected"),
    "verdict": (object, "on above the threshold; unaffected: equal runs, so no evidence"),
    "verdict_holm": (object, "the same after Holm"),
    "n_seeds": (object, "number of seeds; None: blocked"),
    "pairing_correlation": (float, "correlation of the two performances over seeds"),
    "flags": (object, "those of `Estimate`, with blanks between; None: blocked"),
    "saturated": (bool, "whether it rests on a P that is capped"),
    "claim": (object, "what is claimed, e.g. not tolerant; None: nothing"),
    "published": (float, "the reference's value of the indicator"),
    "claim_verdict": (object, "on the claim"),
    "claim_verdict_holm": (object, "the same after Holm"),
    "seeds_for_power_80": (object, "seeds for 80 % power at the published value, on average"),
    "no_plan": (object, "why no such number can be named"),
    "problem": (object, "why the comparison is blocked, e.g. by a failed run"),
    "property": (object, "what is asked, e.g. tolerant, FT > 0.5 or P falls"),
    "answer": (object, "verdict on the property"),
    "answer_holm": (object, "the same after Holm"),
    "claimed": (object, "whether the indicator is claimed to lie above the threshold, or None"),
    "detectable": (float, "distance from the threshold that these seeds find with 80 % power"),
    "least_power": (float, "power of the seeds needed that nine pilots of ten reach"),
    "compared": (object, "the `Comparison`"),
    "estimate": (object, "the `Estimate`; None: blocked"),
}


def indicator_table(
    plan: Plan, cells: Mapping[CellKey, Row], reference: Reference | None, confidence: float
) -> pd.DataFrame:
    """Return every comparison of a plan with its verdicts, in the order of the report.

    A comparison that needs a run which failed or is missing is blocked, and with it the adjusted
    verdicts of its family, whose size would else be too small.

    Args:
        plan: of the study.
        cells: rows of the table of performances.
        reference: published performances and claims; None: there are none.
        confidence: confidence level of intervals and verdicts, in (0, 1).

    Returns:
        A table with the columns of `INDICATORS`.
    """
    found = [
        estimate_of(c, cells, paired=plan.paired, confidence=confidence) for c in plan.comparisons
    ]
    adjusted = _adjusted(plan.comparisons, found)
    rows = []
    for comparison, estimate, (p_holm, holm) in zip(plan.comparisons, found, adjusted):
        rows.append(
            {
                "policy": comparison.policy,
                "table": comparison.table,
                "indicator": comparison.indicator,
                "comparison": comparison.label,
                "kind": comparison.changed.setting.kind,
                "factor": comparison.changed.setting.name,
                "before": comparison.original.setting.value,
                "after": comparison.changed.setting.value,
                "onset": comparison.changed.setting.onset,
                "n_robots": comparison.original.condition.size,
                "threshold": comparison.threshold,
                "p_holm": p_holm,
                "saturated": any(
                    cells[comparison.policy, comparison.table, arm].saturated
                    for arm in comparison.arms
                ),
                "problem": estimate if isinstance(estimate, str) else None,
                "compared": comparison,
                **_verdicts(comparison, reference, estimate, holm),
                **_estimated(comparison, reference, estimate),
            }
        )
    return table_of(rows, INDICATORS)


def estimate_of(
    comparison: Comparison,
    cells: Mapping[CellKey, Row],
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
            lambda arm: used[arm].by_seed,
            confidence=confidence,
            paired=paired,
            saturated=[arm for arm, cell in used.items() if cell.saturated],
            identical=comparison.removed is None and same_runs(before.digests, after.digests),
        )
    except spi.IndicatorError as error:
        return str(error)


def same_runs(before: Sequence[str | None], after: Sequence[str | None]) -> bool:
    """Return whether two conditions gave the same run at every seed, by the digests of the runs."""
    return list(before) == list(after) and None not in before


def _adjusted(
    comparisons: Sequence[Comparison], found: Sequence[Estimate | str]
) -> list[tuple[float | None, str | None]]:
    """Return p and verdict under Holm; None where the family has a blocked comparison."""
    families: dict[tuple[str, str], list[int]] = {}
    for index, comparison in enumerate(comparisons):
        families.setdefault(comparison.family, []).append(index)
    adjusted: list[tuple[float | None, str | None]] = [(None, None)] * len(found)
    for members in families.values():
        estimates = [e for e in (found[index] for index in members) if isinstance(e, Estimate)]
        if len(estimates) < len(members):
            continue
        verdicts = zip(spi.adjusted_p_values(estimates), spi.adjust(estimates))
        for index, estimate, (p, verdict) in zip(members, estimates, verdicts):
            if not estimate.identical:
                adjusted[index] = p, verdict
    return adjusted


def _verdicts(
    comparison: Comparison, reference: Reference | None, estimate: Estimate | str, holm: str | None
) -> dict[str, Any]:
    """Return the columns on what is asked and claimed."""
    claimed = comparison.claim
    if claimed is None and reference:
        claimed = reference.claims.get(comparison.question)
    below = claimed is False
    asked = comparison.definition.property_name(comparison.threshold, claimed_below=below)
    # "P falls" is asked as it is claimed; every other property is one above the threshold.
    asks_for_fall = comparison.definition.compares == "policy" and below
    plain: str | None = None if isinstance(estimate, str) else estimate.verdict
    if isinstance(estimate, Estimate) and estimate.identical:
        plain = holm = UNAFFECTED
    said, said_holm = (_turned(v) if below else v for v in (plain, holm))
    nothing = claimed is None
    return {
        "verdict": plain,
        "verdict_holm": holm,
        "claimed": claimed,
        "claim": None if nothing else asked if claimed or asks_for_fall else f"not {asked}",
        "claim_verdict": None if nothing else said,
        "claim_verdict_holm": None if nothing else said_holm,
        "property": asked,
        "answer": said if asks_for_fall else plain,
        "answer_holm": said_holm if asks_for_fall else holm,
    }


def _turned(verdict: str | None) -> str | None:
    """Turn a verdict on "above the threshold" into one on "not above"."""
    return {"supported": "refuted", "refuted": "supported"}.get(verdict or "", verdict)


def _estimated(
    comparison: Comparison, reference: Reference | None, estimate: Estimate | str
) -> dict[str, Any]:
    """Return the columns on the numbers: the published one, the estimate, and what it takes."""
    known = reference.estimate(comparison) if reference else None
    published = known.value if known else None
    if isinstance(estimate, str):
        return {"published": published}
    needed = least = None
    if published is not None:
        needed = spi.seeds_for_power(estimate, published, POWER)
    if published is not None and needed is not None:
        least = spi.lower_decile_of_power(estimate, published, needed)
    return {
        "published": published,
        "value": estimate.value,
        "low": estimate.low,
        "high": estimate.high,
        "confidence": estimate.confidence,
        "probability": estimate.probability,
        "p_value": estimate.p_value,
        "n_seeds": estimate.n_seeds,
        "pairing_correlation": estimate.pairing_correlation,
        "flags": " ".join(estimate.flags),
        "seeds_for_power_80": needed,
        "no_plan": None if published is None else spi.no_plan_because(estimate, published),
        "detectable": spi.minimum_detectable_effect(estimate, POWER),
        "least_power": least,
        "estimate": estimate,
    }
