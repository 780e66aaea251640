"""The questions of a study, a line each, and what they say in sentences."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from more_itertools import map_reduce

from swarm_logistics_env.spi.definitions import DEFINITIONS
from swarm_logistics_env.spi.summaries import Interval
from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.study.verdicts.verdict import UNAFFECTED, UNTESTABLE, Verdict

from . import section
from .policies_compared import factor_of

_MOST_NAMED = 3  # questions that are decided alike, in a sentence


class Line(NamedTuple):
    """One row of the answer: a question.

    Attributes:
        subject: whose swarm it is about, and in which task where there are several.
        question: indicator and what is changed, e.g. "R FM4 no delivery, 1 of 25".
        verdict: on it.
        number: the index of the verdict among those of the study.
        p: mean P before and after, of FT with the robots removed and faulty; empty: not played.
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


def lines_of(results: StudyResults) -> Iterator[Line]:
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
        return f"P with them removed {before}, faulty {after}{seeds}"
    return f"P {before}→{after}{seeds}"


def sentences(lines: Sequence[Line], level: str) -> Iterator[str]:
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
        lambda line: section.word_to_count(line.verdict, line.verdict.conclusion),
    )
    for word in sorted(by_word, key=section.rank_of_word):
        alike = by_word[word]
        if alike[0].verdict.conclusion == "equivalent":
            yield f"{len(alike)} with {alike[0].verdict.in_words}"
            continue
        names = [line.name(with_subject=names_subjects) for line in alike]
        decision, _, provisional = word.removesuffix(")").partition(" (")
        is_named = decision in ("supported", "refuted") and len(lines) > 1
        of_which = names if is_named and len(names) <= _MOST_NAMED else []
        details = "; ".join(filter(None, [provisional, *of_which]))
        yield f"{len(alike)} {decision} ({details})" if details else f"{len(alike)} {decision}"


def in_short(lines: Sequence[Line]) -> list[str]:
    """Return what is decided of the indicators in plain sentences; none where one is asked."""
    by_indicator: dict[str, list[Line]] = map_reduce(
        lines, lambda line: line.verdict.compared.indicator
    )
    parts: list[str] = []
    for indicator, alike in by_indicator.items():
        definition = DEFINITIONS[indicator]
        usual = [line for line in alike if line.threshold == 0.0]
        parts += _decided_in_words(usual, "refuted", definition.below, "worst")
        parts += _decided_in_words(usual, "supported", definition.above, "least")
    if not parts or len(lines) == 1:
        return []
    n_open = sum(line.verdict.conclusion == "open" for line in lines)
    are = "is" if n_open == 1 else "are"
    parts += [f"{n_open} of {len(lines)} questions {are} open"] if n_open else []
    first, *others = parts
    return [f"In short: {first}.", *(f"{part[0].upper()}{part[1:]}." for part in others)]


def _decided_in_words(
    lines: Sequence[Line], word: str, meaning: str, extreme: str
) -> Iterator[str]:
    """Yield in how many questions that is so, and in which the value is lowest; none: nothing."""
    decided = [line for line in lines if line.verdict.conclusion == word]
    if decided and meaning:
        lowest = min(decided, key=lambda line: line.verdict.value or 0.0)
        where = f"{lowest.name(with_subject=False)}: {lowest.p}"
        if len(lines) > 1:
            where = f"in {len(decided)} of {len(lines)} questions, {extreme} at {where}"
        yield f"{meaning}, {where}"
