"""A run of the warehouse played again, for a page that shows it: where everything was, and when."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.episode import Play
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.warehouse.state import NOBODY, STORED

from .policy_choice import policy_of
from .task import Playable

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
