"""The performances that indicators are relative to: given, or measured during a training."""

from __future__ import annotations

import operator
from collections import Counter, deque
from collections.abc import Mapping

import numpy as np

from swarm_logistics_env.errors import SetupError

from .condition import Condition


class GivenPerformances:
    """Performances that were given as numbers, for instance from a study.

    Raises:
        SetupError: a performance is negative or not finite, or a key is not a `Condition`.
    """

    def __init__(self, performances: Mapping[Condition, float]) -> None:
        self._performances = dict(performances)
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
        least: a divisor is at least this [items]; at the start of a training a mean may be 0.
        initial: the divisor of a condition that was not played yet [items]; None means `least`.

    Raises:
        SetupError: `window` is below 1, or `least` or `initial` is not positive.

    Example:
        >>> means = RunningMeans(window=2)
        >>> for delivered in (30, 34, 36):
        ...     means.add(Condition(25), delivered)
        >>> means.mean(Condition(25)), means.count(Condition(25))
        (35.0, 3)
    """

    def __init__(
        self, window: int = 50, *, least: float = 1.0, initial: float | None = None
    ) -> None:
        try:
            self.window = operator.index(window)
        except TypeError:
            self.window = 0
        if self.window < 1:
            raise SetupError(f"window = {window!r}: should be a number of episodes, at least 1")
        self.least = least
        self.initial = least if initial is None else initial
        for name in ("least", "initial"):
            value = getattr(self, name)
            if not isinstance(value, int | float | np.number) or not 0 < value < np.inf:
                raise SetupError(f"{name} = {value!r}: should be a positive number of items")
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
        """Return its mean P as a divisor: at least `least`, and `initial` if it was not played."""
        mean = self.mean(condition)
        return max(self.initial if mean is None else mean, self.least)
