"""Figures of a report: what each shows, as numbers, and how it is drawn. Nothing is drawn here."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

from swarm_logistics_env.report import drawing
from swarm_logistics_env.report.drawing import Panel, Point, Series
from swarm_logistics_env.report.wording import listed, percent, seeds_text
from swarm_logistics_env.spi.definitions import DEFINITIONS, Definition, Factor
from swarm_logistics_env.studies.results import IndicatorTest, StudyResults, Value
from swarm_logistics_env.studies.size_series import SizeSeries

_Key = TypeVar("_Key")


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
        f"{percent(results.confidence)} intervals, an arrow where a bar leaves the axis; dashed: "
        "thresholds"
    )


def indicator_figures(results: StudyResults) -> Iterator[Figure]:
    """Yield S per step, FT and R per mode and m, A per parameter, and P without a part."""
    yield from _scalability(results)
    yield from _faults(results)
    yield from _adaptability(results)
    yield from _ablations(results)


def _scalability(results: StudyResults) -> Iterator[Figure]:
    for table, here in _grouped(_thresholded(results, "size"), lambda j: j.table):
        yield _intervals(
            results,
            slug(_symbols(here), table),
            f"{_policies(here)}, {table}: {_caption(here, 'per step in N')}",
            here,
            _panels(here, "swarm size N → N + m", lambda js: _by_policy(js, _step)),
        )


def _faults(results: StudyResults) -> Iterator[Figure]:
    asked = _thresholded(results, "fault")
    first = asked[0].policy if asked else ""
    for (policy, table, onset), here in _grouped(
        asked, lambda j: (j.policy, j.table, j.comparison.changed.setting.onset)
    ):

        def by_m(tests: list[IndicatorTest], shown: bool = policy == first) -> tuple[Series, ...]:
            return tuple(
                Series(f"m = {m:g}", tuple(_points(js, _mode, published=shown)))
                for m, js in _grouped(tests, lambda j: j.comparison.changed.setting.value)
            )

        swarm = here[0].comparison.original.condition.size
        start = f", faults from {onset:g} s" if onset else ""
        yield _intervals(
            results,
            slug(_symbols(here), policy, table, f"{onset:g}s" if onset else ""),
            f"{policy}, {table}, N = {swarm}{start}: "
            f"{_caption(here, 'per failure mode and number m of faulty robots')}",
            here,
            _panels(here, "failure mode", by_m),
        )


def _adaptability(results: StudyResults) -> Iterator[Figure]:
    asked = _thresholded(results, "parameter")
    panels = [
        replace(panel, title=table)
        for (table, name), here in _grouped(
            asked, lambda j: (j.table, j.comparison.changed.setting.name)
        )
        for panel in _panels(here, f"{name}, x_o → x_new", lambda js: _by_policy(js, _step))
    ]
    if asked:
        caption = f"{_policies(asked)}: {_caption(asked, 'per parameter')}"
        yield _intervals(results, slug(_symbols(asked)), caption, asked, panels)


def _ablations(results: StudyResults) -> Iterator[Figure]:
    asked = [j for j in results.tests if j.comparison.definition.compares == "policy"]
    for table, here in _grouped(asked, lambda j: j.table):
        # 0 first: it is the threshold that always stands in the picture.
        thresholds = tuple(dict.fromkeys([0.0, *(j.comparison.threshold for j in here)]))
        panels = _panels(here, "in its place", lambda js: _by_policy(js, _label))
        yield _intervals(
            results,
            slug(_symbols(here), table),
            f"{_policies(here)}, {table}: relative change of P where another policy takes its "
            "place, (P_new - P_o) / P_o; below a threshold P falls by more than that share.",
            here,
            [replace(panel, thresholds=thresholds) for panel in panels],
        )


def _by_policy(
    tests: list[IndicatorTest], category: Callable[[IndicatorTest], str]
) -> tuple[Series, ...]:
    return tuple(
        Series(policy, tuple(_points(js, category, published=not index)))
        for index, (policy, js) in enumerate(_grouped(tests, lambda j: j.policy))
    )


def _panels(
    tests: list[IndicatorTest],
    x_label: str,
    series: Callable[[list[IndicatorTest]], tuple[Series, ...]],
) -> list[Panel]:
    """Return a pair of axes for each indicator."""
    return [
        Panel("", definition.axis, series(js), tuple(definition.adjectives), x_label)
        for definition, js in _by_definition(tests)
    ]


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
    panels: Sequence[Panel],
) -> Figure:
    columns = (
        "policy", "table", "indicator", "comparison", "value", "low", "high",
        "verdict", "verdict_holm", "published", "saturated",
    )  # fmt: skip
    records = [test.record() for test in tests]
    rows = tuple(tuple(record[column] for column in columns) for record in records)
    published = any(test.published is not None for test in tests)
    cross = "; crosses: published" if published else ""
    capped = _saturation(any(test.saturated for test in tests))
    return Figure(
        name,
        f"{caption} {seeds_text(results).capitalize()}. {marks(results)}{cross}.{capped}",
        columns,
        rows,
        0.5 + 2.5 * len(panels),
        lambda canvas: drawing.intervals(canvas, panels),
    )


def _saturation(saturated: bool) -> str:
    return " †: P is capped, every item was delivered in a run." if saturated else ""


def _by_definition(tests: list[IndicatorTest]) -> list[tuple[Definition, list[IndicatorTest]]]:
    by_symbol = dict(_grouped(tests, lambda j: j.indicator))
    return [(row, by_symbol[symbol]) for symbol, row in DEFINITIONS.items() if symbol in by_symbol]


def _symbols(tests: list[IndicatorTest]) -> str:
    return "-".join(definition.symbol for definition, _ in _by_definition(tests))


def _caption(tests: list[IndicatorTest], per: str) -> str:
    """Return what a figure shows, e.g. "robustness R per failure mode; above 0 robust."."""
    definitions = [definition for definition, _ in _by_definition(tests)]
    above: dict[float, list[str]] = {}
    for definition in definitions:
        for threshold, adjective in definition.adjectives.items():
            above.setdefault(threshold, []).append(adjective)
    says = ", ".join(f"above {threshold:g} {', '.join(says)}" for threshold, says in above.items())
    return f"{listed([definition.heading for definition in definitions])} {per}; {says}."


def _thresholded(results: StudyResults, factor: Factor) -> list[IndicatorTest]:
    """Return each indicator of a factor once: that asked against the lowest threshold."""
    first: dict[object, IndicatorTest] = {}
    for test in results.tests:
        comparison = test.comparison
        if comparison.definition.compares != factor:
            continue
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
            test.decided,
            test.saturated,
            test.published if published else None,
        )


def _step(test: IndicatorTest) -> str:
    before, after = test.comparison.original.setting, test.comparison.changed.setting
    return f"{before.value:g}→{after.value:g}"


def _mode(test: IndicatorTest) -> str:
    return test.comparison.changed.setting.name


def _label(test: IndicatorTest) -> str:
    return test.comparison.label


def _policies(tests: list[IndicatorTest]) -> str:
    return listed(list(dict.fromkeys(test.policy for test in tests)))


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
