"""What infos say: numbers, the same keys at every step, and dicts of one's own."""

from __future__ import annotations

import numbers
from typing import Any

import numpy as np

from swarm_logistics_env.wrappers import FaultInjection, IndicatorReward, RunningMeans, SwarmSize
from tests.wrappers.conftest import small


def judged() -> Any:
    env = SwarmSize(small(duration=1.0), [6, 8], leave=[(1, 0.3)])
    env = FaultInjection(env, "FM4", 2, onset=0.5, duration=0.2)
    return IndicatorReward(env, {"FT": 1.0, "S": 1.0}, references=RunningMeans())


def test_they_are_numbers_with_the_same_keys_at_every_step_and_share_nothing() -> None:
    env, other = judged(), judged()
    keys = list(next(iter(env.reset(seed=0)[1].values())))
    assert {"failed", "delivered", "FT"} <= set(keys)
    for seed in range(4):
        (observations, infos), (_, other_infos) = env.reset(seed=seed), other.reset(seed=seed)
        while True:
            assert infos.keys() == observations.keys()
            assert other_infos == infos
            for number, info in enumerate(infos.values()):
                assert list(info) == keys
                assert all(isinstance(value, numbers.Real) for value in info.values())
                assert all(np.isfinite(value) for value in info.values())
                info["mine"] = number
            assert [info["mine"] for info in infos.values()] == list(range(len(infos)))
            assert not any("mine" in info for info in other_infos.values())
            if not env.agents:
                break
            actions = {agent: np.zeros(4) for agent in env.agents}
            observations, *_, infos = env.step(actions)
            *_, other_infos = other.step(actions)
