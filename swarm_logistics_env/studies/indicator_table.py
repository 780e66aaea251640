"""The table of indicators: one row for each comparison of a study, with its verdicts."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

from swarm_logistics_env import spi
from swarm_logistics_env.spi.definitions import Factor
from swarm_logistics_env.spi.equivalence import Equivalence
from swarm_logistics_env.spi.estimate import Estimate

from .comparisons import Comparison, Reference
from .judged_comparisons import Judged
from .performance_table import columns_of, records_of, table_of

if TYPE_CHECKING:
    import pandas as pd

POWER = 0.8
UNAFFECTED = "unaffected"


@dataclass(frozen=True, eq=False)
class Finding:
    """One comparison with its verdicts; a number that is missing is NaN."""

    policy: Annotated[str, "label of the policy"]
    table: Annotated[str, "heading of the report's table"]
    indicator: Annotated[str, "its symbol, e.g. FT"]
    comparison: Annotated[str, "the step in words, e.g. N 5 -> 10"]
    kind: Annotated[Factor, "what differs between the conditions: size, fault, parameter or policy"]
    factor: Annotated[str, "its name: n_robots, a failure mode, a parameter, or a policy"]
    before: Annotated[float, "its value in the original condition, as in the table of performances"]
    after: Annotated[float, "its value in the changed condition"]
    onset: Annotated[float, "when the fault begins [s]"]
    n_robots: Annotated[int, "swarm size N of the original condition"]
    threshold: Annotated[float, "what the indicator is tested against"]
    value: Annotated[float, "the estimate; missing: blocked"]
    low: Annotated[float, "lower limit of its interval"]
    high: Annotated[float, "upper limit of its interval"]
    confidence: Annotated[float, "confidence level of the interval and the verdict"]
    probability: Annotated[
        float,
        "confidence that the indicator lies above the threshold, in [0, 1]",
    ]
    p_value: Annotated[float, "two-sided p, unadjusted"]
    p_holm: Annotated[
        float,
        "p adjusted after Holm within the family; missing: blocked or unaffected",
    ]
    verdict: Annotated[
        str | None,
        "whether it lies above the threshold; unaffected: equal runs, no evidence",
    ]
    verdict_holm: Annotated[str | None, "the same after Holm"]
    n_seeds: Annotated[int | None, "number of seeds; None: blocked"]
    stopped_at: Annotated[
        int | None,
        "number of seeds at which it was clear; None: open, or seeds are fixed",
    ]
    pairing_correlation: Annotated[float, "correlation of the two performances over seeds"]
    flags: Annotated[str, "marks on the verdict, see `Estimate`, with blanks between"]
    saturated: Annotated[bool, "whether it rests on a P that is capped"]
    claim: Annotated[str | None, "what is claimed, e.g. not tolerant; None: nothing"]
    published: Annotated[float, "the reference's value of the indicator"]
    claim_verdict: Annotated[str | None, "verdict on the claim"]
    claim_verdict_holm: Annotated[str | None, "the same after Holm"]
    unchanged: Annotated[str | None, "what is tested for equivalence, e.g. P_F within 10 % of P_o"]
    margin: Annotated[float, "the largest change that counts as none, as a share of P_o"]
    change: Annotated[float, "relative change, e.g. P_F / P_o - 1; of FT (P_F - P_S) / P_o"]
    change_low: Annotated[float, "lower limit of its interval, of level 1 - 2 alpha"]
    change_high: Annotated[float, "upper limit of it"]
    p_unchanged: Annotated[
        float,
        "p of equivalence; of a larger change p of its being beyond the margin",
    ]
    equivalence: Annotated[str | None, "verdict on unchanged: equivalent, refuted or inconclusive"]
    equivalence_holm: Annotated[str | None, "the same after Holm"]
    seeds_for_power_80: Annotated[
        int | None,
        "seeds for 80 % power at the published value, on average",
    ]
    no_plan: Annotated[str | None, "why no such number can be named"]
    problem: Annotated[str | None, "why the comparison is blocked, e.g. by a failed run"]
    property: Annotated[str, "what is asked, e.g. tolerant, FT > 0.5 or P falls"]
    answer: Annotated[str | None, "verdict on the property"]
    answer_holm: Annotated[str | None, "the same after Holm"]
    conclusion: Annotated[
        str | None,
        "answer_holm, but equivalent if that is inconclusive and P unchanged",
    ]
    claimed: Annotated[
        bool | None,
        "whether the indicator is claimed to lie above the threshold, or None",
    ]
    detectable: Annotated[
        float,
        "distance from the threshold that these seeds find with 80 % power",
    ]
    least_power: Annotated[float, "power that so many seeds keep in at least nine pilots of ten"]
    compared: Annotated[Comparison, "the `Comparison`"]
    estimate: Annotated[Estimate | None, "the `Estimate`; None: blocked"]
    equivalence_test: Annotated[Equivalence | None, "the `Equivalence`; None: blocked or not asked"]


INDICATORS = columns_of(Finding)
_OF_ESTIMATE = (
    "value", "low", "high", "confidence", "probability", "p_value", "n_seeds",
    "pairing_correlation",
)  # fmt: skip


def indicator_table(
    judged: Iterable[Judged], reference: Reference | None, margin: float
) -> pd.DataFrame:
    """Return every comparison of a study with its verdicts, in the order given.

    Args:
        judged: the comparisons with their verdicts.
        reference: published performances and claims; None: there are none.
        margin: of equivalence, as a share of P_o.

    Returns:
        A table with the columns of `INDICATORS`.
    """
    rows = []
    for one in judged:
        comparison = one.comparison
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
                "p_holm": one.p_holm,
                "saturated": one.saturated,
                "stopped_at": one.stopped_at,
                "problem": one.estimate if isinstance(one.estimate, str) else None,
                "compared": comparison,
                **_verdicts(one, reference),
                **_estimated(comparison, reference, one.estimate),
                **_unchanged(one, margin),
            }
        )
    return table_of(rows, INDICATORS)


def findings_of(table: pd.DataFrame) -> Iterator[Finding]:
    """Yield the rows of a table of indicators."""
    return records_of(table, Finding)


def _verdicts(one: Judged, reference: Reference | None) -> dict[str, Any]:
    """Return the columns on what is asked and claimed."""
    comparison, estimate = one.comparison, one.estimate
    holm: str | None = one.verdict_holm
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
    answer_holm = said_holm if asks_for_fall else holm
    open_but_unchanged = answer_holm == "inconclusive" and one.equivalence_holm == "equivalent"
    return {
        "verdict": plain,
        "verdict_holm": holm,
        "claimed": claimed,
        "claim": None if nothing else asked if claimed or asks_for_fall else f"not {asked}",
        "claim_verdict": None if nothing else said,
        "claim_verdict_holm": None if nothing else said_holm,
        "property": asked,
        "answer": said if asks_for_fall else plain,
        "answer_holm": answer_holm,
        "conclusion": "equivalent" if open_but_unchanged else answer_holm,
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
        return {"published": published, "flags": ""}
    needed = least = None
    if published is not None:
        needed = spi.seeds_for_power(estimate, published, POWER)
    if published is not None and needed is not None:
        least = spi.lower_decile_of_power(estimate, published, needed)
    return {
        "published": published,
        **{name: getattr(estimate, name) for name in _OF_ESTIMATE},
        "flags": " ".join(estimate.flags),
        "seeds_for_power_80": needed,
        "no_plan": None if published is None else spi.no_plan_because(estimate, published),
        "detectable": spi.minimum_detectable_effect(estimate, POWER),
        "least_power": least,
        "estimate": estimate,
    }


def _unchanged(one: Judged, margin: float) -> dict[str, Any]:
    """Return the columns on equivalence."""
    asked = one.comparison.definition.unchanged(margin)
    found = one.equivalence
    if asked is None or found is None:
        return {"unchanged": asked}
    return {
        "unchanged": asked,
        "margin": margin,
        "change": found.change.value,
        "change_low": found.change.low,
        "change_high": found.change.high,
        "p_unchanged": found.p_value,
        "equivalence": found.verdict,
        "equivalence_holm": one.equivalence_holm,
        "equivalence_test": found,
    }
