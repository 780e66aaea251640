"""Figures of how policies differ from the first one, seed by seed."""

from __future__ import annotations

from collections.abc import Iterator

from swarm_logistics_env.spi.summaries import Interval
from swarm_logistics_env.studies.analysis.policies import (
    CellContest,
    IndicatorContest,
    judged_policies,
)
from swarm_logistics_env.studies.comparisons import Level
from swarm_logistics_env.studies.judgement import Findings
from swarm_logistics_env.studies.reporting import drawing
from swarm_logistics_env.studies.reporting.drawing import Panel, Point, Series
from swarm_logistics_env.studies.reporting.figures import Figure, Value, slug
from swarm_logistics_env.studies.reporting.wording import listed, seeds_text

Differences = list[tuple[str, str, Interval]]  # policy, category, difference


def difference_figures(
    findings: Findings,
    cells: dict[str, list[CellContest]],
    indicators: tuple[IndicatorContest, ...],
) -> Iterator[Figure]:
    """Yield one figure a table: differences of P, then of every indicator."""
    baseline, *others = judged_policies(findings)
    for table, contests in cells.items():
        names = list(dict.fromkeys(contest.cell.arm.level.name for contest in contests))
        found: dict[str, Differences] = {
            "P": [
                (contest.cell.policy, _cell(contest.cell.arm.level), contest.difference)
                # One failure mode after the other, as in the tables.
                for contest in sorted(contests, key=lambda c: names.index(c.cell.arm.level.name))
                if contest.difference is not None
            ]
        }
        for indicator_contest in indicators:
            if indicator_contest.table == table:
                label, differences = _of_indicator(indicator_contest)
                found.setdefault(label, []).extend(differences)
        panels = tuple(
            Panel(
                "",
                f"difference of {label}" + (" [items]" if label == "P" else ""),
                tuple(_series(differences, others)),
                (0.0,),
                _x_label(contests[0].cell.arm.level, stepwise=label in ("S", "A")),
            )
            for label, differences in found.items()
            if differences
        )
        if panels:
            yield _figure(findings, table, baseline, others, found, panels)


def _of_indicator(contest: IndicatorContest) -> tuple[str, Differences]:
    (first, *_) = (judgement for judgement in contest.judgements if judgement is not None)
    comparison = first.comparison
    before, after = comparison.original.level, comparison.changed.level
    category = _cell(after) if after.kind == "fault" else f"{before.value:g}→{after.value:g}"
    differences = [
        (judgement.comparison.policy, category, difference)
        for judgement, difference in zip(contest.judgements, contest.differences)
        if judgement is not None and difference is not None
    ]
    # Asked against two thresholds, its value is one.
    return comparison.indicator, differences if comparison.threshold == 0.0 else []


def _cell(level: Level) -> str:
    if level.kind != "fault":
        return f"{level.value:g}"
    if not level.value:
        return str(level).replace("no fault, other behaviour seeds", "other seeds")
    return f"{level.name} {level.value:g}" + (f" {level.onset:g} s" if level.onset else "")


def _x_label(level: Level, *, stepwise: bool) -> str:
    if level.kind == "fault":
        return "failure mode and m"
    if level.kind == "size":
        return "swarm size N → N + m" if stepwise else "swarm size N"
    return f"{level.name}, x_o → x_new" if stepwise else level.name


def _series(differences: Differences, others: list[str]) -> Iterator[Series]:
    # The baseline has the first style in every other figure.
    for style, policy in enumerate(others, start=1):
        points = tuple(
            Point(category, value, low, high, _clear(low, high), saturated=False, published=None)
            for owner, category, (value, low, high) in differences
            if owner == policy
        )
        yield Series(policy, points, style)


def _clear(low: float | None, high: float | None) -> bool:
    return low is not None and high is not None and not low <= 0.0 <= high


def _figure(
    findings: Findings,
    table: str,
    baseline: str,
    others: list[str],
    found: dict[str, Differences],
    panels: tuple[Panel, ...],
) -> Figure:
    rows: list[tuple[Value, ...]] = [
        (label, policy, baseline, category, *interval)
        for label, differences in found.items()
        for policy, category, interval in differences
    ]
    return Figure(
        slug("differences", table),
        f"{listed(others)} less {baseline}, {table}: differences of P and of the indicators, "
        f"paired by seed. {seeds_text(findings).capitalize()}. Bars: 95 % intervals (t for P, "
        "jackknife for indicators), unadjusted; filled: the interval is clear of 0.",
        ("of", "policy", "less", "cell", "difference", "low", "high"),
        tuple(rows),
        0.5 + 2.5 * len(panels),
        lambda canvas: drawing.intervals(canvas, panels),
    )
