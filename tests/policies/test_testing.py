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


class LosesSeedWhenCopied(SwarmDT):
    """A copy of it lacks what it was made with."""

    shift = 0

    def __setstate__(self, state: Any) -> None:
        self.__dict__ |= state | {"shift": 1}

    def reset(self, n_robots: int, seed: int) -> None:
        super().reset(n_robots, seed + self.shift)


class Counted(SwarmDT):
    n_acts = 0  # of any copy
    last_scenario: Scenario

    def configure(self, scenario: Scenario) -> None:
        Counted.last_scenario = scenario
        super().configure(scenario)

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


class Changes(Wrapper):
    """Hands on something else from the third step on."""

    steps = 0

    def change(self, observations: Any) -> None: ...

    def step(self, actions: Any) -> Any:
        self.steps += 1
        observations, *rest = super().step(actions)
        if self.steps == 3:
            self.change(observations)
        return observations, *rest


class Drops(Changes):
    def change(self, observations: Any) -> None:
        del observations["robot_2"]


class Doubles(Changes):
    def change(self, observations: Any) -> None:
        observations["robot_2"] = observations["robot_2"].astype(np.float64)


class Raises(Changes):
    def change(self, observations: Any) -> None:
        observations["robot_4"][7] = 9.0


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
        (
            Adds,
            r"^robot_0's .* \(142,\) and type float32: .* \(141,\) and float32, as observation_spa",
        ),
        (Drops, "^robot_2's observation at step 3 is None: should be an array$"),
        (Doubles, r"has shape \(141,\) and type float64: should have \(141,\) and float32, as"),
        (
            Raises,
            "^robot_4's observation at step 3 has 9.0 in column 7: should be 0.0 to 2.0, as obs",
        ),
        (
            Counts,
            "^the same seed gives another episode beside another live world: they part at 1$",
        ),
        (
            lambda _: SimpleNamespace(unwrapped=None),
            r"^make\(\) = .*: should be a SwarmLogisticsEnv in parallel wrappers$",
        ),
    ],
)
def test_a_broken_wrapper_is_named(wrapper: Any, sentence: str) -> None:
    with pytest.raises(testing.CheckError, match=sentence):
        testing.check_wrapper(lambda: wrapper(parallel_env(SMALL)), steps=30)


def test_a_policy_that_is_not_reset_is_named() -> None:
    start = "^the same seed gives another episode"
    after = f"{start} after another episode: reset should forget it: they part at 0$"
    with pytest.raises(testing.CheckError, match=after):
        testing.check_policy(Forgetful(), SMALL, steps=60)
    with pytest.raises(testing.CheckError, match=f"{start} with a pickled copy of the policy: "):
        testing.check_policy(LosesSeedWhenCopied(), SMALL, steps=5)


def test_as_many_steps_are_played_as_asked_for() -> None:
    Counted.n_acts = 0
    testing.check_policy(Counted(), SMALL, steps=7)
    assert Counted.n_acts == 4 * 7
    assert Counted.last_scenario == SMALL
    testing.check_policy(Counted(), steps=1)
    assert Counted.last_scenario == Scenario()
    Counted.n_acts = 0
    testing.check_wrapper(lambda: parallel_env(SMALL), Counted(), steps=7)
    assert Counted.n_acts == 3 * 7
