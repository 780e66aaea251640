"""Sections on faults in mid-run: measures that the paper does not define."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial

from swarm_logistics_env.spi.estimate import Estimate
from swarm_logistics_env.studies.comparison import Comparison
from swarm_logistics_env.studies.measures import (
    RepairCurve,
    Resilience,
    mid_run_faults,
    rate_curves,
    resiliences,
    window_of,
)
from swarm_logistics_env.studies.results import StudyResults
from swarm_logistics_env.studies.verdict import grouped

from . import drawing, section
from .section import Figure, Section, slug

_SINGLE_TEXT = (
    "Until the first window in which a run delivers as much again as the paired run with the "
    "robots removed; those that never do are censored (Kaplan and Meier). Deliveries scatter, so "
    "what counts is the distance from the null: pairs without a fault that differ in behaviour."
)
_REPAIR_DATA = ["panel", "runs", "seconds", "share_not_back", "low", "high"]
_RATE_DATA = ["panel", "runs", "seconds", "deliveries", "low", "high"]


def fault_sections(results: StudyResults) -> Iterator[Section]:
    """Yield the measures of faults in mid-run, and the curves of what is delivered around them."""
    found = list(resiliences(results))
    if not found:
        return
    who: list[tuple[str, Callable[[Resilience], str]]] = [
        ("policy", lambda one: one.compared.policy),
        ("fault", lambda one: str(one.compared.changed.setting)),
    ]
    yield Section.table(
        "Resilience: deliveries after the onset",
        found,
        [
            *who,
            ("over the removed robots' [95 %]", lambda r: section.bracketed(r.against_removed, 3)),
            ("above 1", lambda one: _verdict(one.against_removed)),
            ("over the whole swarm's [95 %]", lambda one: section.bracketed(one.against_whole, 3)),
            ("above 1 - m/N", lambda one: _verdict(one.against_whole)),
        ],
        "Deliveries after the onset over those of the paired reference. Reference with the robots "
        "removed at the onset: fault tolerance local in time; whole swarm: robustness local in "
        f"time. Verdicts unadjusted; {section.seeds_text(results)}.",
    )
    figures = tuple(_rate_figures(results))
    if figures:
        yield Section("", figures=figures)
    single = [one for one in found if one.single]
    problems = [
        f"{one.compared.policy}, {one.compared.changed.setting}: no time to come back: "
        f"{one.problem}."
        for one in found
        if one.problem
    ]
    yield Section.table(
        "Time until single runs are back",
        single,
        [
            *who,
            ("median [s]", lambda one: _median(one.single[0])),
            ("not back", lambda one: _not_back(one.single[0])),
            ("null's median [s]", lambda one: _median(one.single[1])),
            ("null not back", lambda one: _not_back(one.single[1])),
        ],
        _SINGLE_TEXT,
        *problems,
    )
    repairs = tuple(_repair_figures(results, {one.compared: one.single for one in single}))
    if repairs:
        yield Section("", figures=repairs)


def _verdict(estimate: Estimate | None) -> str:
    if estimate is None:
        return "undefined"
    if estimate.identical:
        return section.UNAFFECTED
    return section.said(estimate.verdict) + section.SATURATED * ("capped" in estimate.flags)


def _median(curve: RepairCurve) -> str:
    median = curve.curve.median()
    return "not reached" if median is None else f"{median:g}"


def _not_back(curve: RepairCurve) -> str:
    return f"{curve.censored} of {curve.total} runs"


def _by_mode(results: StudyResults) -> Iterator[tuple[Comparison, list[Comparison]]]:
    """Yield the faults in mid-run that share a figure, after the first of them."""

    def place(one: Comparison) -> tuple[str, str, int, str, float]:
        setting = one.changed.setting
        return one.policy, one.table, one.n_robots, setting.name, setting.onset

    for compared in grouped(mid_run_faults(results), place).values():
        yield compared[0], compared


def _figure(
    name: str,
    one: Comparison,
    caption: str,
    columns: list[str],
    panels: Mapping[str, Iterable[tuple[str, Iterable[Iterable[float]]]]],
    draw: drawing.Draw,
) -> Iterator[Figure]:
    """Yield a figure with a panel for each number of faulty robots, unless there is no curve."""
    import pandas as pd

    rows = [
        (title, runs, *point)
        for title, curves in panels.items()
        for runs, points in curves
        for point in points
    ]
    setting = one.changed.setting
    if rows:
        yield Figure(
            slug(name, one.policy, one.table, setting.name, f"{setting.onset:g}s"),
            f"{one.policy}, {one.table}, N = {one.n_robots}: {caption}",
            pd.DataFrame(rows, columns=columns),
            0.6 + 2.2 * len(panels),
            draw,
        )


def _rate_figures(results: StudyResults) -> Iterator[Figure]:
    """Yield deliveries over time around every fault in mid-run, a figure per failure mode."""
    for one, compared in _by_mode(results):
        setting, window = one.changed.setting, window_of(one)
        panels = {f"m = {c.changed.setting.value:g}": rate_curves(results, c) for c in compared}
        yield from _figure(
            "deliveries",
            one,
            f"deliveries in the trailing {window:g} s around failure mode {setting.name} from "
            f"{setting.onset:g} s (dotted line). Mean over {section.seeds_text(results)} with "
            "pointwise 95 % t-intervals.",
            _RATE_DATA,
            {title: [(c.runs, zip(*c[1:])) for c in curves] for title, curves in panels.items()},
            partial(
                drawing.rates,
                panels=panels,
                onset=setting.onset,
                y_label=f"deliveries in {window:g} s",
            ),
        )


def _repair_figures(
    results: StudyResults, singles: dict[Comparison, tuple[RepairCurve, ...]]
) -> Iterator[Figure]:
    """Yield the curves of single runs' times to come back, a figure per failure mode."""
    for one, compared in _by_mode(results):
        setting = one.changed.setting
        panels = {f"m = {c.changed.setting.value:g}": singles[c] for c in compared if c in singles}
        yield from _figure(
            "self-repair",
            one,
            f"share of runs whose delivery rate is not back yet after failure mode {setting.name} "
            f"from {setting.onset:g} s, beside pairs of runs without fault that differ in "
            "behaviour seeds alone. Kaplan-Meier with pointwise 95 % intervals (Greenwood, "
            f"log-log); {section.seeds_text(results)}; a cross where runs are censored.",
            _REPAIR_DATA,
            {title: [(c.runs, zip(*c.curve)) for c in curves] for title, curves in panels.items()},
            partial(drawing.repairs, panels=panels),
        )
