"""Gymnasium environments whose spaces are tuples, as parallel environments."""

from __future__ import annotations

import importlib
import warnings
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.spaces import Box, Discrete, Tuple

from swarm_logistics_env.errors import SetupError
from swarm_logistics_env.tasks import TupleEnv


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


def test_one_reward_is_given_to_each(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Pair, "shared", True)
    env = TupleEnv(Pair())
    env.reset()
    assert env.step(dict.fromkeys(env.agents, 0))[1] == {"agent_0": 1.5, "agent_1": 1.5}


def test_pettingzoos_test_passes() -> None:
    with warnings.catch_warnings():
        # It loads environments of PettingZoo's in a way that it deprecates.
        warnings.simplefilter("ignore", DeprecationWarning)
        conformance = importlib.import_module("pettingzoo.test")
    conformance.parallel_api_test(TupleEnv(Pair()), num_cycles=5)


def test_other_spaces_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Pair, "action_space", Discrete(2))
    with pytest.raises(SetupError, match=r"space Discrete\(2\) should be a Tuple"):
        TupleEnv(Pair())
