"""Comparisons: which conditions an indicator sets against each other, and its numbers."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias, Unpack

from swarm_logistics_env.spi.definitions import (
    DEFINITIONS,
    Change,
    Definition,
    FactorKind,
    comparing,
)
from swarm_logistics_env.spi.estimate import Estimate, Options
from swarm_logistics_env.spi.inputs import Numbers
from swarm_logistics_env.study.tasks.task import Case
from swarm_logistics_env.study.tasks.task_world import world_of

CONFIDENCE = 0.95  # of intervals and verdicts, unless a look of a study makes it larger


class Setting(NamedTuple):
    """One setting of a factor: a swarm size, a fault, a parameter's value, or another policy.

    Where policies are compared in several conditions, `condition` says in which.
    """

    kind: FactorKind
    name: str
    value: float
    onset: float = 0.0
    condition: str = ""

    def __str__(self) -> str:
        if self.kind == "size":
            return f"N = {self.value:g}"
        if self.kind == "parameter":
            return f"{self.name} = {self.value:g}"
        if self.kind == "policy":
            return f"{self.name}, {self.condition or f'N = {self.value:g}'}"
        if self == NO_FAULT:
            return "no fault"
        if self == OTHER_BEHAVIOUR:
            return "no fault, other behaviour seeds"
        start = f" from {self.onset:g} s" if self.onset else ""
        return f"{self.name}, m = {self.value:g}{start}"


NO_FAULT = Setting("fault", "none", 0)
OTHER_BEHAVIOUR = Setting("fault", "other behaviour", 0)


@dataclass(frozen=True)
class Arm:
    """A case in the part that it plays in a comparison."""

    setting: Setting
    case: Case


Family: TypeAlias = tuple[str, str]  # policy and indicator, whose p Holm adjusts together


class Question(NamedTuple):
    """What a comparison asks, whichever policy it is asked of."""

    indicator: str
    original: Setting
    changed: Setting
    threshold: float


@dataclass(frozen=True)
class Comparison:
    """One indicator between conditions: is it above `threshold`?

    Attributes:
        table: heading of the report's table that it stands in.
        indicator: a symbol of `spi.definitions.DEFINITIONS`.
        original: the arm of P_o (P_N for S).
        changed: the arm of P_F, P_new or P_(N+m).
        removed: the arm of P_S, where the indicator needs it.
        threshold: that the indicator is tested against.
        claim: whether the study claims that it is above; None: the study claims nothing.
    """

    table: str
    indicator: str
    original: Arm
    changed: Arm
    removed: Arm | None = None
    threshold: float = 0.0
    claim: bool | None = None

    @property
    def policy(self) -> str:
        """Label of the policy that is judged."""
        return self.original.case.policy.title

    @property
    def definition(self) -> Definition:
        """The indicator's row in the table of indicators."""
        return DEFINITIONS[self.indicator]

    @property
    def question(self) -> Question:
        """What is compared, apart from the policy; it is the same for all policies."""
        return Question(self.indicator, self.original.setting, self.changed.setting, self.threshold)

    @property
    def family(self) -> Family:
        """Holm's family: all comparisons of one indicator for one policy."""
        return self.policy, self.indicator

    @property
    def arms(self) -> tuple[Arm, ...]:
        """The two or three arms whose P it needs."""
        return tuple(filter(None, (self.original, self.removed, self.changed)))

    @property
    def arguments(self) -> dict[str, Arm]:
        """The arms by the names that the indicator's function has for their performances."""
        # In the definition's order of performances, which is not that of `arms`.
        arms = filter(None, (self.original, self.changed, self.removed))
        return dict(zip(self.definition.performances, arms))

    @property
    def n_robots(self) -> int:
        """Swarm size N of the original condition."""
        return self.original.case.scenario.n_robots

    @property
    def change(self) -> str:
        """What changes, as the answer of a study has it, e.g. "FM4, 1 of 25"."""
        after = self.changed.setting
        if after.condition:
            return f"to {after.name}, {after.condition}"
        if after.kind == "fault":
            start = f" from {after.onset:g} s" if after.onset else ""
            mode = f"{after.name} {world_of(self.original.case.task).mode_title(after.name)}"
            return f"{mode.rstrip()}{start}, {after.value:g} of {self.n_robots}"
        if after.kind == "policy":
            return f"with {after.name}"
        name = "N" if after.kind == "size" else after.name
        return f"{name} {self.original.setting.value:g}→{after.value:g}"

    @property
    def label(self) -> str:
        """The step in words, e.g. "N 5 -> 10" or "FM1, m = 2"."""
        before = self.original.setting
        after = self.changed.setting
        if after.kind == "size":
            return f"N {before.value:g} -> {after.value:g}"
        if after.kind == "parameter":
            return f"{after.name} {before.value:g} -> {after.value:g}"
        return str(after)

    def estimate(
        self,
        performance: Mapping[Arm, Numbers],
        *,
        capped: Collection[Arm] = (),
        **options: Unpack[Options],
    ) -> Estimate:
        """Return the indicator over seeds.

        Args:
            performance: P of each arm, shape (n_seeds,) [items], seed by seed.
            capped: arms whose P is capped, every item delivered in a run.
            options: further ones of `spi.Options`; identical: whether the original and the changed
                arm gave the same runs, and there is no arm with the robots removed.

        Raises:
            IndicatorError: the indicator is undefined, e.g. because mean P_o is 0.
        """
        definition = self.definition
        named = self.arguments
        before = self.original.setting.value
        after = self.changed.setting.value
        return definition.function(
            **{name: performance[arm] for name, arm in named.items()},
            **definition.arguments(Change(before, after, self.n_robots)),
            threshold=self.threshold,
            saturated=[name for name, arm in named.items() if arm in capped],
            **options,
        )


