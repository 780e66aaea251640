"""Task: what a study can play, and what playing it once gives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Outcome:
    """What one run gave: an episode's result, or the traceback of the error that ended it.

    Attributes:
        run: key of the run.
        delivery_times: [s], ascending, shape (delivered,); its length is the paper's P.
        ended_at: [s].
        all_delivered: whether no item was left, so that more robots could not have delivered more.
        failed_robots: numbers of the robots that any fault names.
        anchoring_seconds: robot-seconds that working robots spent in contact range of failed ones.
        digest: of the trajectory and the deliveries (`Episode.digest`); None: not known.
        error: traceback; None: the run succeeded.
        wall_seconds: time it took [s]; no part of the result.
        untimed: P, 0 or more, where no times are known; None: the number of times is P.
    """

    run: str
    delivery_times: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    ended_at: float = 0.0
    all_delivered: bool = False
    failed_robots: tuple[int, ...] = ()
    anchoring_seconds: float = 0.0
    digest: str | None = None
    error: str | None = None
    wall_seconds: float = 0.0
    untimed: float | None = None

    @property
    def delivered(self) -> float:
        """The paper's P, 0 or more: the number of items delivered, or a task's own measure."""
        return len(self.delivery_times) if self.untimed is None else self.untimed


class Playable(Protocol):
    """What a task needs of a condition."""

    @property
    def scenario(self) -> Any:
        """What is held fixed during a run, of the task's own type."""

    @property
    def faults(self) -> tuple[Any, ...]:
        """What fails during a run, of the task's own type."""


class Task(Protocol):
    """Something that a policy can be tested in.

    Attributes:
        name: part of a condition's identity, but for the warehouse's.
        removed: the failure mode that takes members away, for the paper's P_S.
    """

    name: str
    removed: str

    @property
    def fields(self) -> Mapping[str, str]:
        """The scenario's numeric fields, but its size, each with unit and meaning."""

    @property
    def failure_modes(self) -> Mapping[str, str]:
        """The failure modes, each with what it does to a member."""

    def code(self) -> str:
        """Return a text that changes whenever the task's runs may have changed."""

    def size(self, scenario: Any) -> int:
        """Return the number N of members."""

    def duration(self, scenario: Any) -> float:
        """Return the time at which a run ends at the latest [s]."""

    def vary(self, base: Any, fields: Mapping[str, Any]) -> Any:
        """Return a scenario with some fields changed."""

    def fault(self, mode: str, members: int, onset: float, duration: float | None) -> Any:
        """Return the fault of some members from `onset` on, for `duration` [s] or for good."""

    def play(self, policy: object, condition: Playable, seed: int, policy_seed: int) -> Outcome:
        """Play one run of a policy, as `policy_choice` knows it, and return what it gave.

        Args:
            seed: of the world.
            policy_seed: of the policy's own randomness.
        """
