"""Tables: results, agreement with published values, faults; warnings."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial

import numpy as np
from more_itertools import map_reduce

from swarm_logistics_env.spi.definitions import DEFINITIONS
from swarm_logistics_env.spi.estimate import Estimate
from swarm_logistics_env.study.questions.comparison import CONFIDENCE, Arm, Family
from swarm_logistics_env.study.verdicts.agreement import Agreement
from swarm_logistics_env.study.verdicts.cell import Cell
from swarm_logistics_env.study.verdicts.mid_run_faults import (
    RUNS_ARE_MISSING,
    RepairCurve,
    Resilience,
    resiliences,
)
from swarm_logistics_env.study.verdicts.reference import Reference
from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.study.verdicts.verdict import UNAFFECTED, UNDEFINED, Verdict, level_of

from . import section
from .collapse_tables import collapsed_in_words, edge_sections
from .figures import rate_figures
from .section import NOTHING, Section, Sentence, Texts

CellColumn = tuple[str, Callable[[Cell], str]]
# What stands behind a table's title, its columns, and the arms of its rows; None: all.
Layout = tuple[str, list[CellColumn], set[Arm] | None]


def verdict_sections(
    verdicts: Sequence[Verdict], sentences: Sequence[Sentence]
) -> Iterator[Section]:
    """Yield the verdicts in words, those of one policy and indicator together."""
    families: dict[Family, list[tuple[Verdict, Sentence]]] = map_reduce(
        zip(verdicts, sentences), lambda pair: pair[0].compared.family
    )
    for (policy, indicator), pairs in families.items():
        yield Section(
            f"{policy}: {DEFINITIONS[indicator].heading}",
            sentences=tuple(sentence for _, sentence in pairs),
        )


def tables(results: StudyResults, *, for_paper: bool = False) -> Iterator[Section]:
    """Yield the tables of a study's results, policy by policy; then how near each comes.

    Args:
        for_paper: whether P alone stands beside each indicator, and Holm's verdicts alone.
    """
    verdicts_of: dict[tuple[str, str], list[Verdict]] = map_reduce(
        results.verdicts, lambda verdict: (verdict.compared.policy, verdict.compared.table)
    )
    for policy, table in dict.fromkeys((cell.policy, cell.table) for cell in results.cells):
        cells = [cell for cell in results.cells if (cell.policy, cell.table) == (policy, table)]
        has_published = any(cell.published is not None for cell in cells)
        has_contacts = any(cell.contacts.value >= 0.0 for cell in cells)  # NaN: not counted
        has_looks = bool(results.looks)
        verdicts = verdicts_of.get((policy, table), [])
        columns = [_SETTING, *_performance_columns(published=has_published, looks=has_looks)]
        if not for_paper:
            columns.append((f"one run [{section.P_LEVEL}]", _one_run))
            if has_contacts:
                columns.append((CONTACTS_HEADING, contacts_text))
        decision = _holm if for_paper else section.decision_text
        answers = partial(_answers, decision, published=has_published, looks=has_looks)
        layouts = _layouts(verdicts, columns, answers, repeats_p=for_paper)
        for title, columns, arms in layouts:
            rows = tuple(
                tuple(text(cell) for _, text in columns)
                for cell in cells
                if arms is None or cell.arm in arms
            )
            headings = tuple(heading for heading, _ in columns)
            yield Section(f"{policy}: {table}{title}", headings, rows)
    yield from map(_agreement, results.agreements)
    yield from _text_sections(results)
    yield from _times_to_clear(results.cells)
    yield from edge_sections(results.edges)


def _holm(verdict: Verdict) -> str:
    """Return Holm's verdict, and why it is untestable, or open beside an interval on one side."""
    word = verdict.on_property.adjusted
    return f"{word} ({verdict.reason})" if verdict.reason else word


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
        yield "P paper", _published_text
    heading = "P ours" if published else "P"
    yield f"{heading} [{section.P_LEVEL}]", section.mean_p
    if looks:  # conditions have seeds as many as were needed
        yield "seeds", lambda cell: str(cell.n_seeds)


_SETTING: CellColumn = ("", lambda cell: cell.words)
CONTACTS_HEADING = f"contacts a robot-minute [{section.P_LEVEL}]"


def contacts_text(cell: Cell) -> str:
    """Return the mean contacts per robot-minute of a cell with its limits."""
    return section.bracketed(cell.contacts, 1) if cell.contacts.value >= 0.0 else NOTHING


def _published_text(cell: Cell) -> str:
    return NOTHING if cell.published is None else f"{cell.published:g}"


def _one_run(cell: Cell) -> str:
    return section.limits(cell.one_run, section.digits_of(cell.mean.value)) or NOTHING


def _answers(
    decision_text: Callable[[Verdict], str],
    indicator: str,
    verdicts: Sequence[Verdict],
    *,
    published: bool,
    looks: bool,
) -> Iterator[CellColumn]:
    """Yield the columns of one indicator in a table of cells.

    Value with interval, the paper's value, and per property (scalable, superlinear, ...) the
    decision, with Holm's in brackets where it differs, beside what the paper claims.
    """
    level = level_of(verdicts)
    ratio = partial(section.ratio, level=level)
    yield _column(f"{indicator} [{section.percent(level)}]", verdicts, ratio)
    if looks:
        yield _column("seeds", verdicts, _number_of_seeds)
    if published:
        yield _column(f"{indicator} paper", verdicts, lambda v: section.number(v.published))
    by_property: dict[str, list[Verdict]] = map_reduce(verdicts, lambda v: v.property_name)
    for name, of_property in by_property.items():
        yield _column(name, of_property, decision_text)
        if published:
            yield _column("paper", of_property, _claim_text)


