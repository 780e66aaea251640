"""The payments of an indicator: one for each delivery and one for the whole episode.

The performances that they are relative to are given, or measured during a training.
"""

from __future__ import annotations

import dataclasses
from collections import Counter, deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from swarm_logistics_env.core.errors import SetupError, suggest
from swarm_logistics_env.environment.requests import checked_count
from swarm_logistics_env.spi.definitions import DEFINITIONS
from swarm_logistics_env.world.scenario import Scenario

from .wrapper import Condition


class GivenPerformances:
    """Performances that were given as numbers, for instance from a study.

    Args:
        performances: of each condition [items].
        whatever_changes: whether a performance without changes stands for conditions in which
            parameters differ as well.

    Raises:
        SetupError: a performance is negative or not finite, or a key is not a `Condition`.
    """

    def __init__(
        self, performances: Mapping[Condition, float], *, whatever_changes: bool = False
    ) -> None:
        self._performances = dict(performances)
        self._whatever_changes = whatever_changes
        for condition, items in self._performances.items():
            if not isinstance(condition, Condition):
                raise SetupError(f"references: key {condition!r} should be a Condition")
            if not isinstance(items, int | float | np.number) or not 0 <= items < np.inf:
                raise SetupError(
                    f"references[{condition}] = {items!r}: should be a number of items, at least 0"
                )

    def performance(self, condition: Condition) -> float:
        """Return its P [items].

        Raises:
            SetupError: it was not given.
        """
        if self._whatever_changes:
            condition = dataclasses.replace(condition, changes=())
        if condition not in self._performances:
            raise SetupError(f"references should have the performance of {condition}")
        return float(self._performances[condition])

    def divisor(self, condition: Condition) -> float:
        """Return its P as a divisor.

        Raises:
            SetupError: it was not given, or is 0.
        """
        p_o = self.performance(condition)
        if p_o == 0:
            raise SetupError(f"P_o = 0 of {condition}: should be positive, indicators divide by it")
        return p_o


class RunningMeans:
    """Mean number of items delivered under each condition, over its last episodes.

    Environments may share it, so that a few reference episodes serve them all. They should play
    the same scenario, apart from the swarm size, in one process. `SwarmVecEnv` lets them report
    in the order of its worlds, so that results do not depend on its threads.

    Args:
        window: the number of last episodes of a condition that its mean is over; it is limited
            because the policy changes.
        least: a divisor is at least this [items]; at the start of a training a mean may be 0, or
            there is none. `add` notes what is known before.

    Raises:
        SetupError: `window` is below 1, or `least` is not positive.

    Example:
        >>> means = RunningMeans(window=2)
        >>> for delivered in (30, 34, 36):
        ...     means.add(Condition(25), delivered)
        >>> means.mean(Condition(25)), means.count(Condition(25))
        (35.0, 3)
    """

    def __init__(self, window: int = 50, *, least: float = 1.0) -> None:
        self.window = checked_count("window", window)
        self.least = least
        if not isinstance(least, int | float | np.number) or not 0 < least < np.inf:
            raise SetupError(f"least = {least!r}: should be a positive number of items")
        self._last: dict[Condition, deque[int]] = {}
        self._counts: Counter[Condition] = Counter()

    def add(self, condition: Condition, delivered: int) -> None:
        """Count an episode that is over."""
        self._last.setdefault(condition, deque(maxlen=self.window)).append(delivered)
        self._counts[condition] += 1

    def mean(self, condition: Condition) -> float | None:
        """Return the mean P of its last episodes [items], or None if there was none."""
        last = self._last.get(condition)
        return sum(last) / len(last) if last else None

    def count(self, condition: Condition) -> int:
        """Return how many of its episodes there were in all."""
        return self._counts[condition]

    @property
    def conditions(self) -> tuple[Condition, ...]:
        """The conditions met so far, in order of their first episodes."""
        return tuple(self._last)

    def performance(self, condition: Condition) -> float:
        """Return its mean P [items], 0 if there was none."""
        return self.mean(condition) or 0.0

    def divisor(self, condition: Condition) -> float:
        """Return its mean P as a divisor: `least` or more."""
        return max(self.performance(condition), self.least)


# The indicators that `comparison` has a case of, and the performances that each is relative to.
INDICATORS = ("S", "FT", "R", "A")
PERFORMANCES = {name: DEFINITIONS[name].references for name in INDICATORS}


@dataclass(frozen=True)
class Payment:
    """The parts of an episode's return: `share` for each item delivered, and `constant` once.

    Of an indicator also the performances in them, by the names of `PERFORMANCES`.
    """

    share: float = 0.0
    constant: float = 0.0
    performances: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Ratio:
    """An indicator as one ratio, scale (P - P_against) / P_o + offset; P is the tested episode's.

    `against` is the condition of P_o itself, but for FT, where it is that of P_S.
    """

    scale: float
    offset: float
    reference: Condition
    against: Condition


