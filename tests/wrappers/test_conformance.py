"""PettingZoo's own tests, spaces, copies and arrays, of the environment and stacks of wrappers."""

from __future__ import annotations

import copy
import doctest
import importlib
import pickle
import warnings
from collections.abc import Callable, Iterator
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from pettingzoo.utils.conversions import parallel_to_aec

from swarm_logistics_env import wrappers
from swarm_logistics_env.errors import SetupError
from tests.wrappers.conftest import WRAPPED, stacked

each_stack = pytest.mark.parametrize("stack", WRAPPED)
# Their arrays have a row for each robot of the warehouse, of commands as it takes them.
PLAIN = [name for name in WRAPPED if name.split("(")[0] not in ("fixed", "numbers", "motion")]


@pytest.fixture
def conformance(monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    """PettingZoo's own tests."""
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    with warnings.catch_warnings():
        # They load environments of PettingZoo's in a way that it deprecates, and pass an option of
        # their own, which we ignore and say so.
        warnings.simplefilter("ignore", DeprecationWarning)
        warnings.filterwarnings("ignore", "reset option 'options' is ignored")
        # In a swarm smaller than the largest, not all possible agents end.
        warnings.filterwarnings("ignore", "No agents present but not all possible_agents")
        # Inputs of the frame of motion have no bounds.
        warnings.filterwarnings("ignore", "Agent's m.* observation space value is")
        # A robot that left observes zeros.
        warnings.filterwarnings("ignore", "Observation numpy array is all zeros")
        yield importlib.import_module("pettingzoo.test")


@each_stack
def test_pettingzoos_own_tests_pass(conformance: ModuleType, stack: str) -> None:
    conformance.parallel_api_test(stacked(stack, 12), num_cycles=45)
    conformance.parallel_seed_test(lambda: stacked(stack), num_cycles=20)
    env = stacked(stack, duration=2.0)
    conformance.api_test(parallel_to_aec(env), num_cycles=25)
    conformance.state_test(parallel_to_aec(env), env, num_cycles=20)


@pytest.mark.parametrize("stack", ["plain", "fixed(faults(sizes(changes)))"])
def test_rendering(conformance: ModuleType, stack: str) -> None:
    pytest.importorskip("pygame")
    conformance.render_test(
        lambda render_mode: parallel_to_aec(stacked(stack, 2, render_mode=render_mode))
    )


@pytest.mark.parametrize("n_robots", [1, 12])
@each_stack
def test_what_is_seen_stays_in_its_space_and_no_step_follows_the_end(
    stack: str, n_robots: int
) -> None:
    env = stacked(stack, n_robots, max_cycles=25)
    space, state_space, largest = env.observation_space("robot_0"), env.state_space, 0
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
            assert state_space.contains(env.state())
        assert (env.unwrapped.max_cycles, env.warehouse.state.step) == (25, 25)
        for step, nothing in (
            (env.step, {}),
            (env.step_arrays, np.zeros((env.n_rows, *env.action_space("robot_0").shape))),
        ):
            with pytest.raises(SetupError, match="after the end of the episode: call reset"):
                step(nothing)
    assert env.observation_space("robot_0") is space
    assert len(env.possible_agents) == largest


@pytest.mark.parametrize("stack", PLAIN)
@pytest.mark.parametrize(
    "copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))], ids=["copy", "pickle"]
)
def test_a_copy_made_halfway_is_an_exact_twin(stack: str, copied: Callable[[Any], Any]) -> None:
    pictured = {"render_mode": "rgb_array"} if "changes(" in stack else {}
    rewards = {"delivery": 1.0, "contact": -1.0, "approach": 1.0}
    env = stacked(stack, 6, **pictured, rewards=rewards)
    rng = np.random.default_rng(0)

    def act(env: Any, commands: np.ndarray[Any, Any]) -> Any:
        return env.step({agent: commands[int(agent[6:])] for agent in env.agents})

    env.reset(seed=1)
    for _ in range(8):
        act(env, rng.uniform(-1, 1, (12, 4)))
    seen = env.render() if pictured else None
    twin = copied(env)
    np.testing.assert_array_equal(twin.render() if pictured else None, seen)
    assert twin.unwrapped is not env.unwrapped
    for _ in range(2):
        while env.agents:
            commands = rng.uniform(-1, 1, (12, 4))
            np.testing.assert_equal(act(env, commands), act(twin, commands))
            assert env.agents == twin.agents
            np.testing.assert_array_equal(env.state(), twin.state())
        assert not twin.agents
        np.testing.assert_equal(env.reset(), twin.reset())


@pytest.mark.parametrize("stack", [*PLAIN, "motion(sizes(faults))"])
def test_arrays_and_dicts_are_one_environment(stack: str) -> None:
    dicts, arrays = stacked(stack, 6), stacked(stack, 6)
    rng = np.random.default_rng(0)
    for seed in range(3):
        observations, _ = dicts.reset(seed=seed)
        parts = [observations]
        rows = [arrays.reset_arrays(seed=seed)]
        while True:
            for part, row in zip(parts, rows, strict=True):
                by_agent = {agent: row[int(agent[6:])] for agent in part}
                np.testing.assert_equal(part, by_agent)
            assert arrays.agents == dicts.agents
            if not dicts.agents:
                break
            commands = rng.uniform(-1, 1, (len(rows[0]), *dicts.action_space("robot_0").shape))
            *parts, _ = dicts.step({name: commands[int(name[6:])] for name in dicts.agents})
            rows = list(arrays.step_arrays(commands))


MODULES = ("action_forms", "disturbances", "indicator_payments", "indicator_reward", "swarm_size")


@pytest.mark.parametrize("name", [*MODULES, "wrapper"])
def test_the_examples_of_docstrings_run(name: str) -> None:
    ran = doctest.testmod(importlib.import_module(f"{wrappers.__name__}.{name}"))
    assert ran.attempted
    assert not ran.failed
