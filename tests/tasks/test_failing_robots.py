"""Wrappers of parallel environments: robots that fail, and spaces that are tuples."""

from __future__ import annotations

import importlib
import warnings
from itertools import pairwise
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.spaces import Box, Dict, Discrete, Tuple

from swarm_logistics_env.errors import FaultError, SetupError
from swarm_logistics_env.tasks import FailingRobots, RobotFault, TupleEnv
from swarm_logistics_env.tasks.failing_robots import failing_rows
from tests.tasks.lane import FAILURES, STAY, WALK, Lane


class Spy(Lane):
    """Remembers the actions that reach it."""

    def step(self, actions: dict[str, Any]) -> tuple[dict[str, Any], ...]:
        self.seen = getattr(self, "seen", [])
        self.seen.append(list(actions.values()))
        return super().step(actions)


def played(mode: str, seed: int = 3, **fields: Any) -> tuple[list[list[int]], list[Any], int]:
    """Play ten steps of distinct actions; return what was executed and observed, and who failed."""
    env = FailingRobots(Spy(3), [RobotFault(mode=mode, robots=1, **fields)], FAILURES)
    seen = [env.reset(seed=seed)[0]]
    seen += [env.step(dict.fromkeys(env.agents, step % 2))[0] for step in range(10)]
    (row,) = failing_rows(seed, 3, 1)
    return env.unwrapped.seen, seen, row


def test_faults_of_one_seed_are_nested_and_differ_between_seeds() -> None:
    sets = [set(failing_rows(5, 10, m)) for m in range(11)]
    assert all(a < b for a, b in pairwise(sets))
    assert len({failing_rows(seed, 10, 1) for seed in range(30)}) > 5


def test_silent_and_frozen_robots() -> None:
    executed, _, row = played("silent", onset=2.0, duration=3.0)
    mine = [actions[row] for actions in executed]
    assert mine == [0, 1, STAY, STAY, STAY, 1, 0, 1, 0, 1]
    others = [actions[row - 1] for actions in executed]
    assert others == [step % 2 for step in range(10)]
    executed, _, row = played("frozen", onset=2.0, duration=3.0)
    assert [actions[row] for actions in executed] == [0, WALK, WALK, WALK, WALK, 1, 0, 1, 0, 1]
    executed, _, row = played("frozen")
    assert [actions[row] for actions in executed] == [0] * 10


def test_blind_and_noisy_robots() -> None:
    _, seen, row = played("blind", onset=2.0, duration=3.0)
    mine = [observations[f"robot_{row}"] for observations in seen]
    assert [not value.any() for value in mine] == [False] * 2 + [True] * 3 + [False] * 6
    plain = [seen[t][f"robot_{(row + 1) % 3}"] for t in range(11)]
    _, noisy, _ = played("noisy")
    assert all((noisy[t][f"robot_{(row + 1) % 3}"] == plain[t]).all() for t in range(11))
    shifts = np.array([noisy[t][f"robot_{row}"][1] - 6 for t in range(11)])
    assert noisy[0][f"robot_{row}"].dtype == np.float32
    assert 0.2 < shifts.std() < 1.0
    env = FailingRobots(Lane(3), [RobotFault(mode="noisy", robots=3)], FAILURES)
    errors = [value[1] - 6 for value in env.reset(seed=3)[0].values()]
    assert len(set(errors)) == 3, "each robot errs on its own"
    again = played("noisy")[1]
    assert all((again[t][f"robot_{row}"] == noisy[t][f"robot_{row}"]).all() for t in range(11))


class Nested(Lane):
    """Observes a structure."""

    def observation_space(self, agent: str) -> Any:
        return Tuple([Dict({"a": Box(0, 9, (2,))}), Discrete(9, start=1)])

    def _observations(self) -> dict[str, Any]:
        return {agent: ({"a": np.ones(2)}, 4) for agent in self.agents}


