"""The kit passes what is right, and fails on what breaks a promise."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Scenario, policies, testing
from swarm_logistics_env.errors import PolicyError
from swarm_logistics_env.policies import SwarmDT
from swarm_logistics_env.swarm_logistics_v0 import parallel_env
from swarm_logistics_env.wrappers import FaultInjection, FixedAgents, SwarmSize, Wrapper

SMALL = Scenario(n_robots=6, n_items=12, warehouse_width=5.0, warehouse_height=4.0, duration=60.0)


class Forgetful(SwarmDT):
    """Goes on from the episode before."""

    episodes = 0

    def reset(self, n_robots: int, seed: int) -> None:
        self.episodes += 1
        super().reset(n_robots, seed + self.episodes)


class OneColumn(SwarmDT):
    def act(self, observations: Any) -> Any:
        return super().act(observations)[:, :1]


class Magnifies(Wrapper):
    def step_arrays(self, commands: Any) -> Any:
        rows, *rest = super().step_arrays(commands)
        return rows * np.float32(100.0), *rest


class Doubles(Wrapper):
    def step_arrays(self, commands: Any) -> Any:
        rows, *rest = super().step_arrays(commands)
        return rows.astype(np.float64), *rest


class Counts(Wrapper):
    """Depends on how many worlds took a step before."""

    steps = 0

    def step_arrays(self, commands: Any) -> Any:
        Counts.steps += 1
        rows, rewards, *rest = super().step_arrays(commands)
        return rows, rewards + Counts.steps, *rest


class Stranger:
    unwrapped = None

    def __init__(self, env: object) -> None:
        pass


@pytest.mark.parametrize("mode", ["FM1", "dead", "removed"])
def test_wrappers_of_the_package_pass(mode: str) -> None:
    def make() -> Any:
        env = FaultInjection(parallel_env(SMALL), mode, robots=2, onset=1.0)
        return FixedAgents(SwarmSize(env, [6, 9], leave=[(1, 3.0)]))

    testing.check_wrapper(make, steps=60)


@pytest.mark.parametrize("policy", ["swarm-dt", policies.load("homing")])
def test_policies_of_the_package_pass(policy: Any) -> None:
    testing.check_policy(policy, SMALL, steps=60)


@pytest.mark.parametrize(
    ("wrapper", "sentence"),
    [
        (Magnifies, "outside"),
        (Doubles, "outside"),
        (Counts, "another episode"),
        (Stranger, "should be a SwarmLogisticsEnv"),
    ],
)
def test_a_broken_wrapper_is_named(wrapper: Any, sentence: str) -> None:
    with pytest.raises(testing.CheckError, match=sentence):
        testing.check_wrapper(lambda: wrapper(parallel_env(SMALL)), steps=30)


@pytest.mark.parametrize(
    ("policy", "error", "sentence"),
    [
        (Forgetful(), testing.CheckError, "reset should forget it"),
        (OneColumn(), PolicyError, "shape"),
    ],
)
def test_a_broken_policy_is_named(policy: SwarmDT, error: type[Exception], sentence: str) -> None:
    with pytest.raises(error, match=sentence):
        testing.check_policy(policy, SMALL, steps=60)
