"""Two policies side by side: whose P is larger by which factor, and where the order turns."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple, Self

from more_itertools import map_reduce

from swarm_logistics_env.spi.summaries import Interval
from swarm_logistics_env.study.questions.comparison import CONFIDENCE
from swarm_logistics_env.study.tasks.task import Case
from swarm_logistics_env.study.tasks.warehouse_task import RecordedScenario
from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.study.verdicts.verdict import Verdict

from . import section


def between_policies(verdicts: Iterable[Verdict]) -> list[Verdict]:
    """Return the verdicts on P of a policy and of the first one; a claimed ablation is none."""
    return [verdict for verdict in verdicts if verdict.compares_policies]


def comparison_in_words(results: StudyResults) -> str:
    """Return by which factor P of the first of two policies differs from that of the other.

    Empty: the study does not compare two.
    """
    by_policy = _by_policy(results)
    if len(by_policy) != 1:
        return ""
    (comparison,) = (_Compared.of(results, verdicts) for verdicts in by_policy.values())
    return comparison.sentence


def turns_in_words(results: StudyResults) -> str:
    """Return where each of several policies and the first one stand the other way round.

    Empty: the study does not compare more than two.
    """
    by_policy = _by_policy(results)
    if len(by_policy) < 2:
        return ""
    compared = {policy: _Compared.of(results, v) for policy, v in by_policy.items()}
    turned = [f"{policy} at {where}" for policy, c in compared.items() if (where := c.turned)]
    n_others = sum(len(comparison.elsewhere) for comparison in compared.values())
    if not turned:
        return f"In {n_others} comparisons under other conditions no order is shown to turn."
    return f"The order turns in some of {n_others} comparisons elsewhere: {'; '.join(turned)}."


def factors(results: StudyResults) -> dict[str, tuple[str, str]]:
    """Return how P of each policy, and task, compares with that of the first policy.

    That is: by which factor it is larger, with its interval; and "more", "less", or why it is open.
    """
    by_subject = map_reduce(
        between_policies(results.verdicts),
        lambda v: subject_of(results, v.compared.original.case, v.compared.policy),
    )
    return {
        subject: _Compared.of(results, verdicts).factor for subject, verdicts in by_subject.items()
    }


def subject_of(results: StudyResults, case: Case, policy: str) -> str:
    """Return whose swarm a case is about: a policy, and of recorded trials its task."""
    task = case.scenario.table if isinstance(case.scenario, RecordedScenario) else ""
    if task and has_no_name(results):
        return task
    return f"{policy}, {task}" if task else policy


def has_no_name(results: StudyResults) -> bool:
    """Return whether recorded trials name no policy, so that it is called as their file."""
    plan = results.plan
    return bool(plan.origin) and results.policies == (plan.specification.name,)


def condition_of(verdict: Verdict) -> str:
    """Return in which condition two policies are compared; of recorded trials with the task."""
    case = verdict.compared.original.case
    task = case.scenario.table if isinstance(case.scenario, RecordedScenario) else ""
    return f"{task} {verdict.after.condition}".strip()


def _by_policy(results: StudyResults) -> dict[str, list[Verdict]]:
    """Return the verdicts on P of the first policy and of each other one."""
    return map_reduce(between_policies(results.verdicts), lambda verdict: verdict.compared.policy)


class _Compared(NamedTuple):
    """P of the first policy and of another one.

    Attributes:
        main: the verdict where the swarm is as it should be.
        elsewhere: those in other conditions.
    """

    main: Verdict
    elsewhere: list[Verdict]

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
        return cls(main, [verdict for verdict in verdicts if verdict is not main])

    @property
    def condition(self) -> str:
        """The condition of `main`."""
        return condition_of(self.main)

    @property
    def is_ahead(self) -> bool:
        """Whether P of the first policy is the larger one, or both are equal."""
        return self.main.interval is not None and self.main.interval.value >= 0.0

    @property
    def sentence(self) -> str:
        """By which factor P of the first policy differs, as the table says, and where it turns."""
        first = self.main.after.name
        second = self.main.compared.policy
        if self.main.interval is None:
            return (
                f"P of {first} and of {second} cannot be compared: {self.main.problem} "
                f"({self.condition})"
            )
        times = f"{section.bracketed(_factor(self.main.interval), 2, [1.0])} times"
        level = section.percent(self.main.level or CONFIDENCE)
        condition = self.condition if level == section.P_LEVEL else f"{self.condition}, {level}"
        if self.main.on_threshold.adjusted in ("supported", "refuted"):
            text = f"P of {first} is {times} that of {second} ({condition})"
        else:
            text = (
                f"Whether P of {first} or of {second} is larger is {self.main.in_words}: {times} "
                f"({condition})"
            )
        return f"{text}{_elsewhere(self.elsewhere, self.is_ahead)}."

    @property
    def factor(self) -> tuple[str, str]:
        """The factor of the other policy to the first one, and whether it is decided."""
        times = section.NOTHING
        if self.main.interval is not None:
            times = section.bracketed(_inverse(_factor(self.main.interval)), 2, [1.0])
        words = {"supported": "less", "refuted": "more"}
        word = self.main.on_threshold.adjusted
        return times, words.get(word, self.main.in_words)

    @property
    def turned(self) -> str:
        """Where the order is shown to be the other way round; empty: nowhere."""
        turned = "refuted" if self.is_ahead else "supported"
        conditions = [
            condition_of(verdict).replace(",", "")
            for verdict in self.elsewhere
            if verdict.on_threshold.adjusted == turned
        ]
        return ", ".join(conditions)


def _factor(change: Interval) -> Interval:
    """Return a relative change as a factor of P."""
    low, high = (None if end is None else 1.0 + end for end in (change.low, change.high))
    return Interval(1.0 + change.value, low, high)


def _inverse(factor: Interval) -> Interval:
    """Return a factor of P as that of the other policy."""
    low, high = (None if end is None else 1.0 / max(end, 1e-9) for end in (factor.high, factor.low))
    return Interval(1.0 / max(factor.value, 1e-9), low, high)


def _elsewhere(verdicts: Sequence[Verdict], is_ahead: bool) -> str:
    """Return in how many other conditions the order is the same, and where it is not.

    Empty: there are no others.
    """
    alike = "supported" if is_ahead else "refuted"
    turned = "refuted" if is_ahead else "supported"
    by_word: dict[str, list[str]] = map_reduce(
        verdicts,
        lambda v: v.on_threshold.adjusted,
        # Without commas: they stand between conditions.
        lambda v: condition_of(v).replace(",", ""),
    )
    text = ""
    if n_same := len(by_word.pop(alike, ())):
        word = "more" if is_ahead else "less"
        text += f"; also {word} in {n_same} of {len(verdicts)} other conditions"
        of_alike = [v.interval for v in verdicts if v.on_threshold.adjusted == alike]
        values = [_factor(change).value for change in of_alike if change]
        least = section.fixed(min(values), 2, [1.0])
        most = section.fixed(max(values), 2, [1.0])
        if least != most:
            text += f" ({least} to {most} times)"
    if turned in by_word:
        text += f"; the other way round: {', '.join(by_word.pop(turned))}"
    undecided = [condition for conditions in by_word.values() for condition in conditions]
    if undecided:
        text += f"; open: {', '.join(undecided)}"
    return text
