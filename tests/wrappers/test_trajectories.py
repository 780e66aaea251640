"""Wrapped environments: copies go on as the original does, and a key fixes the trajectory."""

from __future__ import annotations

import copy
import os
import pickle
import subprocess
import sys
import textwrap
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

STACKS = [
    "plain", "faults", "sizes", "changes", "changes(sizes(faults))", "faults(sizes(changes))",
]  # fmt: skip

# 2,000 steps with faults, robots that leave and changed parameters: all that a step returns.
SCRIPT = textwrap.dedent(
    """
    import hashlib, sys
    import numpy as np
    from swarm_logistics_env import policies, swarm_logistics_v0
    from swarm_logistics_env.wrappers import FaultInjection, ParameterChange, SwarmSize

    def onsets(rng):
        return rng.uniform(10.0, 150.0, size=3)

    def made():
        env = swarm_logistics_v0.parallel_env(duration=200.0, restock=True, radio_loss=0.1)
        env = FaultInjection(env, "motor_slow", robots=2, onset=onsets, duration=40.0)
        env = SwarmSize(env, [16, 20], leave=[(2, 80.0), (3, 120.0)])
        env = ParameterChange(env, "delivery_width", [1.0, 3.0], at=[50.0, 100.0])
        return FaultInjection(env, "FM1", robots=3, onset=60.0)

    class Run:
        def __init__(self, seed):
            self.env, self.policy = made(), policies.load("swarm-dt")
            self.rows = self.env.reset_arrays(seed)
            self.policy.reset(len(self.rows), seed)

        def advance(self):
            outcome = self.env.step_arrays(self.policy.act(self.rows))
            self.rows = outcome[0]
            return outcome

    main, other = Run(0), Run(1) if sys.argv[1] == "beside" else None
    digest = hashlib.blake2b(main.rows.tobytes())
    while main.env.agents:
        for part in main.advance():
            digest.update(np.ascontiguousarray(part).tobytes())
        digest.update(repr((main.env.agents, main.env.warehouse.state.failure_modes)).encode())
        if other and other.env.agents:
            other.advance()
    state = main.env.warehouse.state
    print(digest.hexdigest(), state.step, state.delivered, len(main.env.failed_robots))
    """
)


def trajectory(hash_seed: str, how: str) -> str:
    environment = {**os.environ, "PYTHONHASHSEED": hash_seed}
    command = [sys.executable, "-c", SCRIPT, how]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return done.stdout


def test_a_trajectory_is_the_same_in_two_processes_and_beside_another_world() -> None:
    first = trajectory("0", "alone")
    _, steps, delivered, failed = first.split()
    assert int(steps) == 2000
    assert int(delivered) > 3
    assert int(failed) == 3
    assert trajectory("20240229", "beside") == first


@pytest.mark.parametrize("stack", STACKS)
@pytest.mark.parametrize(
    "copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))], ids=["copy", "pickle"]
)
def test_a_copy_made_halfway_is_an_exact_twin(
    make: Callable[..., Any], stack: str, copied: Callable[[Any], Any]
) -> None:
    env = make(stack, 6, rewards={"delivery": 1.0, "contact": -1.0, "approach": 1.0})
    rng = np.random.default_rng(0)

    def act(env: Any, commands: np.ndarray[Any, Any]) -> Any:
        return env.step({agent: commands[int(agent[6:])] for agent in env.agents})

    env.reset(seed=1)
    for _ in range(8):
        act(env, rng.uniform(-1, 1, (12, 4)))
    twin = copied(env)
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


def test_a_copy_of_an_environment_that_has_rendered_renders(make: Callable[..., Any]) -> None:
    pytest.importorskip("pygame")
    env = make("changes(sizes(faults))", render_mode="rgb_array")
    env.reset(seed=0)
    picture = env.render()
    twin = copy.deepcopy(env)
    np.testing.assert_array_equal(twin.render(), picture)
    for each in (env, env, twin):
        each.close()
