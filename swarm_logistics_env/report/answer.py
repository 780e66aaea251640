"""The answer of a study: a line a question, with value, interval and verdict, and what is open."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from functools import partial
from itertools import zip_longest
from textwrap import wrap
from typing import NamedTuple

from swarm_logistics_env import spi
from swarm_logistics_env.grouping import grouped
from swarm_logistics_env.questions.comparison import CONFIDENCE
from swarm_logistics_env.spi.definitions import DEFINITIONS
from swarm_logistics_env.tasks.task import DEFAULT
from swarm_logistics_env.verdicts.cell import Cell
from swarm_logistics_env.verdicts.results import StudyResults
from swarm_logistics_env.verdicts.verdict import POWER, UNAFFECTED, UNDEFINED, Verdict

from . import section
from .section import Section

MOST_LINES = 30  # of the answer of `paper` at a terminal
_EFFECT = 0.1  # of an indicator, for which seeds are counted


class Line(NamedTuple):
    """One line of the answer: a question, or several that are alike.

    Attributes:
        policy: whose swarm it is about.
        indicator: its symbol.
        question: indicator and what is changed, e.g. "R FM4, 1 of 25".
        tests: the verdicts, in the order of the values.
        numbers: their places among the verdicts of the study.
    """

    policy: str
    indicator: str
    question: str
    tests: tuple[Verdict, ...]
    numbers: tuple[int, ...]

    @property
    def thresholds(self) -> list[float]:
        """What the values are tested against."""
        return [test.compared.threshold for test in self.tests]

    @property
    def value(self) -> str:
        """The values, one after the other; from the lowest to the highest where they are many."""
        known = [test.value for test in self.tests if test.value is not None]
        if not known:
            return section.NOTHING
        if len(self.tests) > 3:
            return " to ".join(self._fixed(value) for value in (min(known), max(known)))
        capped = any(test.saturated for test in self.tests)
        return " ".join(map(self._fixed, known)) + capped * section.SATURATED

    def _fixed(self, value: float) -> str:
        return section.fixed(value, 2, self.thresholds)

    def interval(self, level: float) -> str:
        """Return the interval; of several values that which holds all of theirs.

        Args:
            level: that the heading names; another one stands behind the interval.
        """
        known = [t.interval for t in self.tests if t.interval and t.conclusion != UNAFFECTED]
        low = [one.low for one in known if one.low is not None]
        high = [one.high for one in known if one.high is not None]
        if not (low and high):
            return ""
        whole = f"[{self._fixed(min(low))}, {self._fixed(max(high))}]"
        whole += section.other_levels(self.tests, level)
        if len(self.tests) == 1:
            return whole
        # A value that is capped or alone has none.
        if len(low) == len(self.tests):
            return f"in {whole}"
        return f"{len(low)} of {len(self.tests)} in {whole}"

    @property
    def verdict(self) -> str:
        """The verdicts in words, and what an open one takes."""
        words, test = section.concluded(*self.tests), self.tests[0]
        if not any(one.estimate for one in self.tests):
            if all(str(one.problem).endswith(" missing") for one in self.tests):
                return "not played yet"
            return f"{words}: {test.problem}"
        if all(one.estimate and one.conclusion == UNDEFINED for one in self.tests):
            return f"no verdict: {self.indicator} lacks runs"
        if len(self.tests) > 1:
            return words
        assert test.estimate is not None
        if test.conclusion == UNAFFECTED:
            return f"{words}, exact"
        if test.estimate.untestable:
            return f"{words}: it cannot be below {test.compared.threshold:g}"
        if "unbounded" in test.flags and test.on_property.adjusted in section.DECIDED:
            return f"{words} by its test; P_o is too near 0 for an interval"
        if test.conclusion != "open":
            return words
        # An effect on the side of the value, which 80 % power finds.
        estimate, threshold = test.estimate, test.estimate.threshold
        effect = threshold + math.copysign(_EFFECT, estimate.value - threshold)
        needed = spi.seeds_for_power(estimate, effect, POWER)
        if needed is None or needed <= estimate.n_seeds:
            return words
        runs = "seeds" if estimate.paired else "trials"
        return f"open: {needed - estimate.n_seeds} more {runs} tell {effect:g}"

    @property
    def contradicts(self) -> bool:
        """Whether a verdict contradicts what the study's reference claims."""
        return any(
            test.on_claim is not None and test.on_claim.adjusted == "refuted" for test in self.tests
        )


