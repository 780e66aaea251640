"""Wrapped environments: copies go on as the original does, and a key fixes the trajectory."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from tests.wrappers.conftest import WRAPPED

STACKS = [name for name in WRAPPED if name.split("(")[0] not in ("fixed", "numbers", "motion")]


@pytest.mark.parametrize("stack", STACKS)
@pytest.mark.parametrize(
    "copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))], ids=["copy", "pickle"]
)
def test_a_copy_made_halfway_is_an_exact_twin(
    make: Callable[..., Any], stack: str, copied: Callable[[Any], Any]
) -> None:
    pictured = {"render_mode": "rgb_array"} if "changes(" in stack else {}
    env = make(stack, 6, **pictured, rewards={"delivery": 1.0, "contact": -1.0, "approach": 1.0})
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
    for episode in range(2):
        while env.agents:
            commands = rng.uniform(-1, 1, (12, 4))
            mine, theirs = act(env, commands), act(twin, commands)
            np.testing.assert_equal(mine, theirs)
            assert env.agents == twin.agents
            np.testing.assert_array_equal(env.state(), twin.state())
        assert not twin.agents
        if episode == 0:
            np.testing.assert_equal(env.reset(), twin.reset())


@pytest.mark.parametrize("stack", STACKS)
def test_arrays_and_dicts_are_one_environment(make: Callable[..., Any], stack: str) -> None:
    dicts, arrays = make(stack, 6), make(stack, 6)
    assert dicts.unwrapped is not dicts or stack == "plain"
    rng = np.random.default_rng(0)
    for seed in range(3):
        observations, _ = dicts.reset(seed=seed)
        rows = arrays.reset_arrays(seed=seed)
        while dicts.agents:
            for agent, row in observations.items():
                np.testing.assert_array_equal(row, rows[int(agent[6:])])
            commands = rng.uniform(-1, 1, (len(rows), 4))
            actions = {agent: commands[int(agent[6:])] for agent in dicts.agents}
            observations, rewards, terminated, truncated, _ = dicts.step(actions)
            rows, paid, ended, cut = arrays.step_arrays(commands)
            for agent in actions:
                row = int(agent[6:])
                assert rewards[agent] == paid[row]
                assert terminated[agent] == ended[row]
                assert truncated[agent] == cut[row]
            assert arrays.agents == dicts.agents
