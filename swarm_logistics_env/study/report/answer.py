"""The answer of a study: a line a question, with value, interval and verdict, and what is open."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

from more_itertools import map_reduce

from swarm_logistics_env import spi
from swarm_logistics_env.spi.definitions import DEFINITIONS
from swarm_logistics_env.study.questions.comparison import CONFIDENCE
from swarm_logistics_env.study.tasks.task_world import counted_in
from swarm_logistics_env.study.verdicts.cell import Cell
from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.study.verdicts.verdict import (
    DECIDED,
    POWER,
    UNAFFECTED,
    UNDEFINED,
    UNTESTABLE,
    Verdict,
    level_of,
)

from . import section, templates
from .answer_notes import notes, reasons_in_words
from .policies_compared import comparison_in_words
from .section import Section
from .templates import Slots, fill

MOST_LINES = 30  # of the answer of `paper` at a terminal
_EFFECT = 0.1  # of an indicator, for which seeds are counted


class Line(NamedTuple):
    """One line of the answer: a question, or several that are alike.

    Attributes:
        policy: whose swarm it is about.
        indicator: its symbol.
        question: indicator and what is changed, e.g. "R FM4, 1 of 25".
        verdicts: in the order of the values.
        numbers: the indices of these verdicts among those of the study.
    """

    policy: str
    indicator: str
    question: str
    verdicts: tuple[Verdict, ...]
    numbers: tuple[int, ...]

    @property
    def value(self) -> str:
        """The values, one after the other; from the lowest to the highest where they are many."""
        values = [verdict.value for verdict in self.verdicts if verdict.value is not None]
        if not values:
            return section.NOTHING
        if len(self.verdicts) > 3:
            return f"{self._fixed(min(values))} to {self._fixed(max(values))}"
        text = " ".join(map(self._fixed, values))
        is_capped = any(verdict.saturated for verdict in self.verdicts)
        return text + section.SATURATED if is_capped else text

    def _fixed(self, value: float) -> str:
        thresholds = [verdict.compared.threshold for verdict in self.verdicts]
        return section.fixed(value, 2, thresholds)

    def interval(self, level: float) -> str:
        """Return the interval; of several values that which holds all of theirs.

        Args:
            level: that the heading names; another one stands behind the interval.
        """
        intervals = [
            verdict.interval
            for verdict in self.verdicts
            if verdict.interval and verdict.conclusion != UNAFFECTED
        ]
        lows = [interval.low for interval in intervals if interval.low is not None]
        highs = [interval.high for interval in intervals if interval.high is not None]
        if not (lows and highs):
            return ""
        hull = f"[{self._fixed(min(lows))}, {self._fixed(max(highs))}]"
        hull += section.other_levels(self.verdicts, level)
        if len(self.verdicts) == 1:
            return hull
        # A value that is capped or alone has none.
        if len(lows) == len(self.verdicts):
            return f"in {hull}"
        return f"{len(lows)} of {len(self.verdicts)} in {hull}"

    @property
    def verdict_text(self) -> str:
        """The verdicts in words, and what an open one takes."""
        case, slots = self._case()
        return templates.LINE[case].format(**slots)

    def _case(self) -> tuple[str, Slots]:
        """Return which template of a line applies, and its slots."""
        first = self.verdicts[0]
        words = section.conclusion_text(*self.verdicts)
        if not any(verdict.estimate for verdict in self.verdicts):
            if all(str(verdict.problem).endswith(" missing") for verdict in self.verdicts):
                return "not_played", {}
            return "problem", {"words": words, "problem": first.problem}
        if all(v.estimate and v.conclusion == UNDEFINED for v in self.verdicts):
            return "family_lacks_runs", {"indicator": self.indicator}
        if len(self.verdicts) > 1:
            case = "with_reason" if self.reason else "words"
            return case, {"words": words, "reason": self.reason}
        estimate = first.estimate
        assert estimate is not None
        if first.conclusion == UNAFFECTED:
            return "unaffected", {"words": words}
        if estimate.untestable:
            return "untestable", {"words": words, "reason": self.reason}
        if "unbounded" in first.flags and first.on_property.adjusted in DECIDED:
            return "unbounded", {"words": words}
        if self.reason:
            return "with_reason", {"words": words, "reason": self.reason}
        if first.conclusion == "open":
            # An effect on the side of the value, which 80 % power finds.
            effect = estimate.threshold + math.copysign(
                _EFFECT, estimate.value - estimate.threshold
            )
            n_needed = spi.seeds_for_power(estimate, effect, POWER)
            if n_needed is not None and n_needed > estimate.n_seeds:
                n_more = n_needed - estimate.n_seeds
                threshold = estimate.threshold
                return "more_runs", {"n_more": n_more, "effect": effect, "threshold": threshold}
        return "words", {"words": words}

    @property
    def reason(self) -> str:
        """Why what is untestable is so, or its one verdict open; empty: there is no reason."""
        if len(self.verdicts) == 1:
            return self.verdicts[0].reason
        reasons = [verdict.reason for verdict in self.verdicts if verdict.conclusion == UNTESTABLE]
        return ", ".join(dict.fromkeys(reasons))

    @property
    def needs_runs(self) -> bool:
        """Whether the verdict in words says how many more runs it takes."""
        return self._case()[0] == "more_runs"

    @property
    def contradicts(self) -> bool:
        """Whether a verdict contradicts what the study's reference claims."""
        decisions = [verdict.on_claim for verdict in self.verdicts]
        return any(
            decision is not None and decision.adjusted == "refuted" for decision in decisions
        )


