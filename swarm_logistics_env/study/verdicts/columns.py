"""The tables of cells and verdicts, for CSV and for users."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, TypeAlias, TypeVar

from .cell import Cell
from .verdict import Verdict

if TYPE_CHECKING:
    import pandas as pd

Judged = TypeVar("Judged")
# Name to type, source of a row's value, and what it means. The source is a path of attributes, of
# which any may be None, or a function. A number that is missing is NaN, a text None.
Columns: TypeAlias = Mapping[str, tuple[type, str | Callable[[Judged], object], str]]
# Mean over runs of what `ContactMeasures` has.
_CONTACT_MEASURES = {
    "overlap_share": "share of steps with two robots that overlap by more than 10 mm",
    "mean_acceleration": "mean acceleration of a robot [m/s2]",
    "p95_acceleration": "95th percentile of it, mean over runs [m/s2]",
}
# Mean over runs of what `OrderMeasures` has; the columns are there where any cell has a value.
ORDER_MEASURES = {
    "on_time": "orders that were served by their due time",
    "share_on_time": "share of the orders that were served by their due time",
    "mean_tardiness": "mean time by which orders were late [s]",
    "p95_tardiness": "95th percentile of it [s]",
    "longest_queue": "most orders that were open or waited at a time",
    "turned_away": "orders that found no item or no room to wait",
    "put_back": "requests that were not served within `request_timeout`",
    "all_served": "share of runs with nothing left to serve at the end, so that P is capped",
}
CELL_COLUMNS: Columns[Cell] = {
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
    "standstill": (
        float,
        partial(Cell.mean_of, measure="longest_standstill"),
        "longest time without a delivery, mean over runs [s]; missing: no times are known",
    ),
    "standstills": (
        float,
        partial(Cell.mean_of, measure="stands_still"),
        "share of runs without a delivery in their last fifth; missing: no times are known",
    ),
    "phases_untestable": (
        str,
        lambda cell: cell.phases.untestable or None,
        "why the runs were not tested for two phases; missing: they were",
    ),
    "contacts": (
        float,
        "contacts.value",
        "mean contacts per robot-minute [1/min], see `ContactMeasures`; missing: not counted",
    ),
    "contacts_low": (float, "contacts.low", "lower limit of its interval"),
    "contacts_high": (float, "contacts.high", "upper limit of it"),
    "fast_contacts": (
        float,
        "fast_contacts",
        "share of them that close faster than 1 m/s; missing: none",
    ),
    **{
        measure: (float, partial(Cell.mean_of, measure=measure), meaning)
        for measure, meaning in (_CONTACT_MEASURES | ORDER_MEASURES).items()
    },
    "problem": (str, "problem", "why runs are missing; missing: they are complete"),
}
VERDICT_COLUMNS: Columns[Verdict] = {
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
    "p_value": (
        float,
        "estimate.p_value",
        "two-sided p, unadjusted, which holds for stalls and collapses that may be hidden",
    ),
    "p_seen": (
        float,
        "estimate.p_seen",
        "the same of the runs seen alone, by the rule of the interval",
    ),
    "p_holm": (float, "p_adjusted", "p adjusted after Holm within the family"),
    "verdict": (
        str,
        "on_threshold.plain",
        "decision on the threshold; unaffected: the same runs; untestable: `flags` says why",
    ),
    "verdict_holm": (str, "on_threshold.adjusted", "the same after Holm"),
    "n_seeds": (float, "estimate.n_seeds", "number of seeds; missing: undefined"),
    "n_trainings": (float, "estimate.n_trainings", "trainings over these seeds; missing: one"),
    "collapsed": (
        float,
        "estimate.collapsed.number",
        "trainings that collapsed under the change; missing: one training",
    ),
    "collapsed_upper": (
        float,
        "estimate.collapsed.upper",
        "95 % upper limit of the share that collapses",
    ),
    "stopped_at": (float, "stopped_at", "number of seeds at which it was clear; missing: open"),
    "pairing_correlation": (float, "estimate.pairing_correlation", "of the two P over seeds"),
    "flags": (
        str,
        lambda verdict: " ".join(verdict.flags),
        "marks on the verdict, see `Estimate`, with blanks between",
    ),
    "saturated": (bool, "saturated", "whether it rests on a P that is capped"),
    "property": (
        str,
        "property_name",
        "the property in question, e.g. tolerant, FT > 0.5 or P falls",
    ),
    "answer": (str, "on_property.plain", "decision on the property"),
    "answer_holm": (str, "on_property.adjusted", "the same after Holm"),
    "conclusion": (str, "conclusion", "answer_holm; equivalent if that is open and P unchanged"),
    "in_words": (
        str,
        "in_words",
        "the verdict in a word or two, as every table has it, e.g. P within 10 %",
    ),
    "claim": (str, "claim", "what is claimed, e.g. not tolerant; missing: nothing"),
    "published": (float, "published", "the reference's value of the indicator"),
    "claim_verdict": (str, "on_claim.plain", "decision on the claim"),
    "claim_verdict_holm": (str, "on_claim.adjusted", "the same after Holm"),
    "unchanged": (
        str,
        "equivalence_name",
        "what is tested for equivalence, e.g. P_F within 10 % of P_o",
    ),
    "margin": (float, "equivalence.margin", "the largest change that counts as none"),
    "change": (float, "equivalence.change.value", "P_F / P_o - 1; of FT (P_F - P_S) / P_o"),
    "change_low": (float, "equivalence.change.low", "lower limit of its interval"),
    "change_high": (float, "equivalence.change.high", "upper limit of it"),
    "change_confidence": (float, "equivalence.confidence", "level of it, 1 - 2 alpha"),
    "p_unchanged": (float, "equivalence.p_value", "p of equivalence, or of a change beyond it"),
    "equivalence": (
        str,
        "on_equivalence.plain",
        "whether P is unchanged: equivalent, refuted or open",
    ),
    "equivalence_holm": (str, "on_equivalence.adjusted", "the same after Holm"),
    "detectable": (float, "detectable", "distance that these seeds find with 80 % power"),
    "seeds_for_power_80": (float, "seeds_needed", "seeds for 80 % power at the published value"),
    "problem": (str, "problem", "why the comparison is undefined, e.g. by a failed run"),
}


def frame(rows: Sequence[Judged], columns: Columns[Judged]) -> pd.DataFrame:
    """Return cells or verdicts as a table with these columns, for CSV and for users."""
    import pandas as pd

    table = pd.DataFrame(
        {
            # Missing texts stay None, which pandas would turn into NaN.
            name: pd.Series(
                [_value(row, source) for row in rows], dtype=kind if kind is float else "O"
            )
            for name, (kind, source, _) in columns.items()
        }
    )
    without_values = [name for name in table if name in ORDER_MEASURES and table[name].isna().all()]
    return table.drop(columns=without_values)


def _value(row: Judged, source: str | Callable[[Judged], object]) -> object:
    if not isinstance(source, str):
        return source(row)
    value: object = row
    for name in source.split("."):
        value = None if value is None else getattr(value, name)
    return value
