"""Comparisons: which conditions an indicator sets against each other, and its numbers."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple, TypedDict

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import spi
from swarm_logistics_env.errors import StudyError, suggest
from swarm_logistics_env.spi.estimate import Estimate, Indicator
from swarm_logistics_env.studies.conditions import Condition

Performance = Callable[["Arm"], NDArray[np.float64]]


class Setting(NamedTuple):
    """One setting of a factor: a swarm size, a fault, a parameter's value, or another policy."""

    kind: Literal["size", "fault", "parameter", "policy"]
    name: str
    value: float
    onset: float = 0.0

    def __str__(self) -> str:
        if self.kind == "size":
            return f"N = {self.value:g}"
        if self.kind == "parameter":
            return f"{self.name} = {self.value:g}"
        if self.kind == "policy":
            return f"{self.name}, N = {self.value:g}"
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
    """A condition in the part that it plays in a comparison."""

    setting: Setting
    condition: Condition


@dataclass(frozen=True)
class NullPair:
    """Two arms without fault that share worlds, not behaviour: what chance alone makes of them.

    Attributes:
        table: heading of the report's table of the faults whose null this is.
        original: the arm of P_o.
        other: the same with other behaviour seeds.
    """

    table: str
    original: Arm
    other: Arm

    @property
    def policy(self) -> str:
        """Label of the policy."""
        return self.original.condition.policy.label


class Question(NamedTuple):
    """What a comparison asks, whichever policy it is asked of."""

    indicator: Indicator
    original: Setting
    changed: Setting
    threshold: float


@dataclass(frozen=True)
class Comparison:
    """One indicator between conditions: is it above `threshold`?

    Attributes:
        table: heading of the report's table that it stands in.
        indicator: "S", "FT", "R", "A" or "change".
        original: the arm of P_o (P_N for S).
        changed: the arm of P_F, P_new or P_(N+m).
        removed: the arm of P_S, for FT alone.
        threshold: that the indicator is tested against.
        claim: whether the study claims that it is above; None: the study claims nothing.
    """

    table: str
    indicator: Indicator
    original: Arm
    changed: Arm
    removed: Arm | None = None
    threshold: float = 0.0
    claim: bool | None = None

    @property
    def policy(self) -> str:
        """Label of the policy that is judged."""
        return self.original.condition.policy.label

    @property
    def question(self) -> Question:
        """The comparison without its policy."""
        return Question(self.indicator, self.original.setting, self.changed.setting, self.threshold)

    @property
    def family(self) -> tuple[str, Indicator]:
        """Holm's family: all comparisons of one indicator for one policy."""
        return self.policy, self.indicator

    @property
    def arms(self) -> tuple[Arm, ...]:
        """The two or three arms whose P it needs."""
        return (self.original, *([self.removed] if self.removed else []), self.changed)

    @property
    def label(self) -> str:
        """The step in words, e.g. "N 5 -> 10" or "FM1, m = 2"."""
        before, after = self.original.setting, self.changed.setting
        if after.kind == "size":
            return f"N {before.value:g} -> {after.value:g}"
        if after.kind == "parameter":
            return f"{after.name} {before.value:g} -> {after.value:g}"
        return str(after)

    def estimate(
        self,
        performance: Performance,
        *,
        level: float = 0.95,
        paired: bool = True,
        saturated: Collection[Arm] = (),
        identical: bool = False,
    ) -> Estimate:
        """Return the indicator over seeds.

        Args:
            performance: gives the P of an arm, shape (n_seeds,) [items], seed by seed.
            level: confidence level of interval and verdict, in (0, 1).
            paired: whether the arms share their seeds, row by row.
            saturated: arms whose P is capped, every item delivered in a run.
            identical: whether the runs of the original and the changed arm are the same runs.

        Raises:
            IndicatorError: the indicator is undefined, e.g. because mean P_o is 0.
        """
        before, after = self.original.setting.value, self.changed.setting.value
        p_o, p_new = performance(self.original), performance(self.changed)
        swarm = self.original.condition.scenario.n_robots
        asked: _Asked = {
            "threshold": self.threshold,
            "level": level,
            "paired": paired,
            "saturated": [
                name
                for name, arm in zip(_NAMES[self.indicator], self._named_arms())
                if arm in saturated
            ],
        }
        if self.indicator == "S":
            return spi.scalability(
                p_o, p_new, n=int(before), m=int(after - before), identical=identical, **asked
            )
        if self.indicator == "FT":
            assert self.removed is not None
            p_s = performance(self.removed)
            return spi.fault_tolerance(p_o, p_new, p_s, n=swarm, m=int(after), **asked)
        if self.indicator == "R":
            return spi.robustness(p_o, p_new, n=swarm, m=int(after), identical=identical, **asked)
        if self.indicator == "A":
            return spi.adaptability(
                p_o, p_new, x_o=before, x_new=after, identical=identical, **asked
            )
        return spi.relative_change(p_o, p_new, identical=identical, **asked)

    def _named_arms(self) -> tuple[Arm, ...]:
        """Return the arms in the order of `_NAMES`."""
        return (self.original, self.changed, *([self.removed] if self.removed else []))


# What each indicator calls the P of the original, the changed and the removed arm.
_NAMES = {
    "S": ("p_n", "p_nm"),
    "FT": ("p_o", "p_f", "p_s"),
    "R": ("p_o", "p_f"),
    "A": ("p_o", "p_new"),
    "change": ("p_o", "p_new"),
}


class _Asked(TypedDict):
    threshold: float
    level: float
    paired: bool
    saturated: list[str]


@dataclass(frozen=True)
class Reference:
    """Performances and yes/no claims that somebody published, without a number of runs.

    Each performance is treated as one run.

    Attributes:
        source: whose they are, for the report.
        performance: P at each setting [items].
        cells: the settings that count as cells of the tables; a baseline repeated under another
            name is none.
        claims: whether the text says that the indicator is above the threshold.
    """

    source: str
    performance: Mapping[Setting, float]
    cells: tuple[Setting, ...]
    claims: Mapping[Question, bool]

    def estimate(self, comparison: Comparison) -> Estimate | None:
        """Return the published value of an indicator, without interval, where there is one."""
        if any(arm.setting not in self.performance for arm in comparison.arms):
            return None
        return comparison.estimate(lambda arm: np.array([self.performance[arm.setting]]))


def load_reference(name: str | None) -> Reference | None:
    """Return the reference of that name; None for none.

    Raises:
        StudyError: there is none of that name.
    """
    if name is None:
        return None
    from swarm_logistics_env.studies.paper import PAPER

    known = {"paper": PAPER}
    if name not in known:
        raise StudyError(f"no reference {name!r}{suggest(name, known)}")
    return known[name]
