"""Swarm sizes that change from episode to episode, and within one."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Fault
from swarm_logistics_env.core.errors import FaultError, ScenarioError, SetupError
from swarm_logistics_env.wrappers import FaultInjection, FixedAgents, SwarmSize
from tests.wrappers.conftest import eastward, small


def sizes_of(env: Any, n_seeds: int) -> list[int]:
    return [len(env.reset(seed=seed)[0]) for seed in range(n_seeds)]


def test_sizes_are_drawn_by_the_seed() -> None:
    env = SwarmSize(small(), [2, 5, 9])
    sizes = sizes_of(env, 20)
    assert set(sizes) == {2, 5, 9}
    assert sizes_of(SwarmSize(small(), (2, 5, 9)), 20) == sizes
    assert env.possible_agents == [f"robot_{row}" for row in range(9)]


def test_a_smaller_swarm_is_that_swarm() -> None:
    smaller = SwarmSize(small(n_robots=6), [3])
    assert smaller.possible_agents == ["robot_0", "robot_1", "robot_2"]
    np.testing.assert_array_equal(smaller.reset_arrays(4), small(n_robots=3).reset_arrays(4))
    assert smaller.state_space.contains(smaller.state())


def test_a_size_among_the_options_and_an_outer_wrapper_come_first() -> None:
    env = SwarmSize(SwarmSize(small(n_robots=2, max_robots=5), 2), 4)
    assert len(env.possible_agents) == 5
    assert sizes_of(env, 1) == [4]
    observations, _ = env.reset(options={"scenario": {"n_robots": 5, "n_items": 5}})
    assert len(observations) == 5
    assert env.warehouse.scenario.n_items == 5


def test_who_leaves_terminates_and_is_gone_for_the_rest_of_the_episode() -> None:
    env = SwarmSize(small(), 5, leave=[(2, 2.0), (1, 1.0)])
    env.reset(seed=0)
    first = small(n_robots=5, faults=[Fault("FM1", 1)])
    first.reset(seed=0)
    sizes, gone = [], set[str]()
    while env.agents:
        _, _, terminated, truncated, _ = env.step(dict.fromkeys(env.agents, np.zeros(4)))
        if not any(truncated.values()):
            gone |= {agent for agent, is_over in terminated.items() if is_over}
            assert not gone & set(env.agents)
            sizes.append(len(env.agents))
        if len(gone) == 1:
            assert gone == {f"robot_{row}" for row in first.warehouse.struck_robots}
    assert sizes == [5] * 9 + [4] * 10 + [2] * 40


@pytest.mark.parametrize(
    ("arguments", "error", "complaint"),
    [
        ({"sizes": [5, 4000]}, ScenarioError, "n_robots = 4000 of radius"),
        ({"sizes": []}, SetupError, r"n_robots = \[\]"),
        ({"sizes": lambda rng: 4}, ScenarioError, "n_robots"),
        ({"sizes": [3, 9], "leave": [(4, 1.0)]}, FaultError, "at most n_robots = 3"),
        (
            {"sizes": [3, 9], "leave": [(2, 0.0), (1, 0.0)]},
            SetupError,
            "remove all 3 robots at 0 s",
        ),
        ({"sizes": 9, "leave": [(4, -1.0)]}, FaultError, "Fault.onset = -1.0"),
        ({"sizes": 9, "leave": [4]}, SetupError, r"leave = \[4\]"),
        (
            {"sizes": 9, "leave": [(0, 1.0)]},
            SetupError,
            r"leave = \[\(0, .* at least one robot each",
        ),
    ],
)
def test_wrong_arguments_are_refused_at_once(
    arguments: dict[str, Any], error: type[Exception], complaint: str
) -> None:
    with pytest.raises(error, match=complaint):
        SwarmSize(small(), **arguments)


def test_rows_are_those_of_the_wrapped_environment_and_zeros() -> None:
    inner = SwarmSize(small(duration=2.0), [2, 3, 6], leave=[(1, 0.5)])
    env = FixedAgents(copy.deepcopy(inner))
    assert env.possible_agents == [f"robot_{row}" for row in range(6)]
    rng = np.random.default_rng(0)
    sizes = set()
    for seed in range(12):
        observations, infos = env.reset(seed=seed)
        rows = inner.reset_arrays(seed)
        n = len(rows)
        sizes.add(n)
        for step in range(1, 21):
            present = inner.warehouse.state.robot_present
            assert list(observations) == list(infos) == env.possible_agents == env.agents
            seen = np.array(list(observations.values()))
            np.testing.assert_array_equal(seen[:n], rows)
            assert not seen[n:].any()
            assert [i["active"] for i in infos.values()] == [*map(int, present), *[0] * (6 - n)]
            commands = rng.uniform(-1, 1, (6, 4))
            observations, paid, ended, cut, infos = env.step(dict(zip(env.agents, commands)))
            rows, rewards, _, _ = inner.step_arrays(commands[:n])
            assert list(paid.values()) == [*rewards.tolist(), *[0.0] * (6 - n)]
            assert not any(ended.values())
            assert set(cut.values()) == {step == 20}
        assert env.agents == []
        assert int(present.sum()) == n - 1
    assert sizes == {2, 3, 6}


@pytest.mark.parametrize(
    "fields",
    [{"faults": [Fault("removed", 2, onset=0.3)]}, {"n_items": 1, "pickup_range": 14.0}],
)
def test_nobody_left_and_everything_delivered_terminate_all(fields: dict[str, Any]) -> None:
    env = FixedAgents(SwarmSize(small(duration=60.0, max_robots=6, **fields), [2]))
    env.reset(seed=0)
    ended: dict[str, bool] = {}
    while env.agents:
        assert not any(ended.values())
        commands = np.vstack([eastward(env), np.zeros((4, 4))])
        _, _, ended, cut, _ = env.step(dict(zip(env.agents, commands)))
    assert ended == dict.fromkeys(env.possible_agents, True)
    assert cut == dict.fromkeys(env.possible_agents, False)
    assert env.warehouse.all_delivered == ("faults" not in fields)


def test_it_is_the_outermost_wrapper() -> None:
    with pytest.raises(SetupError, match="FaultInjection around FixedAgents: should be inside"):
        FaultInjection(FixedAgents(small()), "FM1")
