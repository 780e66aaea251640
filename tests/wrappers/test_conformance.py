"""PettingZoo's own tests, of the environment and of every wrapper, alone and stacked."""

from __future__ import annotations

import doctest
import importlib
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from pettingzoo.utils.conversions import parallel_to_aec

from swarm_logistics_env import wrappers
from swarm_logistics_env.errors import SetupError
from tests.wrappers.conftest import WRAPPED

each_stack = pytest.mark.parametrize("stack", WRAPPED)
each_size = pytest.mark.parametrize("n_robots", [1, 12])
Make = Callable[..., Any]


@each_size
@each_stack
def test_parallel_api(conformance: ModuleType, make: Make, stack: str, n_robots: int) -> None:
    conformance.parallel_api_test(make(stack, n_robots), num_cycles=45)


@each_stack
def test_a_step_after_the_end_is_refused(make: Make, stack: str) -> None:
    env = make(stack, max_cycles=1)
    env.reset(seed=0)
    env.step({agent: env.action_space(agent).sample() for agent in env.agents})
    assert (env.unwrapped.max_cycles, env.warehouse.state.step) == (1, 1)
    with pytest.raises(SetupError, match="after the end of the episode: call reset"):
        env.step({})
    with pytest.raises(SetupError, match="after the end of the episode: call reset"):
        env.step_arrays(np.zeros((env.n_rows, *env.action_space("robot_0").shape)))


@each_stack
def test_aec_api(conformance: ModuleType, make: Make, stack: str) -> None:
    env = parallel_to_aec(make(stack, duration=2.0))
    conformance.api_test(env, num_cycles=25)


@each_stack
def test_seeds(conformance: ModuleType, make: Make, stack: str) -> None:
    conformance.parallel_seed_test(lambda: make(stack), num_cycles=20)


@each_stack
def test_state(conformance: ModuleType, make: Make, stack: str) -> None:
    env = make(stack)
    conformance.state_test(parallel_to_aec(env), env, num_cycles=20)


@pytest.mark.parametrize("stack", ["plain", "fixed(changes(sizes(faults)))"])
def test_rendering(conformance: ModuleType, make: Make, stack: str) -> None:
    pytest.importorskip("pygame")

    def made(render_mode: str) -> Any:
        return parallel_to_aec(make(stack, 2, render_mode=render_mode))

    conformance.render_test(made)


@each_size
@each_stack
def test_observations_and_states_stay_in_their_spaces(
    make: Make, stack: str, n_robots: int
) -> None:
    env = make(stack, n_robots)
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
        assert env.warehouse.state.step == 40
    assert env.observation_space("robot_0") is space
    assert len(env.possible_agents) == largest


MODULES = ("action_forms", "disturbances", "indicator_payments", "indicator_reward", "swarm_size")


@pytest.mark.parametrize("name", [*MODULES, "wrapper"])
def test_the_examples_of_docstrings_run(name: str) -> None:
    ran = doctest.testmod(importlib.import_module(f"{wrappers.__name__}.{name}"))
    assert ran.attempted
    assert not ran.failed