class Answer(NamedTuple):
    """What a study found.

    Attributes:
        comparison: by which factor P of policies differs; empty: they are not compared.
        scope: how much was asked, of which policies, and over which seeds.
        performance: P of every policy where the swarm is as it should be.
        lines: the questions.
        reasons: why lines of it are open, in words; empty: none says why.
        notes: how to read the verdicts, and what is still open.
    """

    comparison: str
    scope: str
    performance: str
    lines: tuple[Line, ...]
    reasons: str
    notes: str

    @property
    def questions(self) -> list[str]:
        """The question of each line, with its policy where there are several."""
        if len({line.policy for line in self.lines}) > 1:
            return [f"{line.policy}: {line.question}" for line in self.lines]
        return [line.question for line in self.lines]

    @property
    def verdicts(self) -> list[Verdict]:
        """The verdicts of all lines."""
        return [verdict for line in self.lines for verdict in line.verdicts]

    @property
    def level(self) -> float:
        """The level of most intervals, which the heading names."""
        return level_of(self.verdicts)

    @property
    def section(self) -> Section:
        """The lines as a table."""
        level = self.level
        columns = "question", "value", f"{section.percent(level)} interval", "verdict"
        rows = tuple(
            (question, line.value, line.interval(level), line.verdict_text)
            for question, line in zip(self.questions, self.lines)
        )
        above = [self.comparison] if self.comparison else []
        return Section("Answer", columns, rows, (*above, self.performance, self.notes))


def answer(results: StudyResults, most: int | None = MOST_LINES - 5) -> Answer:
    """Return what a study found.

    Args:
        most: lines at most, as far as what is alike can share one; None: a line a question.
    """
    scope = _scope(results)
    performance = _performance(results)
    lines: list[Line] = []
    for sharing in range(4):
        groups = map_reduce(enumerate(results.verdicts), partial(_what_a_line_shares, sharing))
        lines = [line_of(group) for group in groups.values()]
        if most is None or len(lines) <= most:
            break
    # Recorded trials may ask one question in several tables, at other values of a parameter.
    counts = Counter((line.policy, line.question) for line in lines)
    for index, line in enumerate(lines):
        if counts[line.policy, line.question] > 1:
            condition = _part_of_title(line.verdicts[0].compared.table)
            lines[index] = line._replace(question=f"{line.question}, {condition}")
    policies = results.policies
    indicators = list(DEFINITIONS)
    lines.sort(key=lambda line: (policies.index(line.policy), indicators.index(line.indicator)))
    needs_runs = any(line.needs_runs for line in lines)
    reasons = reasons_in_words({line.reason for line in lines})
    notes_text = notes(results, needs_runs, reasons)
    comparison = comparison_in_words(results)
    return Answer(comparison, scope, performance, tuple(lines), reasons, notes_text)


def _part_of_title(table: str) -> str:
    """Return what stands in brackets at the end of a table's title, or else the title."""
    return table.rstrip(")").rpartition(" (")[2]


def _what_a_line_shares(sharing: int, numbered: tuple[int, Verdict]) -> tuple[object, ...]:
    """Return what the questions of a line have in common.

    Args:
        sharing: 0: a line has one question; 1: those of one failure mode; 2: those of any one
            factor; 3: those of an indicator in a table.
        numbered: a verdict, and its index among those of the study.
    """
    number, verdict = numbered
    comparison = verdict.compared
    after = verdict.after
    if sharing == 0 or (sharing == 1 and after.kind != "fault"):
        return (number,)
    indicator = comparison.policy, comparison.table, comparison.indicator
    if sharing == 3:
        return indicator
    return (*indicator, after.name, after.onset, comparison.threshold)


def line_of(numbered: Sequence[tuple[int, Verdict]]) -> Line:
    """Return the line of verdicts, each with its index among those of the study."""
    numbers, verdicts = zip(*numbered)
    comparison = verdicts[0].compared
    case, slots = _question(verdicts)
    question = f"{comparison.indicator} {templates.QUESTION[case].format(**slots)}"
    return Line(comparison.policy, comparison.indicator, question, verdicts, numbers)


