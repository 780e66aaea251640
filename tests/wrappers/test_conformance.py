"""PettingZoo's own tests, spaces, copies and arrays, of the environment and stacks of wrappers."""

from __future__ import annotations

import doctest
import importlib
import pickle
import warnings
from collections.abc import Callable, Iterator
from pkgutil import iter_modules
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from pettingzoo.utils.conversions import parallel_to_aec

from swarm_logistics_env import wrappers
from swarm_logistics_env.core.errors import SetupError
from swarm_logistics_env.wrappers import (
    DiscreteActions,
    FaultInjection,
    FixedAgents,
    IndicatorReward,
    MotionFrame,
    ParameterChange,
    RunningMeans,
    SwarmSize,
)
from tests.wrappers.conftest import small


def onsets(rng: np.random.Generator) -> Any:
    return rng.uniform(0.5, 3.0, rng.integers(3))


def in_all(env: Any) -> Any:
    """Faults around sizes around changes."""
    n = env.unwrapped.scenario.n_robots
    env = ParameterChange(ParameterChange(env, "n_items", [10, 20]), "radio_range", 6.0, at=1.0)
    env = SwarmSize(env, [n, 2 * n], leave=[(1, 1.5)] if n > 1 else ())
    env = FaultInjection(env, "away", onset=0.5, duration=0.7)
    return FaultInjection(FaultInjection(env, "FM3", onset=onsets), "motor_slow", onset=[0.0, 1.0])


# The arrays of the first three have a row for each robot of the warehouse.
STACKS: dict[str, Callable[[Any], Any]] = {
    "plain": lambda env: env,
    "indicators": lambda env: IndicatorReward(in_all(env), "R", references=RunningMeans()),
    "motion": lambda env: MotionFrame(in_all(env)),
    "fixed": lambda env: FixedAgents(in_all(env)),
    "numbers": lambda env: DiscreteActions(in_all(env)),
    "orders": in_all,
    "numbers of motion": lambda env: FixedAgents(DiscreteActions(MotionFrame(in_all(env)))),
}
ORDERS: dict[str, Any] = {
    "orders": "bursts", "order_rate": 1.0, "order_cycle": 2.0, "order_due": 1.0,
    "announced": "urgent", "request_timeout": 0.5, "request_delay": 0.2, "request_loss": 0.3,
    "restock": True,
}  # fmt: skip
each_stack = pytest.mark.parametrize("stack", STACKS)


def stacked(stack: str, n_robots: int = 4, **fields: Any) -> Any:
    usual = {"n_robots": n_robots, "warehouse_width": 6.0, "warehouse_height": 5.0, "duration": 4.0}
    orders = ORDERS if stack == "orders" else {}
    return STACKS[stack](small(**{**usual, "n_items": 10, **orders, **fields}))


