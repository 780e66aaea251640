"""Two policies side by side: whose P is larger by which factor, and where the order turns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple, Self

from more_itertools import map_reduce

from swarm_logistics_env.spi.summaries import Interval
from swarm_logistics_env.study.questions.comparison import CONFIDENCE
from swarm_logistics_env.study.tasks.task import Case
from swarm_logistics_env.study.verdicts.results import StudyResults, Subject
from swarm_logistics_env.study.verdicts.verdict import Verdict

from . import section


class PoliciesCompared(NamedTuple):
    """P of the policies of a study side by side; of one alone all is empty.

    Attributes:
        sentence: of two, by which factor P of the first differs from that of the other.
        turns: of more, where each and the first one stand the other way round.
        factors: by which factor P of each other policy, and task, is larger than that of the first
            one, with its interval; and "more", "less", or why it is open.
    """

    sentence: str
    turns: str
    factors: Mapping[str, tuple[str, str]]


def compare_policies(results: StudyResults) -> PoliciesCompared:
    """Return how P of the policies of a study compares."""
    by_policy: dict[str, list[Verdict]] = map_reduce(
        results.on_policies, lambda verdict: verdict.compared.policy
    )
    by_subject: dict[str, list[Verdict]] = map_reduce(
        results.on_policies,
        lambda verdict: results.subjects[verdict.compared.original.case].name,
    )
    compared = {policy: _Compared.of(results, v) for policy, v in by_policy.items()}
    sentences = [comparison.sentence for comparison in compared.values()]
    return PoliciesCompared(
        sentences[0] if len(sentences) == 1 else "",
        _turns(compared) if len(compared) > 1 else "",
        {subject: _Compared.of(results, v).factor for subject, v in by_subject.items()},
    )


def _turns(compared: Mapping[str, _Compared]) -> str:
    """Return where each of several policies and the first one stand the other way round."""
    turned = [f"{policy} at {where}" for policy, c in compared.items() if (where := c.turned)]
    n_others = sum(len(comparison.elsewhere) for comparison in compared.values())
    if not turned:
        return f"In {n_others} comparisons under other conditions no order is shown to turn."
    return f"The order turns in some of {n_others} comparisons elsewhere: {'; '.join(turned)}."


class _Compared(NamedTuple):
    """P of the first policy and of another one.

    Attributes:
        main: the verdict where the swarm is as it should be.
        elsewhere: those in other conditions.
        subjects: whose swarm each case is about.
    """

    main: Verdict
    elsewhere: list[Verdict]
    subjects: Mapping[Case, Subject]

    @classmethod
    def of(cls, results: StudyResults, verdicts: Sequence[Verdict]) -> Self:
        """Return it from the verdicts on a pair of policies."""
        base = results.plan.specification.scenario
        sound = [verdict for verdict in verdicts if not verdict.compared.original.case.faults]
        # Trials have no base: that with which failures are compared, or which has the most of them.
        references = {
            verdict.compared.original.case.key
            for verdict in results.verdicts
            if verdict.after.kind == "fault"
        }
        as_it_is = [v for v in sound if v.compared.original.case.scenario == base]
        usual = [v for v in sound if v.compared.original.case.key in references]
        main = max(
            as_it_is or usual or sound or verdicts,
            key=lambda v: v.estimate.n_seeds if v.estimate else 0,
        )
        elsewhere = [verdict for verdict in verdicts if verdict is not main]
        return cls(main, elsewhere, results.subjects)

    def condition(self, verdict: Verdict) -> str:
        """Return in which condition a verdict is; of recorded trials with the task."""
        task = self.subjects[verdict.compared.original.case].task
        return f"{task} {verdict.after.condition}".strip()

    @property
    def is_ahead(self) -> bool:
        """Whether P of the first policy is the larger one, or both are equal."""
        return self.main.interval is not None and self.main.interval.value >= 0.0

    @property
    def sentence(self) -> str:
        """By which factor P of the first policy differs, as the table says, and where it turns."""
        first = self.main.after.name
        second = self.main.compared.policy
        condition = self.condition(self.main)
        if self.main.interval is None:
            return (
                f"P of {first} and of {second} cannot be compared: {self.main.problem} "
                f"({condition})."
            )
        times = f"{section.bracketed(factor_of(self.main.interval), 2, [1.0])} times"
        level = section.percent(self.main.level or CONFIDENCE)
        if level != section.P_LEVEL:
            condition += f", {level}"
        if self.main.on_threshold.adjusted in ("supported", "refuted"):
            text = f"P of {first} is {times} that of {second} ({condition})"
        else:
            text = (
                f"Whether P of {first} or of {second} is larger is {self.main.in_words}: {times} "
                f"({condition})"
            )
        return f"{text}{self.other_conditions}."

    @property
    def factor(self) -> tuple[str, str]:
        """The factor of the other policy to the first one, and whether it is decided."""
        times = section.NOTHING
        if self.main.interval is not None:
            times = section.bracketed(_inverse(factor_of(self.main.interval)), 2, [1.0])
        words = {"supported": "less", "refuted": "more"}
        word = self.main.on_threshold.adjusted
        return times, words.get(word, self.main.in_words)

    @property
    def turned(self) -> str:
        """Where the order is shown to be the other way round; empty: nowhere."""
        turned = "refuted" if self.is_ahead else "supported"
        return ", ".join(self._conditions_by_word.get(turned, ()))

    @property
    def other_conditions(self) -> str:
        """In how many other conditions the order is the same, and where it is not; empty: none."""
        alike = "supported" if self.is_ahead else "refuted"
        by_word = self._conditions_by_word
        text = ""
        if n_same := len(by_word.pop(alike, ())):
            word = "more" if self.is_ahead else "less"
            text += f"; also {word} in {n_same} of {len(self.elsewhere)} other conditions"
            of_alike = [v.interval for v in self.elsewhere if v.on_threshold.adjusted == alike]
            values = [factor_of(change).value for change in of_alike if change]
            least = section.fixed(min(values), 2, [1.0])
            most = section.fixed(max(values), 2, [1.0])
            if least != most:
                text += f" ({least} to {most} times)"
        turned = "refuted" if self.is_ahead else "supported"
        if turned in by_word:
            text += f"; the other way round: {', '.join(by_word.pop(turned))}"
        undecided = [condition for conditions in by_word.values() for condition in conditions]
        if undecided:
            text += f"; open: {', '.join(undecided)}"
        return text

    @property
    def _conditions_by_word(self) -> dict[str, list[str]]:
        """The other conditions by what is decided there."""
        return map_reduce(
            self.elsewhere,
            lambda verdict: verdict.on_threshold.adjusted,
            # Without commas: they stand between conditions.
            lambda verdict: self.condition(verdict).replace(",", ""),
        )


def factor_of(change: Interval) -> Interval:
    """Return a relative change as a factor of P."""
    low, high = (None if end is None else 1.0 + end for end in (change.low, change.high))
    return Interval(1.0 + change.value, low, high)


def _inverse(factor: Interval) -> Interval:
    """Return a factor of P as that of the other policy."""
    low, high = (None if end is None else 1.0 / max(end, 1e-9) for end in (factor.high, factor.low))
    return Interval(1.0 / max(factor.value, 1e-9), low, high)
