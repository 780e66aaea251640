"""Sections and figures that set policies side by side; only for studies of several."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

from swarm_logistics_env.spi.summaries import Interval
from swarm_logistics_env.studies.comparisons import Setting
from swarm_logistics_env.studies.performance_table import groups_of
from swarm_logistics_env.studies.policy_comparison import (
    CellAgainstBaseline,
    IndicatorAgainstBaseline,
    cells_against_baseline,
    indicators_against_baseline,
    judged_policies,
)
from swarm_logistics_env.studies.results import StudyResults

from . import drawing, wording
from .drawing import Panel
from .figures import Figure, slug
from .result_tables import Column, Section, table_section

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


def policy_sections(results: StudyResults) -> Iterator[Section]:
    """Yield policy x indicator: values with differences, then P cell by cell."""
    policies = judged_policies(results)
    if len(policies) < 2:
        return
    yield Section("", lines=(*_HOW_TO_READ, f"All over {wording.seeds_text(results)}."))
    questions = list(indicators_against_baseline(results))
    cells_by_table = cells_against_baseline(results)
    for table, cells in cells_by_table.items():
        here = [one for one in questions if one.test.table == table]
        yield from _difference_figure(results, table, policies, cells, here)
    for table in dict.fromkeys(one.test.table for one in questions):
        here = [one for one in questions if one.test.table == table]
        yield _indicators(table, here, policies, wording.percent(results.confidence))
    for table, cells in cells_by_table.items():
        yield _cells(table, cells, policies[0])


def _indicators(
    table: str,
    questions: Sequence[IndicatorAgainstBaseline],
    policies: Sequence[str],
    confidence: str,
) -> Section:
    def answer(one: IndicatorAgainstBaseline, policy: str) -> str:
        test = one.tests.get(policy)
        return f"{wording.ratio(test)} {wording.verdict(test)}" if test else wording.NOTHING

    def difference(one: IndicatorAgainstBaseline, policy: str) -> str:
        return wording.bracketed(one.differences.get(policy), 3)

    baseline, *others = policies
    columns: list[Column] = [
        ("question", lambda one: f"{one.test.property}, {one.test.comparison}"),
        *((f"{policy} [{confidence}]", partial(answer, policy=policy)) for policy in policies),
        *((f"{one} - {baseline} [95 %]", partial(difference, policy=one)) for one in others),
    ]
    return table_section(f"Indicators side by side: {table}", questions, columns)


def _cells(table: str, cells: Sequence[CellAgainstBaseline], baseline: str) -> Section:
    columns: list[Column] = [
        ("condition", lambda one: one.cell.cell),
        ("policy", lambda one: one.cell.policy),
        ("mean P [95 %]", lambda one: wording.mean_p(one.cell)),
        ("IQM of P", lambda one: f"{one.interquartile_mean:.1f}"),
        ("worst tenth", lambda one: f"{one.worst_decile:.1f}"),
        (f"P - {baseline}'s [95 %]", lambda one: wording.bracketed(one.difference, 1)),
        (f"P / {baseline}'s [95 %]", lambda one: wording.bracketed(one.ratio, 2)),
        (
            f"delivers more than {baseline} [95 %]",
            lambda one: wording.bracketed(one.improvement, 2),
        ),
    ]
    return table_section(f"P side by side: {table}", cells, columns)


def _difference_figure(
    results: StudyResults,
    table: str,
    policies: Sequence[str],
    cells: Sequence[CellAgainstBaseline],
    questions: Sequence[IndicatorAgainstBaseline],
) -> Iterator[Section]:
    """Yield the differences of P in one table, then those of every indicator."""
    import pandas as pd

    baseline, *others = policies
    columns = ["of", "policy", "less", "cell", "difference", "low", "high"]
    rows = [
        (what, policy, baseline, category, *difference)
        for what, policy, category, difference in _differences(cells, questions)
        if difference is not None
    ]
    if not rows:
        return
    data = pd.DataFrame(rows, columns=columns).astype({"low": float, "high": float})
    data = pd.concat([here for _, here in groups_of(data, "of")])
    points = data.assign(
        series=data["policy"],
        # The baseline has the first style in every other figure.
        style=data["policy"].map(policies.index),
        category=data["cell"],
        value=data["difference"],
        # Clear of 0.
        decided=(data["low"] > 0.0) | (data["high"] < 0.0),
        saturated=False,
        published=float("nan"),
    )
    setting = cells[0].cell.arm.setting
    panels = [
        Panel(
            "",
            f"difference of {what}",
            here,
            (0.0,),
            _x_label(setting, stepwise=what != "P"),
        )
        for what, here in groups_of(points, "of")
    ]
    figure = Figure(
        slug("differences", table),
        f"{wording.listed(others)} less {baseline}, {table}: differences of P and of the "
        f"indicators, paired by seed. {wording.seeds_text(results).capitalize()}. Bars: 95 % "
        "intervals (t for P, jackknife for indicators), unadjusted; filled: the interval is clear "
        "of 0.",
        data,
        0.5 + 2.5 * len(panels),
        partial(drawing.intervals, panels=panels),
    )
    yield Section("", figures=(figure,))


def _differences(
    cells: Sequence[CellAgainstBaseline], questions: Sequence[IndicatorAgainstBaseline]
) -> Iterator[tuple[str, str, str, Interval | None]]:
    """Yield what differs, the policy, the category of the axis, and the difference."""
    # One failure mode after the other, as in the tables.
    names = list(dict.fromkeys(one.cell.factor for one in cells))
    for one in sorted(cells, key=lambda one: names.index(one.cell.factor)):
        yield "P", one.cell.policy, _category(one.cell.arm.setting), one.difference
    for question in questions:
        test = question.test
        # An indicator that is asked against two thresholds has one value.
        if test.threshold == 0.0:
            category = f"{test.before:g}→{test.after:g}"
            if test.kind == "fault":
                category = _category(test.compared.changed.setting)
            for policy, difference in question.differences.items():
                yield test.indicator, policy, category, difference


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
