"""PettingZoo's own tests, of the environment and of every wrapper, alone and stacked."""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from pettingzoo.utils.conversions import parallel_to_aec

from swarm_logistics_env.errors import SetupError

STACKS = [
    "plain", "faults", "sizes", "changes", "changes(sizes(faults))", "faults(sizes(changes))",
    "fixed(changes(sizes(faults)))",
]  # fmt: skip
each_stack = pytest.mark.parametrize("stack", STACKS)
each_size = pytest.mark.parametrize("n_robots", [1, 5, 25])
Make = Callable[..., Any]


@each_size
@each_stack
def test_parallel_api(conformance: ModuleType, make: Make, stack: str, n_robots: int) -> None:
    conformance.parallel_api_test(make(stack, n_robots), num_cycles=45)


@each_stack
def test_parallel_api_after_the_cut(conformance: ModuleType, make: Make, stack: str) -> None:
    env = make(stack)
    conformance.parallel_api_test(env, num_cycles=20)
    assert env.unwrapped.max_cycles == 20
    assert env.warehouse.state.step == 20


@each_stack
def test_a_step_after_the_end_is_refused(make: Make, stack: str) -> None:
    env = make(stack, max_cycles=1)
    env.reset(seed=0)
    env.step({agent: env.action_space(agent).sample() for agent in env.agents})
    n_rows, columns = env.n_rows, env.action_space("robot_0").shape[0]
    with pytest.raises(SetupError, match="after the end of the episode: call reset"):
        env.step({})
    with pytest.raises(SetupError, match="after the end of the episode: call reset"):
        env.step_arrays(np.zeros((n_rows, columns)))


@each_size
@each_stack
def test_aec_api(conformance: ModuleType, make: Make, stack: str, n_robots: int) -> None:
    env = parallel_to_aec(make(stack, n_robots, duration=2.0))
    conformance.api_test(env, num_cycles=25)


@each_size
@each_stack
def test_seeds(conformance: ModuleType, make: Make, stack: str, n_robots: int) -> None:
    conformance.parallel_seed_test(lambda: make(stack, n_robots), num_cycles=20)


@each_size
@each_stack
def test_state(conformance: ModuleType, make: Make, stack: str, n_robots: int) -> None:
    env = make(stack, n_robots)
    conformance.state_test(parallel_to_aec(env), env, num_cycles=20)


@each_stack
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
    rng = np.random.default_rng(0)
    for seed in range(4):
        env.reset(seed=seed)
        largest = max(largest, len(env.agents))
        while env.agents:
            actions = {agent: rng.uniform(-1, 1, 4) for agent in env.agents}
            observations, rewards, *_ = env.step(actions)
            assert all(space.contains(row) for row in observations.values())
            assert all(np.isfinite(reward) for reward in rewards.values())
            assert state_space.contains(env.state())
        assert env.warehouse.state.step == 40
    assert env.observation_space("robot_0") is space
    assert len(env.possible_agents) == largest