def _column(
    heading: str, verdicts: Sequence[Verdict], text: Callable[[Verdict], str]
) -> CellColumn:
    verdict_of = {verdict.compared.changed: verdict for verdict in verdicts}
    return heading, lambda cell: text(verdict_of[cell.arm]) if cell.arm in verdict_of else NOTHING


def _number_of_seeds(verdict: Verdict) -> str:
    return str(verdict.estimate.n_seeds) if verdict.estimate else NOTHING


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


def warnings(results: StudyResults) -> Iterator[str]:
    """Yield what a reader has to know before any verdict, one sentence each."""
    if results.damage:
        yield f"{results.damage}."
    if any(cell.saturated for cell in results.cells):
        yield (
            f"{section.SATURATED} marks a P that is capped, because every item was delivered in at "
            "least one run, and the indicators that rest on it. A verdict that a larger P could "
            "turn is open."
        )
    if results.collapses:
        words = collapsed_in_words(
            results.collapses, names_policies=len(results.policies) > 1, most=None
        )
        yield (
            f"Runs are of two phases, a good one and one that has collapsed: {words}. A mean P is "
            "of both."
        )
    if results.exploratory:
        yield (
            "The verdicts are exploratory: they are over other seeds than the study declared "
            "before its first run, so they err more often than their level."
        )
    if results.late_margin:
        yield (
            "The verdicts on the margin of equivalence are exploratory: another margin was "
            "declared before the first run."
        )
    for cell in results.cells:
        if cell.problem:
            yield f"{cell.policy}, {cell.table}, {cell.arm.setting} is incomplete: {cell.problem}."
    for verdict in results.verdicts:
        if verdict.problem:
            comparison = verdict.compared
            name = f"{comparison.policy}, {comparison.indicator}, {comparison.label}"
            yield f"{name} is undefined: {verdict.problem}."


_SINGLE_TEXT = (
    "Until the first window in which a run delivers as much again as the paired run with the "
    "robots removed; those that never do are censored (Kaplan and Meier). Deliveries scatter, so "
    "what counts is the distance from the null: pairs without a fault that differ in behaviour."
)


def fault_sections(results: StudyResults) -> Iterator[Section]:
    """Yield the measures of faults in mid-run, and the curves of what is delivered around them."""
    all_measures = list(resiliences(results))
    measures = [measure for measure in all_measures if measure.problem != RUNS_ARE_MISSING]
    if not measures:
        return
    faults = [
        (measure.compared.policy, str(measure.compared.changed.setting)) for measure in measures
    ]
    yield _resilience_table(faults, measures, results.seeds_text)
    figures = tuple(rate_figures(all_measures, results.seeds_text))
    if figures:
        yield Section("", figures=figures)
    columns = ("policy", "fault", "median [s]", "not back", "null's median [s]", "null not back")
    rows = tuple(
        (*fault, *_back(measure.single[0]), *_back(measure.single[1]))
        for fault, measure in zip(faults, measures)
        if measure.single
    )
    problems = [
        f"{policy}, {fault}: no time to come back: {measure.problem}."
        for (policy, fault), measure in zip(faults, measures)
        if measure.problem
    ]
    yield Section("Time until single runs are back", columns, rows, (_SINGLE_TEXT, *problems))


def _resilience_table(
    faults: Sequence[tuple[str, str]], measures: Sequence[Resilience], seeds: str
) -> Section:
    indices = [
        index
        for measure in measures
        for index in (measure.against_removed, measure.against_whole)
        if index
    ]
    level = section.percent(indices[0].confidence if indices else CONFIDENCE)
    columns = (
        "policy", "fault", f"over the removed robots' [{level}]", "above 1",
        f"over the whole swarm's [{level}]", "above 1 - m/N",
    )  # fmt: skip
    rows = tuple(
        (*fault, *_index(measure.against_removed), *_index(measure.against_whole))
        for fault, measure in zip(faults, measures)
    )
    line = (
        "Deliveries after the onset over those of the paired reference. Reference with the robots "
        "removed at the onset: fault tolerance local in time; whole swarm: robustness local in "
        f"time. Verdicts unadjusted; {seeds}."
    )
    return Section("Resilience: deliveries after the onset", columns, rows, (line,))


def _index(estimate: Estimate | None) -> Texts:
    """Return an index with its interval, and its decision."""
    if estimate is None:
        return NOTHING, "undefined"
    word = UNAFFECTED if estimate.identical else estimate.verdict
    mark = section.SATURATED if "capped" in estimate.flags else ""
    return section.bracketed(estimate, 3), word + mark


def _back(curve: RepairCurve) -> Texts:
    """Return the median time until runs are back, and how many never are."""
    median = curve.curve.median()
    time = "not reached" if median is None else f"{median:g}"
    return time, f"{np.count_nonzero(~curve.back)} of {curve.back.size} runs"
