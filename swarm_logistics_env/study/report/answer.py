"""The answer of a study: P and each indicator in a sentence, then a row a question."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from more_itertools import map_reduce

from swarm_logistics_env.spi.definitions import DEFINITIONS
from swarm_logistics_env.study.questions.comparison import CONFIDENCE
from swarm_logistics_env.study.tasks.task_world import counted_in, world_of
from swarm_logistics_env.study.verdicts.cell import Cell
from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.study.verdicts.verdict import (
    UNAFFECTED,
    UNTESTABLE,
    Verdict,
)

from . import section
from .answer_notes import notes
from .policies_compared import (
    between_policies,
    comparison_in_words,
    factors,
    subject_of,
    turns_in_words,
)
from .section import Section

_MOST_WITH_SENTENCES = 2  # policies and tasks; more have a table, and sentences together


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

    @property
    def value(self) -> str:
        """The value, with a mark where P is capped."""
        value = self.verdict.value
        if value is None:
            return section.NOTHING
        mark = section.SATURATED if self.verdict.saturated else ""
        return section.fixed(value, 2, [self.verdict.compared.threshold]) + mark

    @property
    def interval(self) -> str:
        """The interval; empty: there is none, or the value is exact."""
        if self.verdict.estimate is None or self.verdict.conclusion == UNAFFECTED:
            return ""
        return section.limits(self.verdict.estimate, 2)

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
        comparison: by which factor P of two policies differs; empty: they are not compared.
        overview: P of each policy and task where there are many, and how that compares; None:
            there are few, and each has sentences of its own.
        turns: where the order of more than two policies is the other way round; empty: of fewer.
        scope: how much was asked, of which policies, and over which seeds.
        subjects: what was found of each policy and task.
        lines: the questions.
        notes: what the words of the verdicts mean, and what is still open.
        seeds: over which everything is.
    """

    comparison: str
    overview: Section | None
    turns: str
    scope: str
    subjects: tuple[SubjectAnswer, ...]
    lines: tuple[Line, ...]
    notes: str
    seeds: str

    @property
    def opening(self) -> list[str]:
        """The sentences before the overview: what is compared, and how much was asked."""
        sentences = [self.comparison] if self.comparison else []
        return sentences if len(self.subjects) == 1 else [*sentences, self.scope]

    @property
    def summary(self) -> list[str]:
        """P and each indicator in a few sentences; of many policies together."""
        if self.overview is not None:
            return [*filter(None, [self.turns]), *_sentences(self.lines)]
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
    def level(self) -> str:
        """The level of all intervals, for a heading; empty: they differ, and each row says its."""
        levels = {line.level for line in self.lines} - {""}
        return "" if len(levels) > 1 else next(iter(levels), section.P_LEVEL)

    @property
    def columns(self) -> tuple[str, ...]:
        """The headings of the columns of `row`."""
        if self.level:
            return "question", "value", f"{self.level} interval", "verdict"
        return "question", "value", "interval", "level", "verdict"

    def row(self, line: Line, question: str) -> tuple[str, ...]:
        """Return a line of the answer in columns; its question may be shortened before."""
        levels = () if self.level else (line.level,)
        return question, line.value, line.interval, *levels, line.verdict.in_words

    @property
    def section(self) -> Section:
        """The lines as a table."""
        rows = tuple(map(self.row, self.lines, self.questions))
        return Section("", self.columns, rows, (self.notes,))


def answer(results: StudyResults) -> Answer:
    """Return what a study found."""
    lines = list(_lines(results))
    engine = _unusual_engine(results)
    subjects = []
    for name, cell in _sound_cells(results).items():
        of_subject = [line for line in lines if line.subject == name]
        subjects.append(
            SubjectAnswer(
                name,
                _performance(results, cell) + engine,
                _p_alone(cell),
                _condition(results, cell),
                tuple(_sentences(of_subject)),
            )
        )
    if not subjects:
        policies = section.join_names(results.policies)
        subjects = [SubjectAnswer(policies, "P: no run has succeeded", section.NOTHING, "", ())]
    return Answer(
        comparison_in_words(results),
        _overview(results, subjects),
        turns_in_words(results),
        _scope(results),
        tuple(subjects),
        tuple(lines),
        notes(results),
        results.seeds_text,
    )