@pytest.fixture
def conformance(monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    """PettingZoo's own tests."""
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of their own environments
        warnings.filterwarnings("ignore", "reset option 'options' is ignored")
        # In a swarm smaller than the largest, not all possible agents end.
        warnings.filterwarnings("ignore", "No agents present but not all possible_agents")
        # A robot that left observes zeros.
        warnings.filterwarnings("ignore", "Observation numpy array is all zeros")
        yield importlib.import_module("pettingzoo.test")


@pytest.mark.unmeasured
@each_stack
def test_pettingzoos_own_tests_pass(conformance: ModuleType, stack: str) -> None:
    conformance.parallel_api_test(stacked(stack, 12), num_cycles=45)
    conformance.parallel_seed_test(lambda: stacked(stack), num_cycles=20)
    env = stacked(stack, duration=2.0)
    conformance.api_test(parallel_to_aec(env), num_cycles=25)
    conformance.state_test(parallel_to_aec(env), env, num_cycles=20)


WRAPPERS: dict[str, Callable[[Any], Any]] = {
    "faults": lambda env: FaultInjection(env, "FM1", onset=1.0),
    "change": lambda env: ParameterChange(env, "handling_time", [0.5, 1.0]),
    "sizes": lambda env: SwarmSize(env, [2, 4], leave=[(1, 1.0)]),
    "indicator": lambda env: IndicatorReward(env, "R", references=10.0),
    "fixed": FixedAgents,
    "motion": MotionFrame,
    "numbers": DiscreteActions,
    "own": wrappers.Wrapper,
}
REFUSED = {("numbers", "numbers"), ("numbers", "motion"), ("motion", "motion")}


@pytest.mark.parametrize("outer", WRAPPERS)
@pytest.mark.parametrize("inner", WRAPPERS)
def test_two_wrappers_stack_in_either_order_or_are_refused_when_made(
    conformance: ModuleType, inner: str, outer: str
) -> None:
    env = WRAPPERS[inner](small(n_robots=4, warehouse_width=6.0, n_items=5, duration=2.0))
    if inner == "fixed" or (inner, outer) in REFUSED:
        with pytest.raises(SetupError, match=r"around .* should be"):
            WRAPPERS[outer](env)
    else:
        conformance.parallel_api_test(WRAPPERS[outer](env), num_cycles=45)


@pytest.mark.unmeasured
@pytest.mark.parametrize("n_robots", [1, 12])
@each_stack
def test_what_is_seen_stays_in_its_space_and_no_step_follows_the_end(
    stack: str, n_robots: int
) -> None:
    env = stacked(stack, n_robots, max_cycles=25)
    space, largest = env.observation_space("robot_0"), 0
    for agent in env.possible_agents:
        env.action_space(agent).seed(0)
    for seed in range(4):
        env.reset(seed=seed)
        largest = max(largest, len(env.agents))
        while env.agents:
            actions = {agent: env.action_space(agent).sample() for agent in env.agents}
            observations, rewards, *_ = env.step(actions)
            assert all(space.contains(row) for row in observations.values())
            assert all(np.isfinite(reward) for reward in rewards.values())
            assert env.state_space.contains(env.state())
        assert (env.unwrapped.max_cycles, env.warehouse.state.step) == (25, 25)
        with pytest.raises(SetupError, match="after the end of the episode: call reset"):
            env.step({})
        with pytest.raises(SetupError, match="after the end of the episode: call reset"):
            env.step_arrays(np.zeros((env.n_rows, *env.action_space("robot_0").shape)))
    assert env.observation_space("robot_0") is space
    assert len(env.possible_agents) == largest


@pytest.mark.parametrize("stack", ["plain", "indicators"])
def test_a_copy_made_halfway_is_an_exact_twin(stack: str) -> None:
    pictured = {"render_mode": "rgb_array"} if stack != "plain" else {}
    rewards = {"delivery": 1.0, "contact": -1.0, "approach": 1.0}
    env = stacked(stack, 6, **pictured, rewards=rewards)
    rng = np.random.default_rng(0)

    env.reset(seed=1)
    for _ in range(8):
        env.step_arrays(rng.uniform(-1, 1, (env.n_rows, 4)))
    seen = env.render() if pictured else None
    twin = pickle.loads(pickle.dumps(env))
    np.testing.assert_array_equal(twin.render() if pictured else None, seen)
    for _ in range(2):
        while env.agents:
            commands = rng.uniform(-1, 1, (env.n_rows, 4))
            np.testing.assert_equal(env.step_arrays(commands), twin.step_arrays(commands))
            assert env.agents == twin.agents
            np.testing.assert_array_equal(env.state(), twin.state())
        np.testing.assert_equal(env.reset(), twin.reset())


@pytest.mark.unmeasured
@pytest.mark.parametrize("stack", list(STACKS)[:3])
def test_arrays_and_dicts_are_one_environment(stack: str) -> None:
    dicts, arrays = stacked(stack, 6), stacked(stack, 6)
    rng = np.random.default_rng(0)
    for seed in range(3):
        observations, _ = dicts.reset(seed=seed)
        parts = [observations]
        rows = [arrays.reset_arrays(seed=seed)]
        while True:
            for part, row in zip(parts, rows, strict=True):
                np.testing.assert_equal(part, {agent: row[int(agent[6:])] for agent in part})
            assert arrays.agents == dicts.agents
            if not dicts.agents:
                break
            commands = rng.uniform(-1, 1, (len(rows[0]), *dicts.action_space("robot_0").shape))
            *parts, _ = dicts.step({name: commands[int(name[6:])] for name in dicts.agents})
            rows = list(arrays.step_arrays(commands))


@pytest.mark.parametrize("name", [module.name for module in iter_modules(wrappers.__path__)])
def test_the_examples_of_docstrings_run(name: str) -> None:
    ran = doctest.testmod(importlib.import_module(f"{wrappers.__name__}.{name}"))
    assert ran.attempted
    assert not ran.failed
