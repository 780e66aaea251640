"""Tables: results, agreement with published values, faults; warnings."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np

from swarm_logistics_env.grouping import grouped
from swarm_logistics_env.questions.comparison import CONFIDENCE
from swarm_logistics_env.spi.estimate import Estimate
from swarm_logistics_env.verdicts.agreement import Agreement, agreements
from swarm_logistics_env.verdicts.cell import Cell
from swarm_logistics_env.verdicts.mid_run_faults import RepairCurve, resiliences
from swarm_logistics_env.verdicts.reference import Reference
from swarm_logistics_env.verdicts.results import StudyResults
from swarm_logistics_env.verdicts.verdict import UNAFFECTED, UNDEFINED, Verdict

from . import section
from .figures import rate_figures
from .section import NOTHING, Section, Texts

CellColumn = tuple[str, Callable[[Cell], str]]


def tables(results: StudyResults) -> Iterator[Section]:
    """Yield the tables of a study's results, policy by policy; then how near each comes.

    Each has a table of P and the first indicator, then one of each further indicator.
    """
    tests = grouped(results.verdicts, lambda test: (test.compared.policy, test.compared.table))
    for place in dict.fromkeys((cell.policy, cell.table) for cell in results.cells):
        rows = [cell for cell in results.cells if (cell.policy, cell.table) == place]
        published = any(cell.published is not None for cell in rows)
        setting: CellColumn = ("", lambda cell: cell.words)
        columns = [setting]
        if published:
            columns.append(("P paper", _published))
        columns.append((f"P{' ours' * published} [{section.P_LEVEL}]", section.mean_p))
        columns.append((f"one run [{section.P_LEVEL}]", _one_run))
        whole = title = ": ".join(place)
        asked_here = tests.get(place, ())
        for indicator, asked in grouped(asked_here, lambda test: test.compared.indicator).items():
            answers = _answers(indicator, asked, published=published)
            shown = [*columns, *answers]
            lines = tuple(tuple(text(cell) for _, text in shown) for cell in rows)
            yield Section(title, tuple(heading for heading, _ in shown), lines)
            # P is printed once: the tables of further indicators hold what was asked alone.
            changed = {test.compared.changed for test in asked}
            rows = [cell for cell in rows if cell.arm in changed]
            columns, title = [setting], f"{whole}, continued"
    yield from map(_agreement, agreements(results))
    yield from _sentences(results)
    yield from _times_to_clear(results)


def _published(cell: Cell) -> str:
    return NOTHING if cell.published is None else f"{cell.published:g}"


def _one_run(cell: Cell) -> str:
    return section.limits(cell.one_run, section.digits_of(cell.mean.value)) or NOTHING


def _answers(indicator: str, tests: Sequence[Verdict], *, published: bool) -> Iterator[CellColumn]:
    """Yield the columns of one indicator in a table of cells.

    Value with interval, the paper's value, and per property (scalable, superlinear, ...) the
    verdict, with Holm's in brackets where it differs, beside what the paper claims.
    """

    def column(
        heading: str, asked: Sequence[Verdict], text: Callable[[Verdict], str]
    ) -> CellColumn:
        by_arm = {test.compared.changed: test for test in asked}
        return heading, lambda cell: text(by_arm[cell.arm]) if cell.arm in by_arm else NOTHING

    level = section.level_of(tests)
    shown = partial(section.ratio, level=level)
    yield column(f"{indicator} [{section.percent(level)}]", tests, shown)
    if published:
        yield column(f"{indicator} paper", tests, lambda test: section.number(test.published))
    for name, asked in grouped(tests, lambda test: test.property_name).items():
        yield column(name, asked, section.answered)
        if published:
            yield column("paper", asked, _claimed)


def _claimed(test: Verdict) -> str:
    return NOTHING if test.claimed is None else "yes" if test.claimed else "no"


def _sentences(results: StudyResults) -> Iterator[Section]:
    """Yield what the reference's text says beside what each policy does."""
    if (reference := results.reference) is None:
        return
    for policy, tests in grouped(results.verdicts, lambda test: test.compared.policy).items():
        if said := sentences(reference, tests):
            columns = ("the text", "claim", f"ours [{section.P_LEVEL}]", "verdict")
            yield Section(f"{policy}: what the text says", columns, tuple(said), (reference.whose,))


def sentences(reference: Reference, tests: Sequence[Verdict]) -> list[Texts]:
    """Return a row for each claim of the reference's text, those of a sentence together."""
    by_question = {test.compared.question: test for test in tests}
    rows = []
    for sentence, questions in reference.sentences.items():
        rows += claims(
            f'"{sentence}"', [by_question[one] for one in questions if one in by_question]
        )
    return rows


def claims(heading: str, tests: Sequence[Verdict]) -> list[Texts]:
    """Return a row for each claim: below the heading what it asks, our value, and the verdict."""
    rows: list[Texts] = []
    for test in tests:
        compared = test.compared
        sign = ">" if test.claimed else "<" if compared.definition.compares == "policy" else "≤"
        asked = f"{compared.label}: {compared.indicator} {sign} {compared.threshold:.3g}"
        rows.append((heading, asked, section.ratio(test), _on_claim(test)))
        heading = ""
    return rows