def _question(verdicts: Sequence[Verdict]) -> tuple[str, Slots]:
    """Return which template of a question applies, and its slots."""
    first = verdicts[0]
    comparison = first.compared
    before = comparison.original.setting
    after = first.after
    usual_property = comparison.definition.adjectives.get(0.0)
    named = "" if first.property_name == usual_property else f", {first.property_name}"
    start = f" from {after.onset:g} s" if after.onset else ""
    names = {verdict.after.name for verdict in verdicts}
    values = [f"{verdict.after.value:g}" for verdict in verdicts]
    if after.kind == "size":
        sizes = [f"{before.value:g}", *values]
        if len(sizes) > 4:
            sizes = [sizes[0], "…", sizes[-1]]
        return "sizes", {"chain": "→".join(sizes), "property": named}
    if len(names) > 1:
        case = "failure_modes" if after.kind == "fault" else "parameters"
        return case, {"count": len(names), "start": start}
    slots = {"name": after.name, "values": ", ".join(values), "property": named}
    if after.kind == "fault":
        return "fault", {**slots, "start": start, "n_robots": comparison.n_robots}
    if after.kind == "policy":
        if after.condition:  # nothing is claimed of it
            slots["property"] = ""
        condition = f", {after.condition}" if after.condition else ""
        return "policy", {**slots, "condition": condition}
    return "parameter", {**slots, "before": before.value}


def _scope(results: StudyResults) -> str:
    policies = results.policies
    origin = results.plan.origin
    policies_text = policies[0] if len(policies) == 1 else f"{len(policies)} policies"
    if origin and policies == (results.plan.specification.name,):  # nobody named it
        policies_text = f"trials of {origin.file}"
    case = "incomplete" if any(cell.problem for cell in results.cells) else "complete"
    return templates.SCOPE[case].format(
        study=results.plan.specification.name,
        questions=section.plural(len(results.verdicts), "question"),
        policies=policies_text,
        seeds=results.seeds_text.split(" (")[0],
    )


def _performance(results: StudyResults) -> str:
    """Return P of every policy where the swarm is as it should be, in a sentence."""
    played = [cell for cell in results.cells if cell.n_seeds]
    if not played:
        return templates.PERFORMANCE["nothing"]
    cells = [cell for cell in played if cell.arm.setting.kind != "policy"]
    if cells:
        # Where the swarm is as it should be, or else in the first condition.
        sound = [c for c in cells if c.arm.setting.kind == "fault" and not c.arm.setting.value]
        candidates = sound or cells
        setting = candidates[0].arm.setting
        chosen = [(cell.policy, cell) for cell in candidates if cell.arm.setting == setting]
        where = "" if setting.kind == "size" else f", {setting}"
    else:  # policies alone are compared: in the first table
        table = played[0].table
        chosen = [(cell.arm.setting.name, cell) for cell in played if cell.table == table]
        where = f", {table}"
    by_policy: dict[str, Cell] = {}
    for policy, cell in chosen:
        # Its first cell counts; a policy that others are compared with stands behind them.
        first_cell = by_policy.pop(policy, cell)
        by_policy[policy] = first_cell
    case = next(iter(by_policy.values())).arm.case
    means = [_mean(cell) for cell in by_policy.values()]
    if len(by_policy) > 1 or len(results.policies) > 1:
        means = [f"{policy} {mean}" for policy, mean in zip(by_policy, means)]
    counted = counted_in(case)
    template = "count" if counted else "no_count"
    if any(cell.mean.low is not None for cell in by_policy.values()):
        template += "_with_interval"
    return templates.PERFORMANCE[template].format(
        level=section.P_LEVEL,
        counted=counted,
        duration=case.scenario.duration,
        condition=f"N = {case.scenario.n_robots}{where}",
        means=", ".join(means),
        p=results.plan.name_of_p,
    )


def _mean(cell: Cell) -> str:
    """Return mean P; where nothing was delivered, with the upper limit of a Poisson mean."""
    slots: dict[str, Slots] = {}
    if cell.by_seed.any() or cell.arm.case.performance:
        slots["mean"] = {"mean": section.mean_p(cell)}
        if cell.problem:
            slots["problem"] = {"problem": cell.problem}
        if any(outcome.all_delivered for outcome in cell.outcomes):
            slots["all_delivered"] = {"time": section.time_to_clear(cell)}
    else:
        slots["nothing_and_problem" if cell.problem else "nothing"] = {
            "most": -math.log(1.0 - CONFIDENCE) / cell.n_seeds,
            "level": section.P_LEVEL,
            "n_runs": cell.n_seeds,
            "problem": cell.problem,
        }
    return "".join(fill(templates.MEAN, slots))
