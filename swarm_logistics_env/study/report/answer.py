"""The answer of a study: P and each indicator in a sentence, then a row a question."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from more_itertools import map_reduce

from swarm_logistics_env.spi.definitions import DEFINITIONS
from swarm_logistics_env.spi.summaries import Interval
from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.study.verdicts.verdict import (
    UNAFFECTED,
    UNTESTABLE,
    Verdict,
)

from . import section
from .answer_notes import notes
from .performances import performances
from .policies_compared import compare_policies, factor_of
from .section import Section

_MOST_WITH_SENTENCES = 2  # policies and tasks; more have a table, and sentences together
_MOST_NAMED = 3  # questions that are decided alike, in a sentence


class Line(NamedTuple):
    """One row of the answer: a question.

    Attributes:
        subject: whose swarm it is about, and in which task where there are several.
        question: indicator and what is changed, e.g. "R FM4, 1 of 25".
        verdict: on it.
        number: the index of the verdict among those of the study.
        p: mean P before and after, of FT without the robots and with them; empty: not played.
    """

    subject: str
    question: str
    verdict: Verdict
    number: int
    p: str = ""

    def name(self, *, with_subject: bool) -> str:
        """Return the question without what is compared, perhaps with whose swarm it is about."""
        name = self.question.partition(" ")[2].removeprefix("P, ")
        return f"{self.subject}: {name}" if with_subject else name

    @property
    def heading(self) -> str:
        """The indicator by its name and symbol, or what is compared between policies."""
        if self.verdict.compares_policies:
            return "times P"
        heading = self.verdict.compared.definition.heading
        return f"{heading[0].upper()}{heading[1:]}"

    @property
    def threshold(self) -> float:
        """What the value is tested against."""
        return 1.0 if self.verdict.compares_policies else self.verdict.compared.threshold

    @property
    def estimate(self) -> Interval | None:
        """The indicator, or P of a policy in times that of another, with its limits; None: none."""
        interval = self.verdict.interval
        return factor_of(interval) if interval and self.verdict.compares_policies else interval

    @property
    def value(self) -> str:
        """The value, with a mark where P is capped."""
        if self.estimate is None:
            return section.NOTHING
        mark = section.SATURATED if self.verdict.saturated else ""
        return section.fixed(self.estimate.value, 2, [self.threshold]) + mark

    @property
    def interval(self) -> str:
        """The interval; empty: there is none, or the value is exact."""
        if self.estimate is None or self.verdict.conclusion == UNAFFECTED:
            return ""
        return section.limits(self.estimate, 2, [self.threshold])

    @property
    def level(self) -> str:
        """The level of the interval; empty: there is none."""
        return section.percent(self.verdict.level) if self.interval and self.verdict.level else ""

    @property
    def contradicts(self) -> bool:
        """Whether the verdict contradicts what the study's reference claims."""
        decision = self.verdict.on_claim
        return decision is not None and decision.adjusted == "refuted"


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
        """The sentences before the overview: what is compared, and how much was asked."""
        sentences = [self.comparison] if self.comparison else []
        words = {line.verdict.conclusion for line in self.lines}
        if len(self.lines) > 1 and words <= {"open", UNTESTABLE}:
            sentences.insert(0, f"None of {len(self.lines)} questions is decided.")
        return sentences if len(self.subjects) == 1 else [*sentences, self.scope]

    @property
    def summary(self) -> list[str]:
        """P and each indicator in a few sentences; of many policies together."""
        if self.overview is not None:
            return [*filter(None, [self.turns]), *_sentences(self.lines, self.level)]
        seeds = f"; {self.seeds}" if len(self.subjects) == 1 else ""
        sentences = []
        for subject in self.subjects:
            sentences += [f"{subject.name}: {subject.performance}{seeds}.", *subject.sentences]
        return sentences

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
    lines = list(_lines(results))
    level = _common_level(lines)
    letters = _letters(lines, level)
    of_levels = [f"{letter}: interval of {other}." for other, letter in letters.items()]
    subjects = tuple(
        SubjectAnswer(
            name,
            *performance,
            tuple(_sentences([line for line in lines if line.subject == name], level)),
        )
        for name, performance in performance_of.items()
    )
    if not subjects:
        subjects = (SubjectAnswer(policies, "P: no run has succeeded", section.NOTHING, "", ()),)
    return Answer(
        _title(results, policies),
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


def _lines(results: StudyResults) -> Iterator[Line]:
    """Yield the questions: those on a policy and task together, in the order of indicators."""
    lines = []
    for number, verdict in enumerate(results.verdicts):
        comparison = verdict.compared
        subject = results.subjects[comparison.original.case].name
        question = verdict.question
        if verdict.compares_policies:
            subject = f"{verdict.after.name} against {subject}"
            question = f"times P, {verdict.after.condition}"
        p = _p_before_and_after(results, verdict)
        lines.append(Line(subject, question, verdict, number, p))
    # Recorded trials may ask one question in several tables, at other values of a parameter.
    counts = Counter((line.subject, line.question) for line in lines)
    policies = results.policies
    subjects = list(dict.fromkeys(line.subject for line in lines))
    lines.sort(
        key=lambda line: (
            not line.verdict.compares_policies,
            policies.index(line.verdict.compared.policy),
            subjects.index(line.subject),
            [*DEFINITIONS].index(line.verdict.compared.indicator),
        )
    )
    for line in lines:
        if counts[line.subject, line.question] > 1:
            # What stands in brackets at the end of the table's title, or else the title.
            condition = line.verdict.compared.table.rstrip(")").rpartition(" (")[2]
            yield line._replace(question=f"{line.question}, {condition}")
        else:
            yield line


def _p_before_and_after(results: StudyResults, verdict: Verdict) -> str:
    """Return the means of P that a value comes of, over its seeds; empty: not played."""
    comparison = verdict.compared
    estimate = verdict.estimate
    arms = (comparison.removed or comparison.original, comparison.changed)
    cells = [verdict.cells[arm] for arm in arms]
    if not all(cell.n_seeds for cell in cells):
        return ""
    before, after = (f"{cell.by_seed.mean():.3g}" for cell in cells)
    # Until it is clear, conditions may be played further than this question looks.
    seeds = f" ({estimate.n_seeds} seeds)" if estimate and results.looks else ""
    if comparison.removed:
        return f"P without them {before}, with them {after}{seeds}"
    return f"P {before}→{after}{seeds}"


def _sentences(lines: Sequence[Line], level: str) -> Iterator[str]:
    """Yield a sentence on each indicator; policies side by side have their own."""
    by_indicator: dict[str, list[Line]] = map_reduce(
        lines, lambda line: line.verdict.compared.indicator
    )
    for indicator, alike in by_indicator.items():
        if questions := [line for line in alike if not line.verdict.compares_policies]:
            yield _sentence(DEFINITIONS[indicator].heading, questions, level)


def _sentence(heading: str, lines: Sequence[Line], level: str) -> str:
    """Return which questions on an indicator are decided how, and which value is lowest.

    Args:
        level: of intervals that do not say theirs.
    """
    names_subjects = len({line.subject for line in lines}) > 1
    counts = ", ".join(_counts(lines, names_subjects=names_subjects))
    indicator = f"{heading[0].upper()}{heading[1:]}"
    tested = [line for line in lines if line.interval and line.verdict.conclusion != UNTESTABLE]
    candidates = tested or [line for line in lines if line.verdict.value is not None]
    if not candidates:
        return f"{indicator}: {counts}."
    lowest = min(candidates, key=lambda line: line.verdict.value or 0.0)
    value = f"{lowest.verdict.compared.indicator} {lowest.value} {lowest.interval}".rstrip()
    if lowest.level not in ("", level):
        value += f" at {lowest.level}"
    parts = ", ".join(filter(None, [lowest.p, value, lowest.verdict.in_words]))
    result = f"{lowest.name(with_subject=names_subjects)}: {parts}"
    if len(lines) == 1:
        return f"{indicator}, {result}."
    return f"{indicator}: {counts}; lowest at {result}."


def _counts(lines: Sequence[Line], *, names_subjects: bool) -> Iterator[str]:
    """Yield how many questions have each word; which, where they are decided and few."""
    by_word: dict[str, list[Line]] = map_reduce(
        lines,
        lambda line: section.word_to_count(line.verdict, line.verdict.on_property.adjusted),
    )
    for word in sorted(by_word, key=section.rank_of_word):
        alike = by_word[word]
        names = [line.name(with_subject=names_subjects) for line in alike]
        decision, _, provisional = word.removesuffix(")").partition(" (")
        is_named = decision in ("supported", "refuted") and len(lines) > 1
        of_which = names if is_named and len(names) <= _MOST_NAMED else []
        details = "; ".join(filter(None, [provisional, *of_which]))
        yield f"{len(alike)} {decision} ({details})" if details else f"{len(alike)} {decision}"


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