def _overview(results: StudyResults, subjects: Sequence[SubjectAnswer]) -> Section | None:
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
    if by_subject := factors(results):
        columns += ["times the first", ""]
        for row, subject in zip(rows, subjects):
            row += by_subject.get(subject.name, ("", ""))
    return Section("", tuple(columns), tuple(map(tuple, rows)))


def _lines(results: StudyResults) -> Iterator[Line]:
    """Yield the questions: those on a policy and task together, in the order of indicators."""
    lines = []
    for number, verdict in enumerate(results.verdicts):
        comparison = verdict.compared
        subject = subject_of(comparison.original.case, comparison.policy)
        question = section.question_of(verdict)
        if verdict.compares_policies:
            subject = f"{verdict.after.name} against {subject}"
            question = f"P of {verdict.after.name}, {verdict.after.condition}"
        cells = results.cells_of(comparison)
        arms = (comparison.removed or comparison.original, comparison.changed)
        means = [cells[arm].mean.value for arm in arms if cells[arm].n_seeds]
        p = f"P {means[0]:.3g}→{means[1]:.3g}" if len(means) == len(arms) else ""
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


def _sentences(lines: Sequence[Line]) -> Iterator[str]:
    """Yield a sentence on each indicator; policies side by side have their own."""
    by_indicator: dict[str, list[Line]] = map_reduce(
        lines, lambda line: line.verdict.compared.indicator
    )
    for indicator, alike in by_indicator.items():
        compared = between_policies([line.verdict for line in alike])
        questions = [line for line in alike if line.verdict not in compared]
        if questions:
            yield _sentence(DEFINITIONS[indicator].heading, questions)


def _sentence(heading: str, lines: Sequence[Line]) -> str:
    """Return how many questions on an indicator are decided how, and which value is lowest."""
    counts = section.count_words(
        section.word_to_count(line.verdict, line.verdict.on_property.adjusted) for line in lines
    )
    indicator = f"{heading[0].upper()}{heading[1:]}"
    tested = [line for line in lines if line.interval and line.verdict.conclusion != UNTESTABLE]
    candidates = tested or [line for line in lines if line.verdict.value is not None]
    if not candidates:
        return f"{indicator}: {counts}."
    worst = min(candidates, key=lambda line: line.verdict.value or 0.0)
    value = f"{worst.verdict.compared.indicator} {worst.value} {worst.interval}".rstrip()
    if worst.level not in ("", section.P_LEVEL):
        value += f" at {worst.level}"
    whose = f"{worst.subject}, " if len({line.subject for line in lines}) > 1 else ""
    parts = ", ".join(filter(None, [worst.p, value, worst.verdict.in_words]))
    result = f"{whose}{worst.question.partition(' ')[2]}: {parts}"
    if len(lines) == 1:
        return f"{indicator}, {result}."
    is_change = worst.verdict.compared.definition.compares == "policy"
    extreme = "lowest" if is_change else "worst"
    return f"{indicator}: {counts} ({extreme} {result})."


def _scope(results: StudyResults) -> str:
    policies = results.policies
    origin = results.plan.origin
    policies_text = policies[0] if len(policies) == 1 else f"{len(policies)} policies"
    if origin and policies == (results.plan.specification.name,):  # nobody named it
        policies_text = f"trials of {origin.file}"
    seeds = results.seeds_text.split(" (")[0]
    if any(cell.problem for cell in results.cells):
        seeds = f"up to {seeds}"
    questions = section.plural(len(results.verdicts), "question")
    return f"{results.plan.specification.name}: {questions}, {policies_text}, {seeds}."


