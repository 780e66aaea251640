"""The PettingZoo view of a warehouse."""

from __future__ import annotations

import hashlib
from typing import Any

import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence
from numpy.typing import NDArray
from pettingzoo import AECEnv, ParallelEnv

from swarm_logistics_env import Fault, Scenario, swarm_logistics_v0
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.errors import (
    ArgumentError,
    CommandError,
    ScenarioError,
    SetupError,
)
from swarm_logistics_env.swarm_logistics_v0 import parallel_env
from swarm_logistics_env.wrappers import FaultInjection
from tests.wrappers.conftest import eastward

# Everything is in reach of everybody, so that whoever drives east delivers.
REACHABLE = Scenario(n_robots=2, n_items=1, pickup_range=14.0, duration=60.0)


def still(env: SwarmLogisticsEnv) -> dict[str, NDArray[np.float32]]:
    return {agent: np.zeros(4, np.float32) for agent in env.agents}


def east(env: SwarmLogisticsEnv) -> dict[str, NDArray[np.float64]]:
    """Return commands that hold on and drive to the delivery area."""
    commands = eastward(env)
    return {agent: commands[int(agent[6:])] for agent in env.agents}


def test_the_three_constructors_give_what_their_names_say() -> None:
    assert isinstance(swarm_logistics_v0.parallel_env(n_robots=2), ParallelEnv)
    for make in (swarm_logistics_v0.env, swarm_logistics_v0.raw_env):
        aec = make(n_robots=2)
        assert isinstance(aec, AECEnv)
        aec.reset(seed=0)
        assert aec.agents == ["robot_0", "robot_1"]


def test_actions_may_be_given_in_any_order_and_beyond_their_bounds() -> None:
    first, second = parallel_env(n_robots=2), parallel_env(n_robots=2)
    for env in (first, second):
        env.reset(seed=1)
    far = {"robot_1": np.array([0.1, 0.2, 0.3, 0.4]), "robot_0": np.array([7.0, 0.0, -3.0, 9.0])}
    cut = {"robot_0": np.array([1.0, 0.0, -1.0, 1.0]), "robot_1": far["robot_1"]}
    assert data_equivalence(first.step(far), second.step(cut))


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"robot_1": None}, "no command for 'robot_1': should be one for every agent"),
        ({"robot_7": np.zeros(4)}, "'robot_7', who is not there: should be among 2 possible"),
        ({"robot_0": np.zeros(3)}, r"command of 'robot_0' of shape \(3,\): should be \(4,\)"),
        ({"robot_0": 1.0}, r"of shape \(\): should be \(4,\)"),
        ({"robot_0": ["a"] * 4}, "commands should be numbers"),
        ({"robot_0": np.zeros(4, complex)}, "should be numbers"),
        ({"robot_0": [[1.0, 2.0], [3.0]]}, r"\(type list\) cannot be read: should be numbers"),
        ({"robot_1": [0, np.nan, 0, 0]}, r"\[1, 1\] = nan: should be finite"),
    ],
)
def test_wrong_commands_are_refused_and_nothing_has_happened(
    change: dict[str, Any], complaint: str
) -> None:
    env, undisturbed = parallel_env(n_robots=2), parallel_env(n_robots=2)
    env.reset(seed=0)
    undisturbed.reset(seed=0)
    actions: dict[str, Any] = {**still(env), **change}
    wrong = {agent: command for agent, command in actions.items() if command is not None}
    with pytest.raises(CommandError, match=complaint):
        env.step(wrong)
    with pytest.raises(CommandError, match=r"actions of type .*: should be a dict"):
        env.step(list(actions.values()))  # type: ignore[arg-type]
    assert env.agents == ["robot_0", "robot_1"]
    assert data_equivalence(env.step(still(env)), undisturbed.step(still(undisturbed)))


@pytest.mark.parametrize(
    ("arguments", "error", "complaint"),
    [
        ({"n_robot": 3}, ScenarioError, "did you mean 'n_robots'"),
        ({"render_mode": "hologram"}, SetupError, "render_mode = 'hologram': should be"),
        ({"scenario": {"n_robots": 3}}, SetupError, "scenario = .*: should be a Scenario"),
        ({"reward": {}}, ScenarioError, "unexpected .* argument 'reward'; did you mean 'rewards'"),
        ({"num_agents": 3}, TypeError, "keyword argument 'num_agents'; did you mean 'n_robots'"),
        ({"frameskip": 4}, ArgumentError, "got an unexpected keyword argument 'frameskip'"),
        ({"max_robots": 24}, SetupError, "max_robots = 24: should be .* of at least 25"),
        ({"max_robots": 9000}, ScenarioError, "n_robots = 9000 of radius .* do not fit"),
        ({"max_cycles": 0}, SetupError, "max_cycles = 0: should be a whole number"),
        ({"rewards": ["delivery"]}, SetupError, r"rewards = \[.*\]: should be None or a dict"),
    ],
)
def test_wrong_arguments_are_refused(
    arguments: dict[str, Any], error: type[Exception], complaint: str
) -> None:
    with pytest.raises(error, match=complaint):
        parallel_env(**arguments)


