"""Sections on faults that begin during the run: resilience, self-repair, deliveries over time,
and who is to blame for what they cost.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.spi.estimate import Estimate
from swarm_logistics_env.spi.self_repair import SelfRepair
from swarm_logistics_env.spi.summaries import Interval
from swarm_logistics_env.studies.comparisons import Comparison
from swarm_logistics_env.studies.fault_measures import (
    RepairCurve,
    mid_run_faults,
    rate_curves,
    resiliences,
    window_of,
)
from swarm_logistics_env.studies.performance_table import Row, groups_of, rows_of
from swarm_logistics_env.studies.results import StudyResults

from . import wording
from .drawing import losses, rates, repairs
from .figures import Figure, slug
from .result_tables import Column, Section, table_section

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
_REPAIR: list[Column] = [
    *_WHO,
    ("self-repair [s, 95 %]", lambda one: _seconds(one.repair)),
    ("p of no loss", lambda one: wording.p_text(one.repair.p_value)),
    ("followed for [s]", lambda one: f"{one.repair.followed:.0f}"),
    ("without a fault [s]", lambda one: f"{one.repair.null_seconds:.0f}"),
    ("reading", lambda one: _reading(one.repair)),
]
_SINGLE: list[Column] = [
    *_WHO,
    ("median [s]", lambda one: _median(one.single[0])),
    ("not back", lambda one: _not_back(one.single[0])),
    ("null's median [s]", lambda one: _median(one.single[1])),
    ("null not back", lambda one: _not_back(one.single[1])),
]
_REPAIR_TEXT = (
    "From the onset to the change point of the delivery counts, pooled over seeds: before it the "
    "swarm delivers a share of what the paired runs with the robots removed do, after it as much. "
    "Interval: every time that an inverted simulated likelihood ratio keeps. p: pairs swapped at "
    "random lose as much; where it is not below 5 %, the time measures noise, as does that of a "
    "pair without a fault that differs in behaviour seeds alone. ∞ and \"censored\": that the loss "
    "lasted to the end of the run is not excluded."
)  # fmt: skip
_SINGLE_TEXT = (
    "Kaplan and Meier's curves of each run's own time, those that are not back censored at the "
    "last moment that could show it. A single run's rate scatters, so what counts is the distance "
    "from the no-fault null, not the times."
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
    repaired = [one for one in found if one.repair is not None]
    problems = [
        f"{one.compared.policy}, {one.compared.changed.setting}: no self-repair time: "
        f"{one.problem}."
        for one in found
        if one.problem
    ]
    yield table_section("Self-repair time", repaired, _REPAIR, _REPAIR_TEXT, *problems)
    yield Section("Deliveries over time", figures=tuple(_rate_figures(results)))
    if repaired:
        singles = {one.compared: one.single for one in repaired}
        yield replace(
            table_section("Self-repair run by run", repaired, _SINGLE, _SINGLE_TEXT),
            figures=tuple(_repair_figures(results, singles)),
        )


def _verdict(estimate: Estimate | None) -> str:
    if estimate is None:
        return "undefined"
    if estimate.identical:
        return wording.UNAFFECTED
    return estimate.verdict + (wording.SATURATED if "capped" in estimate.flags else "")


def _seconds(repair: SelfRepair) -> str:
    seconds = math.inf if repair.seconds is None else repair.seconds
    return wording.bracketed(Interval(seconds, repair.low, repair.high), 0)


def _reading(repair: SelfRepair) -> str:
    if not repair.distinguishable:
        return "not distinguishable from no fault"
    return "censored: a loss to the end is not excluded" if repair.censored else "a loss, and back"


def _median(curve: RepairCurve) -> str:
    median = curve.curve.median()
    return "not reached" if median is None else f"{median:g}"


def _not_back(curve: RepairCurve) -> str:
    return f"{curve.censored} of {curve.total} runs"


def _rate_figures(results: StudyResults) -> Iterator[Figure]:
    """Yield deliveries over time around every fault in mid-run, a figure per failure mode."""
    import pandas as pd

    for (*where, mode, onset), tests in groups_of(mid_run_faults(results), *_ONE_FIGURE):
        curves = {_members(test): rate_curves(results, test.compared) for test in rows_of(tests)}
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
    """Yield the curves of single runs' self-repair times, a figure per failure mode."""
    import pandas as pd

    tests = mid_run_faults(results)
    tests = tests[tests["compared"].isin(list(singles))]
    for (*where, mode, onset), here in groups_of(tests, *_ONE_FIGURE):
        panels = {_members(test): singles[test.compared] for test in rows_of(here)}
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


def _members(test: Row) -> str:
    return f"m = {test.after:g}"


_LOSSES: list[Column] = [
    ("what", lambda row: row.part),
    ("meaning", lambda row: row.meaning),
    ("robots", lambda row: f"{row.robots:.0f}" if wording.is_known(row.robots) else ""),
    (
        "deliveries lost [95 %]",
        lambda row: wording.bracketed(Interval(row.lost, row.low, row.high), 2),
    ),
]


_COLUMNS = (
    *("policy", "fault", "seeds", "capped", "blocked_seconds", "anchoring_seconds"),
    *("group", "part", "meaning", "robots", "lost", "low", "high"),
)


def attribution_section(path: Path) -> Section:
    """Return the table of losses that `blame` wrote (`attribution.csv`), with its figure.

    Raises:
        StudyError: it wrote none such.
    """
    import pandas as pd

    try:
        table = pd.read_csv(path)
        one = next(rows_of(table[list(_COLUMNS)]))
    except (OSError, KeyError, ValueError, StopIteration):
        raise StudyError(
            f"{path} is no table of this version of `blame`: should be written anew by the same "
            "command, or be deleted"
        ) from None
    title = f"{one.policy}: deliveries that {one.fault} costs, per episode"
    over = f"Means over {one.seeds} seeds" if one.seeds > 1 else "Of one seed, without an interval"
    means = (
        f"{over}. The rows of roles sum to all, and so do those of lost "
        "capabilities (Shapley values); robots: how many failed in that role, over all seeds."
    )
    contacts = (
        f"The requested item was held by a failed robot for {one.blocked_seconds:.0f} s, and "
        f"working robots touched failed ones for {one.anchoring_seconds:.0f} robot-seconds."
    )
    lines = [means, contacts]
    if one.capped:
        lines.append(
            f"Capped: in {one.capped} of them every item was delivered without the fault, so it "
            "costs more than is shown. Where items come back (restock) there is no cap."
        )
    figure = Figure(
        slug(path.parent.name),
        f"{title}, with 95 % intervals over {one.seeds} seeds.",
        table,
        1.0 + 0.3 * len(table),
        partial(losses, table=table),
    )
    section = table_section(title, rows_of(table), _LOSSES, *lines)
    return replace(section, figures=(figure,))