class Answer(NamedTuple):
    """What a study found.

    Attributes:
        asked: how much was asked, of whom, and over which seeds.
        performance: P of every policy where the swarm is as it should be.
        lines: the questions.
        last: how to read the verdicts, and what is still open.
    """

    asked: str
    performance: str
    lines: tuple[Line, ...]
    last: str

    @property
    def questions(self) -> list[str]:
        """The question of each line, with its policy where there are several."""
        several = len({line.policy for line in self.lines}) > 1
        return [f"{one.policy}: {one.question}" if several else one.question for one in self.lines]

    @property
    def level(self) -> float:
        """The level of most intervals, which the heading names."""
        return section.level_of(test for line in self.lines for test in line.tests)

    @property
    def section(self) -> Section:
        """The lines as a table."""
        level = self.level
        columns = "question", "value", f"{section.percent(level)} interval", "verdict"
        rows = tuple(
            (question, line.value, line.interval(level), line.verdict)
            for question, line in zip(self.questions, self.lines)
        )
        return Section("Answer", columns, rows, (self.performance, self.last))


def answer(results: StudyResults, most: int | None = MOST_LINES - 5) -> Answer:
    """Return what a study found.

    Args:
        most: lines at most, as far as what is alike can share one; None: a line a question.
    """
    lines: list[Line] = []
    for shared in range(4):
        alike = grouped(enumerate(results.verdicts), partial(_alike, shared))
        lines = [_line(here) for here in alike.values()]
        if most is None or len(lines) <= most:
            break
    # Recorded trials may ask one question in several tables, at other values of a parameter.
    times = Counter((line.policy, line.question) for line in lines)
    lines = [
        line._replace(question=f"{line.question}, {_part_of_title(line.tests[0].compared.table)}")
        if times[line.policy, line.question] > 1
        else line
        for line in lines
    ]
    order, policies = list(DEFINITIONS), results.policies
    lines.sort(key=lambda line: (policies.index(line.policy), order.index(line.indicator)))
    return Answer(_asked(results), _performance(results), tuple(lines), _last(results))


def _part_of_title(table: str) -> str:
    """Return what stands in brackets at the end of a table's title, or else the title."""
    return table.rstrip(")").rpartition(" (")[2]


def _alike(shared: int, numbered: tuple[int, Verdict]) -> tuple[object, ...]:
    """Return what the questions of a line have in common.

    Args:
        shared: 0: a line has one question; 1: those of one failure mode; 2: those of any one
            factor; 3: those of an indicator in a table.
        numbered: a verdict, and its place among those of the study.
    """
    number, test = numbered
    compared, after = test.compared, test.after
    if shared == 0 or (shared == 1 and after.kind != "fault"):
        return (number,)
    indicator = compared.policy, compared.table, compared.indicator
    return indicator if shared == 3 else (*indicator, after.name, after.onset, compared.threshold)


def _line(numbered: Sequence[tuple[int, Verdict]]) -> Line:
    numbers, tests = zip(*numbered)
    compared = tests[0].compared
    question = f"{compared.indicator} {_about(tests)}"
    return Line(compared.policy, compared.indicator, question, tests, numbers)


def _about(tests: Sequence[Verdict]) -> str:
    compared, after = tests[0].compared, tests[0].after
    before = compared.original.setting
    usual = compared.definition.adjectives.get(0.0)
    asked = "" if tests[0].property_name == usual else f", {tests[0].property_name}"
    names = {test.after.name for test in tests}
    start = f" from {after.onset:g} s" if after.onset else ""
    values = [f"{test.after.value:g}" for test in tests]
    if after.kind == "size":
        chain = [f"{before.value:g}", *values]
        return f"N {'→'.join(chain if len(chain) <= 4 else [chain[0], '…', chain[-1]])}{asked}"
    if len(names) > 1:
        return f"{len(names)} {'failure modes' if after.kind == 'fault' else 'parameters'}{start}"
    if after.kind == "fault":
        return f"{after.name}{start}, {', '.join(values)} of {compared.n_robots}{asked}"
    if after.kind == "policy":
        return f"with {after.name}{asked}"
    return f"{after.name} {before.value:g}→{', '.join(values)}{asked}"


