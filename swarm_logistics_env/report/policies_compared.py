"""Sections and figures that set policies side by side; only for studies of several."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial

from swarm_logistics_env.studies.comparison import Setting
from swarm_logistics_env.studies.policy_comparison import (
    CellAgainstBaseline,
    IndicatorAgainstBaseline,
    cells_against_baseline,
    indicators_against_baseline,
)
from swarm_logistics_env.studies.results import StudyResults
from swarm_logistics_env.studies.verdict import grouped

from . import drawing, section
from .drawing import Panel, Point
from .section import Figure, Section, slug

_HOW_TO_READ = (
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
_DATA = ["of", "policy", "less", "cell", "difference", "low", "high"]


def policy_sections(results: StudyResults) -> Iterator[Section]:
    """Yield policy x indicator: values with differences, then P cell by cell."""
    if len(results.policies) < 2:
        return
    yield Section("", lines=(*_HOW_TO_READ, f"All over {section.seeds_text(results)}."))
    questions = list(indicators_against_baseline(results))
    by_table = grouped(questions, lambda one: one.test.compared.table)
    cells_by_table = cells_against_baseline(results)
    for table, cells in cells_by_table.items():
        yield from _difference_figure(results, table, cells, by_table.get(table, []))
    for table, here in by_table.items():
        yield _indicators(table, here, results.policies)
    for table, cells in cells_by_table.items():
        yield _cells(table, cells, results.policies[0])


def _indicators(
    table: str, questions: Sequence[IndicatorAgainstBaseline], policies: Sequence[str]
) -> Section:
    def answer(one: IndicatorAgainstBaseline, policy: str) -> str:
        test = one.tests.get(policy)
        return f"{section.ratio(test)} {section.answered(test)}" if test else section.NOTHING

    def difference(one: IndicatorAgainstBaseline, policy: str) -> str:
        return section.bracketed(one.differences.get(policy), 3)

    baseline, *others = policies
    columns: list[tuple[str, Callable[[IndicatorAgainstBaseline], str]]] = [
        ("question", lambda one: f"{one.test.asked}, {one.test.compared.label}"),
        *((f"{policy} [95 %]", partial(answer, policy=policy)) for policy in policies),
        *((f"{one} - {baseline} [95 %]", partial(difference, policy=one)) for one in others),
    ]
    return Section.table(f"Indicators side by side: {table}", questions, columns)


def _cells(table: str, cells: Sequence[CellAgainstBaseline], baseline: str) -> Section:
    return Section.table(
        f"P side by side: {table}",
        cells,
        [
            ("condition", lambda one: str(one.cell.arm.setting)),
            ("policy", lambda one: one.cell.policy),
            ("mean P [95 %]", lambda one: section.mean_p(one.cell)),
            ("IQM of P", lambda one: f"{one.interquartile_mean:.1f}"),
            ("worst tenth", lambda one: f"{one.worst_decile:.1f}"),
            (f"P - {baseline}'s [95 %]", lambda one: section.bracketed(one.difference, 1)),
            (f"P / {baseline}'s [95 %]", lambda one: section.bracketed(one.ratio, 2)),
            (
                f"delivers more than {baseline} [95 %]",
                lambda one: section.bracketed(one.improvement, 2),
            ),
        ],
    )


def _difference_figure(
    results: StudyResults,
    table: str,
    cells: Sequence[CellAgainstBaseline],
    questions: Sequence[IndicatorAgainstBaseline],
) -> Iterator[Section]:
    """Yield the differences of P in one table, then those of every indicator."""
    import pandas as pd

    policies = results.policies
    baseline, *others = policies
    points = grouped(_differences(policies, cells, questions), lambda one: one[0])
    if not points:
        return
    setting = cells[0].cell.arm.setting
    panels = [
        Panel(
            "",
            f"difference of {what}",
            tuple(point for _, point in here),
            (0.0,),
            _x_label(setting, stepwise=what != "P"),
        )
        for what, here in points.items()
    ]
    rows = [
        (what, p.series, baseline, p.category, p.value, p.low, p.high)
        for what, here in points.items()
        for _, p in here
    ]
    figure = Figure(
        slug("differences", table),
        f"{section.listed(others)} less {baseline}, {table}: differences of P and of the "
        f"indicators, paired by seed. {section.seeds_text(results).capitalize()}. Bars: 95 % "
        "intervals (t for P, jackknife for indicators), unadjusted; filled: the interval is clear "
        "of 0.",
        pd.DataFrame(rows, columns=_DATA).astype({"low": float, "high": float}),
        0.5 + 2.5 * len(panels),
        partial(drawing.intervals, panels=panels),
    )
    yield Section("", figures=(figure,))


def _differences(
    policies: Sequence[str],
    cells: Sequence[CellAgainstBaseline],
    questions: Sequence[IndicatorAgainstBaseline],
) -> Iterator[tuple[str, Point]]:
    """Yield what differs, and the difference as a point."""
    found = [
        ("P", one.cell.policy, _category(one.cell.arm.setting), one.difference)
        # One failure mode after the other, as in the tables.
        for here in grouped(cells, lambda one: one.cell.arm.setting.name).values()
        for one in here
    ]
    for question in questions:
        compared = question.test.compared
        before, after = compared.original.setting, compared.changed.setting
        # An indicator that is asked against two thresholds has one value.
        if compared.threshold == 0.0:
            category = f"{before.value:g}→{after.value:g}"
            if after.kind == "fault":
                category = _category(after)
            for policy, difference in question.differences.items():
                found.append((compared.indicator, policy, category, difference))
    for what, policy, category, difference in found:
        if difference is not None:
            value, low, high = difference
            clear = low is not None and high is not None and (low > 0.0 or high < 0.0)
            # The baseline has the first style in every other figure.
            style = policies.index(policy)
            yield what, Point(policy, style, category, value, low, high, decided=clear)


def _category(setting: Setting) -> str:
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
