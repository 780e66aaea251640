"""Every robot of every world is a row of a VecEnv of stable-baselines3."""

from __future__ import annotations

import doctest
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Fault
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.errors import CommandError, ScenarioError, SetupError
from swarm_logistics_env.streams import key
from swarm_logistics_env.wrappers import IndicatorReward, ParameterChange, SwarmSize
from tests.adapters.conftest import played, small, worlds, wrapped
from tests.wrappers.conftest import eastward

pytest.importorskip("stable_baselines3")

import torch

from swarm_logistics_env.adapters import sb3
from swarm_logistics_env.adapters.sb3 import SwarmVecEnv


def test_rows_are_the_worlds_own_over_several_episodes() -> None:
    env = worlds(3, [3, 5], seed=7)
    assert env.num_envs == 3 + 5 + 3
    own = [small(n_robots=size) for size in (3, 5, 3)]
    rng = np.random.default_rng(0)
    first = [world.reset_arrays(key(7, "world", w) >> 1) for w, world in enumerate(own)]
    np.testing.assert_array_equal(env.reset(), np.concatenate(first))
    shown = np.zeros(0)
    for step in range(1, 48):
        kept = shown.copy()
        actions = rng.uniform(-1, 1, (11, 4)).astype(np.float32)
        observations, rewards, dones, infos = env.step(actions)
        parts = np.split(actions, [3, 8])
        outcomes = [world.step_arrays(part) for world, part in zip(own, parts)]
        last = np.concatenate([outcome[0] for outcome in outcomes])
        np.testing.assert_array_equal(rewards, np.concatenate([o[1] for o in outcomes]))
        is_end = step % 20 == 0
        assert dones.all() == dones.any() == is_end
        for row, (info, world) in enumerate(zip(infos, [0] * 3 + [1] * 5 + [2] * 3, strict=True)):
            about = {
                "TimeLimit.truncated": is_end, "padding": False, "failed": 0, "world": world,
                "n_robots": 5 if world == 1 else 3, "delivered": info["delivered"],
            }  # fmt: skip
            if is_end:
                np.testing.assert_array_equal(info.pop("terminal_observation"), last[row])
                assert info.pop("episode")["l"] == 20
            assert info == about
        if is_end:
            last = np.concatenate([world.reset_arrays() for world in own])
        np.testing.assert_array_equal(observations, last)
        np.testing.assert_array_equal(shown, kept)  # what was returned stays as it was
        shown = observations
        assert observations.dtype == rewards.dtype == np.float32
        assert env.observation_space.contains(observations[0])


def test_a_seed_fixes_all_episodes_and_no_seed_none() -> None:
    env = worlds(2)
    trace = played(env, 45)
    assert not np.array_equal(trace[0], env.reset())  # goes on with the next episodes
    seeds = env.seed(0)
    assert seeds[0] == seeds[2] != seeds[3]
    np.testing.assert_equal(played(env, 45), trace)
    other = worlds(2, seed=None)
    assert not np.array_equal(other.reset(), trace[0])
    other.seed(1)
    assert not np.array_equal(other.reset(), trace[0])


def test_a_removed_robot_is_done_once_and_then_padding() -> None:
    env = worlds(2, faults=[Fault("removed", (1,), onset=0.5)])
    env.reset()
    for step in range(1, 41):
        observations, rewards, dones, infos = env.step(np.ones((6, 4)))
        in_episode = (step - 1) % 20 + 1
        if in_episode == 5:
            assert dones.tolist() == [False, True, False] * 2
            assert infos[1]["TimeLimit.truncated"] is infos[1]["padding"] is False
            assert [info["failed"] for info in infos] == [0, 1, 0] * 2
            assert infos[1]["terminal_observation"].shape == env.observation_space.shape
            assert env.present.tolist() == [True, False, True] * 2
        elif in_episode == 20:
            assert dones.all()
            assert [info["TimeLimit.truncated"] for info in infos] == [True, False, True] * 2
            assert [info["padding"] for info in infos] == [False, True, False] * 2
            assert observations.any(axis=1).all()
            assert env.present.all()
        else:
            assert not dones.any()
        if 5 <= in_episode < 20:
            assert not observations[[1, 4]].any()
            assert not rewards[[1, 4]].any()


def test_a_smaller_swarm_leaves_padding() -> None:
    env = SwarmVecEnv(make_env=lambda _: SwarmSize(small(), [2, 5]), n_worlds=1, seed=0)
    sizes = set()
    observations = env.reset()
    for _ in range(8 * 20):
        n_robots = env.worlds[0].warehouse.state.n_robots
        sizes.add(n_robots)
        assert env.present.sum() == n_robots
        assert not observations[n_robots:].any()
        observations, _, dones, infos = env.step(np.zeros((5, 4)))
        if dones.any():
            assert dones.all()
            assert [info["padding"] for info in infos] == [row >= n_robots for row in range(5)]
            assert infos[0]["n_robots"] == n_robots
    assert sizes == {2, 5}


def test_all_delivered_is_no_time_limit_and_nobody_left_ends_a_world() -> None:
    env = worlds(1, n_items=2, pickup_range=14.0, duration=60.0)
    env.reset()
    total, dones, infos = 0.0, np.zeros(3, np.bool_), []
    while not dones.any():
        _, rewards, dones, infos = env.step(eastward(env.worlds[0]))
        total += rewards[0]
    assert dones.all()
    assert total == 2.0
    assert all(info["delivered"] == 2 for info in infos)
    assert not any(info["TimeLimit.truncated"] for info in infos)
    for onset, length in ((0.2, 2), (0.1, 1)):
        env = worlds(1, faults=[Fault("removed", 3, onset=onset)])
        env.reset()
        ends = [env.step(np.zeros((3, 4)))[2].all() for _ in range(4)]
        assert ends == [(step % length) == 0 for step in range(1, 5)]


