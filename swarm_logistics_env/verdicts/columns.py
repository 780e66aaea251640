"""The tables of cells and verdicts, for CSV and for users."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, TypeAlias

from .cell import Cell
from .verdict import Verdict

if TYPE_CHECKING:
    import pandas as pd

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
