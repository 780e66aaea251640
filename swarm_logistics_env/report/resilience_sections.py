"""Sections on faults that begin during the run: resilience, self-repair, deliveries over time."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from functools import partial
from typing import NamedTuple

from swarm_logistics_env.report import wording
from swarm_logistics_env.report.drawing_over_time import TimePanel, rates, repairs
from swarm_logistics_env.report.figures import Figure, slug
from swarm_logistics_env.report.result_tables import Section
from swarm_logistics_env.spi.estimate import Estimate
from swarm_logistics_env.spi.self_repair import SelfRepair
from swarm_logistics_env.spi.summaries import Interval
from swarm_logistics_env.studies.comparisons import Comparison
from swarm_logistics_env.studies.mid_run_faults import (
    RepairCurve,
    Resilience,
    mid_run_faults,
    rate_curves,
    resiliences,
    window_of,
)
from swarm_logistics_env.studies.results import StudyResults


def beyond_resilience(results: StudyResults) -> Iterator[Section]:
    """Yield what there is to say of faults that begin during the run."""
    found = tuple(resiliences(results))
    if not found:
        return
    rows, times, singles, problems = [], [], [], []
    for one in found:
        who = one.comparison.policy, str(one.comparison.changed.setting)
        rows.append((*who, *_index(one.against_removed), *_index(one.against_whole)))
        if one.repair is not None:
            times.append((*who, *_repair(one.repair)))
        if one.single is not None:
            singles.append((*who, *_single(one.single.fault), *_single(one.single.null)))
        if one.problem:
            problems.append(f"{who[0]}, {who[1]}: no self-repair time: {one.problem}.")
    yield Section(
        "Resilience: deliveries after the onset",
        (
            "policy", "fault", "over the removed robots' [95 %]", "above 1",
            "over the whole swarm's [95 %]", "above 1 - m/N",
        ),
        tuple(rows),
        (
            ("Deliveries after the onset over those of the paired reference. Reference with the "
            "robots removed at the onset: fault tolerance local in time; whole swarm: robustness "
            f"local in time. Verdicts unadjusted; {wording.seeds_text(results)}."),
        ),
    )  # fmt: skip
    yield Section(
        "Self-repair time",
        (
            "policy", "fault", "self-repair [s, 95 %]", "p of no loss", "followed for [s]",
            "without a fault [s]", "reading",
        ),
        tuple(times),
        (
            ("From the onset to the change point of the delivery counts, pooled over seeds: before "
            "it the swarm delivers a share of what the paired runs with the robots removed do, "
            "after it as much. Interval: every time that an inverted simulated likelihood ratio "
            "keeps. p: pairs swapped at random lose as much; where it is not below 5 %, the time "
            "measures noise, as does that of a pair without a fault that differs in behaviour "
            "seeds alone. ∞ and \"censored\": that the loss lasted to the end of the run is not "
            "excluded."),
            *problems,
        ),
    )  # fmt: skip
    yield Section("Deliveries over time", figures=tuple(rate_figures(results)))
    if singles:
        yield Section(
            "Self-repair run by run",
            (
                "policy",
                "fault",
                "median [s]",
                "not back",
                "null's median [s]",
                "null not back",
            ),
            tuple(singles),
            (
                (
                    "Kaplan and Meier's curves of each run's own time, those that are not back "
                    "censored at the last moment that could show it. A single run's rate scatters, "
                    "so what counts is the distance from the no-fault null, not the times."
                ),
            ),
            figures=tuple(repair_figures(results, found)),
        )


def _index(estimate: Estimate | None) -> tuple[str, str]:
    if estimate is None:
        return wording.NOTHING, "undefined"
    interval = Interval(estimate.value, estimate.low, estimate.high)
    return wording.bracketed(interval, 3), estimate.verdict


def _repair(repair: SelfRepair) -> tuple[str, ...]:
    seconds = math.inf if repair.seconds is None else repair.seconds
    if not repair.distinguishable:
        reading = "not distinguishable from no fault"
    elif repair.censored:
        reading = "censored: a loss to the end is not excluded"
    else:
        reading = "a loss, and back"
    return (
        wording.bracketed(Interval(seconds, repair.low, repair.high), 0),
        wording.p_text(repair.p_value),
        f"{repair.followed:.0f}",
        f"{repair.null_seconds:.0f}",
        reading,
    )


def _single(curve: RepairCurve) -> tuple[str, str]:
    median = curve.curve.median()
    return (
        "not reached" if median is None else f"{median:g}",
        f"{curve.censored} of {curve.runs} runs",
    )


def repair_figures(results: StudyResults, found: tuple[Resilience, ...]) -> Iterator[Figure]:
    """Yield the curves of single runs' self-repair times, a figure per failure mode."""
    singles = {one.comparison: one.single for one in found if one.single is not None}
    for fault, comparisons in _by_fault(singles):
        panels = tuple(TimePanel(_members(c), singles[c]) for c in comparisons)
        rows = tuple(
            (panel.title, curve.label, *values)
            for panel in panels
            for curve in panel.curves
            for values in zip(*(column.tolist() for column in curve.curve))
        )
        if rows:
            yield Figure(
                slug("self-repair", *fault.names),
                f"{fault.where}: share of runs whose delivery rate is not back yet after failure "
                f"mode {fault.mode} from {fault.onset:g} s, beside pairs of runs without fault "
                "that differ in behaviour seeds alone. Kaplan-Meier with pointwise 95 % intervals "
                f"(Greenwood, log-log); {wording.seeds_text(results)}; a cross where runs are "
                "censored.",
                ("panel", "runs", "seconds", "share_not_back", "low", "high"),
                rows,
                0.6 + 2.1 * len(panels),
                partial(repairs, panels=panels),
            )