def comparison(name: str, tested: Condition, base: Scenario) -> Ratio | None:
    """Return what the indicator compares episodes of `tested` with; None: it does not test them.

    Everything that the indicator does not vary is the same in its references.

    Args:
        name: one of `INDICATORS`, or "P".
        base: the scenario that changes are relative to, with the N of S.

    Raises:
        SetupError: the indicator is about such an episode, but undefined; or it is none of those.
    """
    if name not in (*INDICATORS, "P"):
        raise SetupError(f"no indicator {name!r} is paid{suggest(name, (*INDICATORS, 'P'))}")
    n = tested.n_robots
    m = tested.n_failed
    unbroken = dataclasses.replace(tested, modes=(), n_failed=0)
    if name == "R" and m:
        return Ratio(1.0, m / n, unbroken, unbroken)
    if name == "FT" and m:
        n_removed = tested.n_removed + m
        if n_removed >= n:
            raise SetupError(
                f"FT with {m} of {n - tested.n_removed} robots faulty: should leave a robot for "
                "P_S (m < N)"
            )
        removed = dataclasses.replace(unbroken, n_removed=n_removed)
        return Ratio(1.0, 0.0, unbroken, removed)
    if name == "S" and n != base.n_robots:
        if n < base.n_robots:
            raise SetupError(
                f"S from N = {base.n_robots} to {n} robots: should be to more (m >= 1); N is the "
                "environment's own n_robots"
            )
        smaller = dataclasses.replace(tested, n_robots=base.n_robots)
        return Ratio(base.n_robots / (n - base.n_robots), 0.0, smaller, smaller)
    if name == "A" and tested.changes:
        original = dataclasses.replace(tested, changes=())
        return Ratio(1.0 / _relative_change(tested.changes, base), 1.0, original, original)
    return None


def indicator_of(
    name: str, condition: Condition, base: Scenario, references: GivenPerformances | RunningMeans
) -> Payment | None:
    """Return the indicator of episodes of that condition; None: it does not test them.

    Raises:
        SetupError: a reference performance is missing or 0, or the indicator is undefined.
    """
    compared = comparison(name, condition, base)
    if compared is None:
        return Payment(1.0) if name == "P" else None
    p_o = p_against = references.divisor(compared.reference)
    if compared.against != compared.reference:
        p_against = references.performance(compared.against)
    performances = dict(zip(PERFORMANCES[name], (p_o, p_against)))
    share = compared.scale / p_o
    return Payment(share, compared.offset - share * p_against, performances)


def derivative_of(name: str, condition: Condition, base: Scenario, means: RunningMeans) -> Payment:
    """Return the payment of an episode as a reference of others: the derivative, centred.

    Summed over the conditions that have it as reference, each as often as it was played, so that
    the mean return over all episodes has the gradient of the mean indicator.
    """
    slope = 0.0
    mean = means.mean(condition)
    if mean is None:
        return Payment()
    for tested in means.conditions:
        try:
            compared = comparison(name, tested, base)
        except SetupError:  # it is of another environment, of another size
            continue
        if compared is not None and condition in (compared.reference, compared.against):
            by_episode = _derivative(compared, condition, means.performance(tested), means)
            slope += by_episode * means.count(tested) / means.count(condition)
    return Payment(slope, -slope * mean)


def _derivative(
    compared: Ratio, condition: Condition, p_tested: float, means: RunningMeans
) -> float:
    p_o = means.divisor(compared.reference)
    if condition != compared.reference:
        return -compared.scale / p_o
    if means.performance(condition) < means.least:
        return 0.0  # it counts as `least`, so that a change of it moves nothing
    if compared.against != compared.reference:
        p_tested -= means.performance(compared.against)
    return -compared.scale * p_tested / p_o**2


def _relative_change(changes: tuple[tuple[str, Any], ...], base: Scenario) -> float:
    if len(changes) > 1:
        names = ", ".join(name for name, _ in changes)
        raise SetupError(f"A of changes in {names}: should be in one parameter only")
    name, x_new = changes[0]
    x_o = getattr(base, name)
    if not all(isinstance(x, int | float) and not isinstance(x, bool) for x in (x_o, x_new)):
        raise SetupError(f"A of a change in {name}: should be in a parameter that is a number")
    if x_o == 0:
        raise SetupError(f"A of a change in {name} from 0: a change relative to 0 is undefined")
    return float(abs((x_new - x_o) / x_o))
