"""Sections on measures that the paper does not define, and on the looks until it is clear."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial

from swarm_logistics_env import spi
from swarm_logistics_env.spi.estimate import Estimate
from swarm_logistics_env.studies.comparisons import Comparison
from swarm_logistics_env.studies.fault_measures import (
    ModeBudget,
    RepairCurve,
    anchoring_loads,
    fault_budgets,
    mid_run_faults,
    rate_curves,
    resiliences,
    window_of,
)
from swarm_logistics_env.studies.indicator_table import Finding, findings_of
from swarm_logistics_env.studies.judged_comparisons import CONFIDENCE
from swarm_logistics_env.studies.performance_table import groups_of
from swarm_logistics_env.studies.results import StudyResults
from swarm_logistics_env.studies.until_clear import SPENDING

from . import wording
from .drawing import rates, repairs
from .figures import Figure, slug
from .result_tables import Column, Section, table_section

_BUDGET_COLUMNS: list[Column] = [
    ("policy", lambda one: one.compared.policy),
    ("failure mode", lambda one: _mode(one)),
    ("N", lambda one: str(one.compared.original.condition.size)),
    ("m tested", lambda one: ", ".join(map(str, one.tested))),
    ("robots that may fail", lambda one: _may_fail(one)),
]
_LOAD_TEXT = (
    "Time that working robots spend in contact range of failed ones; in the paired "
    "run with the same robots removed it is 0. The last column is the load per "
    "failed robot and second of failure."
)
_LOAD_COLUMNS: list[Column] = [
    ("policy", lambda one: one.compared.policy),
    ("fault", lambda one: str(one.compared.changed.setting)),
    ("robot-seconds a run [95 %]", lambda one: wording.bracketed(one.load, 1)),
    ("robots by a failed one [95 %]", lambda one: wording.bracketed(one.neighbours, 3)),
]


def budget_sections(results: StudyResults) -> Iterator[Section]:
    """Yield how many robots may fail by each mode, where R was asked."""
    budgets = list(fault_budgets(results))
    text = (
        "The largest m with R > 0 supported at every m' up to it, tested in order, with unadjusted "
        "verdicts: the sequence is fixed, so the error stays below 5 %. "
        f"Over {wording.seeds_text(results)}."
    )
    if budgets:
        yield table_section("Fault budget", budgets, _BUDGET_COLUMNS, text)


def load_sections(results: StudyResults) -> Iterator[Section]:
    """Yield how long robots stay by failed ones, where that is known."""
    loads = list(anchoring_loads(results))
    if loads:
        yield table_section("Anchoring load", loads, _LOAD_COLUMNS, _LOAD_TEXT)


def _mode(one: ModeBudget) -> str:
    setting = one.compared.changed.setting
    return setting.name + (f" from {setting.onset:g} s" if setting.onset else "")


def _may_fail(one: ModeBudget) -> str:
    if one.budget is None:
        return "blocked: runs are missing"
    robots, limit = one.budget
    if limit is None:
        return f"at least {robots}"
    if limit not in one.tested:
        return f"{robots} shown; m = {limit} was not tested"
    # Whether more are refuted or only unknown differs for whoever has to decide.
    return f"{robots}; m = {limit} {one.verdict}"


def look_sections(results: StudyResults) -> Iterator[Section]:
    """Yield the looks of a study that runs until it is clear."""
    if results.plan.specification.until_clear:
        yield _stops(results)


def _stops(results: StudyResults) -> Section:
    """Return the looks of a study that runs until it is clear, and what stopped at each."""
    stopped = Counter(results.indicators["stopped_at"].dropna())
    total = len(results.indicators)
    alphas = spi.look_alphas(results.looks, 1 - CONFIDENCE, spending=SPENDING)
    columns: list[Column] = [
        ("seeds", lambda look: str(look[0])),
        ("p below, alone", lambda look: f"{look[1]:.4f}"),
        ("level of intervals", lambda look: wording.percent(1 - look[1])),
        ("stopped here", lambda look: str(stopped[look[0]])),
    ]
    return table_section(
        "Looks, until it is clear",
        zip(results.looks, alphas),
        columns,
        "Declared before the first run. Alpha is spent over the looks in proportion to the seeds, "
        "and Holm's procedure steps down at each look, so that a comparison stops once its verdict "
        "stands; the intervals hold over all looks together with 95 %.",
        f"{stopped.total()} of {total} comparisons stopped. P and the further measures are over "
        f"the {len(results.plan.seeds)} seeds that all conditions share.",
    )


_WHO: list[Column] = [
    ("policy", lambda one: one.compared.policy),
    ("fault", lambda one: str(one.compared.changed.setting)),
]
_RESILIENCE: list[Column] = [
    *_WHO,
    ("over the removed robots' [95 %]", lambda one: wording.bracketed(one.against_removed, 3)),
    ("above 1", lambda one: _verdict(one.against_removed)),
    ("over the whole swarm's [95 %]", lambda one: wording.bracketed(one.against_whole, 3)),
    ("above 1 - m/N", lambda one: _verdict(one.against_whole)),
]
_SINGLE: list[Column] = [
    *_WHO,
    ("median [s]", lambda one: _median(one.single[0])),
    ("not back", lambda one: _not_back(one.single[0])),
    ("null's median [s]", lambda one: _median(one.single[1])),
    ("null not back", lambda one: _not_back(one.single[1])),
]
_SINGLE_TEXT = (
    "Until the first window in which a run delivers as much again as the paired run with the "
    "robots removed; those that never do are censored (Kaplan and Meier). Deliveries scatter, so "
    "what counts is the distance from the null: pairs without a fault that differ in behaviour."
)


def resilience_sections(results: StudyResults) -> Iterator[Section]:
    """Yield what there is to say of faults that begin during the run."""
    found = list(resiliences(results))
    if not found:
        return
    yield table_section(
        "Resilience: deliveries after the onset",
        found,
        _RESILIENCE,
        "Deliveries after the onset over those of the paired reference. Reference with the robots "
        "removed at the onset: fault tolerance local in time; whole swarm: robustness local in "
        f"time. Verdicts unadjusted; {wording.seeds_text(results)}.",
    )
    repaired = [one for one in found if one.single]
    problems = [
        f"{one.compared.policy}, {one.compared.changed.setting}: no time to come back: "
        f"{one.problem}."
        for one in found
        if one.problem
    ]
    yield Section("Deliveries over time", figures=tuple(_rate_figures(results)))
    singles = {one.compared: one.single for one in repaired}
    yield replace(
        table_section("Time to come back", repaired, _SINGLE, _SINGLE_TEXT, *problems),
        figures=tuple(_repair_figures(results, singles)),
    )


def _verdict(estimate: Estimate | None) -> str:
    if estimate is None:
        return "undefined"
    if estimate.identical:
        return wording.UNAFFECTED
    return estimate.verdict + (wording.SATURATED if "capped" in estimate.flags else "")


def _median(curve: RepairCurve) -> str:
    median = curve.curve.median()
    return "not reached" if median is None else f"{median:g}"


def _not_back(curve: RepairCurve) -> str:
    return f"{curve.censored} of {curve.total} runs"


def _rate_figures(results: StudyResults) -> Iterator[Figure]:
    """Yield deliveries over time around every fault in mid-run, a figure per failure mode."""
    import pandas as pd

    for (*where, mode, onset), tests in groups_of(mid_run_faults(results), *_ONE_FIGURE):
        curves = {
            _members(test): rate_curves(results, test.compared) for test in findings_of(tests)
        }
        data = pd.concat(curves, names=["panel"]).reset_index(level="panel")
        window = window_of(tests["compared"].iloc[0])
        if not data.empty:
            yield Figure(
                slug("deliveries", *where[:2], mode, f"{onset:g}s"),
                f"{_where(*where)}: deliveries in the trailing {window:g} s around failure mode "
                f"{mode} from {onset:g} s (dotted line). Mean over {wording.seeds_text(results)} "
                "with pointwise 95 % t-intervals.",
                data,
                0.6 + 2.3 * len(curves),
                partial(rates, panels=curves, onset=onset, y_label=f"deliveries in {window:g} s"),
            )


def _repair_figures(
    results: StudyResults, singles: Mapping[Comparison, tuple[RepairCurve, ...]]
) -> Iterator[Figure]:
    """Yield the curves of single runs' times to come back, a figure per failure mode."""
    import pandas as pd

    tests = mid_run_faults(results)
    tests = tests[tests["compared"].isin(list(singles))]
    for (*where, mode, onset), here in groups_of(tests, *_ONE_FIGURE):
        panels = {_members(test): singles[test.compared] for test in findings_of(here)}
        rows = [
            (title, curve.runs, *point)
            for title, curves in panels.items()
            for curve in curves
            for point in zip(*curve.curve)
        ]
        if rows:
            yield Figure(
                slug("self-repair", *where[:2], mode, f"{onset:g}s"),
                f"{_where(*where)}: share of runs whose delivery rate is not back yet after "
                f"failure mode {mode} from {onset:g} s, beside pairs of runs without fault that "
                "differ in behaviour seeds alone. Kaplan-Meier with pointwise 95 % intervals "
                f"(Greenwood, log-log); {wording.seeds_text(results)}; a cross where runs are "
                "censored.",
                pd.DataFrame(rows, columns=_REPAIR_DATA),
                0.6 + 2.1 * len(panels),
                partial(repairs, panels=panels),
            )


_ONE_FIGURE = ("policy", "table", "n_robots", "factor", "onset")
_REPAIR_DATA = ["panel", "runs", "seconds", "share_not_back", "low", "high"]


def _where(policy: str, table: str, n_robots: int) -> str:
    return f"{policy}, {table}, N = {n_robots}"


def _members(test: Finding) -> str:
    return f"m = {test.after:g}"