def rate_figures(results: StudyResults) -> Iterator[Figure]:
    """Yield deliveries over time around every fault in mid-run, a figure per failure mode."""
    for fault, comparisons in _by_fault(mid_run_faults(results)):
        panels = tuple(TimePanel(_members(c), rate_curves(results, c)) for c in comparisons)
        window = window_of(comparisons[0])
        rows = tuple(
            (panel.title, curve.label, second, *rate)
            for panel in panels
            for curve in panel.curves
            for second, rate in zip(curve.seconds, curve.rates)
        )
        if rows:
            yield Figure(
                slug("deliveries", *fault.names),
                f"{fault.where}: deliveries in the trailing {window:g} s around failure mode "
                f"{fault.mode} from {fault.onset:g} s (dotted line). Mean over "
                f"{wording.seeds_text(results)} with pointwise 95 % t-intervals.",
                ("panel", "runs", "seconds", "deliveries", "low", "high"),
                rows,
                0.6 + 2.3 * len(panels),
                partial(
                    rates,
                    panels=panels,
                    onset=fault.onset,
                    y_label=f"deliveries in {window:g} s",
                ),
            )


class _Fault(NamedTuple):
    """A failure mode and its onset [s], in the swarm that one table is about."""

    policy: str
    table: str
    n_robots: int
    mode: str
    onset: float

    @property
    def names(self) -> tuple[str, ...]:
        return self.policy, self.table, self.mode, f"{self.onset:g}s"

    @property
    def where(self) -> str:
        return f"{self.policy}, {self.table}, N = {self.n_robots}"


def _by_fault(comparisons: Iterable[Comparison]) -> list[tuple[_Fault, list[Comparison]]]:
    groups: dict[_Fault, list[Comparison]] = {}
    for c in comparisons:
        setting = c.changed.setting
        size = c.original.condition.size
        fault = _Fault(c.policy, c.table, size, setting.name, setting.onset)
        groups.setdefault(fault, []).append(c)
    return list(groups.items())


def _members(comparison: Comparison) -> str:
    return f"m = {comparison.changed.setting.value:g}"