def _asked(results: StudyResults) -> str:
    policies = results.policies
    whose = policies[0] if len(policies) == 1 else f"{len(policies)} policies"
    seeds = section.seeds_text(results).split(" (")[0]
    if any(cell.problem for cell in results.cells):
        seeds = f"up to {seeds}"
    name = results.plan.specification.name
    return f"{name}: {section.plural(len(results.verdicts), 'question')}, {whose}, {seeds}."


def _performance(results: StudyResults) -> str:
    shown = [one for one in results.cells if one.arm.setting.kind != "policy" and one.n_seeds]
    # Where the swarm is as it should be, or else in the first condition.
    base = [c for c in shown if c.arm.setting.kind == "fault" and not c.arm.setting.value] or shown
    here = {c.policy: c for c in reversed(base) if c.arm.setting == base[0].arm.setting}
    if not here:
        return "P: no run has succeeded."
    cell, scenario = base[0], base[0].arm.case.scenario
    where = f"N = {scenario.n_robots}"
    where += "" if cell.arm.setting.kind == "size" else f", {cell.arm.setting}"
    several = len(results.policies) > 1
    told = (f"{one.policy} " * several + _mean(one) for one in reversed(here.values()))
    is_usual = cell.arm.case.task.name == DEFAULT
    level = (
        f" [{section.P_LEVEL}]" if any(one.mean.low is not None for one in here.values()) else ""
    )
    measured = f"P{level}, items in {scenario.duration:g} s," if is_usual else f"P{level}"
    return f"{measured} at {where}: {', '.join(told)}."


def _mean(cell: Cell) -> str:
    """Return mean P; where nothing was delivered, with the upper limit of a Poisson mean."""
    failed = f" ({cell.problem} and do not count)" if cell.problem else ""
    if cell.by_seed.any():
        cleared = any(outcome.all_delivered for outcome in cell.outcomes)
        time = f", all items after {section.time_to_clear(cell)} s" if cleared else ""
        return section.mean_p(cell) + failed + time
    most = -math.log(1.0 - CONFIDENCE) / cell.n_seeds
    why = f"none of {cell.n_seeds} runs delivered anything"
    problem = f"; {cell.problem}" if cell.problem else ""
    return f"0 (at most {most:.2f} at {section.P_LEVEL}, as {why}{problem})"


def _last(results: StudyResults) -> str:
    """Return what the symbols mean, how to read the verdicts, and what limits them, in one line."""
    tests, reference = results.verdicts, results.reference
    runs = "seeds" if results.plan.paired else "trials a condition"
    asked = {test.compared.indicator for test in tests} - {"change"}
    named = [one.heading for symbol, one in DEFINITIONS.items() if symbol in asked]
    parts = [f"{', '.join(named)}: good above 0"] if named else []
    level = section.level_of(tests)
    differ = section.other_levels(tests, level) and ", or as said behind them"
    if any(test.interval and test.interval.low is not None for test in tests):
        parts.append(f"{section.percent(level)} intervals{differ}")
    parts.append("verdicts are Holm-adjusted")
    flags = {flag for test in tests for flag in test.flags}
    if "assumes_normal" in flags:
        few = "below ten seeds" if results.plan.paired else "unpaired"
        parts.append(f"provisional ({few} they assume normality)")
    if "cannot_fail" in flags:
        parts.append("untestable where it cannot lie below the threshold, as P cannot below 0")
    if "too_few_seeds" in flags:
        parts.append("two seeds give no verdict")
    if results.damage:
        parts.append(results.damage)
    if results.exploratory:
        parts.append("exploratory: other seeds than were declared, whose report this replaces")
    if results.late_margin:
        parts.append("equivalence is exploratory: another margin was declared")
    if any(test.saturated for test in tests):
        parts.append(f"{section.SATURATED} P is capped: --clearing or --restock has no cap")
    if any(cell.stalled for cell in results.cells):
        parts.append("some runs stalled (P below a quarter of the median; --full names them)")
    undecided = [test for test in tests if test.conclusion == "open"]
    if undecided:
        parts.append(
            f"so many more {runs} would tell such a value from the threshold in 4 of 5 studies"
        )
    beside = [test for test in undecided if section.lies_above(test) is not None]
    reasons = {
        "so few seeds may hide stalls": any("hidden_stalls" in test.flags for test in beside),
        "Holm counts all questions": any(
            test.on_threshold.plain in section.DECIDED for test in beside
        ),
    }
    if why := " or ".join(reason for reason, holds in reasons.items() if holds):
        parts.append(f"open beside an interval on one side of it: {why}")
    claims = [test for test in tests if test.on_claim is not None]
    told = reference.claims if reference else {}
    of_text = [test for test in claims if test.compared.question in told]
    of_others = [test for test in claims if test not in of_text]
    for where, here in ((" in the paper's text", of_text), (" beside it" * bool(told), of_others)):
        if here:
            found = section.counted(test.on_claim.adjusted for test in here if test.on_claim)
            parts.append(f"of {section.plural(len(here), 'claim')}{where} {found}")
    line = "; ".join(parts)
    return f"{line[0].upper()}{line[1:]}."


