"""The built-in task: robots deliver items in a warehouse; a run of it recorded, to show it."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.episode import Play, run_episode
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.warehouse.failure_modes import FAILURE_MODES
from swarm_logistics_env.warehouse.faults import Fault
from swarm_logistics_env.warehouse.state import NOBODY, STORED

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


FRAME_RATE = 2.5  # per second, at most
NOWHERE = -1.0  # in both coordinates: a robot removed, an item carried or delivered


@dataclass(frozen=True)
class Recording:
    """Positions over time; a frame every `period` seconds from 0 on.

    Attributes:
        scenario: of the run.
        period: time between two frames [s].
        robots: (T, N, 2) [m]; `NOWHERE` where one is absent.
        items: (T, I, 2) [m]; `NOWHERE` where one is carried or delivered.
        carrying, failed: (T, N) whether a robot has an item, and whether it fails in any mode.
        digest: of the whole run, as in `Episode`: it tells whether this is the run that was stored.
    """

    scenario: Scenario
    period: float
    robots: NDArray[np.float64]
    items: NDArray[np.float64]
    carrying: NDArray[np.bool_]
    failed: NDArray[np.bool_]
    digest: str


def record_run(source: object, condition: Playable, seed: int, policy_seed: int) -> Recording:
    """Play a run of the warehouse again and return where everything was.

    Args:
        source: the policy, as `policy_of` takes it.
        condition: its scenario and faults.
        seed, policy_seed: as `Task.play`.

    Raises:
        PolicyError: the policy cannot be found or built, or returned what is no command.
    """
    play = Play(condition.scenario, policy_of(source), seed, condition.faults, policy_seed)
    state, scenario = play.world.state, condition.scenario
    every = max(1, round(1.0 / (FRAME_RATE * scenario.control_period)))
    digest = hashlib.blake2b(digest_size=16)
    frames = []
    while True:
        if state.step % every == 0 or play.is_over:
            robots = np.where(state.robot_present[:, np.newaxis], state.robot_position, NOWHERE)
            lies = state.item_status == STORED
            items = np.where(lies[:, np.newaxis], state.item_position, NOWHERE)
            frames.append((robots, items, state.robot_item != NOBODY, state.failed.copy()))
        if play.is_over:
            break
        play.step()
        digest.update(state.robot_position.tobytes())
    digest.update(np.array(state.delivery_times, dtype=np.float64).tobytes())
    period = every * scenario.control_period
    columns = (np.array(column) for column in zip(*frames))
    robots, items, carrying, failed = columns
    return Recording(scenario, period, robots, items, carrying, failed, digest.hexdigest())
