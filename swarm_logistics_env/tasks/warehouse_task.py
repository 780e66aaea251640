"""The built-in task: robots deliver items in a warehouse."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from swarm_logistics_env.episode import run_episode
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.warehouse.failure_modes import FAILURE_MODES
from swarm_logistics_env.warehouse.faults import Fault

from .code_version import code_version
from .policy_choice import policy_of
from .task import Outcome, Playable

__all__ = ["WAREHOUSE", "Fault", "Scenario", "WarehouseTask"]


class WarehouseTask:
    """Episodes of `run_episode`; see `Task` for its attributes."""

    name = "warehouse"
    removed: str | None = "removed"
    performance = "the number of items delivered in the order requested"
    default = Scenario()
    policies: Mapping[str, Callable[..., Any]] = MappingProxyType({})

    @property
    def fields(self) -> dict[str, str]:
        """The scenario's numeric fields but `n_robots`, each with unit, meaning and source."""
        return {
            name: str(field.description)
            for name, field in Scenario.model_fields.items()
            if isinstance(field.default, int | float) and not isinstance(field.default, bool)
            if name != "n_robots"
        }

    @property
    def failure_modes(self) -> dict[str, str]:
        """The failure modes of `FAILURE_MODES`, each with what it does to a robot."""
        return {mode: FAILURE_MODES[mode].description for mode in FAILURE_MODES}

    def code(self) -> str:
        """Return the version of the simulation."""
        return code_version()

    def vary(self, base: Scenario, fields: Mapping[str, Any]) -> Scenario:
        """Return `base` with `fields` changed; "preset" starts from that preset instead.

        Raises:
            ScenarioError: there is no such preset, or a field cannot be.
        """
        changes = dict(fields)
        if "preset" in changes:
            base = Scenario.preset(str(changes.pop("preset")))
        return base.replace(**changes)

    def fault(self, mode: str, robots: int, onset: float, duration: float | None) -> Fault:
        """Return the fault of some robots from `onset` on, for `duration` [s] or for good."""
        return Fault(mode, robots, onset=onset, duration=duration)

    def play(self, policy: object, condition: Playable, seed: int, policy_seed: int) -> Outcome:
        """Play one episode; see `Task.play`."""
        # A policy of its own: one that remembers must not make rows depend on the order of runs.
        episode = run_episode(
            condition.scenario,
            policy_of(policy, self.policies),
            seed,
            condition.faults,
            policy_seed,
        )
        return Outcome(
            "",
            delivery_times=np.asarray(episode.delivery_times, dtype=np.float64),
            ended_at=float(episode.ended_at),
            all_delivered=bool(episode.all_delivered),
            failed_robots=tuple(int(robot) for robot in episode.failed_robots),
            anchoring_seconds=float(episode.anchoring_seconds),
            digest=episode.digest,
        )


WAREHOUSE = WarehouseTask()
