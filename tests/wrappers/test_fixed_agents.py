"""All possible agents from the first step to the last."""

from __future__ import annotations

import copy
import doctest
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Fault, testing
from swarm_logistics_env.adapters import CentralEnv
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.errors import CommandError, SetupError
from swarm_logistics_env.wrappers import (
    FaultInjection,
    FixedAgents,
    IndicatorReward,
    SwarmSize,
    swarm_size,
)

REACHABLE: dict[str, Any] = {"n_items": 1, "pickup_range": 14.0, "duration": 60.0}


def small(**fields: Any) -> SwarmLogisticsEnv:
    return SwarmLogisticsEnv(**{"n_robots": 6, "n_items": 8, "duration": 2.0, **fields})


def test_rows_are_those_of_the_wrapped_environment_and_zeros() -> None:
    inner = SwarmSize(small(), [2, 3, 6], leave=[(1, 0.5)])
    env = FixedAgents(copy.deepcopy(inner))
    assert env.possible_agents == [f"robot_{row}" for row in range(6)]
    rng = np.random.default_rng(0)
    sizes = set()
    for seed in range(12):
        observations, infos = env.reset(seed=seed)
        rows = inner.reset_arrays(seed)
        rewards, n = np.zeros(len(rows)), len(rows)
        sizes.add(n)
        for step in range(1, 21):
            present = inner.warehouse.state.robot_present
            assert list(observations) == list(infos) == env.possible_agents
            seen = np.array(list(observations.values()))
            np.testing.assert_array_equal(seen[:n], rows)
            assert not seen[n:].any()
            assert [i["active"] for i in infos.values()] == [*map(int, present), *[0] * (6 - n)]
            assert env.agents == env.possible_agents
            commands = rng.uniform(-1, 1, (6, 4))
            actions = dict(zip(env.agents, commands))
            observations, paid, ended, cut, infos = env.step(actions)
            rows, rewards, _, _ = inner.step_arrays(commands[:n])
            assert list(paid.values()) == [*rewards.tolist(), *[0.0] * (6 - n)]
            assert not any(ended.values())
            assert set(cut.values()) == {step == 20}
        assert env.agents == []
        with pytest.raises(SetupError, match="after the end of the episode: call reset"):
            env.step({})
        assert int(present.sum()) == n - 1
    assert sizes == {2, 3, 6}


def test_arrays_have_a_row_for_every_possible_agent() -> None:
    env = FixedAgents(SwarmSize(small(), [2, 6]))
    for seed in range(4):
        assert env.reset_arrays(seed).shape == (6, 140)
        outcome = env.step_arrays(np.full((6, 4), 0.1))
        assert [part.shape for part in outcome] == [(6, 140), (6,), (6,), (6,)]
        with pytest.raises(CommandError, match=r"of shape \(2, 4\): should be \(6, 4\)"):
            env.step_arrays(np.zeros((2, 4)))
        assert env.warehouse.state.step == 1


@pytest.mark.parametrize(
    ("fields", "seconds"),
    [({"faults": [Fault("removed", 2, onset=0.3)]}, 0.3), (REACHABLE, None)],
)
def test_nobody_left_and_everything_delivered_terminate_all(
    fields: dict[str, Any], seconds: float | None
) -> None:
    env = FixedAgents(SwarmSize(small(**{"duration": 60.0, **fields}), [2], within=None))
    env.unwrapped.possible_agents = ["robot_0", "robot_1", "robot_2"]
    env.reset(seed=0)
    ended: dict[str, bool] = {}
    cut: dict[str, bool] = {}
    while env.agents:
        assert not any(ended.values())
        heading = np.append(env.warehouse.state.robot_heading, 0.0)
        east = np.stack([np.cos(heading), -np.sin(heading), 0 * heading, 1 + 0 * heading], axis=1)
        _, _, ended, cut, _ = env.step(dict(zip(env.agents, east)))
    assert ended == dict.fromkeys(env.possible_agents, True)
    assert cut == dict.fromkeys(env.possible_agents, False)
    if seconds:
        assert env.warehouse.state.time == pytest.approx(seconds)
    else:
        assert env.warehouse.all_delivered


def test_it_is_the_outermost_wrapper() -> None:
    env = FixedAgents(small())
    with pytest.raises(SetupError, match=r"FaultInjection around FixedAgents: should be inside"):
        FaultInjection(env, "FM1")
    with pytest.raises(SetupError, match="FixedAgents around FixedAgents"):
        FixedAgents(env)
    with pytest.raises(SetupError, match="env = 3: should be a SwarmLogisticsEnv"):
        FixedAgents(3)  # type: ignore[arg-type]


def test_what_the_other_wrappers_say_is_said_of_every_agent() -> None:
    env = FixedAgents(IndicatorReward(SwarmSize(small(), [6, 8]), "S", references=20.0))
    for seed in range(4):
        _, infos = env.reset(seed=seed)
        n_robots = env.warehouse.state.n_robots
        assert {info["n_robots"] for info in infos.values()} == {n_robots}
        assert {info["S_tested"] for info in infos.values()} == {int(n_robots == 8)}


def test_one_controller_of_all_takes_it_too() -> None:
    plain, fixed = (
        CentralEnv(env)
        for env in (SwarmSize(small(), [2, 6]), FixedAgents(SwarmSize(small(), [2, 6])))
    )
    np.testing.assert_array_equal(plain.reset(seed=1)[0], fixed.reset(seed=1)[0])
    action = np.full((6, 4), 0.2, np.float32)
    np.testing.assert_array_equal(plain.step(action)[0], fixed.step(action)[0])


def test_the_kit_checks_it() -> None:
    def make() -> FixedAgents:
        return FixedAgents(SwarmSize(small(), [3, 6], leave=[(1, 0.5)]))

    testing.check_wrapper(make, steps=15)


def test_the_example_runs() -> None:
    ran = doctest.testmod(swarm_size)
    assert ran.attempted
    assert not ran.failed