def _sound_cells(results: StudyResults) -> dict[str, Cell]:
    """Return the cell of each policy and task where the swarm is as it should be."""
    played = [cell for cell in results.cells if cell.n_seeds]
    conditions = [cell for cell in played if cell.arm.setting.kind != "policy"]
    sound_cells: dict[str, Cell] = {}
    by_subject: dict[str, list[Cell]] = map_reduce(
        conditions, lambda cell: subject_of(cell.arm.case, cell.policy)
    )
    for subject, cells in by_subject.items():
        # Where the swarm is as it should be, or else in the first condition.
        sound = [c for c in cells if c.arm.setting.kind == "fault" and not c.arm.setting.value]
        sound_cells[subject] = (sound or cells)[0]
    if not conditions:  # policies alone are compared: in the first table
        for cell in played:
            if cell.table == played[0].table:
                sound_cells.setdefault(cell.arm.setting.name, cell)
    judged = results.policies

    def place(subject: str) -> int:
        # A policy that others are compared with stands behind them.
        policy = sound_cells[subject].arm.case.policy.title
        return judged.index(policy) if policy in judged else len(judged)

    return {subject: sound_cells[subject] for subject in sorted(sound_cells, key=place)}


def _unusual_engine(results: StudyResults) -> str:
    """Return what moves the bodies, behind a comma; empty: what usually does."""
    task = results.plan.specification.played
    world = world_of(task)
    engine = world.engine(results.plan.specification.scenario)
    return "" if engine == world.engine(task.default) else f", engine {engine}"


def _performance(results: StudyResults, cell: Cell) -> str:
    """Return P of a policy in words, e.g. "P [95 %] = 40.0 [39.5, 40.5] items in 500 s, N = 25"."""
    case = cell.arm.case
    has_interval = _counts_anything(cell) and cell.mean.low is not None
    level = f" [{section.P_LEVEL}]" if has_interval else ""
    performance = f"{results.plan.name_of_p}{level} = {_mean(cell)}"
    if counted := counted_in(case):
        performance += f" {counted} in {case.scenario.duration:g} s"
    return f"{performance}, {_condition(results, cell)}"


def _condition(results: StudyResults, cell: Cell) -> str:
    """Return where P of a policy is told, e.g. "N = 25, no fault"."""
    setting = cell.arm.setting
    task = results.plan.specification.played
    condition = f"N = {cell.arm.case.scenario.n_robots}"
    if setting.kind == "policy":
        condition += f", {cell.table}"
    elif setting.kind != "size":
        condition += f", {setting}"
    if task.name != "warehouse" and not results.plan.origin:
        condition += f", task {task.name}"
    return condition


def _counts_anything(cell: Cell) -> bool:
    """Return whether something was delivered, or P is another measure, of which 0 tells as much."""
    return bool(cell.by_seed.any() or cell.arm.case.performance)


def _p_alone(cell: Cell) -> str:
    """Return mean P for a table."""
    if _counts_anything(cell):
        return section.mean_p(cell)
    return f"0 (at most {-math.log(1.0 - CONFIDENCE) / cell.n_seeds:.2f})"


def _mean(cell: Cell) -> str:
    """Return mean P; where nothing was delivered, with the upper limit of a Poisson mean."""
    if not _counts_anything(cell):
        reason = f"as none of {cell.n_seeds} runs delivered anything"
        if cell.problem:
            reason += f"; {cell.problem}"
        return f"{_p_alone(cell).removesuffix(')')} at {section.P_LEVEL}, {reason})"
    mean = section.mean_p(cell)
    if cell.problem:
        mean += f" ({cell.problem} and do not count)"
    if any(outcome.all_delivered for outcome in cell.outcomes):
        mean += f", all items after {section.time_to_clear(cell)} s"
    return mean