def test_infos_that_are_written_into_share_nothing() -> None:
    first, second = (worlds(2, 2) for _ in range(2))
    for env in (first, second):
        env.reset()
    for _ in range(21):
        *_, infos = first.step(np.zeros((4, 4)))
        keys = [set(info) - {"terminal_observation", "episode", "mine"} for info in infos]
        assert keys == [set(first.reset_infos[0])] * 4
        assert not any("mine" in info for info in infos)
        infos[0]["mine"] = 1
        assert not any("mine" in info for info in infos[1:])
        assert not any("mine" in info for info in second.step(np.zeros((4, 4)))[-1])


def test_attributes_and_methods_are_reached_by_row() -> None:
    env = SwarmVecEnv(make_env=wrapped, n_worlds=2, seed=0)
    env.reset()
    assert env.get_attr("render_mode") == [None] * 12
    assert env.has_attr("max_cycles")
    assert not env.has_attr("no_such_thing")
    assert env.get_attr("value", [6, 11]) == [env.worlds[1].value] * 2
    env.set_attr("max_cycles", 3, indices=7)
    assert [world.max_cycles for world in env.worlds] == [None, 3]
    assert env.env_is_wrapped(ParameterChange) == [False] * 6 + [True] * 6
    assert env.env_is_wrapped(SwarmSize, indices=0) == [True]
    assert len(env.env_method("state", indices=range(5, 7))) == 2
    rows = env.env_method("reset_arrays", 5, indices=[0, 1])
    assert rows[0] is rows[1]
    with pytest.raises(AttributeError):
        env.env_method("no_such_thing")
    with pytest.raises(IndexError):
        env.get_attr("value", 12)


def test_options_are_for_the_next_reset_only() -> None:
    env = worlds(2)
    faulty = {"faults": [Fault("FM1", (0,))]}
    options: Any
    for options, n_faults in ((faulty, [1, 1]), ([{}, faulty], [0, 1]), (None, [0, 0])):
        if options:
            env.set_options(options)
        env.reset()
        assert [len(world.warehouse.faults) for world in env.worlds] == n_faults
    with pytest.raises(SetupError, match="3 options"):
        env.set_options([{}, {}, {}])
    env.set_options({"scenario": {"n_robots": 4}})
    with pytest.raises(SetupError, match="n_robots = 4: should be at most 3"):
        env.reset()


def test_pictures_are_tiles_of_the_worlds() -> None:
    pytest.importorskip("pygame")
    env = worlds(2, 2, render_mode="rgb_array")
    env.reset()
    picture: Any = env.render()
    single: Any = env.worlds[0].render()
    assert picture.shape == (2 * single.shape[0], single.shape[1], 3)
    np.testing.assert_array_equal(picture[: single.shape[0]], single)
    env.close()


ONE = SwarmLogisticsEnv(n_robots=1)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"n_worlds": 0}, "n_worlds = 0"),
        ({"threads": 1.5}, "threads = 1.5"),
        ({"n_robots": []}, r"n_robots = \[\]"),
        ({"n_robots": [1, 2, 3], "n_worlds": 2}, "1 to 2 sizes"),
        ({"make_env": lambda world: SwarmLogisticsEnv(), "n_robots": 3}, "one or the other"),
        ({"make_env": lambda world: world}, "make_env gave 0"),
        ({"make_env": lambda world: ONE}, "same environment twice"),
        ({"make_env": lambda world: SwarmLogisticsEnv(message_size=world)}, "one message_size"),
        ({"seed": "a"}, "seed = 'a'"),
    ],
)
def test_wrong_arguments_are_refused(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(SetupError, match=message):
        SwarmVecEnv(**arguments)
    with pytest.raises(ScenarioError, match="n_robots"):
        SwarmVecEnv(n_robot=3)


@pytest.mark.parametrize(
    ("actions", "message"),
    [
        (np.zeros((5, 4)), r"actions of shape \(5, 4\)"),
        (np.full((6, 4), np.nan), r"actions\[0\] .* \(world 0, robot_0\): should be finite"),
        ([["a"] * 4] * 6, "numbers"),
        (torch.zeros((6, 4), dtype=torch.bfloat16), r"actions \(type Tensor, dtype torch.bfloat16"),
    ],
)
def test_wrong_actions_are_refused_before_anything_happens(actions: Any, message: str) -> None:
    env = worlds(2)
    with pytest.raises(SetupError, match="step before reset"):
        env.step(np.zeros((6, 4)))
    env.reset()
    with pytest.raises(CommandError, match=message):
        env.step(actions)
    assert [world.warehouse.state.step for world in env.worlds] == [0, 0]


def test_the_end_of_an_episode_tells_indicators_and_references() -> None:
    def make_env(world: int) -> Any:
        return IndicatorReward(small(n_robots=3), "R", references=20.0)

    env = SwarmVecEnv(make_env=make_env, n_worlds=2, seed=0)
    env.set_options([{}, {"faults": [Fault("FM1", 2)]}])
    env.reset()
    returns = np.zeros(6)
    for _ in range(20):
        _, rewards, _, infos = env.step(np.zeros((6, 4)))
        returns += rewards
    assert infos[0]["R_tested"] == infos[0]["R"] == 0
    assert (infos[3]["R_tested"], infos[3]["R_P_o"], infos[3]["n_failed"]) == (1, 20.0, 2)
    assert infos[3]["R"] == pytest.approx(-1 + 2 / 3)
    assert returns == pytest.approx([0.0] * 3 + [-1 + 2 / 3] * 3)


def test_the_example_runs() -> None:
    ran = doctest.testmod(sb3)
    assert ran.attempted > 5
    assert not ran.failed
