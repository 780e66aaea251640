"""Figures of a report: what each shows, as numbers, and how it is drawn. Nothing is drawn here."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TypeVar

from swarm_logistics_env.report import drawing
from swarm_logistics_env.report.drawing import Panel, Point, Series
from swarm_logistics_env.report.wording import decided, listed, percent, seeds_text
from swarm_logistics_env.spi import Verdict
from swarm_logistics_env.studies.results import IndicatorTest, StudyResults
from swarm_logistics_env.studies.size_series import SizeSeries

_Key = TypeVar("_Key")
Value = str | float | int | bool | None


@dataclass(frozen=True)
class Figure:
    """One figure.

    Attributes:
        name: of its files, without ending; letters, digits and hyphens.
        caption: what it shows and under which conditions, in full.
        columns, rows: its data.
        height: of the drawing [inch]; the width is that of all figures.
        draw: draws it on an empty canvas.
    """

    name: str
    caption: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Value, ...], ...]
    height: float
    draw: drawing.Draw


def marks(results: StudyResults) -> str:
    """Return what the marks of a figure of indicators mean."""
    return (
        "Filled: the Holm-adjusted verdict is decided; hollow: inconclusive; bars: "
        f"{percent(results.level)} intervals, an arrow where a bar leaves the axis; dashed: "
        "thresholds"
    )


def indicator_figures(results: StudyResults) -> Iterator[Figure]:
    """Yield S per step, FT and R per mode and m, A per parameter, and P without a part."""
    yield from _scalability(results)
    yield from _faults(results)
    yield from _adaptability(results)
    yield from _ablations(results)


def _scalability(results: StudyResults) -> Iterator[Figure]:
    asked = [j for j in _thresholded(results) if j.comparison.indicator == "S"]
    for table in _tables(asked):
        here = [j for j in asked if j.comparison.table == table]
        series = [
            Series(policy, tuple(_points(js, _step, published=not index)))
            for index, (policy, js) in enumerate(_grouped(here, lambda j: j.comparison.policy))
        ]
        panel = Panel("", "scalability S", tuple(series), (0.0, 1.0), "swarm size N → N + m")
        yield _intervals(
            results,
            slug("S", table),
            f"{_policies(here)}, {table}: scalability S per step in N; above 0 scalable, above 1 "
            "superlinear.",
            here,
            (panel,),
        )


def _faults(results: StudyResults) -> Iterator[Figure]:
    asked = [j for j in _thresholded(results) if j.comparison.indicator in ("FT", "R")]
    first = asked[0].comparison.policy if asked else ""
    keys = dict.fromkeys(
        (j.comparison.policy, j.comparison.table, j.comparison.changed.setting.onset) for j in asked
    )
    for policy, table, onset in keys:
        here = [
            j
            for j in asked
            if (j.comparison.policy, j.comparison.table, j.comparison.changed.setting.onset)
            == (policy, table, onset)
        ]
        panels = []
        for indicator, label in (("FT", "fault tolerance FT"), ("R", "robustness R")):
            of_indicator = [j for j in here if j.comparison.indicator == indicator]
            series = [
                Series(f"m = {m:g}", tuple(_points(js, _mode, published=policy == first)))
                for m, js in _grouped(of_indicator, lambda j: j.comparison.changed.setting.value)
            ]
            panels.append(Panel("", label, tuple(series), (0.0,), "failure mode"))
        swarm = here[0].comparison.original.condition.scenario.n_robots
        start = f", faults from {onset:g} s" if onset else ""
        yield _intervals(
            results,
            slug("FT-R", policy, table, f"{onset:g}s" if onset else ""),
            f"{policy}, {table}, N = {swarm}{start}: fault tolerance FT and robustness R per "
            "failure mode and number m of faulty robots; above 0 tolerant, robust.",
            here,
            tuple(panels),
        )


def _adaptability(results: StudyResults) -> Iterator[Figure]:
    asked = [j for j in _thresholded(results) if j.comparison.indicator == "A"]
    if not asked:
        return
    panels = []
    for (table, name), js in _grouped(
        asked, lambda j: (j.comparison.table, j.comparison.changed.setting.name)
    ):
        series = [
            Series(policy, tuple(_points(of_policy, _step, published=not index)))
            for index, (policy, of_policy) in enumerate(_grouped(js, lambda j: j.comparison.policy))
        ]
        panels.append(Panel(table, "A", tuple(series), (0.0, 1.0), f"{name}, x_o → x_new"))
    yield _intervals(
        results,
        "A",
        f"{_policies(asked)}: adaptability A per parameter; above 0 adaptable, above 1 "
        "P has grown.",
        asked,
        tuple(panels),
    )


def _ablations(results: StudyResults) -> Iterator[Figure]:
    asked = [j for j in results.tests if j.comparison.indicator == "change"]
    for table in _tables(asked):
        here = [j for j in asked if j.comparison.table == table]
        series = [
            Series(policy, tuple(_points(js, lambda j: j.comparison.label)))
            for policy, js in _grouped(here, lambda j: j.comparison.policy)
        ]
        # 0 first: it is the threshold that always stands in the picture.
        thresholds = {0.0: None, **{j.comparison.threshold: None for j in here}}
        panel = Panel("", "change of P", tuple(series), tuple(thresholds), "in its place")
        yield _intervals(
            results,
            slug("change", table),
            f"{_policies(here)}, {table}: relative change of P where another policy takes its "
            "place, (P_new - P_o) / P_o; below a threshold P falls by more than that share.",
            here,
            (panel,),
        )


def scaling_figure(results: StudyResults, series: SizeSeries) -> Figure:
    """Return P(N) with the laws fitted to it under weights 1/P, and N* with its interval."""
    rows: list[tuple[Value, ...]] = [
        ("mean P", size, mean.value, mean.low, mean.high)
        for size, mean in zip(series.sizes, series.performance)
    ]
    fits = tuple(fit for fit in series.fits if fit.weighting == "1/P")
    grid = drawing.size_grid(series.sizes)
    for fit in fits:
        rows += [(fit.law, n, p, None, None) for n, p in zip(grid, fit.predict(grid).tolist())]
        rows.append((f"N* of {fit.law}", fit.peak, None, fit.peak_low, fit.peak_high))
    who = series.policy or "published runs"
    laws = (
        "lines: scaling laws fitted with weights 1/P; bars at the foot: N* of each with its 95 % "
        "interval, an arrow where it goes on"
        if fits
        else f"no scaling law fits: {series.problem}"
    )
    seeds = (
        f"mean of {seeds_text(results)}, bars: 95 % t-intervals"
        if series.policy
        else ("number of runs not given, so no intervals")
    )
    return Figure(
        slug("P-N", series.policy or "published", series.table),
        f"{who}, {series.table}: P against swarm size N ({seeds}); {laws}."
        + _saturation(any(series.saturated)),
        ("what", "N", "P", "low", "high"),
        tuple(rows),
        3.6,
        lambda canvas: drawing.scaling(canvas, series, fits),
    )


def _intervals(
    results: StudyResults,
    name: str,
    caption: str,
    tests: list[IndicatorTest],
    panels: tuple[Panel, ...],
) -> Figure:
    columns = (
        "policy", "table", "indicator", "comparison", "value", "low", "high",
        "verdict", "verdict_holm", "published", "saturated",
    )  # fmt: skip
    rows = []
    for test in tests:
        comparison, estimate = test.comparison, test.estimate
        rows.append(
            (
                comparison.policy,
                comparison.table,
                comparison.indicator,
                comparison.label,
                estimate.value if estimate else None,
                estimate.low if estimate else None,
                estimate.high if estimate else None,
                _verdict(test, estimate.verdict if estimate else None),
                _verdict(test, test.adjusted_verdict),
                test.published,
                test.saturated,
            )
        )
    published = any(test.published is not None for test in tests)
    cross = "; crosses: published" if published else ""
    capped = _saturation(any(test.saturated for test in tests))
    return Figure(
        name,
        f"{caption} {seeds_text(results).capitalize()}. {marks(results)}{cross}.{capped}",
        columns,
        tuple(rows),
        0.5 + 2.5 * len(panels),
        lambda canvas: drawing.intervals(canvas, panels),
    )


def _verdict(test: IndicatorTest, verdict: Verdict | None) -> str | None:
    return "unaffected" if test.unaffected else verdict


def _saturation(saturated: bool) -> str:
    return " †: P is capped, every item was delivered in a run." if saturated else ""


def _thresholded(results: StudyResults) -> list[IndicatorTest]:
    """Return each indicator once: that asked against the lowest threshold."""
    first: dict[object, IndicatorTest] = {}
    for test in results.tests:
        comparison = test.comparison
        key = (
            comparison.policy, comparison.table, comparison.indicator,
            comparison.original.setting, comparison.changed.setting,
        )  # fmt: skip
        known = first.get(key)
        if known is None or comparison.threshold < known.comparison.threshold:
            first[key] = test
    return list(first.values())


def _points(
    tests: list[IndicatorTest], category: Callable[[IndicatorTest], str], *, published: bool = True
) -> Iterator[Point]:
    for test in tests:
        estimate = test.estimate
        yield Point(
            category(test),
            estimate.value if estimate else None,
            estimate.low if estimate else None,
            estimate.high if estimate else None,
            decided(test),
            test.saturated,
            test.published if published else None,
        )


def _step(test: IndicatorTest) -> str:
    before, after = test.comparison.original.setting, test.comparison.changed.setting
    return f"{before.value:g}→{after.value:g}"


def _mode(test: IndicatorTest) -> str:
    return test.comparison.changed.setting.name


def _tables(tests: list[IndicatorTest]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(test.comparison.table for test in tests))


def _policies(tests: list[IndicatorTest]) -> str:
    return listed(list(dict.fromkeys(test.comparison.policy for test in tests)))


def _grouped(
    tests: list[IndicatorTest], key: Callable[[IndicatorTest], _Key]
) -> list[tuple[_Key, list[IndicatorTest]]]:
    groups: dict[_Key, list[IndicatorTest]] = {}
    for test in tests:
        groups.setdefault(key(test), []).append(test)
    return list(groups.items())


def slug(*parts: str) -> str:
    """Return a name for files of letters, digits and hyphens."""
    return re.sub(r"[^A-Za-z0-9]+", "-", " ".join(parts)).strip("-")