def episode_digest(env: SwarmLogisticsEnv, seed: int | None) -> str:
    digest = hashlib.sha256(env.reset_arrays(seed).tobytes())
    rng = np.random.default_rng(0)
    for _ in range(20):
        digest.update(env.step_arrays(rng.uniform(-1, 1, (3, 4)))[0].tobytes())
    return digest.hexdigest()


def test_episodes_follow_from_the_last_seed_that_was_given_and_differ() -> None:
    env, other, unseeded = (parallel_env(n_robots=3) for _ in range(3))
    digests = [episode_digest(env, seed) for seed in (0, None, None)]
    assert [episode_digest(other, seed) for seed in (0, None, None)] == digests
    assert episode_digest(env, 0) == digests[0]
    digests += [episode_digest(unseeded, None) for _ in range(2)]
    digests += [episode_digest(parallel_env(n_robots=3), None)]
    assert len(set(digests)) == 6


def test_options_change_one_episode() -> None:
    env = parallel_env(n_robots=2, max_robots=5, faults=(Fault("FM1", 1),))
    options = {"scenario": {"n_robots": 4}, "faults": [Fault("FM2", (0, 3))]}
    observations, infos = env.reset(seed=0, options=options)
    assert list(observations) == env.agents == [f"robot_{number}" for number in range(4)]
    assert env.possible_agents == [f"robot_{number}" for number in range(5)]
    assert [info["failed"] for info in infos.values()] == [1, 0, 0, 1]
    env.step(still(env))
    _, infos = env.reset(seed=0)
    assert env.agents == ["robot_0", "robot_1"]
    assert [info["failed"] for info in infos.values()].count(1) == 1


def test_spaces_and_possible_agents_stay_as_they_were_made() -> None:
    env = parallel_env(n_robots=3, n_items=5, max_robots=4)
    agents, spaces, state_space = env.possible_agents, env.observation_spaces, env.state_space
    assert list(spaces) == list(env.action_spaces) == agents
    assert spaces["robot_3"] is env.observation_space("robot_3")
    assert env.action_spaces["robot_3"] is env.action_space("robot_3")
    env.reset(seed=0)
    before = env.warehouse.state
    for scenario, complaint in (
        ({"n_robots": 5}, "n_robots = 5: should be at most 4, .* max_robots=5 or .* SwarmSize"),
        ({"n_items": 6}, "n_items = 6: observations or states could leave their spaces"),
        ({"duration": 501.0}, "duration = 501.0: observations or states"),
        ({"message_size": 1}, "message_size = 1: observations or states"),
    ):
        with pytest.raises(SetupError, match=complaint):
            env.reset(seed=1, options={"scenario": scenario})
        assert env.warehouse.state is before
    for scenario in ({"n_robot": 3}, {"delivery_width": 10.0}):
        with pytest.raises(ScenarioError):
            env.reset(seed=1, options={"scenario": scenario})
    for n_robots in (1, 4):
        env.reset(seed=1, options={"scenario": {"n_robots": n_robots, "n_items": 2}})
        assert len(env.agents) == n_robots
        assert state_space.contains(env.state())
    assert env.possible_agents == agents
    assert env.observation_spaces == spaces
    assert env.state_space == state_space


@pytest.mark.parametrize("n_robots", [2, 3])
def test_a_reset_that_leaves_nobody_is_refused(n_robots: int) -> None:
    env = parallel_env(n_robots=3, faults=[Fault("removed", 2), Fault("removed", (0, 1, 2), 0.1)])
    options = {"scenario": {"n_robots": n_robots}, "faults": [Fault("removed", n_robots)]}
    with pytest.raises(SetupError, match=f"remove all {n_robots} robots at 0 s"):
        env.reset(seed=0, options=options)
    assert not env.is_begun
    assert len(env.reset(seed=0)[0]) == 1


