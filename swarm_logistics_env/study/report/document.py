"""The whole report in order, before it becomes Markdown or HTML."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, NamedTuple

from swarm_logistics_env.study.verdicts.mid_run_faults import resiliences
from swarm_logistics_env.study.verdicts.results import StudyResults

from .answer import Answer, answer
from .answer_notes import warnings
from .fault_sections import fault_sections
from .figures import (
    forest_figures,
    forest_points,
    indicator_figures,
    policies_figure,
    trade_off_figure,
)
from .for_a_paper import PaperTables, in_a_sentence, paper_tables
from .points import Point
from .section import Figure, Section
from .sentences import sentence, verdict_sections
from .set_up import methods, setup_sheet
from .single_runs import SingleRuns, single_runs
from .tables import cell_tables, further_tables

if TYPE_CHECKING:
    import pandas as pd


class Chapter(NamedTuple):
    """A part of the report; `text` explains what it shows and how to read it."""

    title: str
    text: str
    sections: tuple[Section, ...]


class Document(NamedTuple):
    """The whole report: all that is written, and nothing that is still to be asked.

    Attributes:
        text: the sentences below its heading, which the answer has.
        answer: what the study found.
        points: the value of each line of the answer, as it is drawn.
        chapters: its parts, in order.
        paper: its tables for a paper.
        runs: its single runs, for the page.
        cells, claims: P of every condition and every verdict, a row each.
    """

    text: tuple[str, ...]
    answer: Answer
    points: tuple[Point, ...]
    chapters: tuple[Chapter, ...]
    paper: PaperTables
    runs: SingleRuns
    cells: pd.DataFrame
    claims: pd.DataFrame

    @property
    def summary(self) -> tuple[Section, ...]:
        """Warnings, tables and measures of faults alone, for a terminal."""
        shown = ("Warnings", "Results", "Beyond the paper")
        return tuple(
            section._replace(figures=())
            for chapter in self.chapters
            if chapter.title in shown
            for section in chapter.sections
            if section.columns or section.lines
        )

    @property
    def figures(self) -> list[Figure]:
        """Every figure, in the order of the report."""
        return [
            figure
            for chapter in self.chapters
            for section in chapter.sections
            for figure in section.figures
        ]


def document(results: StudyResults) -> Document:
    """Return the report on a study's results."""
    plan = results.plan
    text = tuple(_text(results))
    study_answer = answer(results)
    lines = tuple(warnings(results))
    sentences = [sentence(results, verdict) for verdict in results.verdicts]
    verdicts_in_words = tuple(verdict_sections(results.verdicts, sentences))
    points = forest_points(results, study_answer)
    figures = (
        *policies_figure(results),
        *forest_figures(results, study_answer, points),
        *indicator_figures(results),
    )
    trade_off = tuple(Section("", figures=(figure,)) for figure in trade_off_figure(results))
    runs = single_runs(results, sentences)
    measures = tuple(resiliences(results))
    of_faults = tuple(fault_sections(measures, results.seeds_text))
    tables = tuple(cell_tables(results))
    paper_sections = tuple(cell_tables(results, for_paper=True))
    further = tuple(further_tables(results))
    methods_section = Section("", lines=(methods(plan, results.looks),))
    set_up = setup_sheet(plan)
    paper = paper_tables(results, study_answer, (*paper_sections, *further, *of_faults))
    has_values = any(verdict.estimate for verdict in results.verdicts)
    quotable = (Section("", lines=(in_a_sentence(results, study_answer),)),) if has_values else ()
    chapters = [
        Chapter("Warnings", "", (Section("Warnings", lines=lines),) if lines else ()),
        Chapter(
            "Figures",
            "The paper's indicators; raw P and the numbers stand in the tables below.",
            tuple(Section("", figures=(figure,)) for figure in figures),
        ),
        Chapter(
            "Verdicts",
            "One sentence per question. Verdicts are Holm-adjusted; the family is all comparisons "
            "of one indicator for one policy.",
            verdicts_in_words,
        ),
        Chapter(
            "Results",
            f"P is {plan.what_p_is}. Square brackets hold intervals at the "
            "level that the heading gives, or at that behind them; "
            '"one run" is where a single further run falls.',
            (*tables, *further),
        ),
        Chapter(
            "Beyond the paper",
            "Measures that the paper does not define; none of them enters a verdict above.",
            (*trade_off, *of_faults),
        ),
        Chapter("Set-up", "", set_up),
        Chapter("Methods", "", (methods_section,)),
        Chapter("For a paper", "In a few sentences; tables.tex has the tables.", quotable),
    ]
    report = Document(
        text,
        study_answer,
        points,
        tuple(chapter for chapter in chapters if chapter.sections),
        paper,
        runs,
        results.cell_table,
        results.verdict_table,
    )
    _make_names_differ(report.figures)
    return report


def _text(results: StudyResults) -> Iterator[str]:
    """Yield the sentences below the title."""
    plan = results.plan
    yield (
        f"{plan.specification.name}: {len(plan.cases)} conditions, {results.seeds_text}; every "
        "verdict holds for the conditions of the set-up sheet below and for no others."
    )
    if results.reference:
        yield f'"paper" is {results.reference.source}.'


def _make_names_differ(figures: Iterable[Figure]) -> None:
    """Number figures whose policies or tables differ in punctuation or case alone."""
    used_names: set[str] = set()
    for figure in figures:
        name = figure.name
        number = 1
        while figure.name.lower() in used_names:
            number += 1
            figure.name = f"{name}-{number}"
        used_names.add(figure.name.lower())
