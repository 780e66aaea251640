"""Tables: results, agreement with published values, and how near each policy is to its edge."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial

from more_itertools import map_reduce

from swarm_logistics_env.study.questions.comparison import Arm
from swarm_logistics_env.study.verdicts.agreement import Agreement
from swarm_logistics_env.study.verdicts.cell import Cell
from swarm_logistics_env.study.verdicts.collapses import Edge
from swarm_logistics_env.study.verdicts.reference import Reference
from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.study.verdicts.verdict import UNDEFINED, Verdict, level_of

from . import section
from .section import NOTHING, Section, Texts

CellColumn = tuple[str, Callable[[Cell], str]]
# What stands behind a table's title, its columns, and the arms of its rows; None: all.
Layout = tuple[str, list[CellColumn], set[Arm] | None]


def cell_tables(results: StudyResults, *, for_paper: bool = False) -> Iterator[Section]:
    """Yield the tables of a study's cells with what is judged of each, policy by policy.

    Args:
        for_paper: whether P alone stands beside each indicator, and Holm's verdicts alone.
    """
    verdicts_of: dict[tuple[str, str], list[Verdict]] = map_reduce(
        results.verdicts, lambda verdict: (verdict.compared.policy, verdict.compared.table)
    )
    cells_of: dict[tuple[str, str], list[Cell]] = map_reduce(
        results.cells, lambda cell: (cell.policy, cell.table)
    )
    for (policy, table), cells in cells_of.items():
        has_published = any(cell.published is not None for cell in cells)
        has_looks = bool(results.looks)
        verdicts = verdicts_of.get((policy, table), [])
        columns = [_SETTING, *_performance_columns(published=has_published, looks=has_looks)]
        if not for_paper:
            columns.append((f"one run [{section.P_LEVEL}]", _one_run))
            columns += [
                (heading, text)
                for heading, measure, text in _COUNTED
                if any(cell.mean_of(measure) is not None for cell in cells)
            ]
        answers = partial(_answers, published=has_published, looks=has_looks)
        layouts = _layouts(verdicts, columns, answers, repeats_p=for_paper)
        for title, columns, arms in layouts:
            rows = tuple(
                tuple(text(cell) for _, text in columns)
                for cell in cells
                if arms is None or cell.arm in arms
            )
            headings = tuple(heading for heading, _ in columns)
            yield Section(f"{policy}: {table}{title}", headings, rows)


def further_tables(results: StudyResults) -> Iterator[Section]:
    """Yield agreement with the reference, times until all is delivered, and how near the edge."""
    yield from map(_agreement, results.agreements)
    yield from _text_sections(results)
    yield from _times_to_clear(results.cells)
    yield from _edge_sections(results.edges)


def _layouts(
    verdicts: Sequence[Verdict],
    columns: Sequence[CellColumn],
    answers: Callable[[str, Sequence[Verdict]], Iterable[CellColumn]],
    *,
    repeats_p: bool,
) -> Iterator[Layout]:
    """Yield the tables of one policy and one heading of the plan, without their cells.

    The first has P and the first indicator; each further one has an indicator. If P is not
    repeated, it has the cells alone for which its indicator was asked.

    Yields:
        What stands behind the title, the columns, and the arms of the rows; None: all.
    """
    by_indicator: dict[str, list[Verdict]] = map_reduce(verdicts, lambda v: v.compared.indicator)
    for number, (indicator, same_indicator) in enumerate(by_indicator.items()):
        of_indicator = answers(indicator, same_indicator)
        if repeats_p:
            title = f", {indicator}" if len(by_indicator) > 1 else ""
            yield title, [*columns, *of_indicator], None
        elif number:
            arms = {verdict.compared.changed for verdict in same_indicator}
            yield ", continued", [_SETTING, *of_indicator], arms
        else:
            yield "", [*columns, *of_indicator], None


def _performance_columns(*, published: bool, looks: bool) -> Iterator[CellColumn]:
    if published:
        yield "P paper", lambda cell: NOTHING if cell.published is None else f"{cell.published:g}"
    heading = "P ours" if published else "P"
    yield f"{heading} [{section.P_LEVEL}]", section.mean_p
    if looks:  # conditions have seeds as many as were needed
        yield "seeds", lambda cell: str(cell.n_seeds)


def _standstills(cell: Cell) -> str:
    """Return the share of runs that deliver nothing at their end, and the longest standstill."""
    longest = cell.mean_of("longest_standstill")
    if longest is None:
        return NOTHING
    return f"{_percent_of(cell, 'stands_still')} (longest wait {longest:.0f} s in the mean)"


def _percent_of(cell: Cell, measure: str) -> str:
    share = cell.mean_of(measure)
    return NOTHING if share is None else f"{100.0 * share:.0f} %"


def _rounded_mean(cell: Cell, measure: str) -> str:
    mean = cell.mean_of(measure)
    return NOTHING if mean is None else f"{mean:.0f}"


_SETTING: CellColumn = ("", lambda cell: cell.words)
CONTACTS_HEADING = f"contacts a robot-minute [{section.P_LEVEL}]"


def contacts_text(cell: Cell) -> str:
    """Return the mean contacts per robot-minute of a cell with its limits."""
    return section.bracketed(cell.contacts, 1) if cell.contacts.value >= 0.0 else NOTHING


# What stands beside P where it was counted in all runs of a cell: heading, measure, text.
_COUNTED: tuple[tuple[str, str, Callable[[Cell], str]], ...] = (
    (CONTACTS_HEADING, "contacts_per_robot_minute", contacts_text),
    ("runs that stand still", "stands_still", _standstills),
    ("on time", "share_on_time", partial(_percent_of, measure="share_on_time")),
    ("95 % late by at most [s]", "p95_tardiness", partial(_rounded_mean, measure="p95_tardiness")),
    ("longest queue", "longest_queue", partial(_rounded_mean, measure="longest_queue")),
)


def _one_run(cell: Cell) -> str:
    return section.limits(cell.one_run, section.digits_of(cell.mean.value)) or NOTHING


def _answers(
    indicator: str,
    verdicts: Sequence[Verdict],
    *,
    published: bool,
    looks: bool,
) -> Iterator[CellColumn]:
    """Yield the columns of one indicator in a table of cells.

    Value with interval, its level where they differ, the paper's value, and per property (scalable,
    superlinear, ...) the verdict beside what the paper claims.
    """
    ratio = partial(section.ratio, names_level=False)
    levels = {verdict.level for verdict in verdicts} - {None}
    if len(levels) > 1:
        yield _column(f"{indicator} [interval]", verdicts, ratio)
        yield _column("level", verdicts, lambda v: section.percent(v.level) if v.level else NOTHING)
    else:
        heading = f"{indicator} [{section.percent(level_of(verdicts))}]"
        yield _column(heading, verdicts, ratio)
    if looks:
        yield _column(
            "seeds", verdicts, lambda v: str(v.estimate.n_seeds) if v.estimate else NOTHING
        )
    if published:
        yield _column(f"{indicator} paper", verdicts, lambda v: section.number(v.published))
    by_property: dict[str, list[Verdict]] = map_reduce(verdicts, lambda v: v.property_name)
    for name, of_property in by_property.items():
        yield _column(name, of_property, lambda verdict: verdict.in_words)
        if published:
            yield _column("paper", of_property, _claim_text)


def _column(
    heading: str, verdicts: Sequence[Verdict], text: Callable[[Verdict], str]
) -> CellColumn:
    verdict_of = {verdict.compared.changed: verdict for verdict in verdicts}
    return heading, lambda cell: text(verdict_of[cell.arm]) if cell.arm in verdict_of else NOTHING


def _claim_text(verdict: Verdict) -> str:
    if verdict.claimed is None:
        return NOTHING
    return "yes" if verdict.claimed else "no"


def _text_sections(results: StudyResults) -> Iterator[Section]:
    """Yield what the reference's text says beside what each policy does."""
    reference = results.reference
    if reference is None:
        return
    by_policy: dict[str, list[Verdict]] = map_reduce(
        results.verdicts, lambda verdict: verdict.compared.policy
    )
    for policy, verdicts in by_policy.items():
        if rows := sentences(reference, verdicts):
            columns = ("the text", "claim", f"ours [{section.P_LEVEL}]", "verdict")
            yield Section(f"{policy}: what the text says", columns, tuple(rows), (reference.whose,))


