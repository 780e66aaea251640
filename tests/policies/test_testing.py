"""The kit passes what is right, and fails on what breaks a promise."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Scenario
from swarm_logistics_env.adapters.swarm_logistics_v0 import parallel_env
from swarm_logistics_env.policies import SwarmDT, testing
from swarm_logistics_env.wrappers import (
    DiscreteActions,
    FaultInjection,
    FixedAgents,
    MotionFrame,
    SwarmSize,
    Wrapper,
)

SMALL = Scenario(n_robots=6, n_items=12, warehouse_width=5.0, warehouse_height=4.0, duration=60.0)


class Forgetful(SwarmDT):
    episodes = 0

    def reset(self, n_robots: int, seed: int) -> None:
        self.episodes += 1
        super().reset(n_robots, seed + self.episodes)


class Counted(SwarmDT):
    n_acts = 0  # of any copy

    def act(self, observations: Any) -> Any:
        Counted.n_acts += 1
        return super().act(observations)


class Magnifies(Wrapper):
    def step_arrays(self, commands: Any) -> Any:
        rows, *rest = super().step_arrays(commands)
        return rows * np.float32(100.0), *rest


class Adds(Wrapper):
    """Adds a number that it does not declare."""

    def reset_arrays(self, seed: Any = None, options: Any = None) -> Any:
        return np.pad(super().reset_arrays(seed, options), ((0, 0), (0, 1)))


class Counts(Wrapper):
    steps = 0  # of any world

    def step_arrays(self, commands: Any) -> Any:
        Counts.steps += 1
        rows, rewards, *rest = super().step_arrays(commands)
        return rows, rewards + Counts.steps, *rest


def test_what_the_package_has_passes() -> None:
    def make() -> Any:
        env: Any = FaultInjection(parallel_env(SMALL), "FM1", robots=2, onset=1.0)
        env = FaultInjection(env, "removed", onset=2.0)
        return FixedAgents(SwarmSize(env, [6, 9], leave=[(1, 3.0)]))

    testing.check_wrapper(make, steps=60)
    testing.check_wrapper(lambda: DiscreteActions(MotionFrame(make().env)), steps=60)
    testing.check_policy("swarm-dt", SMALL, steps=60)


def test_an_episode_that_ends_before_the_last_step_is_played_to_its_end() -> None:
    brief = SMALL.replace(duration=1.0)
    Counted.n_acts = 0
    testing.check_wrapper(lambda: parallel_env(brief), Counted(), steps=60)
    assert Counted.n_acts == 3 * brief.n_steps


@pytest.mark.parametrize(
    ("wrapper", "sentence"),
    [
        (Magnifies, r"has .* in column \d+, and \d+ more columns: should be -?\d.* to \d"),
        (Adds, r"at step 0 has shape .*: should have .*overrides that, too$"),
        (Counts, "another episode"),
        (lambda _: SimpleNamespace(unwrapped=None), "should be a SwarmLogisticsEnv"),
    ],
)
def test_a_broken_wrapper_is_named(wrapper: Any, sentence: str) -> None:
    with pytest.raises(testing.CheckError, match=sentence):
        testing.check_wrapper(lambda: wrapper(parallel_env(SMALL)), steps=30)


def test_a_policy_that_is_not_reset_is_named() -> None:
    with pytest.raises(testing.CheckError, match="reset should forget it"):
        testing.check_policy(Forgetful(), SMALL, steps=60)
