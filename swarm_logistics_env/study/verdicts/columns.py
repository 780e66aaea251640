"""The tables of cells and verdicts, for CSV and for users."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, TypeAlias, TypeVar

from swarm_logistics_env.spi import Equivalence, Estimate

from .cell import Cell
from .verdict import Verdict

if TYPE_CHECKING:
    import pandas as pd

Judged = TypeVar("Judged")
# Name to type, what gives the value of a row, and what it means. A number that is missing is NaN, a
# text None.
Columns: TypeAlias = Mapping[str, tuple[type, Callable[[Judged], object], str]]
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
    "policy": (str, lambda cell: cell.policy, "label of the policy"),
    "table": (str, lambda cell: cell.table, "heading of the report's table"),
    "cell": (str, lambda cell: cell.words, "the condition in words, e.g. N = 10"),
    "kind": (
        str,
        lambda cell: cell.arm.setting.kind,
        "what is varied: size, fault, parameter or policy",
    ),
    "factor": (
        str,
        lambda cell: cell.arm.setting.name,
        "n_robots, a failure mode, a parameter, or a policy",
    ),
    "value": (
        float,
        lambda cell: cell.arm.setting.value,
        "N, faulty robots m, or the parameter in its unit",
    ),
    "onset": (float, lambda cell: cell.arm.setting.onset, "when the fault begins [s]"),
    "n_robots": (int, lambda cell: cell.arm.case.scenario.n_robots, "swarm size N"),
    "published": (float, lambda cell: cell.published, "P of the reference"),
    "counted": (
        bool,
        lambda cell: cell.counted,
        "whether it is one of the cells of the reference's tables",
    ),
    "n_seeds": (
        int,
        lambda cell: cell.n_seeds,
        "number of runs that succeeded; of several trainings all together",
    ),
    "mean": (
        float,
        lambda cell: cell.mean.value,
        "mean P, in the unit of the task: items in the warehouse",
    ),
    "low": (float, lambda cell: cell.mean.low, "lower limit of its interval; missing at one seed"),
    "high": (float, lambda cell: cell.mean.high, "upper limit of it"),
    "prediction_low": (
        float,
        lambda cell: cell.one_run.low,
        "lower limit of the interval of a further run",
    ),
    "prediction_high": (float, lambda cell: cell.one_run.high, "upper limit of it"),
    "confidence": (float, lambda cell: cell.confidence, "level of both intervals"),
    "published_inside": (
        bool,
        lambda cell: cell.published_inside,
        "whether the latter holds the published P",
    ),
    "saturated": (
        bool,
        lambda cell: cell.saturated,
        "whether a run delivered every item, so that P is capped",
    ),
    "stalled": (
        float,
        lambda cell: cell.stalled,
        "share of runs with less than a quarter of the median P",
    ),
    "standstill": (
        float,
        lambda cell: cell.mean_of("longest_standstill"),
        "longest time without a delivery, mean over runs [s]; missing: no times are known",
    ),
    "standstills": (
        float,
        lambda cell: cell.mean_of("stands_still"),
        "share of runs without a delivery in their last fifth; missing: no times are known",
    ),
    "phases_untestable": (
        str,
        lambda cell: cell.phases.untestable or None,
        "why the runs were not tested for two phases; missing: they were",
    ),
    "contacts": (
        float,
        lambda cell: cell.contacts.value,
        "mean contacts per robot-minute [1/min], see `ContactMeasures`; missing: not counted",
    ),
    "contacts_low": (float, lambda cell: cell.contacts.low, "lower limit of its interval"),
    "contacts_high": (float, lambda cell: cell.contacts.high, "upper limit of it"),
    "fast_contacts": (
        float,
        lambda cell: cell.fast_contacts,
        "share of them that close faster than 1 m/s; missing: none",
    ),
    "overlap_share": (
        float,
        lambda cell: cell.mean_of("overlap_share"),
        "share of steps with two robots that overlap by more than 10 mm",
    ),
    "mean_acceleration": (
        float,
        lambda cell: cell.mean_of("mean_acceleration"),
        "mean acceleration of a robot [m/s2]",
    ),
    "p95_acceleration": (
        float,
        lambda cell: cell.mean_of("p95_acceleration"),
        "95th percentile of it, mean over runs [m/s2]",
    ),
    **{
        measure: (float, partial(Cell.mean_of, measure=measure), meaning)
        for measure, meaning in ORDER_MEASURES.items()
    },
    "problem": (str, lambda cell: cell.problem, "why runs are missing; missing: they are complete"),
}


def _of_estimate(value: Callable[[Estimate], object]) -> Callable[[Verdict], object]:
    return lambda verdict: None if verdict.estimate is None else value(verdict.estimate)


def _of_equivalence(value: Callable[[Equivalence], object]) -> Callable[[Verdict], object]:
    return lambda verdict: None if verdict.equivalence is None else value(verdict.equivalence)


VERDICT_COLUMNS: Columns[Verdict] = {
    "policy": (str, lambda verdict: verdict.compared.policy, "label of the policy"),
    "table": (str, lambda verdict: verdict.compared.table, "heading of the report's table"),
    "indicator": (str, lambda verdict: verdict.compared.indicator, "its symbol, e.g. FT"),
    "comparison": (
        str,
        lambda verdict: verdict.compared.label,
        "the step in words, e.g. N 5 -> 10",
    ),
    "kind": (
        str,
        lambda verdict: verdict.after.kind,
        "what differs: size, fault, parameter or policy",
    ),
    "factor": (
        str,
        lambda verdict: verdict.after.name,
        "n_robots, a failure mode, a parameter, or a policy",
    ),
    "before": (
        float,
        lambda verdict: verdict.compared.original.setting.value,
        "its value in the original condition",
    ),
    "after": (float, lambda verdict: verdict.after.value, "its value in the changed condition"),
    "onset": (float, lambda verdict: verdict.after.onset, "when the fault begins [s]"),
    "n_robots": (
        int,
        lambda verdict: verdict.compared.n_robots,
        "swarm size N of the original condition",
    ),
    "threshold": (
        float,
        lambda verdict: verdict.compared.threshold,
        "what the indicator is tested against",
    ),
    "value": (float, lambda verdict: verdict.value, "the estimate; missing: undefined"),
    "low": (float, _of_estimate(lambda estimate: estimate.low), "lower limit of its interval"),
    "high": (float, _of_estimate(lambda estimate: estimate.high), "upper limit of its interval"),
    "confidence": (
        float,
        _of_estimate(lambda estimate: estimate.confidence),
        "level of the interval and the verdict",
    ),
    "probability": (
        float,
        _of_estimate(lambda estimate: estimate.probability),
        "confidence that it is above the threshold",
    ),
    "p_value": (
        float,
        _of_estimate(lambda estimate: estimate.p_value),
        "two-sided p, unadjusted, which holds for stalls and collapses that may be hidden",
    ),
    "p_seen": (
        float,
        _of_estimate(lambda estimate: estimate.p_seen),
        "the same of the runs seen alone, by the rule of the interval",
    ),
    "p_holm": (
        float,
        lambda verdict: verdict.p_adjusted,
        "p adjusted after Holm within the family",
    ),
    "verdict": (
        str,
        lambda verdict: verdict.on_threshold.plain,
        "decision on the threshold; unaffected: the same runs; untestable: `flags` says why",
    ),
    "verdict_holm": (str, lambda verdict: verdict.on_threshold.adjusted, "the same after Holm"),
    "n_seeds": (
        float,
        _of_estimate(lambda estimate: estimate.n_seeds),
        "number of seeds; missing: undefined",
    ),
    "n_trainings": (
        float,
        _of_estimate(lambda estimate: estimate.n_trainings),
        "trainings over these seeds; missing: one",
    ),
    "collapsed": (
        float,
        _of_estimate(lambda estimate: estimate.collapsed and estimate.collapsed.number),
        "trainings that collapsed under the change; missing: one training",
    ),
    "collapsed_upper": (
        float,
        _of_estimate(lambda estimate: estimate.collapsed and estimate.collapsed.upper),
        "95 % upper limit of the share that collapses",
    ),
    "stopped_at": (
        float,
        lambda verdict: verdict.stopped_at,
        "number of seeds at which it was clear; missing: open",
    ),
    "pairing_correlation": (
        float,
        _of_estimate(lambda estimate: estimate.pairing_correlation),
        "of the two P over seeds",
    ),
    "flags": (
        str,
        lambda verdict: " ".join(verdict.flags),
        "marks on the verdict, see `Estimate`, with blanks between",
    ),
    "saturated": (
        bool,
        lambda verdict: verdict.saturated,
        "whether it rests on a P that is capped",
    ),
    "property": (
        str,
        lambda verdict: verdict.property_name,
        "the property in question, e.g. tolerant, FT > 0.5 or P falls",
    ),
    "answer": (str, lambda verdict: verdict.on_property.plain, "decision on the property"),
    "answer_holm": (str, lambda verdict: verdict.on_property.adjusted, "the same after Holm"),
    "conclusion": (
        str,
        lambda verdict: verdict.conclusion,
        "answer_holm; equivalent if that is open and P unchanged",
    ),
    "in_words": (
        str,
        lambda verdict: verdict.in_words,
        "the verdict in a word or two, as every table has it, e.g. open, < 10 %",
    ),
    "claim": (
        str,
        lambda verdict: verdict.claim,
        "what is claimed, e.g. not tolerant; missing: nothing",
    ),
    "published": (
        float,
        lambda verdict: verdict.published,
        "the reference's value of the indicator",
    ),
    "claim_verdict": (
        str,
        lambda verdict: verdict.on_claim and verdict.on_claim.plain,
        "decision on the claim",
    ),
    "claim_verdict_holm": (
        str,
        lambda verdict: verdict.on_claim and verdict.on_claim.adjusted,
        "the same after Holm",
    ),
    "unchanged": (
        str,
        lambda verdict: verdict.equivalence_name,
        "what is tested for equivalence, e.g. P_F within 10 % of P_o",
    ),
    "margin": (
        float,
        _of_equivalence(lambda equivalence: equivalence.margin),
        "the largest change that counts as none",
    ),
    "change": (
        float,
        _of_equivalence(lambda equivalence: equivalence.change.value),
        "P_F / P_o - 1; of FT (P_F - P_S) / P_o",
    ),
    "change_low": (
        float,
        _of_equivalence(lambda equivalence: equivalence.change.low),
        "lower limit of its interval",
    ),
    "change_high": (
        float,
        _of_equivalence(lambda equivalence: equivalence.change.high),
        "upper limit of it",
    ),
    "change_confidence": (
        float,
        _of_equivalence(lambda equivalence: equivalence.confidence),
        "level of it, 1 - 2 alpha",
    ),
    "p_unchanged": (
        float,
        _of_equivalence(lambda equivalence: equivalence.p_value),
        "p of equivalence, or of a change beyond it",
    ),
    "equivalence": (
        str,
        lambda verdict: verdict.on_equivalence and verdict.on_equivalence.plain,
        "whether P is unchanged: equivalent, refuted or open",
    ),
    "equivalence_holm": (
        str,
        lambda verdict: verdict.on_equivalence and verdict.on_equivalence.adjusted,
        "the same after Holm",
    ),
    "detectable": (
        float,
        lambda verdict: verdict.detectable,
        "distance that these seeds find with 80 % power",
    ),
    "seeds_for_power_80": (
        float,
        lambda verdict: verdict.seeds_needed,
        "seeds for 80 % power at the published value",
    ),
    "problem": (
        str,
        lambda verdict: verdict.problem,
        "why the comparison is undefined, e.g. by a failed run",
    ),
}


def frame(rows: Sequence[Judged], columns: Columns[Judged]) -> pd.DataFrame:
    """Return cells or verdicts as a table with these columns, for CSV and for users."""
    import pandas as pd

    table = pd.DataFrame(
        {
            # Missing texts stay None, which pandas would turn into NaN.
            name: pd.Series([value(row) for row in rows], dtype=kind if kind is float else "O")
            for name, (kind, value, _) in columns.items()
        }
    )
    without_values = [name for name in table if name in ORDER_MEASURES and table[name].isna().all()]
    return table.drop(columns=without_values)
