"""Sections and figures that set policies side by side; only for studies of several."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from swarm_logistics_env.report import drawing, wording
from swarm_logistics_env.report.drawing import Panel, Point, Series
from swarm_logistics_env.report.figures import Figure, slug
from swarm_logistics_env.report.result_tables import Section
from swarm_logistics_env.report.wording import listed, seeds_text
from swarm_logistics_env.spi.summaries import Interval
from swarm_logistics_env.studies.comparisons import Setting
from swarm_logistics_env.studies.policy_comparison import (
    CellAgainstBaseline,
    IndicatorAgainstBaseline,
    cells_against_baseline,
    indicators_against_baseline,
    judged_policies,
)
from swarm_logistics_env.studies.results import StudyResults, Value

_HOW_TO_READ = (
    "How many questions got which Holm-adjusted verdict; the questions themselves follow.",
    (
        "Indicators: the verdict is the unadjusted one, Holm's in brackets where it differs; "
        "differences are paired by seed, their intervals jackknifed."
    ),
    (
        "P: IQM is the mean without the lowest and the highest quarter of the seeds, worst tenth "
        "the mean of the lowest tenth, rounded up to whole seeds. Differences are paired by seed "
        "(t-interval), and so are ratios of mean P (Fieller); the last column is the share of "
        "seeds with more deliveries, ties counting half (Wilson)."
    ),
)


def compared(results: StudyResults) -> Iterator[Section]:
    """Yield policy x indicator: verdicts counted, values with differences, P cell by cell."""
    policies = judged_policies(results)
    if len(policies) < 2:
        return
    yield _matrix(results, policies)
    entries = tuple(indicators_against_baseline(results))
    cells_by_table = cells_against_baseline(results)
    for figure in difference_figures(results, cells_by_table, entries):
        yield Section("", figures=(figure,))
    confidence = wording.percent(results.confidence)
    for table in dict.fromkeys(one.table for one in entries):
        here = [one for one in entries if one.table == table]
        yield _indicators(table, here, policies, confidence)
    for table, cells in cells_by_table.items():
        yield _cells(table, cells, policies[0])


def _matrix(results: StudyResults, policies: tuple[str, ...]) -> Section:
    properties = dict.fromkeys(
        j.property_name for j in results.tests if j.comparison.definition.compares != "policy"
    )
    rows = []
    for policy in policies:
        row = [policy]
        for name in properties:
            verdicts = Counter[str](
                wording.counted_as(j, j.adjusted_verdict)
                for j in results.tests
                if j.policy == policy and j.property_name == name
            )
            row.append(wording.counted(verdicts) or wording.NOTHING)
        rows.append(tuple(row))
    return Section(
        "Policy x indicator",
        ("policy", *properties),
        tuple(rows),
        (
            *_HOW_TO_READ,
            f"All over {wording.seeds_text(results)}.",
        ),
    )


def _indicators(
    table: str, entries: list[IndicatorAgainstBaseline], policies: tuple[str, ...], confidence: str
) -> Section:
    columns = ["question", *(f"{policy} [{confidence}]" for policy in policies)]
    columns += [f"{policy} - {policies[0]} [95 %]" for policy in policies[1:]]
    rows = []
    for one in entries:
        test = next(j for j in one.tests if j is not None)
        label = f"{test.property_name}, {test.comparison.label}"
        values = [
            wording.NOTHING if j is None else f"{wording.ratio(j)} {wording.verdict(j)}"
            for j in one.tests
        ]
        differences = [wording.bracketed(d, 3) for d in one.differences[1:]]
        rows.append((label, *values, *differences))
    return Section(
        f"Indicators side by side: {table}",
        tuple(columns),
        tuple(rows),
    )


def _cells(table: str, entries: list[CellAgainstBaseline], baseline: str) -> Section:
    rows = tuple(
        (
            str(one.cell.arm.setting),
            one.cell.policy,
            wording.items(one.cell.mean) + (wording.SATURATED if one.cell.saturated else ""),
            f"{one.interquartile_mean:.1f}",
            f"{one.worst_decile:.1f}",
            wording.bracketed(one.difference, 1),
            wording.bracketed(one.ratio, 2),
            wording.bracketed(one.improvement, 2),
        )
        for one in entries
    )
    return Section(
        f"P side by side: {table}",
        (
            "condition", "policy", "mean P [95 %]", "IQM of P", "worst tenth",
            f"P - {baseline}'s [95 %]", f"P / {baseline}'s [95 %]",
            f"delivers more than {baseline} [95 %]",
        ),
        rows,
    )  # fmt: skip


Differences = list[tuple[str, str, Interval]]  # policy, category, difference


def difference_figures(
    results: StudyResults,
    cells: dict[str, list[CellAgainstBaseline]],
    indicators: tuple[IndicatorAgainstBaseline, ...],
) -> Iterator[Figure]:
    """Yield one figure a table: differences of P, then of every indicator."""
    baseline, *others = judged_policies(results)
    for table, entries in cells.items():
        names = list(dict.fromkeys(one.cell.arm.setting.name for one in entries))
        found: dict[str, Differences] = {
            "P": [
                (one.cell.policy, _cell(one.cell.arm.setting), one.difference)
                # One failure mode after the other, as in the tables.
                for one in sorted(entries, key=lambda c: names.index(c.cell.arm.setting.name))
                if one.difference is not None
            ]
        }
        for indicator in indicators:
            if indicator.table == table:
                label, differences = _of_indicator(indicator)
                found.setdefault(label, []).extend(differences)
        panels = tuple(
            Panel(
                "",
                f"difference of {label}" + (" [items]" if label == "P" else ""),
                tuple(_series(differences, others)),
                (0.0,),
                _x_label(entries[0].cell.arm.setting, stepwise=label != "P"),
            )
            for label, differences in found.items()
            if differences
        )
        if panels:
            yield _figure(results, table, baseline, others, found, panels)


def _of_indicator(one: IndicatorAgainstBaseline) -> tuple[str, Differences]:
    (first, *_) = (test for test in one.tests if test is not None)
    comparison = first.comparison
    before, after = comparison.original.setting, comparison.changed.setting
    category = _cell(after) if after.kind == "fault" else f"{before.value:g}→{after.value:g}"
    differences = [
        (test.policy, category, difference)
        for test, difference in zip(one.tests, one.differences)
        if test is not None and difference is not None
    ]
    # Asked against two thresholds, its value is one.
    return comparison.indicator, differences if comparison.threshold == 0.0 else []


def _cell(setting: Setting) -> str:
    if setting.kind != "fault":
        return f"{setting.value:g}"
    if not setting.value:
        return str(setting).replace("no fault, other behaviour seeds", "other seeds")
    return f"{setting.name} {setting.value:g}" + (f" {setting.onset:g} s" if setting.onset else "")


def _x_label(setting: Setting, *, stepwise: bool) -> str:
    if setting.kind == "fault":
        return "failure mode and m"
    if setting.kind == "size":
        return "swarm size N → N + m" if stepwise else "swarm size N"
    return f"{setting.name}, x_o → x_new" if stepwise else setting.name


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
    results: StudyResults,
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
        f"paired by seed. {seeds_text(results).capitalize()}. Bars: 95 % intervals (t for P, "
        "jackknife for indicators), unadjusted; filled: the interval is clear of 0.",
        ("of", "policy", "less", "cell", "difference", "low", "high"),
        tuple(rows),
        0.5 + 2.5 * len(panels),
        lambda canvas: drawing.intervals(canvas, panels),
    )