def in_a_sentence(results: StudyResults) -> str:
    """Return what a paper can say of the study: conditions, P, counts, and the lowest value."""
    known = [one for one in results.verdicts if one.interval and one.interval.low is not None]
    known = [test for test in known if test.compared.indicator != "change"] or known
    told = f"{_performance(results)[:-1]} over {section.seeds_text(results)}"
    worst = min(known or results.verdicts, key=lambda test: test.value or 0.0)
    line = _line([(0, worst)])
    value, level = f"{line.question} = {line.value}", section.level_of([worst])
    if interval := line.interval(level):
        value += f", {section.percent(level)} interval {interval}"
    if len(results.verdicts) == 1:
        asked = f"{line.indicator} > {worst.compared.threshold:.3g}"
        told += f"; {value}; {asked}: {section.concluded(worst)} (Holm)"
    else:
        words = section.concluded(*results.verdicts)
        if words == worst.on_property.adjusted:  # all alike
            words = f"{len(results.verdicts)} {words}"
        told += f"; of {len(results.verdicts)} questions {words} (Holm)"
        told += f"; the lowest is {value}" if known else ""
    whose = results.policies
    if results.plan.origin and len(whose) == 1:  # nobody named it
        whose = (results.plan.specification.name,)
    return f"{', '.join(whose)}: {told}."


def digest(found: Answer, width: int, most: int | None = MOST_LINES) -> str:
    """Return the answer for a terminal.

    Args:
        found: to show.
        width: of the terminal [characters]; no line is longer.
        most: lines at most; None: as many as it takes.
    """
    head = [line for text in (found.asked, found.performance) for line in _fold(text, width)]
    tail = _fold(found.last, width)
    rows = _rows(found, width)
    room = None if most is None else most - len(head) - len(tail)
    if room is not None and len(rows) > room:
        rows = [*rows[: room - 1], f"and {len(rows) - room + 1} lines more: --full"]
    return "\n".join([*head, *rows, *tail])


def _rows(found: Answer, width: int) -> list[str]:
    """Return the lines in columns, as few as questions and verdicts can be folded into."""
    level = found.level
    columns = zip(*((line.question, line.value, line.interval(level)) for line in found.lines))
    longest, *others = [max(map(len, column)) for column in columns]
    most = min(longest, max(8, width - sum(others) - 16))
    tried = range(min(20, most), most + 1)
    return min((list(_in_columns(found, [w, *others], width)) for w in tried), key=len)


def _in_columns(found: Answer, widths: Sequence[int], width: int) -> Iterator[str]:
    for policy, lines in grouped(found.lines, lambda line: line.policy).items():
        if len({line.policy for line in found.lines}) > 1:
            yield f"{policy}:"
        for line in lines:
            question, *more = wrap(line.question, widths[0], subsequent_indent="  ")
            interval = line.interval(found.level)
            left = f"{question:{widths[0]}}  {line.value:>{widths[1]}}  {interval:{widths[2]}}"
            verdict = wrap(line.verdict, max(10, width - len(left) - 2)) or [""]
            yield f"{left}  {verdict[0]}".rstrip()
            for first, second in zip_longest(more, verdict[1:], fillvalue=""):
                yield f"{first:{len(left)}}  {second}".rstrip()


def _fold(text: str, width: int) -> list[str]:
    # Paths and names are longer than a line sometimes: they are broken, never cut.
    return wrap(text, width, subsequent_indent="  ", break_on_hyphens=False)
