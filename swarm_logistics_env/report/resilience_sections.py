"""Sections on faults that begin during the run: resilience, self-repair, deliveries over time."""

from __future__ import annotations

import math
from collections.abc import Iterator

from swarm_logistics_env.report import drawing_over_time, wording
from swarm_logistics_env.report.drawing import Draw
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
    rows, repairs, singles, problems = [], [], [], []
    for one in found:
        who = one.comparison.policy, str(one.comparison.changed.setting)
        rows.append((*who, *_index(one.against_removed), *_index(one.against_whole)))
        if one.repair is not None:
            repairs.append((*who, *_repair(one.repair)))
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
        tuple(repairs),
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
    groups: dict[tuple[str, str, str, float], list[Resilience]] = {}
    for one in found:
        if one.single is not None:
            groups.setdefault(_fault_of(one.comparison), []).append(one)
    for (policy, table, mode, onset), members in groups.items():
        panels = [
            drawing_over_time.RepairPanel(
                f"m = {one.comparison.changed.setting.value:g}", one.single
            )
            for one in members
            if one.single is not None
        ]
        rows = tuple(
            (panel.title, curve.label, *values)
            for panel in panels
            for curve in panel.curves
            for values in zip(*(column.tolist() for column in curve.curve))
        )
        if not rows:
            continue
        swarm = members[0].comparison.original.condition.size
        yield Figure(
            slug("self-repair", policy, table, mode, f"{onset:g}s"),
            f"{policy}, {table}, N = {swarm}: share of runs whose delivery rate is not back yet "
            f"after failure mode {mode} from {onset:g} s, beside pairs of runs without fault that "
            "differ in behaviour seeds alone. Kaplan-Meier with pointwise 95 % intervals "
            f"(Greenwood, log-log); {wording.seeds_text(results)}; a cross where runs are "
            "censored.",
            ("panel", "runs", "seconds", "share_not_back", "low", "high"),
            rows,
            0.6 + 2.1 * len(panels),
            _draw_repairs(panels),
        )


def _draw_repairs(panels: list[drawing_over_time.RepairPanel]) -> Draw:
    return lambda canvas: drawing_over_time.repairs(canvas, panels)


def _fault_of(comparison: Comparison) -> tuple[str, str, str, float]:
    setting = comparison.changed.setting
    return comparison.policy, comparison.table, setting.name, setting.onset


def rate_figures(results: StudyResults) -> Iterator[Figure]:
    """Yield deliveries over time around every fault in mid-run, a figure per failure mode."""
    groups: dict[tuple[str, str, str, float], list[Comparison]] = {}
    for comparison in mid_run_faults(results):
        groups.setdefault(_fault_of(comparison), []).append(comparison)
    for (policy, table, mode, onset), comparisons in groups.items():
        panels = [
            drawing_over_time.RatePanel(
                f"m = {comparison.changed.setting.value:g}", rate_curves(results, comparison)
            )
            for comparison in comparisons
        ]
        window = window_of(comparisons[0])
        rows = tuple(
            (panel.title, curve.label, second, rate.value, rate.low, rate.high)
            for panel in panels
            for curve in panel.curves
            for second, rate in zip(curve.seconds, curve.rates)
        )
        if not rows:
            continue
        swarm = comparisons[0].original.condition.size
        yield Figure(
            slug("deliveries", policy, table, mode, f"{onset:g}s"),
            f"{policy}, {table}, N = {swarm}: deliveries in the trailing {window:g} s around "
            f"failure mode {mode} from {onset:g} s (dotted line). Mean over "
            f"{wording.seeds_text(results)} with pointwise 95 % t-intervals.",
            ("panel", "runs", "seconds", "deliveries", "low", "high"),
            rows,
            0.6 + 2.3 * len(panels),
            _draw(panels, onset, f"deliveries in {window:g} s"),
        )


def _draw(panels: list[drawing_over_time.RatePanel], onset: float, y_label: str) -> Draw:
    return lambda canvas: drawing_over_time.rates(canvas, panels, onset, y_label)
