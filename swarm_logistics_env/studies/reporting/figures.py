"""Figures of a report: what each shows, as numbers, and how it is drawn. Nothing is drawn here."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TypeVar

from swarm_logistics_env.spi import Verdict
from swarm_logistics_env.studies.analysis.scaling import SizeSeries
from swarm_logistics_env.studies.judgement import Findings, Judgement
from swarm_logistics_env.studies.reporting import drawing
from swarm_logistics_env.studies.reporting.drawing import Panel, Point, Series
from swarm_logistics_env.studies.reporting.wording import decided, listed, percent, seeds_text

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


def marks(findings: Findings) -> str:
    """Return what the marks of a figure of indicators mean."""
    return (
        "Filled: the Holm-adjusted verdict is decided; hollow: inconclusive; bars: "
        f"{percent(findings.level)} intervals, an arrow where a bar leaves the axis; dashed: "
        "thresholds"
    )


def indicator_figures(findings: Findings) -> Iterator[Figure]:
    """Yield S per step, FT and R per mode and m, A per parameter, and P without a part."""
    yield from _scalability(findings)
    yield from _faults(findings)
    yield from _adaptability(findings)
    yield from _ablations(findings)


def _scalability(findings: Findings) -> Iterator[Figure]:
    asked = [j for j in _thresholded(findings) if j.comparison.indicator == "S"]
    for table in _tables(asked):
        here = [j for j in asked if j.comparison.table == table]
        series = [
            Series(policy, tuple(_points(js, _step, published=not index)))
            for index, (policy, js) in enumerate(_grouped(here, lambda j: j.comparison.policy))
        ]
        panel = Panel("", "scalability S", tuple(series), (0.0, 1.0), "swarm size N → N + m")
        yield _intervals(
            findings,
            slug("S", table),
            f"{_policies(here)}, {table}: scalability S per step in N; above 0 scalable, above 1 "
            "superlinear.",
            here,
            (panel,),
        )


def _faults(findings: Findings) -> Iterator[Figure]:
    asked = [j for j in _thresholded(findings) if j.comparison.indicator in ("FT", "R")]
    first = asked[0].comparison.policy if asked else ""
    keys = dict.fromkeys(
        (j.comparison.policy, j.comparison.table, j.comparison.changed.level.onset) for j in asked
    )
    for policy, table, onset in keys:
        here = [
            j
            for j in asked
            if (j.comparison.policy, j.comparison.table, j.comparison.changed.level.onset)
            == (policy, table, onset)
        ]
        panels = []
        for indicator, label in (("FT", "fault tolerance FT"), ("R", "robustness R")):
            of_indicator = [j for j in here if j.comparison.indicator == indicator]
            series = [
                Series(f"m = {m:g}", tuple(_points(js, _mode, published=policy == first)))
                for m, js in _grouped(of_indicator, lambda j: j.comparison.changed.level.value)
            ]
            panels.append(Panel("", label, tuple(series), (0.0,), "failure mode"))
        swarm = here[0].comparison.original.condition.scenario.n_robots
        start = f", faults from {onset:g} s" if onset else ""
        yield _intervals(
            findings,
            slug("FT-R", policy, table, f"{onset:g}s" if onset else ""),
            f"{policy}, {table}, N = {swarm}{start}: fault tolerance FT and robustness R per "
            "failure mode and number m of faulty robots; above 0 tolerant, robust.",
            here,
            tuple(panels),
        )


def _adaptability(findings: Findings) -> Iterator[Figure]:
    asked = [j for j in _thresholded(findings) if j.comparison.indicator == "A"]
    if not asked:
        return
    panels = []
    for (table, name), js in _grouped(
        asked, lambda j: (j.comparison.table, j.comparison.changed.level.name)
    ):
        series = [
            Series(policy, tuple(_points(of_policy, _step, published=not index)))
            for index, (policy, of_policy) in enumerate(_grouped(js, lambda j: j.comparison.policy))
        ]
        panels.append(Panel(table, "A", tuple(series), (0.0, 1.0), f"{name}, x_o → x_new"))
    yield _intervals(
        findings,
        "A",
        f"{_policies(asked)}: adaptability A per parameter; above 0 adaptable, above 1 "
        "P has grown.",
        asked,
        tuple(panels),
    )


def _ablations(findings: Findings) -> Iterator[Figure]:
    asked = [j for j in findings.judgements if j.comparison.indicator == "change"]
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
            findings,
            slug("change", table),
            f"{_policies(here)}, {table}: relative change of P where another policy takes its "
            "place, (P_new - P_o) / P_o; below a threshold P falls by more than that share.",
            here,
            (panel,),
        )


def scaling_figure(findings: Findings, series: SizeSeries) -> Figure:
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
        f"mean of {seeds_text(findings)}, bars: 95 % t-intervals"
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
    findings: Findings,
    name: str,
    caption: str,
    judgements: list[Judgement],
    panels: tuple[Panel, ...],
) -> Figure:
    columns = (
        "policy", "table", "indicator", "comparison", "value", "low", "high",
        "verdict", "verdict_holm", "published", "saturated",
    )  # fmt: skip
    rows = []
    for judgement in judgements:
        comparison, estimate = judgement.comparison, judgement.estimate
        rows.append(
            (
                comparison.policy,
                comparison.table,
                comparison.indicator,
                comparison.label,
                estimate.value if estimate else None,
                estimate.low if estimate else None,
                estimate.high if estimate else None,
                _verdict(judgement, estimate.verdict if estimate else None),
                _verdict(judgement, judgement.adjusted_verdict),
                judgement.published,
                judgement.saturated,
            )
        )
    published = any(judgement.published is not None for judgement in judgements)
    cross = "; crosses: published" if published else ""
    capped = _saturation(any(judgement.saturated for judgement in judgements))
    return Figure(
        name,
        f"{caption} {seeds_text(findings).capitalize()}. {marks(findings)}{cross}.{capped}",
        columns,
        tuple(rows),
        0.5 + 2.5 * len(panels),
        lambda canvas: drawing.intervals(canvas, panels),
    )


def _verdict(judgement: Judgement, verdict: Verdict | None) -> str | None:
    return "unaffected" if judgement.unaffected else verdict


def _saturation(saturated: bool) -> str:
    return " †: P is capped, every item was delivered in a run." if saturated else ""


def _thresholded(findings: Findings) -> list[Judgement]:
    """Return each indicator once: that asked against the lowest threshold."""
    first: dict[object, Judgement] = {}
    for judgement in findings.judgements:
        comparison = judgement.comparison
        key = (
            comparison.policy, comparison.table, comparison.indicator,
            comparison.original.level, comparison.changed.level,
        )  # fmt: skip
        known = first.get(key)
        if known is None or comparison.threshold < known.comparison.threshold:
            first[key] = judgement
    return list(first.values())


def _points(
    judgements: list[Judgement], category: Callable[[Judgement], str], *, published: bool = True
) -> Iterator[Point]:
    for judgement in judgements:
        estimate = judgement.estimate
        yield Point(
            category(judgement),
            estimate.value if estimate else None,
            estimate.low if estimate else None,
            estimate.high if estimate else None,
            decided(judgement),
            judgement.saturated,
            judgement.published if published else None,
        )


def _step(judgement: Judgement) -> str:
    before, after = judgement.comparison.original.level, judgement.comparison.changed.level
    return f"{before.value:g}→{after.value:g}"


def _mode(judgement: Judgement) -> str:
    return judgement.comparison.changed.level.name


def _tables(judgements: list[Judgement]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(judgement.comparison.table for judgement in judgements))


def _policies(judgements: list[Judgement]) -> str:
    return listed(list(dict.fromkeys(judgement.comparison.policy for judgement in judgements)))


def _grouped(
    judgements: list[Judgement], key: Callable[[Judgement], _Key]
) -> list[tuple[_Key, list[Judgement]]]:
    groups: dict[_Key, list[Judgement]] = {}
    for judgement in judgements:
        groups.setdefault(key(judgement), []).append(judgement)
    return list(groups.items())


def slug(*parts: str) -> str:
    """Return a name for files of letters, digits and hyphens."""
    return re.sub(r"[^A-Za-z0-9]+", "-", " ".join(parts)).strip("-")
