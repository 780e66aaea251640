"""Playing one run and keeping what came of it, an error included."""

from __future__ import annotations

import time
import traceback
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.episode import run_episode
from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.studies.code_version import code_version
from swarm_logistics_env.studies.conditions import Run
from swarm_logistics_env.studies.policy_choice import policy_of


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
        untimed: items delivered, where only their number is known; None: the times tell it.
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
    untimed: int | None = None

    @property
    def delivered(self) -> int:
        """The paper's P [items]."""
        return len(self.delivery_times) if self.untimed is None else self.untimed


def execute(run: Run) -> Outcome:
    """Play a run; whatever goes wrong in it is its outcome."""
    start = time.perf_counter()
    condition = run.condition
    try:
        if run.code != code_version():
            raise StudyError(
                f"this process runs code version {code_version()}, the study {run.code}: "
                "the package changed while the study ran"
            )
        # A policy of its own: one that remembers must not make rows depend on the order of runs.
        policy = policy_of(condition.policy.source)
        episode = run_episode(
            condition.scenario, policy, run.seed, condition.faults, run.policy_seed
        )
    except Exception:  # noqa: BLE001 - kept as the run's row, and blocks the verdict
        return Outcome(
            run.key, error=traceback.format_exc(), wall_seconds=time.perf_counter() - start
        )
    return Outcome(
        run.key,
        delivery_times=np.asarray(episode.delivery_times, dtype=np.float64),
        ended_at=float(episode.ended_at),
        all_delivered=bool(episode.all_delivered),
        failed_robots=tuple(int(robot) for robot in episode.failed_robots),
        anchoring_seconds=float(episode.anchoring_seconds),
        digest=episode.digest,
        wall_seconds=time.perf_counter() - start,
    )