def compared(table: str, arms: Sequence[Arm]) -> Iterator[Comparison]:
    """Yield what is asked of arms that differ in one factor.

    Neighbouring swarm sizes are compared, else the original arm with each other one; where no arm
    has the robots removed, no indicator that needs it is asked.

    Args:
        table: heading of the report's table.
        arms: the original one first.
    """
    original, *changed = arms
    kind = original.setting.kind
    removed = original.case.task.removed
    by_setting = {arm.setting: arm for arm in arms}
    for before, after in zip(arms, changed) if kind == "size" else ((original, x) for x in changed):
        setting = after.setting
        reference = Setting("fault", removed or "", setting.value, setting.onset)
        if setting in (reference, OTHER_BEHAVIOUR):
            continue
        for definition in comparing(kind):
            third = by_setting.get(reference) if definition.needs_removed else None
            if third or not definition.needs_removed:
                yield Comparison(table, definition.symbol, before, after, third)


def between_policies(comparisons: Sequence[Comparison]) -> Iterator[Comparison]:
    """Yield the change of P from each policy to the first, in the conditions that both have.

    Of a failure mode only that with the most robots, so that the questions are few.
    """
    arms: dict[str, dict[tuple[object, object], Arm]] = {}
    for comparison in comparisons:
        removed = comparison.original.case.task.removed
        most = arms.setdefault(comparison.policy, {})
        for arm in comparison.arms:
            setting = arm.setting
            if setting.name == removed or setting == OTHER_BEHAVIOUR:
                continue
            is_fault = setting.kind == "fault" and setting != NO_FAULT
            case = arm.case
            fault: object = (setting.name, setting.onset) if is_fault else case.faults
            condition: tuple[object, object] = (case.scenario, fault)
            before = most.setdefault(condition, arm)
            if is_fault and setting.value > before.setting.value:
                most[condition] = arm
    first, *further = arms
    for policy in further:
        for condition, arm in arms[policy].items():
            if condition in arms[first]:
                pair = (_of_policy(arm), _of_policy(arms[first][condition]))
                yield from compared("Policies", pair)


def _of_policy(arm: Arm) -> Arm:
    """Return the arm as it stands in a comparison of policies."""
    case = arm.case
    setting = Setting(
        "policy", case.policy.title, case.scenario.n_robots, condition=str(arm.setting)
    )
    return Arm(setting, case)