@pytest.mark.parametrize(
    ("arguments", "is_cut", "steps"),
    [
        ({"duration": 1.0}, True, 10),
        ({"max_cycles": 7}, True, 7),
        ({"duration": 0.5, "max_cycles": 7}, True, 5),
        ({"scenario": REACHABLE}, False, None),
        ({"scenario": REACHABLE, "restock": True, "duration": 20.0}, True, 200),
        ({"faults": [Fault("removed", (0, 1), onset=0.1)]}, False, 1),
    ],
)
def test_all_end_together_and_a_step_after_that_is_refused_and_moves_nothing(
    arguments: dict[str, Any], is_cut: bool, steps: int | None
) -> None:
    env = parallel_env(**{"n_robots": 2, **arguments})

    def refused(when: str) -> None:
        for step in (lambda: env.step({}), lambda: env.step_arrays(np.zeros((2, 4)))):
            with pytest.raises(SetupError, match=rf"step {when}: call reset"):
                step()

    refused("before reset")
    for _ in range(2):
        env.reset(seed=0)
        total, step = 0.0, 0
        while env.agents:
            _, rewards, terminated, truncated, infos = env.step(east(env))
            step += 1
            total += rewards["robot_0"]
            assert env.warehouse.state.time == pytest.approx(0.1 * step)
            assert set(terminated.values()) == {not env.agents and not is_cut}
            assert set(truncated.values()) == {not env.agents and is_cut}
        assert steps in (None, step)
        assert total == infos["robot_1"]["delivered"]
        assert (total > 0.0) == ("scenario" in arguments)
        before = env.state()
        refused("after the end of the episode")
        assert env.warehouse.state.step == step
        np.testing.assert_array_equal(env.state(), before)
        assert env.state_space.contains(env.state())


def test_unknown_options_are_ignored_with_a_warning_unless_a_known_one_is_nearly_meant() -> None:
    env = parallel_env(n_robots=2)
    for name in ("options", "default"):
        with pytest.warns(UserWarning, match=f"reset option '{name}' is ignored; "):
            observations, _ = env.reset(seed=0, options={name: [Fault("removed", 1)]})
        assert len(observations) == 2
    for name, meant in (("fault", "faults"), ("FAULTS", "faults"), ("senario", "scenario")):
        for each in (env, FaultInjection(env, "FM1")):
            with pytest.raises(SetupError, match=f"no reset option '{name}'; .* mean '{meant}'"):
                each.reset(seed=0, options={name: ()})
    with pytest.raises(SetupError, match=r"as options={'scenario': {'n_robots': 3}}"):
        env.reset(seed=0, options={"n_robots": 3})


def test_a_removed_robot_terminates_once_and_leaves() -> None:
    faults = [Fault("removed", (1,), onset=0.2), Fault("removed", (3,))]
    env = parallel_env(scenario=Scenario(n_robots=9, n_items=7), n_robots=4, faults=faults)
    assert (env.scenario.n_items, env.scenario.n_robots) == (7, 4)
    observations, _ = env.reset(seed=0)
    assert list(observations) == ["robot_0", "robot_1", "robot_2"]
    assert env.possible_agents == [*observations, "robot_3"]
    _, _, terminated, truncated, _ = env.step(still(env))
    assert not any(terminated.values())
    observations, rewards, terminated, truncated, infos = env.step(still(env))
    assert terminated == {"robot_0": False, "robot_1": True, "robot_2": False}
    assert not any(truncated.values())
    for part in (observations, rewards, infos):
        assert list(part) == ["robot_0", "robot_1", "robot_2"]
    assert env.agents == ["robot_0", "robot_2"]
    others: dict[str, Any]
    for others in ({}, {"robot_1": np.zeros(4)}):
        observations, *_ = env.step({**still(env), **others})
        assert list(observations) == ["robot_0", "robot_2"]


def test_infos_tell_failures_while_they_hold_and_observations_do_not() -> None:
    faults = [Fault("FM2", (1,), onset=0.2, duration=0.2), Fault("FM4", (1,), onset=0.3)]
    failing, healthy = parallel_env(n_robots=2, faults=faults), parallel_env(n_robots=2)
    seen, plain = failing.reset(seed=0)[0], healthy.reset(seed=0)[0]
    assert data_equivalence(seen, plain)
    modes = []
    for _ in range(5):
        seen, _, _, _, infos = failing.step(still(failing))
        plain, *_ = healthy.step(still(healthy))
        assert data_equivalence(seen, plain)
        modes.append(failing.warehouse.state.failure_modes[1])
        assert infos["robot_0"] == {"failed": 0, "delivered": 0}
        assert infos["robot_1"] == {"failed": int(bool(modes[-1])), "delivered": 0}
    assert modes == [(), ("FM2",), ("FM2", "FM4"), ("FM4",), ("FM4",)]


def test_an_absent_robot_earns_nothing() -> None:
    env = parallel_env(REACHABLE, faults=[Fault("removed", (1,))])
    env.reset(seed=0)
    ended, total = np.zeros(2, np.bool_), np.zeros(2)
    while not ended.any():
        _, paid, ended, _ = env.step_arrays([east(env)["robot_0"], np.zeros(4)])
        total += paid
    assert total.tolist() == [1.0, 0.0]
    assert ended.tolist() == [True, False]


def test_the_state_of_a_robot_that_is_shoved_lies_in_its_space() -> None:
    env = SwarmLogisticsEnv(n_robots=2)
    env.reset(seed=0)
    env.warehouse.state.robot_velocity[:] = [[9.0, -9.0], [0.0, 9.0]]
    assert env.state_space.contains(env.state())
