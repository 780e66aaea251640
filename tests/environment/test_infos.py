"""What infos say: numbers, the same keys at every step, and dicts of one's own."""

from __future__ import annotations

import numbers
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.wrappers import (
    FaultInjection,
    FixedAgents,
    IndicatorReward,
    ParameterChange,
    RunningMeans,
    SwarmSize,
)


def small() -> SwarmLogisticsEnv:
    return SwarmLogisticsEnv(n_robots=4, n_items=8, duration=1.0)


def judged(env: Any) -> IndicatorReward:
    weights = {"R": 1.0, "FT": 1.0, "S": 1.0, "A": 1.0, "P": 0.1}
    return IndicatorReward(env, weights, references=RunningMeans())


ENVIRONMENTS: dict[str, Callable[[], Any]] = {
    "plain": small,
    "faults from 0 s": lambda: FaultInjection(small(), "FM1", 2),
    "faults later": lambda: FaultInjection(small(), "FM4", 2, onset=0.5, duration=0.2),
    "sizes": lambda: SwarmSize(small(), [3, 6], leave=[(1, 0.3)]),
    "changes": lambda: ParameterChange(small(), "max_speed", [1.0, 2.0], at=0.5),
    "rewards": lambda: judged(FaultInjection(SwarmSize(small(), [4, 6]), "FM1")),
    "fixed": lambda: FixedAgents(judged(SwarmSize(small(), [4, 6], leave=[(1, 0.3)]))),
}
each_environment = pytest.mark.parametrize("make", ENVIRONMENTS.values(), ids=ENVIRONMENTS)


@each_environment
def test_they_are_numbers_with_the_same_keys_at_every_step(make: Callable[[], Any]) -> None:
    env = make()
    keys = None
    for seed in range(4):
        _, infos = env.reset(seed=seed)
        while True:
            for info in infos.values():
                keys = keys or list(info)
                assert list(info) == keys
                assert all(isinstance(value, numbers.Real) for value in info.values())
                assert all(np.isfinite(value) for value in info.values())
            if not env.agents:
                break
            actions = {agent: np.zeros(4) for agent in env.agents}
            observations, *_, infos = env.step(actions)
            assert infos.keys() == observations.keys()
    assert keys is not None
    assert {"failed", "delivered"} <= set(keys)


@each_environment
def test_those_that_are_written_into_share_nothing(make: Callable[[], Any]) -> None:
    first, second = make(), make()
    answers = [env.reset(seed=0)[1] for env in (first, second)]
    for _ in range(10):
        told, other = answers
        assert other == told
        for number, agent in enumerate(told):
            told[agent]["mine"] = number
        assert not any("mine" in info for info in other.values())
        for number, agent in enumerate(told):
            assert told[agent]["mine"] == number
        if not first.agents:
            break
        actions = {agent: np.zeros(4) for agent in first.agents}
        answers = [env.step(actions)[-1] for env in (first, second)]
        assert not any("mine" in info for infos in answers for info in infos.values())
