"""The whole report in order, before it becomes Markdown or HTML."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from swarm_logistics_env.spi.definitions import DEFINITIONS
from swarm_logistics_env.studies.indicator_table import findings_of
from swarm_logistics_env.studies.performance_table import groups_of
from swarm_logistics_env.studies.results import StudyResults

from .answer import Answer, answer
from .figures import Figure, indicator_figures, size_figures
from .further_measures import budget_sections, load_sections, look_sections, resilience_sections
from .policies_compared import policy_sections
from .result_tables import Section, tables, warnings
from .setup_sheet import glossary, methods, setup_sheet
from .wording import sentence


@dataclass(frozen=True)
class Chapter:
    """A part of the report; `text` explains what it shows and how to read it."""

    title: str
    text: str
    sections: tuple[Section, ...]


@dataclass(frozen=True)
class Document:
    """The whole report.

    Attributes:
        title, text: its heading and the sentences below it.
        answer: what the study found.
        chapters: its parts, in order.
        summary: the tables, warnings and measures of faults alone, for a terminal.
    """

    title: str
    text: tuple[str, ...]
    answer: Answer
    chapters: tuple[Chapter, ...]
    summary: tuple[Section, ...]

    def figures(self) -> Iterator[Figure]:
        """Yield every figure, in the order of the report."""
        for chapter in self.chapters:
            for section in chapter.sections:
                yield from section.figures


def document(results: StudyResults) -> Document:
    """Return the report on a study's results."""
    plan = results.plan
    what = "seed" if plan.paired else "trial"
    seeds = f"1 {what}" if len(plan.seeds) == 1 else f"{len(plan.seeds)} {what}s"
    seeds = seeds if plan.paired else f"at most {seeds}"
    about = (
        f"{plan.specification.name}: {len(plan.conditions)} conditions, {seeds} of each; every "
        "verdict holds for the conditions of the set-up sheet below and for no others."
    )
    text = [about]
    if results.reference:
        text.append(f'"paper" is {results.reference.source}.')
    result_tables, lines = tuple(tables(results)), tuple(warnings(results))
    faults = *budget_sections(results), *resilience_sections(results), *load_sections(results)
    summary = (
        *result_tables,
        *([Section("Warnings", lines=lines)] if lines else []),
        *(replace(one, figures=()) for one in faults if one.columns or one.lines),
    )
    warned = (Section("", lines=lines),) if lines else ()
    chapters = Chapter("Warnings", "", warned), *_chapters(results, result_tables, faults)
    whole = Document(
        f"Study {plan.specification.name!r}",
        tuple(text),
        answer(results),
        tuple(chapter for chapter in chapters if chapter.sections),
        summary,
    )
    # Policies and tables that differ in punctuation or case alone would give equal files.
    taken: set[str] = set()
    for figure in whole.figures():
        name, number = figure.name, 1
        while figure.name.lower() in taken:
            number += 1
            figure.name = f"{name}-{number}"
        taken.add(figure.name.lower())
    return whole


def _chapters(
    results: StudyResults,
    result_tables: tuple[Section, ...],
    faults: tuple[Section, ...],
) -> Iterator[Chapter]:
    figures = [*indicator_figures(results), *size_figures(results)]
    yield Chapter(
        "Figures",
        "The paper's indicators; raw P and the numbers stand in the tables below.",
        tuple(Section("", figures=(figure,)) for figure in figures),
    )
    yield Chapter(
        "Verdicts",
        "One sentence per question. The mark shows the Holm-adjusted verdict; the family is all "
        "comparisons of one indicator for one policy.",
        tuple(_verdicts(results)),
    )
    yield Chapter(
        "Results",
        f"P is {results.plan.specification.played.performance}. Square brackets hold intervals at "
        'the level that the heading gives; "one run" is where a single further run falls.',
        result_tables,
    )
    yield Chapter(
        "Checks", "How far the verdicts hang on the method.", tuple(look_sections(results))
    )
    yield Chapter(
        "Policies compared",
        "Side by side, seed by seed; the first policy of the study is the one that the others are "
        "measured against.",
        tuple(policy_sections(results)),
    )
    yield Chapter(
        "Beyond the paper",
        "Measures that the paper does not define; none of them enters a verdict above.",
        faults,
    )
    yield Chapter("Set-up", "", setup_sheet(results.plan))
    yield Chapter("Methods", "", (Section("", lines=(methods(results.plan),)),))
    yield Chapter("Glossary", "", (glossary(results.plan),))


def _verdicts(results: StudyResults) -> Iterator[Section]:
    families = groups_of(results.indicators, "policy", "indicator")
    for (policy, indicator), tests in families:
        yield Section(
            f"{policy}: {DEFINITIONS[indicator].heading}",
            sentences=tuple(sentence(results, test) for test in findings_of(tests)),
        )
