"""Figures: what each shows, as a table and as a drawing."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from more_itertools import map_reduce, unique_everseen

from swarm_logistics_env.spi.definitions import DEFINITIONS, Definition, FactorKind
from swarm_logistics_env.spi.summaries import Interval
from swarm_logistics_env.study.questions.comparison import CONFIDENCE
from swarm_logistics_env.study.verdicts.cell import Cell
from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.study.verdicts.verdict import DECIDED, Verdict

from . import drawing
from .answer import Answer
from .answer_lines import Line
from .points import Panel, Point, cuts_intervals
from .section import P_LEVEL, Figure, join_names, levels, slug

if TYPE_CHECKING:
    import pandas as pd

_COLUMNS = [
    "policy", "table", "indicator", "comparison", "value", "low", "high", "confidence",
    "verdict", "verdict_holm", "published", "saturated",
]  # fmt: skip


def forest_points(results: StudyResults, answer: Answer) -> tuple[Point, ...]:
    """Return the value of each line of the answer; `published` is the threshold of each."""
    points = []
    for line in answer.lines:
        value, low, high = line.estimate or (None, None, None)
        point = _point(results, line.verdict, "", line.threshold)
        points.append(point._replace(value=value, low=low, high=high))
    return tuple(points)


def forest_figures(
    results: StudyResults, answer: Answer, points: Sequence[Point]
) -> Iterator[Figure]:
    """Yield P in times that of another policy, and the indicators, as forests of intervals.

    Where there are several policies or tasks, those with the same question share its row.
    """
    pairs = [*zip(answer.lines, points)]
    of_policies = [(line, point) for line, point in pairs if line.verdict.compares_policies]
    of_indicators = [(line, point) for line, point in pairs if not line.verdict.compares_policies]
    if of_policies:
        first = of_policies[0][0].verdict
        others = {line.verdict.compared.policy for line, _ in of_policies}
        other = others.pop() if len(others) == 1 else "the policy behind 'against'"
        label = f"P of {first.after.name} / P of {other} (logarithmic)"
        name = "times" if of_indicators else "answer"
        yield _forest_figure(name, label, results, answer, of_policies, is_of_times=True)
    if of_indicators:
        label = "value of the indicator"
        yield _forest_figure("answer", label, results, answer, of_indicators)


def _forest_figure(
    name: str,
    x_label: str,
    results: StudyResults,
    answer: Answer,
    pairs: Sequence[tuple[Line, Point]],
    *,
    is_of_times: bool = False,
) -> Figure:
    subjects = list(dict.fromkeys(line.subject for line, _ in pairs))
    by_heading: dict[str, dict[str, list[Point]]] = {}
    for line, point in pairs:
        of_subject = point._replace(series=line.subject, style=subjects.index(line.subject))
        heading = "" if is_of_times else line.heading
        label = line.name(with_subject=False)
        by_heading.setdefault(heading, {}).setdefault(label, []).append(of_subject)
    rows: list[tuple[str, list[Point]]] = []
    for heading, rows_of in by_heading.items():
        rows += [(heading, [])] if heading else []
        rows += rows_of.items()
    verdicts = [line.verdict for line, _ in pairs]
    zeros = dict.fromkeys(f" {verdict.at_zero}." for verdict in verdicts)
    # Where there are several, the legend names them.
    title = subjects[0] if len(subjects) == 1 else ""
    return Figure(
        name,
        f"{answer.scope} Every question with its interval.",
        _rows(results, verdicts),
        0.9 + sum(max(0.2, 0.05 + 0.1 * len(of_row)) for _, of_row in rows),
        partial(drawing.forest, columns={x_label: rows}, title=title, is_of_times=is_of_times),
        _note(results, verdicts, [point for _, point in pairs], is_of_times=is_of_times)
        + "".join(zeros),
    )


def policies_figure(results: StudyResults) -> Iterator[Figure]:
    """Yield P of policies that are compared, in every condition; a panel for each task."""
    import pandas as pd

    compared = results.on_policies
    if not compared:
        return
    keys = list(dict.fromkeys(arm.case.key for _, _, arm in results.plan.cells))
    policies = list(dict.fromkeys([compared[0].after.name, *(v.compared.policy for v in compared)]))
    points: dict[str, dict[str, Point]] = {}  # each condition of a policy once, by the task
    for verdict in compared:
        comparison = verdict.compared
        task = results.subjects[comparison.original.case].task
        for arm in (comparison.changed, comparison.original):
            cell = results.cells_by_key[comparison.policy, comparison.table, arm]
            policy = arm.case.policy.title
            points.setdefault(task, {})[arm.case.key] = Point(
                policy,
                policies.index(policy),
                verdict.after.condition,
                *cell.mean,
                decided=True,
                saturated=cell.saturated,
                link=f"condition-{keys.index(arm.case.key)}",
            )
    panels = tuple(
        Panel(
            task, f"performance {results.plan.name_of_p}", tuple(of_task.values()), (), "condition"
        )
        for task, of_task in points.items()
    )
    rows = [
        (panel.title, point.series, point.category, point.value, point.low, point.high, CONFIDENCE)
        for panel in panels
        for point in panel.points
    ]
    columns = ["task", "policy", "condition", "mean", "low", "high", "confidence"]
    yield Figure(
        "policies",
        f"P of {join_names(policies)} where they are compared.",
        pd.DataFrame(rows, columns=columns),
        0.5 + 2.5 * len(panels),
        partial(drawing.intervals, panels=panels),
        _note_on_means(results),
        title=f"P of {join_names(policies)}",
        panels=panels,
    )


def indicator_figures(results: StudyResults) -> Iterator[Figure]:
    """Yield S per step, FT and R per mode and m, A per value, and P without a part."""
    for (table, _, onset, swarm), verdicts in _by_figure(results).items():
        definitions = _definitions(verdicts)
        panels = [_panel(results, verdicts, definition) for definition in definitions]
        rows = _rows(results, verdicts)
        condition = _condition(table, onset, swarm)
        symbols = [definition.symbol for definition in definitions]
        names = list(dict.fromkeys(v.compared.policy for v in verdicts))
        policies = join_names(names)
        is_of_one = len(names) == 1 and not results.names_no_policy
        first_title = f"{policies}: {condition}" if is_of_one else condition
        panels[0] = replace(panels[0], title=first_title)
        has_published = any(verdict.published is not None for verdict in verdicts)
        crosses = " Crosses: published." if has_published else ""
        yield Figure(
            slug(*symbols, table, f"{onset:g}s" if onset else ""),
            f"{policies}, {condition}: {_caption(definitions)}",
            rows,
            0.3 + 2.3 * len(panels),
            partial(drawing.intervals, panels=panels),
            note_on_verdicts(results, verdicts) + crosses,
            title=f"{' and '.join(symbols)}: {condition}",
            panels=tuple(panels),
        )


def trade_off_figure(results: StudyResults) -> Iterator[Figure]:
    """Yield P beside contacts where these were counted, a row a condition."""
    import pandas as pd

    # A case may stand in several tables: under its policy's name, and in the place of another.
    by_name = sorted(results.cells, key=lambda cell: cell.arm.setting.kind == "policy")
    distinct = unique_everseen(by_name, lambda cell: cell.arm.case.key)
    cells = [cell for cell in distinct if cell.contacts.value >= 0.0]
    if not cells:
        return
    policies = list(dict.fromkeys(cell.policy for cell in cells))
    by_condition: dict[str, list[Cell]] = map_reduce(cells, lambda cell: cell.words)

    def rows_of(interval_of: Callable[[Cell], Interval]) -> drawing.Rows:
        return [
            (words, [_cell_point(cell, interval_of(cell), policies) for cell in of_condition])
            for words, of_condition in by_condition.items()
        ]

    columns = {
        f"performance {results.plan.name_of_p}": rows_of(lambda cell: cell.mean),
        "contacts per robot-minute": rows_of(lambda cell: cell.contacts),
    }
    rows = [(cell.policy, cell.words, *cell.contacts, *cell.mean, CONFIDENCE) for cell in cells]
    names = ["policy", "cell", "contacts", "contacts_low", "contacts_high"]
    yield Figure(
        "trade-off",
        "P and contacts per robot-minute in each condition.",
        pd.DataFrame(rows, columns=[*names, "mean", "low", "high", "confidence"]),
        0.8 + (0.1 + 0.1 * len(policies)) * len(by_condition),
        partial(drawing.forest, columns=columns, title=policies[0] if len(policies) == 1 else ""),
        _note_on_means(results),
    )


def _cell_point(cell: Cell, interval: Interval, policies: Sequence[str]) -> Point:
    """Return a mean of a cell."""
    return Point(cell.policy, policies.index(cell.policy), cell.words, *interval, decided=True)


def _by_figure(results: StudyResults) -> dict[tuple[str, FactorKind, float, int], list[Verdict]]:
    """Return each value once, by table, kind, onset, and swarm size where robots fail."""

    def figure_of(verdict: Verdict) -> tuple[str, FactorKind, float, int]:
        after = verdict.after
        swarm = verdict.compared.n_robots if after.kind == "fault" else 0
        return verdict.compared.table, after.kind, after.onset, swarm

    # P itself is drawn of those on policies.
    by_value: dict[tuple[str, ...], list[Verdict]] = map_reduce(
        (verdict for verdict in results.verdicts if not verdict.compares_policies),
        lambda verdict: (*verdict.compared.family, verdict.compared.table, verdict.compared.label),
    )
    # The verdict on the lowest threshold shows the value for them all.
    lowest = [
        min(verdicts, key=lambda verdict: verdict.compared.threshold)
        for verdicts in by_value.values()
    ]
    return map_reduce(lowest, figure_of)


def _condition(table: str, onset: float, swarm: int) -> str:
    start = f", faults from {onset:g} s" if onset else ""
    return f"{table}, N = {swarm}{start}" if swarm else table


def _panel(results: StudyResults, verdicts: Sequence[Verdict], definition: Definition) -> Panel:
    """Return a pair of axes for an indicator, a series a policy."""
    of_indicator = [v for v in verdicts if v.compared.indicator == definition.symbol]
    after = of_indicator[0].after
    first_policy = of_indicator[0].compared.policy
    points = tuple(
        # The published values stand beside the first policy.
        _point(
            results,
            verdict,
            _category(verdict),
            verdict.published if verdict.compared.policy == first_policy else None,
        )
        for verdict in of_indicator
    )
    # 0 first: it is the threshold that always stands in the picture.
    thresholds = [verdict.compared.threshold for verdict in of_indicator]
    shown = tuple(dict.fromkeys([0.0, *definition.adjectives, *thresholds]))
    x_label = X_LABELS.get(after.kind, f"{parameter_label(of_indicator[0])}, x_o → x_new")
    return Panel("", definition.heading, points, shown, x_label)


X_LABELS = {
    "size": "swarm size N",
    "fault": "failure mode and number m of faulty robots",
    "policy": "in its place",
}


def parameter_label(verdict: Verdict) -> str:
    """Return a parameter as a reader calls it, with its unit, e.g. "delivery width [m]"."""
    name = verdict.after.name
    description = verdict.compared.original.case.task.fields.get(name, "")
    unit = re.search(r"\[.+?\]", description)
    words = name.replace("_", " ")
    return f"{words} {unit[0]}" if unit else words


def _category(verdict: Verdict) -> str:
    before = verdict.compared.original.setting
    after = verdict.after
    if after.kind == "fault":
        return f"{after.name} {after.value:g}"
    if after.kind == "policy":
        return verdict.compared.label
    return f"{before.value:g}→{after.value:g}"


def _point(
    results: StudyResults, verdict: Verdict, category: str, published: float | None
) -> Point:
    policy = verdict.compared.policy
    value, low, high = verdict.interval or (None, None, None)
    # What stands between two policies has the colour of neither.
    style = results.policies.index(policy)
    if verdict.compares_policies:
        style = len(results.policies)
    return Point(
        policy,
        style,
        category,
        value,
        low,
        high,
        published,
        decided=verdict.on_threshold.adjusted in DECIDED,
        saturated=verdict.saturated,
        link=f"question-{results.verdicts.index(verdict)}",
    )


def _rows(results: StudyResults, verdicts: Sequence[Verdict]) -> pd.DataFrame:
    """Return what a figure shows of these verdicts, one row each."""
    rows = [results.verdicts.index(verdict) for verdict in verdicts]
    return results.verdict_table.iloc[rows].reset_index(drop=True)[_COLUMNS]


CAPPED = "†: P is capped, every item was delivered in a run."


def note_on_verdicts(results: StudyResults, verdicts: Sequence[Verdict]) -> str:
    """Return what the marks of verdicts mean, and over which seeds they are."""
    return _note(results, verdicts, [_point(results, verdict, "", None) for verdict in verdicts])


def _note(
    results: StudyResults,
    verdicts: Sequence[Verdict],
    points: Sequence[Point],
    *,
    is_of_times: bool = False,
) -> str:
    caps = f" {CAPPED}" if any(verdict.saturated for verdict in verdicts) else ""
    leaves = cuts_intervals(points, is_of_times=is_of_times)
    cut = ", with an arrow where they leave the axis" if leaves else ""
    words = {verdict.in_words for verdict in verdicts if verdict.conclusion == "equivalent"}
    small = "".join(f" or {word}" for word in sorted(words))
    return (
        f"{results.seeds_text.capitalize()}. Bars: {levels(verdicts)} intervals{cut}; filled: "
        f"decided by Holm's method; hollow: open{small}, even where the bar lies beside a "
        f"threshold; dashed: thresholds.{caps}"
    )


def _note_on_means(results: StudyResults) -> str:
    return f"Means of {results.seeds_text}; bars: {P_LEVEL} intervals."


def _definitions(verdicts: Sequence[Verdict]) -> list[Definition]:
    indicators = {verdict.compared.indicator for verdict in verdicts}
    return [definition for symbol, definition in DEFINITIONS.items() if symbol in indicators]


def _caption(definitions: Sequence[Definition]) -> str:
    """Return what a figure shows, e.g. "robustness R; above 0 robust."."""
    words_above: dict[float, list[str]] = {}
    for definition in definitions:
        for threshold, word in definition.adjectives.items():
            words_above.setdefault(threshold, []).append(word)
    meaning = ", ".join(f"above {at:g} {', '.join(words)}" for at, words in words_above.items())
    if not meaning:
        meaning = "(P_new - P_o) / P_o; below a threshold P falls by more than that share"
    return f"{join_names([definition.heading for definition in definitions])}; {meaning}."
