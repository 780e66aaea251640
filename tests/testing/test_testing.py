"""The kit passes what is right, and each check fails on a wrapper that breaks its promise."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Scenario, policies, testing
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.errors import SetupError
from swarm_logistics_env.swarm_logistics_v0 import parallel_env
from swarm_logistics_env.warehouse.state import CARRIED
from swarm_logistics_env.wrappers import FaultInjection, SwarmSize, Wrapper

SMALL = Scenario(
    n_robots=6, n_items=12, warehouse_width=5.0, warehouse_height=4.0, duration=60.0
)  # fmt: skip
plain = functools.partial(parallel_env, SMALL)
CHECKS = {name: getattr(testing, name) for name in testing.__all__ if name.startswith("check_")}
ON_ONE_WORLD = [name for name in CHECKS if name != "check_determinism"]


def failing(mode: str = "FM2", robots: int = 6) -> FaultInjection:
    return FaultInjection(plain(), mode, robots=robots, onset=1.0)


@pytest.mark.parametrize("name", ON_ONE_WORLD)
@pytest.mark.parametrize("mode", ["FM1", "FM2", "FM4", "dead", "removed"])
def test_the_environment_passes(name: str, mode: str) -> None:
    CHECKS[name](lambda: SwarmSize(failing(mode, 2), [6, 9], leave=[(1, 3.0)]), steps=150)


def test_the_kit_sees_lifts_and_deliveries() -> None:
    # Otherwise the passes above would say nothing about faults.
    env, policy = plain(), policies.load("swarm-dt")
    rows = env.reset_arrays(0)
    policy.reset(len(rows), 0)
    lifts = 0
    while env.agents:
        before = env.warehouse.state.robot_item.copy()
        rows = env.step_arrays(policy.act(rows))[0]
        lifts += int((env.warehouse.state.robot_item > before).sum())
    assert lifts > 5
    assert env.warehouse.state.delivered > 0


def test_determinism_of_the_environment() -> None:
    testing.check_determinism(plain, steps=60)


def test_a_message_is_padded_for_a_policy_that_sends_none() -> None:
    testing.check_spaces(functools.partial(plain, message_size=3), steps=5)


# -- broken wrappers ----------------------------------------------------------------------------


class Broken(Wrapper):
    """Calls `spoil` before or after every step."""

    before = False

    def spoil(self) -> None:
        raise NotImplementedError

    def step_arrays(self, commands: Any) -> Any:
        if self.before:
            self.spoil()
        outcome = super().step_arrays(commands)
        if not self.before:
            self.spoil()
        return outcome


class LosesAnItem(Broken):
    def spoil(self) -> None:
        state = self.warehouse.state
        state.item_status[np.flatnonzero(state.item_status != CARRIED)[0]] = 7


class HandsAnItemToTwo(Broken):
    def spoil(self) -> None:
        self.warehouse.state.robot_item[:2] = self.warehouse.state.requested


class ForgetsDeliveries(Broken):
    def spoil(self) -> None:
        state = self.warehouse.state
        state.item_status[state.item_status == 0] = 2


class Stacks(Broken):
    def spoil(self) -> None:
        state = self.warehouse.state
        state.robot_position[1] = state.robot_position[0]


class LetsEverybodyLift(Broken):
    before = True

    def spoil(self) -> None:
        self.warehouse.state.lifts[:] = True


class LetsEverybodyDeliver(Broken):
    before = True

    def spoil(self) -> None:
        self.warehouse.state.delivers[:] = True


class KeepsTheRemoved(Broken):
    def spoil(self) -> None:
        self.unwrapped.agents = list(self.possible_agents)


class Doubles(Wrapper):
    """Observations of another type."""

    def step_arrays(self, commands: Any) -> Any:
        rows, *rest = super().step_arrays(commands)
        return rows.astype(np.float64), *rest


class NoNumbers(Wrapper):
    def step_arrays(self, commands: Any) -> Any:
        rows, *rest = super().step_arrays(commands)
        return rows * np.float32(np.nan), *rest


class Magnifies(Wrapper):
    def step_arrays(self, commands: Any) -> Any:
        rows, *rest = super().step_arrays(commands)
        return rows * np.float32(100.0), *rest


@pytest.mark.parametrize(
    ("check", "broken", "mode", "error", "sentence"),
    [
        ("check_conservation", LosesAnItem, "FM1", testing.ConservationError, "has status 7"),
        ("check_conservation", HandsAnItemToTwo, "FM1", testing.ConservationError, "in the hands"),
        ("check_conservation", ForgetsDeliveries, "FM1", testing.ConservationError, "have left"),
        ("check_overlap", Stacks, "FM1", testing.OverlapError, "robots 0 and 1 overlap by 0.25"),
        ("check_faults", LetsEverybodyLift, "FM2", testing.FaultsError, "FM2, lifts item"),
        ("check_faults", LetsEverybodyDeliver, "FM4", testing.FaultsError, "FM4, delivers"),
        ("check_faults", KeepsTheRemoved, "removed", testing.FaultsError, "is still there"),
        ("check_spaces", Doubles, "FM1", testing.SpaceError, "float64: should be an array of"),
        ("check_spaces", NoNumbers, "FM1", testing.SpaceError, "= nan, should be within"),
        ("check_spaces", Magnifies, "FM1", testing.SpaceError, "leaves its space"),
    ],
)
def test_each_check_fails_on_a_broken_wrapper(
    check: str, broken: type[Wrapper], mode: str, error: type[AssertionError], sentence: str
) -> None:
    assert issubclass(error, testing.ConformanceError)
    with pytest.raises(error, match=sentence):
        CHECKS[check](lambda: broken(failing(mode)), steps=600)


def test_faults_are_not_checked_where_nobody_fails() -> None:
    with pytest.raises(testing.FaultsError, match="nobody failed in 20 steps"):
        testing.check_faults(plain, steps=20)


class Counting(Wrapper):
    """Depends on how many worlds took a step before."""

    steps = 0

    def step_arrays(self, commands: Any) -> Any:
        Counting.steps += 1
        rows, rewards, *rest = super().step_arrays(commands)
        return rows, rewards + Counting.steps, *rest


class Hashing(Wrapper):
    """Depends on PYTHONHASHSEED."""

    def step_arrays(self, commands: Any) -> Any:
        rows, rewards, *rest = super().step_arrays(commands)
        return rows, rewards + hash("robot"), *rest


def counting() -> Wrapper:
    return Counting(plain())


def hashing() -> Wrapper:
    return Hashing(plain())


def test_determinism_fails_where_worlds_share_something() -> None:
    with pytest.raises(testing.DeterminismError, match=r"beside another live world: .* step 1$"):
        testing.check_determinism(counting, steps=5)


def test_determinism_fails_where_hashes_matter() -> None:
    with pytest.raises(testing.DeterminismError, match=r"PYTHONHASHSEED=.* part at step 1"):
        testing.check_determinism(hashing, steps=5)


def test_what_a_fresh_process_cannot_import_is_refused() -> None:
    with pytest.raises(SetupError, match="should be a function"):
        testing.check_determinism(lambda: plain(), steps=2)


def test_what_is_no_environment_of_ours_is_refused() -> None:
    class Stranger:
        unwrapped = None

    with pytest.raises(SetupError, match="should be a SwarmLogisticsEnv"):
        testing.check_spaces(Stranger)


def test_the_kit_takes_a_policy_object() -> None:
    testing.check_overlap(SwarmLogisticsEnv, policies.load("random-walk"), steps=5)
