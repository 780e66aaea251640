"""The whole report in order, before it becomes Markdown or HTML."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from swarm_logistics_env.report.figures import (
    Figure,
    indicator_figures,
    scaling_figure,
)
from swarm_logistics_env.report.further_measures import beyond, beyond_faults, checks
from swarm_logistics_env.report.policies_compared import compared
from swarm_logistics_env.report.result_tables import Section, tables, warnings
from swarm_logistics_env.report.setup_sheet import setup_sheet
from swarm_logistics_env.report.wording import sentence
from swarm_logistics_env.spi.definitions import DEFINITIONS
from swarm_logistics_env.studies.results import StudyResults
from swarm_logistics_env.studies.size_series import size_series


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
        chapters: its parts, in order.
        summary: the tables, warnings and measures of faults alone, for a terminal.
    """

    title: str
    text: tuple[str, ...]
    chapters: tuple[Chapter, ...]
    summary: tuple[Section, ...]


def document(results: StudyResults) -> Document:
    """Return the report on a study's results."""
    plan = results.plan
    text = [
        (
            f"{plan.specification.name}: {len(plan.conditions)} conditions, {len(plan.seeds)} "
            f"{'seed' if len(plan.seeds) == 1 else 'seeds'} of each; every verdict holds for the "
            "conditions of the set-up sheet below and for no others."
        )
    ]
    if results.reference:
        text.append(f'"paper" is {results.reference.source}.')
    table_sections, fault_sections = tuple(tables(results)), tuple(beyond_faults(results))
    chapters = _chapters(results, table_sections, fault_sections)
    lines = warnings(results)
    summary = (
        *table_sections,
        *([Section("Warnings", lines=lines)] if lines else []),
        *(replace(one, figures=()) for one in fault_sections if one.columns or one.lines),
    )
    return Document(
        f"Study {plan.specification.name!r}",
        tuple(text),
        tuple(_names_once(chapter for chapter in chapters if chapter.sections)),
        summary,
    )


def _names_once(chapters: Iterable[Chapter]) -> Iterator[Chapter]:
    """Yield chapters whose figures have names of their own, upper and lower case being one.

    Policies and tables that differ in punctuation alone give equal names.
    """
    taken: set[str] = set()

    def named(figure: Figure) -> Figure:
        name, number = figure.name, 1
        while name.lower() in taken:
            number += 1
            name = f"{figure.name}-{number}"
        taken.add(name.lower())
        return replace(figure, name=name)

    for chapter in chapters:
        yield replace(
            chapter,
            sections=tuple(
                replace(section, figures=tuple(named(figure) for figure in section.figures))
                for section in chapter.sections
            ),
        )


def figures_of(whole: Document) -> Iterator[Figure]:
    """Yield every figure of a report, in its order."""
    for chapter in whole.chapters:
        for section in chapter.sections:
            yield from section.figures


def _chapters(
    results: StudyResults,
    table_sections: tuple[Section, ...],
    fault_sections: tuple[Section, ...],
) -> Iterator[Chapter]:
    series = size_series(results)
    yield Chapter(
        "Warnings", "", tuple([Section("", lines=lines)] if (lines := warnings(results)) else [])
    )
    yield Chapter(
        "Figures",
        "The paper's indicators; raw P and the numbers stand in the tables below.",
        tuple(Section("", figures=(figure,)) for figure in indicator_figures(results))
        + tuple(
            Section("", figures=(scaling_figure(results, one),))
            for one in series
            if one.performance
        ),
    )
    yield Chapter(
        "Verdicts",
        "One sentence per question. The mark shows the Holm-adjusted verdict; the family is all "
        "comparisons of one indicator for one policy.",
        tuple(_verdicts(results)),
    )
    yield Chapter(
        "Results",
        "P is the number of items delivered. Square brackets hold intervals at the level that the "
        'heading gives; "one run" is where a single further run falls.',
        table_sections,
    )
    yield Chapter("Checks", "How far the verdicts hang on the method.", tuple(checks(results)))
    yield Chapter(
        "Policies compared",
        "Side by side, seed by seed; the first policy of the study is the one that the others are "
        "measured against.",
        tuple(compared(results)),
    )
    yield Chapter(
        "Beyond the paper",
        "Measures that the paper does not define; none of them enters a verdict above.",
        (*beyond(results, series), *fault_sections),
    )
    yield Chapter("Set-up", "", setup_sheet(results.plan))


def _verdicts(results: StudyResults) -> Iterator[Section]:
    families = dict.fromkeys((j.policy, j.indicator) for j in results.tests)
    for policy, indicator in families:
        yield Section(
            f"{policy}: {DEFINITIONS[indicator].heading}",
            sentences=tuple(
                sentence(results, test)
                for test in results.tests
                if (test.policy, test.indicator) == (policy, indicator)
            ),
        )
