"""The sentence that a paper can quote: policy, world, P, verdicts, and what is not decided."""

from __future__ import annotations

from swarm_logistics_env.study.questions.comparison import CONFIDENCE
from swarm_logistics_env.study.tasks.task_world import world_of
from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.study.verdicts.verdict import UNTESTABLE, Verdict, level_of

from . import section, templates
from .answer import Answer, Line, line_of
from .templates import Slots, fill


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
    world = world_in_words(results)
    slots: dict[str, Slots] = {
        "performance": {
            "policies": ", ".join(results.policies),
            "world": f", {world}" if results.plan.origin else f" in {world}",
            "performance": answer.performance[:-1],
            "seeds": results.seeds_text,
        }
    }
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
        question=line.question,
        value=line.value,
        level=section.percent(level),
        interval=interval,
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


def world_in_words(results: StudyResults) -> str:
    """Return in words where a study was played, e.g. "a warehouse of 6 m x 5 m with .."."""
    plan = results.plan
    if plan.origin is not None:
        stated = "".join(f", {name} {value}" for name, value in plan.origin.setup)
        return templates.WORLD["trials"].format(file=plan.origin.file, setup=stated)
    task = plan.specification.played
    words = world_of(task).world_in_words(plan.specification.scenario)
    return words or templates.WORLD["task"].format(task=task.name)
