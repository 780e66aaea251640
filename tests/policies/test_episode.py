from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import Fault, Scenario, policies, run_episode
from swarm_logistics_env.core.errors import PolicyError
from swarm_logistics_env.world.warehouse import WarehouseState

# All items are within reach, so that a robot that drives east delivers.
REACHABLE = Scenario(n_robots=1, n_items=3, pickup_range=14.0, duration=60.0)


class Courier:
    """Sees everything: drives the requested item straight east, and back for the next."""

    needs_state = True

    def reset(self, n_robots: int, seed: int) -> None:
        self.begun = (n_robots, seed)

    def configure(self, scenario: Scenario) -> None:
        self.scenario = scenario

    def act(
        self, observations: NDArray[np.float32], state: WarehouseState | None = None
    ) -> NDArray[np.float64]:
        assert state is not None
        sign = np.where(state.robot_item == state.requested, 1.0, -1.0)
        heading = state.robot_heading
        return np.array([sign * np.cos(heading), -sign * np.sin(heading), 0 * sign, sign * sign]).T


def test_an_episode_of_swarm_dt_is_what_it_says() -> None:
    scenario = Scenario(duration=60.0, warehouse_width=6)
    episode = run_episode(scenario, policies.load("swarm-dt"), seed=3)
    times = episode.delivery_times
    assert (episode.seed, episode.ended_at, episode.all_delivered) == (3, 60.0, False)
    assert episode.delivered == len(times) > 0
    assert 0.0 < times[0] <= times[-1] <= 60.0
    assert (np.diff(times) >= 0.0).all()
    assert (episode.failed_robots, episode.anchoring_seconds) == ((), 0.0)


def test_who_fails_is_listed_once_and_for_how_long_others_touch_them_is_counted() -> None:
    # In a storage so narrow that a working robot cannot pass a dead one, it stands before it.
    scenario = Scenario(
        n_robots=2, n_items=1, warehouse_width=4, warehouse_height=0.3, delivery_width=1.0,
        duration=20.0, pickup_range=0.15,
    )  # fmt: skip
    walk, faults = policies.load("random-walk"), [Fault("dead", (1,)), Fault("FM2", (1,), onset=99)]
    episodes = [run_episode(scenario, walk, seed, faults) for seed in range(6)]
    assert {episode.failed_robots for episode in episodes} == {(1,)}
    assert 1.0 < max(episode.anchoring_seconds for episode in episodes) <= 20.0
    both = run_episode(scenario, walk, 0, ["dead:2"])
    assert (both.failed_robots, both.anchoring_seconds) == ((0, 1), 0.0)


def test_it_ends_with_the_last_item() -> None:
    courier = Courier()
    episode = run_episode(REACHABLE, courier, seed=0)
    assert (courier.begun, courier.scenario) == ((1, 0), REACHABLE)  # it is told of the episode
    assert (episode.all_delivered, episode.delivered) == (True, 3)
    assert episode.ended_at == episode.delivery_times[-1] < 60.0
    endless = run_episode(REACHABLE.replace(restock=True, duration=30.0), Courier(), seed=0)
    assert (endless.all_delivered, endless.ended_at) == (False, 30.0)
    assert endless.delivered > 3


@pytest.mark.parametrize(
    ("commands", "complaint"),
    [
        (np.zeros((2, 3)), r"Broken at 0 s: .*\(2, 3\): should be \(2, 4\)"),
        (np.full((2, 4), np.nan), r"Broken at 0 s: commands\[0, 0\] = nan: should be finite"),
        (None, "Broken at 0 s: "),
    ],
)
def test_a_policy_that_returns_no_commands_is_named(commands: Any, complaint: str) -> None:
    class Broken:
        def reset(self, n_robots: int, seed: int) -> None: ...
        def act(self, observations: NDArray[np.float32]) -> Any:
            return commands

    with pytest.raises(PolicyError, match=complaint):
        run_episode(Scenario(n_robots=2), Broken(), seed=0)
    name: Any = "swarm-dt"
    with pytest.raises(PolicyError, match=r"'swarm-dt': should have .* policies\.load\(name\)"):
        run_episode(Scenario(), name, seed=0)


def test_runs_that_go_other_ways_have_other_digests_though_neither_delivers() -> None:
    scenario = Scenario(duration=4.0)

    def digest(policy: str, policy_seed: int | None = None) -> str:
        episode = run_episode(scenario, policies.load(policy), 3, policy_seed=policy_seed)
        assert episode.delivered == 0
        return episode.digest

    walk = digest("random-walk")
    assert digest("random-walk") == digest("random-walk", policy_seed=3) == walk
    assert len({walk, digest("swarm-dt"), digest("random-walk", policy_seed=0)}) == 3