def sentences(reference: Reference, verdicts: Sequence[Verdict]) -> list[Texts]:
    """Return a row for each claim of the reference's text, those of a sentence together."""
    verdict_on = {verdict.compared.question: verdict for verdict in verdicts}
    rows = []
    for sentence, questions in reference.sentences.items():
        of_sentence = [verdict_on[question] for question in questions if question in verdict_on]
        rows += claims(f'"{sentence}"', of_sentence)
    return rows


def claims(heading: str, verdicts: Sequence[Verdict]) -> list[Texts]:
    """Return a row for each claim: below the heading what it asks, our value, and the verdict."""
    headings = [heading] + [""] * len(verdicts)
    return [
        (headings[index], *(text(verdict) for text in _CLAIM_COLUMNS))
        for index, verdict in enumerate(verdicts)
    ]


def _claim(verdict: Verdict) -> str:
    """Return what is claimed, e.g. "N 5 -> 10: S > 0"."""
    comparison = verdict.compared
    below = "<" if comparison.definition.compares == "policy" else "≤"
    sign = ">" if verdict.claimed else below
    return f"{comparison.label}: {comparison.indicator} {sign} {comparison.threshold:.3g}"


def _on_claim(verdict: Verdict) -> str:
    """Return the decision on a claim; of an open one the side on which its interval lies."""
    decision = verdict.on_claim.adjusted if verdict.on_claim else UNDEFINED
    word = section.word_to_count(verdict, decision)
    above = verdict.lies_above
    if word == "open" and above is not None:
        return "open, leans for" if above == verdict.claimed else "open, leans against"
    return "contradicted" if word == "refuted" else word


