"""The answer of a study: P and each indicator in a sentence, then a row a question."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from more_itertools import map_reduce

from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.study.verdicts.verdict import UNTESTABLE

from . import section
from .answer_lines import Line, in_short, lines_of, sentences
from .answer_notes import notes
from .performances import performances
from .policies_compared import compare_policies
from .section import Section

_MOST_WITH_SENTENCES = 2  # policies and tasks; more have a table, and sentences together


class SubjectAnswer(NamedTuple):
    """What a study found of one policy, in one task.

    Attributes:
        name: the policy; with the task where there are several.
        performance: P where the swarm is as it should be, in words.
        p: P alone, with its interval.
        condition: where that is.
        sentences: one on each indicator: how many are decided how, and the worst value.
    """

    name: str
    performance: str
    p: str
    condition: str
    sentences: tuple[str, ...]


class Answer(NamedTuple):
    """What a study found.

    Attributes:
        title: the study's name with its policies in front of it.
        policies: their names, as a list in words.
        comparison: by which factor P of two policies differs; empty: they are not compared.
        overview: P of each policy and task where there are many, and how that compares; None:
            there are few, and each has sentences of its own.
        turns: where the order of more than two policies is the other way round; empty: of fewer.
        scope: how much was asked, of which policies, and over which seeds.
        subjects: what was found of each policy and task.
        lines: the questions.
        notes: what the words of the verdicts mean, and what is still open, a line each.
        seeds: over which everything is.
        level: of the intervals, as a heading says; a line with another one has a letter.
    """

    title: str
    policies: str
    comparison: str
    overview: Section | None
    turns: str
    scope: str
    subjects: tuple[SubjectAnswer, ...]
    lines: tuple[Line, ...]
    notes: tuple[str, ...]
    seeds: str
    level: str

    @property
    def opening(self) -> list[str]:
        """The sentences before the overview: what is decided, compared, and how much was asked."""
        words = {line.verdict.conclusion for line in self.lines}
        is_open = len(self.lines) > 1 and words <= {"open", UNTESTABLE}
        undecided = f"None of {len(self.lines)} questions is decided." if is_open else ""
        several = len(self.subjects) > 1
        scope = self.scope if several else ""
        short = [] if several else in_short(self.lines)
        return [*filter(None, [undecided, *short, self.comparison, scope])]

    @property
    def summary(self) -> list[str]:
        """P and each indicator in a few sentences; of many policies together."""
        if self.overview is not None:
            return [*filter(None, [self.turns]), *sentences(self.lines, self.level)]
        seeds = f"; {self.seeds}" if len(self.subjects) == 1 else ""
        summary = []
        for subject in self.subjects:
            summary += [f"{subject.name}: {subject.performance}{seeds}.", *subject.sentences]
        return summary

    @property
    def head(self) -> list[str]:
        """All sentences before the questions."""
        return [*self.opening, *self.summary]

    @property
    def questions(self) -> list[str]:
        """The question of each line, with its policy and task where there are several."""
        if len(self.lines_by_subject) > 1:
            return [f"{line.subject}: {line.question}" for line in self.lines]
        return [line.question for line in self.lines]

    @property
    def lines_by_subject(self) -> dict[str, list[Line]]:
        """The lines on each policy and task."""
        return map_reduce(self.lines, lambda line: line.subject)

    @property
    def columns(self) -> tuple[str, ...]:
        """The headings of the columns of `row`."""
        return "question", "value", f"{self.level} interval", "verdict"

    def row(self, line: Line, question: str) -> tuple[str, ...]:
        """Return a line of the answer in columns; its question may be shortened before."""
        return question, line.value, self.interval(line), line.verdict.in_words

    def interval(self, line: Line) -> str:
        """Return the interval of a line, with a letter if its level is none that most have."""
        return f"{line.interval} {self.letters.get(line.level, '')}".strip()

    @property
    def letters(self) -> dict[str, str]:
        """A letter for each level of an interval that is none that most have."""
        return _letters(self.lines, self.level)

    @property
    def section(self) -> Section:
        """The lines as a table."""
        rows = tuple(map(self.row, self.lines, self.questions))
        return Section("", self.columns, rows, self.notes)


def answer(results: StudyResults) -> Answer:
    """Return what a study found."""
    policies = section.join_names(results.policies)
    compared = compare_policies(results)
    performance_of = performances(results)
    lines = list(lines_of(results))
    level = _common_level(lines)
    letters = _letters(lines, level)
    of_levels = [f"{letter}: interval of {other}." for other, letter in letters.items()]
    subjects = tuple(
        SubjectAnswer(
            name,
            *performance,
            tuple(sentences([line for line in lines if line.subject == name], level)),
        )
        for name, performance in performance_of.items()
    )
    if not subjects:
        subjects = (SubjectAnswer(policies, "P: no run has succeeded", section.NOTHING, "", ()),)
    return Answer(
        _title(results, policies),
        policies,
        compared.sentence,
        _overview(results, subjects, compared.factors),
        compared.turns,
        _scope(results),
        subjects,
        tuple(lines),
        (*of_levels, *notes(results, level)),
        results.seeds_text,
        level,
    )


def _title(results: StudyResults, policies: str) -> str:
    """Return the study's name with its policies in front of it, e.g. "homing: study 'paper'"."""
    name = results.plan.specification.name
    if policies == name:  # of trials: nobody named it
        return f"Study {name!r}"
    n_policies = len(results.policies)
    return f"{policies if n_policies < 4 else f'{n_policies} policies'}: study {name!r}"


def _common_level(lines: Sequence[Line]) -> str:
    """Return the level that most intervals have."""
    levels = Counter(line.level for line in lines if line.level)
    return levels.most_common(1)[0][0] if levels else section.P_LEVEL


def _letters(lines: Sequence[Line], level: str) -> dict[str, str]:
    """Return a letter for each level of an interval that is none that most have."""
    levels = dict.fromkeys(line.level for line in lines if line.level not in ("", level))
    return {other: chr(ord("a") + number) for number, other in enumerate(levels)}


def _overview(
    results: StudyResults,
    subjects: Sequence[SubjectAnswer],
    factors: Mapping[str, tuple[str, str]],
) -> Section | None:
    """Return P of each policy and task, and its factor to the first policy; None: they are few."""
    if len(subjects) <= _MOST_WITH_SENTENCES:
        return None
    conditions = {subject.condition for subject in subjects}
    columns = [f"[{section.P_LEVEL}]", results.plan.name_of_p]
    if len(conditions) == 1:
        columns[1] += f", {subjects[0].condition}"
        rows = [[subject.name, subject.p] for subject in subjects]
    else:
        rows = [[f"{subject.name}, {subject.condition}", subject.p] for subject in subjects]
    if factors:
        columns += ["times the first", ""]
        for row, subject in zip(rows, subjects):
            row += factors.get(subject.name, ("", ""))
    return Section("", tuple(columns), tuple(map(tuple, rows)))


def _scope(results: StudyResults) -> str:
    policies = results.policies
    origin = results.plan.origin
    policies_text = policies[0] if len(policies) == 1 else f"{len(policies)} policies"
    if origin and results.names_no_policy:
        policies_text = f"trials of {origin.file}"
    seeds = results.seeds_text.split(" (")[0]
    if any(cell.problem for cell in results.cells):
        seeds = f"up to {seeds}"
    questions = section.plural(len(results.verdicts), "question")
    return f"{results.plan.specification.name}: {questions}, {policies_text}, {seeds}."
