"""What a paper takes of a study: a sentence to quote, and its tables."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from swarm_logistics_env.spi.definitions import DEFINITIONS
from swarm_logistics_env.study.questions.comparison import CONFIDENCE
from swarm_logistics_env.study.questions.plan import Plan
from swarm_logistics_env.study.tasks.task_world import world_of
from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.study.verdicts.verdict import UNTESTABLE, Verdict, level_of

from . import section, templates
from .answer import Answer, Line, line_of
from .figures import parameter_label
from .section import Section
from .templates import Slots, fill

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
        about += f" {templates.EXPLORATORY[0].upper()}{templates.EXPLORATORY[1:]}."
    labels = {
        verdict.after.name: parameter_label(verdict)
        for verdict in results.verdicts
        if verdict.after.kind == "parameter"
    }
    tables = [_answer(results.policies, answer), *sections]
    return PaperTables(about, tuple(table for table in tables if table.rows), labels)


def _answer(policies: Sequence[str], answer: Answer) -> Section:
    """Return the answer: a row a question, or several that are alike."""
    columns = "question", "value", answer.section.columns[2], "verdict"
    rows = tuple(
        (
            question,
            line.value,
            line.interval(answer.level).removeprefix("in "),
            section.with_reason(section.conclusion_text(*line.verdicts), line.reason),
        )
        for question, line in zip(answer.questions, answer.lines)
    )
    is_grouped = any(len(line.verdicts) > 1 for line in answer.lines)
    hull = "Of several values the interval holds all of theirs." if is_grouped else ""
    symbols = dict.fromkeys(line.indicator for line in answer.lines)
    names = [definition.heading for symbol, definition in DEFINITIONS.items() if symbol in symbols]
    text = ", ".join(names)
    meaning = f"{text[:1].upper()}{text[1:]}: supported above 0, refuted below, open: undecided."
    reasons = f"Open {answer.reasons}." if answer.reasons else ""
    lines = (answer.performance, meaning, hull, reasons, HOLM)
    return Section(f"{section.join_names(policies)}: indicators", columns, rows, lines)


def _world(plan: Plan) -> str:
    """Return the conditions, e.g. "World: a warehouse of .., 500 s; N = 25 unless .."."""
    world = world_in_words(plan)
    if plan.origin is not None:
        return f"{world[:1].upper()}{world[1:]}"
    scenario = plan.specification.scenario
    length = f"{scenario.duration:g} s; N = {scenario.n_robots} unless said otherwise"
    return f"World: {world}, {length}"


def in_a_sentence(results: StudyResults, answer: Answer) -> str:
    """Return what a paper can say of the study: conditions, P, counts, and the lowest value."""
    verdicts = results.verdicts
    tested = [v for v in verdicts if v.conclusion != UNTESTABLE]
    with_interval = [v for v in tested if v.interval and v.interval.low is not None]
    # A change of P has another scale than the indicators.
    candidates = [v for v in with_interval if v.compared.indicator != "change"] or with_interval
    lowest = min(candidates or verdicts, key=lambda verdict: verdict.value or 0.0)
    line = line_of([(0, lowest)])
    words = section.conclusion_text(*verdicts)
    lowest_text = _question_with_value(line, level_of([lowest]))
    reason = templates.REASONS_TO_BE_OPEN.get(lowest.reason, lowest.reason)
    world = world_in_words(results.plan)
    slots: dict[str, Slots] = {
        "performance": {
            "policies": ", ".join(results.policies),
            "world": f", {world}" if results.plan.origin else f" in {world}",
            "performance": answer.performance[:-1],
            "seeds": results.seeds_text,
        }
    }
    if answer.comparison:
        slots["comparison"] = {"comparison": answer.comparison[:-1]}
    method = templates.METHOD.format(error=section.percent(1.0 - CONFIDENCE))
    verdict_slots = {"words": words, "method": method}
    if len(verdicts) == 1:
        verdict_slots["method"] = f"{reason}; {method}" if reason else method
        name = f"{line.indicator} > {lowest.compared.threshold:.3g}"
        slots["one_question"] = {"lowest": lowest_text, "property": name, **verdict_slots}
    else:
        if words == lowest.on_property.adjusted:  # all are alike
            verdict_slots["words"] = f"{len(verdicts)} {words}"
        slots["several_questions"] = {"n_questions": len(verdicts), **verdict_slots}
        if any(verdict.conclusion == "open" for verdict in verdicts):
            slots["not_decided"] = {"questions": _undecided(answer)}
        if candidates:
            word = lowest.on_property.adjusted
            slots["lowest"] = {
                "lowest": lowest_text,
                "word": f"{word}: {reason}" if reason else word,
            }
    if results.exploratory:
        slots["exploratory"] = {"exploratory": templates.EXPLORATORY}
    return "".join(fill(templates.FOR_A_PAPER, {**slots, "end": {}}))


def _question_with_value(line: Line, level: float) -> str:
    interval = line.interval(level)
    return templates.QUESTION_WITH_VALUE["interval" if interval else "value"].format(
        question=line.question, value=line.value, level=section.percent(level), interval=interval
    )


def _undecided(answer: Answer) -> str:
    """Return what is open of each indicator, e.g. "FT of FM4 (m = 1, 2) and S of N 4→10"."""
    verdicts: dict[str, dict[str, list[Verdict]]] = {}
    names_policies = len({line.policy for line in answer.lines}) > 1
    for line in answer.lines:
        policy = f"{line.policy}'s " if names_policies else ""
        name = line.question.removeprefix(f"{line.indicator} ").partition(",")[0]
        by_name = verdicts.setdefault(policy + line.indicator, {})
        by_name.setdefault(name, []).extend(line.verdicts)
    clauses = []
    for indicator, by_name in verdicts.items():
        names = []
        for name, alike in by_name.items():
            undecided = [verdict.after for verdict in alike if verdict.conclusion == "open"]
            is_fault = any(setting.kind == "fault" for setting in undecided)
            numbers = ", ".join(f"{setting.value:g}" for setting in undecided)
            which = f" (m = {numbers})" if is_fault else ""
            names += [name + which] if undecided else []
        clauses += [f"{indicator} of {', '.join(names)}"] if names else []
    return section.join_names(clauses)


def world_in_words(plan: Plan) -> str:
    """Return in words where a study was played, e.g. "a warehouse of 6 m x 5 m with .."."""
    if plan.origin is not None:
        stated = "".join(f", {name} {value}" for name, value in plan.origin.setup)
        return templates.WORLD["trials"].format(file=plan.origin.file, setup=stated)
    task = plan.specification.played
    words = world_of(task).world_in_words(plan.specification.scenario)
    return words or templates.WORLD["task"].format(task=task.name)