# What is claimed, our value, and the verdict.
_CLAIM_COLUMNS: tuple[Callable[[Verdict], str], ...] = (_claim, section.ratio, _on_claim)


def _times_to_clear(cells: Sequence[Cell]) -> Iterator[Section]:
    """Yield the time until all items were delivered, where a run delivered all of them."""
    rows = tuple(
        (f"{cell.policy}: {cell.words}", section.time_to_clear(cell))
        for cell in cells
        if any(outcome.all_delivered for outcome in cell.outcomes)
    )
    line = (
        'No number of items caps it. "x of y": so many runs were not done when the time was up; '
        "∞: nor was the median."
    )
    if rows:
        columns = "", f"median [s], {section.P_LEVEL}"
        yield Section("Time until all items are delivered", columns, rows, (line,))


def _agreement(agreement: Agreement) -> Section:
    n_cells = len(agreement.cells)
    level = section.P_LEVEL
    lines = [f"Cells inside the {level} prediction interval: one seed gives no interval."]
    if all(cell.n_seeds > 1 for cell in agreement.cells):
        lines = [
            (
                f"Cells whose published P lies inside the {level} prediction interval of one of "
                f"our runs: {n_cells - len(agreement.misses)} of {n_cells}; inside that of our "
                f"mean: {len(agreement.met)} of {n_cells}."
            ),
            f"Misses: {'; '.join(cell.words for cell in agreement.misses) or 'none'}.",
        ]
    if agreement.mean_log_error is not None:
        lines.append(f"Mean |log error| of our mean P: {agreement.mean_log_error:.3f}.")
    return Section(f"{agreement.policy}: agreement with the published values", lines=tuple(lines))


def _edge_sections(edges: Sequence[Edge]) -> Iterator[Section]:
    """Yield how near each policy is to the size at which half of its runs collapse."""
    for edge in edges:
        first = edge.cells[0]
        share = f"runs collapsed, {section.P_LEVEL}"
        columns = "N", share, "S of all runs", "S of the runs that did not"
        line = (
            f"{critical_size_in_words(edge)} (logistic in log N, quasi-likelihood). Two phases "
            "are named where a test with 5 % of error over the sizes says so; the other sizes are "
            "told by the one that shows them most clearly."
        )
        title = f"{first.policy}: how near the edge, {first.table}"
        yield Section(title, columns, tuple(_rows_of_edge(edge)), (line,))


def critical_size_in_words(edge: Edge) -> str:
    """Return at which size half of the runs collapse; nothing is told beyond the largest."""
    largest = edge.cells[-1].words
    if edge.size.value > edge.cells[-1].arm.setting.value:
        return f"Less than half of the runs collapse up to {largest}"
    if edge.size.low == 0.0 and edge.size.high == math.inf:
        return (
            f"Half of the runs collapse at about N = {section.fixed(edge.size.value, 0)}, without "
            "interval: the sizes do not show both that few and that nearly all runs collapse"
        )
    return f"Half of the runs collapse at N = {section.bracketed(edge.size, 0)}"


def _rows_of_edge(edge: Edge) -> Iterator[tuple[str, ...]]:
    of_all = edge.scalabilities([cell.by_seed.ravel() for cell in edge.cells])
    of_good = edge.scalabilities(edge.good_runs)
    for cell, share, *values in zip(edge.cells, edge.shares, of_all, of_good):
        shown = (NOTHING if value is None else section.fixed(value, 3) for value in values)
        yield cell.words, section.share_in_words(share), *shown
