"""Cell: P of one policy under one condition."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import spi
from swarm_logistics_env.spi import Interval
from swarm_logistics_env.study.questions.comparison import CONFIDENCE, Arm
from swarm_logistics_env.study.tasks.outcome import Outcome
from swarm_logistics_env.study.tasks.task_world import is_capped, largest_performance, p_of

from .reference import Reference

_UNKNOWN = Interval(np.nan, None, None)


@dataclass(frozen=True, eq=False)
class Cell:
    """P of one policy under one condition.

    Attributes:
        policy: label of the policy.
        table: heading of the report's table.
        arm: the setting and the case.
        outcomes: of the runs that succeeded, seed by seed; of several trainings one after another.
        problem: why runs are missing; None: they are complete.
        published: P of the reference; None: it has none.
        counted: whether it is one of the cells of the reference's tables.
        confidence: level of its intervals.
    """

    policy: str
    table: str
    arm: Arm
    outcomes: tuple[Outcome, ...]
    problem: str | None
    published: float | None = None
    counted: bool = False
    confidence: ClassVar[float] = CONFIDENCE

    @classmethod
    def of(
        cls,
        policy: str,
        table: str,
        arm: Arm,
        outcomes: Sequence[Outcome | None],
        *,
        paired: bool = True,
        reference: Reference | None = None,
    ) -> Self:
        """Return a cell from the outcomes of its runs, seed by seed; None: not played."""
        missing = outcomes.count(None)
        failed = sum(outcome is not None and outcome.error is not None for outcome in outcomes)
        if not paired and missing < len(outcomes):
            missing = 0  # unpaired results need not be equally many everywhere
        problems = [
            f"{count} of {len(outcomes)} runs {what}"
            for count, what in ((failed, "failed"), (missing, "missing"))
            if count
        ]
        succeeded = tuple(
            outcome for outcome in outcomes if outcome is not None and outcome.error is None
        )
        problem = ", ".join(problems) or None
        published = reference.performance.get(arm.setting) if reference else None
        counted = reference is not None and arm.setting in reference.cells
        return cls(policy, table, arm, succeeded, problem, published, counted)

    @cached_property
    def by_seed(self) -> NDArray[np.float64]:
        """P seed by seed, shape (n_seeds,); of K trainings (K, n_seeds) if no run is missing."""
        p = np.array([p_of(self.arm.case, outcome) for outcome in self.outcomes], np.float64)
        several = len(self.arm.case.trainings)
        return p.reshape(several, -1) if several > 1 and not self.problem else p

    @property
    def has_stopped(self) -> bool:
        """Whether a trial was stopped, and nobody counted, so that P may be less."""
        return any(outcome.least is not None for outcome in self.outcomes)

    @cached_property
    def least_by_seed(self) -> NDArray[np.float64]:
        """The least that P may be, seed by seed, shape (n_seeds,), of trials that nobody plays."""
        least = [o.delivered if o.least is None else o.least for o in self.outcomes]
        return np.array(least, np.float64)

    @property
    def n_seeds(self) -> int:
        """Number of runs that succeeded; of several trainings all together."""
        return len(self.outcomes)

    @property
    def saturated(self) -> bool:
        """Whether a run delivered every item, so that P is capped."""
        return any(is_capped(self.arm.case, outcome) for outcome in self.outcomes)

    @cached_property
    def mean(self) -> Interval:
        """Mean P with its interval at `CONFIDENCE`; NaN: no run."""
        if not self.n_seeds:
            return _UNKNOWN
        mean = self._possible(spi.mean_interval(self.by_seed, CONFIDENCE))
        if not self.has_stopped:
            return mean
        return mean._replace(low=spi.mean_interval(self.least_by_seed, CONFIDENCE).low)

    @cached_property
    def one_run(self) -> Interval:
        """Mean P with the interval of one further run at `CONFIDENCE`."""
        p = self.by_seed.ravel()
        return self._possible(spi.prediction_interval(p, CONFIDENCE)) if p.size else _UNKNOWN

    @cached_property
    def contacts(self) -> Interval:
        """Mean contacts per robot-minute with its interval; NaN: not counted in every run."""
        rates = np.array([outcome.contacts_per_robot_minute for outcome in self.outcomes], float)
        if not rates.size or np.isnan(rates).any():
            return _UNKNOWN
        return spi.mean_interval(rates.reshape(self.by_seed.shape), CONFIDENCE)

    @property
    def fast_contacts(self) -> float | None:
        """Share of the contacts of all runs that close faster than 1 m/s; None: unknown, or none.

        Runs count by their contacts per robot-minute.
        """
        rates = [outcome.contacts_per_robot_minute or 0.0 for outcome in self.outcomes]
        fast = [outcome.fast_contacts or 0.0 for outcome in self.outcomes]
        is_known = not math.isnan(self.contacts.value) and sum(rates) > 0.0
        return float(np.average(fast, weights=rates)) if is_known else None

    def mean_of(self, measure: str) -> float | None:
        """Return the mean over runs of what `Outcome` has by that name; None: not of all runs."""
        return _mean([getattr(outcome, measure) for outcome in self.outcomes])

    def _possible(self, interval: Interval) -> Interval:
        """Return an interval that ends at the largest P possible."""
        if interval.high is None:
            return interval
        return interval._replace(high=min(interval.high, largest_performance(self.arm.case)))

    @cached_property
    def phases(self) -> spi.Phases:
        """Whether its runs are of two phases, at any level; without a run they are of one."""
        return spi.two_phases(self.by_seed.ravel(), 1.0) if self.n_seeds else spi.Phases(1.0, None)

    @property
    def stalled(self) -> float:
        """Share of runs with less than a quarter of the cell's median P."""
        return spi.share_stalled(self.by_seed.ravel()) if self.n_seeds else 0.0

    @property
    def words(self) -> str:
        """The condition in words, e.g. "N = 10"."""
        return str(self.arm.setting)

    @property
    def published_inside(self) -> bool | None:
        """Whether the published P lies in the interval of one run; None: unknown."""
        p = self.published
        _, low, high = self.one_run
        return None if p is None or low is None or high is None else low <= p <= high


def _mean(values: Sequence[float | None]) -> float | None:
    """Return the mean of what every run has; None: one lacks it, or there is none."""
    present = [value for value in values if value is not None]
    return float(np.mean(present)) if present and len(present) == len(values) else None


def same_runs(before: Sequence[Outcome], after: Sequence[Outcome]) -> bool:
    """Return whether two conditions gave the same run at every seed, by the digests of the runs.

    Conditions without a run did not.
    """
    digests = [outcome.digest for outcome in before]
    is_equal = digests == [outcome.digest for outcome in after]
    return is_equal and bool(digests) and None not in digests