def test_structures_are_blinded_and_whole_numbers_bear_no_noise() -> None:
    env = FailingRobots(Nested(1), [RobotFault(mode="blind", robots=1)], FAILURES)
    ((arrays, number),) = env.reset(seed=0)[0].values()
    assert not arrays["a"].any()
    assert number == 0
    env = FailingRobots(Nested(1), [RobotFault(mode="noisy", robots=1)], FAILURES)
    with pytest.raises(SetupError, match="observes int64: should be floats"):
        env.reset(seed=0)


def test_both_are_parallel_environments_and_seeds_are_counted() -> None:
    faults = [RobotFault(mode="silent", robots=2)]
    with warnings.catch_warnings():
        # PettingZoo's tests load environments of PettingZoo's in a way that it deprecates.
        warnings.simplefilter("ignore", DeprecationWarning)
        conformance = importlib.import_module("pettingzoo.test")
    conformance.parallel_api_test(FailingRobots(Lane(3), faults, FAILURES), num_cycles=20)
    conformance.parallel_api_test(TupleEnv(Pair()), num_cycles=5)
    one, two = (FailingRobots(Lane(3), faults, FAILURES) for _ in range(2))
    one.reset(seed=0)
    two.reset(seed=1)
    one.reset()
    assert one._failing == two._failing


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ({"mode": "removed"}, "should be one of blind, frozen, noisy, silent"),
        ({"mode": "lost"}, "fault mode 'lost'"),
        ({"mode": "blind", "robots": 4}, "4 robots fail of 3"),
        ({"mode": "blind", "robots": 0}, "RobotFault.robots = 0"),
        ({"mode": "blind", "onset": -1.0}, "RobotFault.onset = -1.0"),
    ],
)
def test_faults_that_cannot_be(fault: dict[str, Any], words: str) -> None:
    with pytest.raises(FaultError, match=words):
        FailingRobots(Lane(3), [RobotFault(**{"robots": 1, **fault})], FAILURES)


class Pair(gymnasium.Env[Any, Any]):
    """Two agents that count their own actions; it ends after five steps."""

    observation_space = Tuple([Box(0, 9, (1,), np.float32)] * 2)
    action_space = Tuple([Discrete(2)] * 2)
    shared = False

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Any, Any]:
        super().reset(seed=seed)
        self.counts, self.steps = [0, 0], 0
        return self._seen(), {"agent_0": {"own": 0}, "agent_1": {"own": 1}}

    def step(self, actions: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        self.steps += 1
        self.counts = [count + action for count, action in zip(self.counts, actions)]
        rewards: Any = 1.5 if self.shared else list(actions)
        return self._seen(), rewards, False, self.steps == 5, {"all": self.steps}

    def _seen(self) -> tuple[Any, ...]:
        return tuple(np.array([count], dtype=np.float32) for count in self.counts)


def test_each_agent_has_its_own_part() -> None:
    env = TupleEnv(Pair())
    observations, infos = env.reset(seed=0)
    assert infos == {"agent_0": {"own": 0}, "agent_1": {"own": 1}}
    observations, rewards, _, truncated, infos = env.step({"agent_1": 1, "agent_0": 0})
    assert {agent: value.tolist() for agent, value in observations.items()} == {
        "agent_0": [0.0], "agent_1": [1.0],
    }  # fmt: skip
    assert rewards == {"agent_0": 0.0, "agent_1": 1.0}
    assert infos == {"agent_0": {"all": 1}, "agent_1": {"all": 1}}
    assert truncated == {"agent_0": False, "agent_1": False}
    for _ in range(4):
        _, _, _, truncated, _ = env.step(dict.fromkeys(env.agents, 0))
    assert all(truncated.values())
    assert env.agents == []


def test_one_reward_is_given_to_each_and_other_spaces_are_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(Pair, "shared", True)
    env = TupleEnv(Pair())
    env.reset()
    assert env.step(dict.fromkeys(env.agents, 0))[1] == {"agent_0": 1.5, "agent_1": 1.5}
    monkeypatch.setattr(Pair, "action_space", Discrete(2))
    with pytest.raises(SetupError, match=r"space Discrete\(2\) should be a Tuple"):
        TupleEnv(Pair())
