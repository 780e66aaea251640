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
    "faults later": lambda: FaultInjection(small(), "FM4", 2, onset=0.5, duration=0.2),
    "changes": lambda: ParameterChange(small(), "max_speed", [1.0, 2.0], at=0.5),
    "rewards": lambda: judged(FaultInjection(SwarmSize(small(), [4, 6]), "FM1")),
    "fixed": lambda: FixedAgents(judged(SwarmSize(small(), [4, 6], leave=[(1, 0.3)]))),
}


@pytest.mark.parametrize("make", ENVIRONMENTS.values(), ids=ENVIRONMENTS)
def test_they_are_numbers_with_the_same_keys_at_every_step_and_share_nothing(
    make: Callable[[], Any],
) -> None:
    env, other = make(), make()
    keys = list(next(iter(env.reset(seed=0)[1].values())))
    assert {"failed", "delivered"} <= set(keys)
    for seed in range(4):
        (observations, infos), (_, others) = env.reset(seed=seed), other.reset(seed=seed)
        while True:
            assert infos.keys() == observations.keys()
            assert others == infos
            for number, info in enumerate(infos.values()):
                assert list(info) == keys
                assert all(isinstance(value, numbers.Real) for value in info.values())
                assert all(np.isfinite(value) for value in info.values())
                info["mine"] = number
            assert [info["mine"] for info in infos.values()] == list(range(len(infos)))
            assert not any("mine" in info for info in others.values())
            if not env.agents:
                break
            actions = {agent: np.zeros(4) for agent in env.agents}
            observations, *_, infos = env.step(actions)
            *_, others = other.step(actions)
