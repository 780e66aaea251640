"""What a paper takes of a study: a sentence to quote, and its tables."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

from swarm_logistics_env.spi.definitions import DEFINITIONS
from swarm_logistics_env.study.questions.comparison import CONFIDENCE
from swarm_logistics_env.study.questions.plan import Plan
from swarm_logistics_env.study.tasks.task_world import world_of
from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.study.verdicts.until_clear import HARDLY

from . import section
from .answer import Answer
from .answer_notes import meanings
from .figures import parameter_label
from .section import Section
from .sentences import stop_of

_EXPLORATORY = "exploratory: over other seeds or P than were declared before the first run"
# Why questions of a study that runs until it is clear were played no further, by `stop_of`.
_STOPS = {
    "clear": "{count} stopped where clear",
    "hardly": "{count} early, as {most} seeds would decide them with a chance below {chance}",
    "margin": "{count} as P changes by less than {margin} of P_o",
    "untestable": "{count} as they cannot be tested",
    "most": "{count} after all {most} seeds",
}
HOLM = "Verdicts are adjusted by Holm's method over all questions on an indicator of one policy."


class PaperTables(NamedTuple):
    """The tables of a study for a paper.

    Attributes:
        about: what the caption of each says of P, the world and the seeds.
        sections: the tables.
        labels: parameters as a reader calls them, with their units, by their names.
    """

    about: str
    sections: tuple[Section, ...]
    labels: Mapping[str, str]


def paper_tables(results: StudyResults, answer: Answer, sections: Iterable[Section]) -> PaperTables:
    """Return the tables of a study for a paper: the answer, then those of these sections."""
    about = f"P is {results.plan.what_p_is}. {_world(results.plan)}; {results.seeds_text}."
    if results.exploratory:
        about += f" {_EXPLORATORY[0].upper()}{_EXPLORATORY[1:]}."
    labels = {
        verdict.after.name: parameter_label(verdict)
        for verdict in results.verdicts
        if verdict.after.kind == "parameter"
    }
    tables = [*_answer_tables(answer), *sections]
    return PaperTables(about, tuple(table for table in tables if table.rows), labels)


def _answer_tables(answer: Answer) -> Iterator[Section]:
    """Yield the answer, a table for each policy and task: a row a question."""
    performances = {subject.name: subject.performance for subject in answer.subjects}
    for subject, lines in answer.lines_by_subject.items():
        rows = tuple(answer.row(line, line.question) for line in lines)
        symbols = dict.fromkeys(line.verdict.compared.indicator for line in lines)
        names = [DEFINITIONS[symbol].heading for symbol in DEFINITIONS if symbol in symbols]
        text = section.join_names(names)
        levels = {line.level for line in lines}
        of_levels = [
            f"{letter}: interval of {level}"
            for level, letter in answer.letters.items()
            if level in levels
        ]
        words = "; ".join([*meanings([line.verdict for line in lines]), *of_levels])
        captions = (performances.get(subject, ""), text, words)
        sentences = tuple(f"{text[0].upper()}{text[1:]}." for text in captions if text)
        yield Section(f"{subject}: indicators", answer.columns, rows, (*sentences, HOLM))


def _world(plan: Plan) -> str:
    """Return the conditions, e.g. "World: a warehouse of .., 500 s; N = 25 unless .."."""
    world = world_in_words(plan)
    if plan.origin is not None:
        return f"{world[:1].upper()}{world[1:]}"
    scenario = plan.specification.scenario
    length = f"{scenario.duration:g} s; N = {scenario.n_robots} unless said otherwise"
    return f"World: {world}, {length}"


def in_a_sentence(results: StudyResults, answer: Answer) -> str:
    """Return what a paper can say of a study, as a paragraph.

    That is: policies, world, seeds, P and each indicator with its worst value, by policy and task,
    how verdicts were reached, and why questions were played no further.
    """
    place = "," if results.plan.origin else " in"
    world = f"{world_in_words(results.plan)}{_preset_and_engine(results.plan)}"
    sentences = [
        f"{answer.policies}{place} {world}, {results.seeds_text}",
    ]
    if answer.comparison:
        sentences.append(answer.comparison.removesuffix("."))
    sentences.append(_subjects(answer))
    method = (
        "Verdicts by Holm's method over all questions on an indicator of one policy, "
        f"{section.percent(1.0 - CONFIDENCE)} error"
    )
    if answer.level != section.P_LEVEL:
        method += f"; intervals of indicators of {answer.level} unless said otherwise"
    if results.looks:
        looks = ", ".join(map(str, results.looks))
        questions = section.plural(len(results.verdicts), "question")
        method += f"; looked at after {looks} seeds: of {questions} {_stops(results)}"
    if results.exploratory:
        method += f"; {_EXPLORATORY}"
    return f"{'. '.join([*sentences, method])}."


def _subjects(answer: Answer) -> str:
    """Return P and indicators of each policy and task, each in a sentence that names it.

    Of many P alone, and then each indicator of all together.
    """
    if answer.overview is not None:
        of_each = [f"{subject.name}: {subject.performance}" for subject in answer.subjects]
        return ". ".join([*of_each, *(sentence.removesuffix(".") for sentence in answer.summary)])
    sentences = []
    for subject in answer.subjects:
        clauses = [subject.performance]
        clauses += [f"{clause[0].lower()}{clause[1:-1]}" for clause in subject.sentences]
        sentences.append(f"{subject.name}: {'; '.join(clauses)}")
    return ". ".join(sentences)


def _preset_and_engine(plan: Plan) -> str:
    """Return the preset and the engine of a study in brackets; empty: the task names none."""
    world = world_of(plan.specification.played)
    scenario = plan.specification.scenario
    engine = world.engine(scenario)
    words = [world.preset_in_words(scenario), f"engine {engine}" if engine else ""]
    named = ", ".join(filter(None, words))
    return f" ({named})" if named and plan.origin is None else ""


def _stops(results: StudyResults) -> str:
    """Return why the questions of a study that runs until it is clear were played no further."""
    counts = Counter(stop_of(verdict) for verdict in results.verdicts)
    slots = {
        "most": results.looks[-1],
        "chance": section.percent(HARDLY),
        "margin": section.percent(results.plan.specification.margin),
    }
    return ", ".join(
        template.format(count=counts[stop], **slots)
        for stop, template in _STOPS.items()
        if stop in counts
    )


def world_in_words(plan: Plan) -> str:
    """Return in words where a study was played, e.g. "a warehouse of 6 m x 5 m with .."."""
    if plan.origin is not None:
        stated = "".join(f", {name} {value}" for name, value in plan.origin.setup)
        return f"trials of {plan.origin.file}{stated}"
    task = plan.specification.played
    words = world_of(task).world_in_words(plan.specification.scenario)
    return words or f"the task {task.name}"