def _on_claim(test: Verdict) -> str:
    """Return the verdict on a claim; of an open one the side on which its interval lies."""
    said = section.counted_as(test, test.on_claim.adjusted if test.on_claim else UNDEFINED)
    above = section.lies_above(test)
    if said == "open" and above is not None:
        return f"open, leans {'for' if above == test.claimed else 'against'}"
    return "contradicted" if said == "refuted" else said


def _times_to_clear(results: StudyResults) -> Iterator[Section]:
    """Yield the time until all items were delivered, where a run delivered all of them."""
    rows = tuple(
        (f"{cell.policy}: {cell.words}", section.time_to_clear(cell))
        for cell in results.cells
        if any(run.all_delivered for run in cell.outcomes)
    )
    line = (
        'No number of items caps it. "x of y": so many runs were not done when the time was up; '
        "∞: nor was the median."
    )
    if rows:
        columns = "", f"median [s], {section.P_LEVEL}"
        yield Section("Time until all items are delivered", columns, rows, (line,))


def _agreement(found: Agreement) -> Section:
    total = len(found.cells)
    level = section.P_LEVEL
    lines = [f"Cells inside the {level} prediction interval: one seed gives no interval."]
    if all(cell.n_seeds > 1 for cell in found.cells):
        lines = [
            (
                f"Cells whose published P lies inside the {level} prediction interval of one of "
                f"our runs: {total - len(found.misses)} of {total}; inside that of our mean: "
                f"{len(found.met)} of {total}."
            ),
            f"Misses: {'; '.join(cell.words for cell in found.misses) or 'none'}.",
        ]
    if found.mean_log_error is not None:
        lines.append(f"Mean |log error| of our mean P: {found.mean_log_error:.3f}.")
    return Section(f"{found.policy}: agreement with the published values", lines=tuple(lines))


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
    stalls = [cell for cell in results.cells if cell.stalled > 0.0]
    if stalls:
        told = (f"{c.policy}, {c.arm.setting} ({c.stalled:.0%} of {c.n_seeds})" for c in stalls)
        yield (
            "Runs stalled: they have less than a quarter of the median P of their condition: "
            f"{'; '.join(dict.fromkeys(told))}."
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
    for test in results.verdicts:
        if test.problem:
            compared = test.compared
            what = f"{compared.policy}, {compared.indicator}, {compared.label}"
            yield f"{what} is undefined: {test.problem}."


_SINGLE_TEXT = (
    "Until the first window in which a run delivers as much again as the paired run with the "
    "robots removed; those that never do are censored (Kaplan and Meier). Deliveries scatter, so "
    "what counts is the distance from the null: pairs without a fault that differ in behaviour."
)


def fault_sections(results: StudyResults) -> Iterator[Section]:
    """Yield the measures of faults in mid-run, and the curves of what is delivered around them."""
    found = list(resiliences(results))
    if not found:
        return
    who = [(one.compared.policy, str(one.compared.changed.setting)) for one in found]
    indices = (x for one in found for x in (one.against_removed, one.against_whole) if x)
    level = section.percent(next((index.confidence for index in indices), CONFIDENCE))
    columns = (
        "policy", "fault", f"over the removed robots' [{level}]", "above 1",
        f"over the whole swarm's [{level}]", "above 1 - m/N",
    )  # fmt: skip
    rows = tuple(
        (*whose, *_index(one.against_removed), *_index(one.against_whole))
        for whose, one in zip(who, found)
    )
    line = (
        "Deliveries after the onset over those of the paired reference. Reference with the robots "
        "removed at the onset: fault tolerance local in time; whole swarm: robustness local in "
        f"time. Verdicts unadjusted; {section.seeds_text(results)}."
    )
    yield Section("Resilience: deliveries after the onset", columns, rows, (line,))
    figures = tuple(rate_figures(results))
    if figures:
        yield Section("", figures=figures)
    columns = ("policy", "fault", "median [s]", "not back", "null's median [s]", "null not back")
    rows = tuple(
        (*whose, *_back(one.single[0]), *_back(one.single[1]))
        for whose, one in zip(who, found)
        if one.single
    )
    problems = [
        f"{policy}, {fault}: no time to come back: {one.problem}."
        for (policy, fault), one in zip(who, found)
        if one.problem
    ]
    yield Section("Time until single runs are back", columns, rows, (_SINGLE_TEXT, *problems))


def _index(estimate: Estimate | None) -> Texts:
    """Return an index with its interval, and its verdict."""
    if estimate is None:
        return NOTHING, "undefined"
    said = UNAFFECTED if estimate.identical else estimate.verdict
    capped = section.SATURATED * ("capped" in estimate.flags)
    return section.bracketed(estimate, 3), said + capped


def _back(found: RepairCurve) -> Texts:
    """Return the median time until runs are back, and how many never are."""
    median = found.curve.median()
    told = "not reached" if median is None else f"{median:g}"
    return told, f"{np.count_nonzero(~found.back)} of {found.back.size} runs"
