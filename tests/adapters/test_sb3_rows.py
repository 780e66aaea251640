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
from swarm_logistics_env.wrappers import FaultInjection, IndicatorReward, ParameterChange, SwarmSize
from tests.adapters.conftest import played, small, worlds, wrapped
from tests.wrappers.conftest import eastward

pytest.importorskip("stable_baselines3")

import torch

from swarm_logistics_env.adapters import sb3
from swarm_logistics_env.adapters.sb3 import SwarmVecEnv


def unlike(world: int) -> Any:
    """Return a world with indicators, one smaller than its largest, or one that a robot leaves."""
    if world == 0:
        faulty = FaultInjection(small(n_robots=3), "FM1", 2)
        return IndicatorReward(faulty, "R", references=20.0)
    if world == 1:
        return SwarmSize(small(n_robots=5), [2, 5])
    return small(n_robots=3, faults=[Fault("removed", (1,), onset=0.5)])


def test_rows_are_the_worlds_own_over_several_episodes_and_padding_is_zeros() -> None:
    env = SwarmVecEnv(make_env=unlike, n_worlds=3, seed=7)
    own, rng = [unlike(world) for world in range(3)], np.random.default_rng(0)
    first = [world.reset_arrays(key(7, "world", w) >> 1) for w, world in enumerate(own)]
    shown = env.reset()
    assert shown.shape == (3 + 5 + 3, 140)
    assert env.rows_of_worlds == [slice(0, 3), slice(3, 8), slice(8, 11)]
    for world, rows in zip(env.rows_of_worlds, first):
        np.testing.assert_array_equal(shown[world][: len(rows)], rows)
    sizes = set()
    for _ in range(125):
        kept = shown.copy()
        actions = rng.uniform(-1, 1, (11, 4)).astype(np.float32)
        there = env.present
        observations, rewards, dones, infos = env.step(actions)
        np.testing.assert_array_equal(shown, kept)  # what was returned stays as it was
        shown = observations
        assert observations.dtype == rewards.dtype == np.float32
        assert not observations[~env.present].any()
        for number, (world, place) in enumerate(zip(own, env.rows_of_worlds)):
            n = world.warehouse.state.n_robots
            sizes.add((number, n))
            rows, paid, ended, cut = world.step_arrays(actions[place][:n])
            is_over = not world.agents
            failed, told = world.warehouse.state.failed.tolist(), world.episode_info
            own_rewards = [*paid.astype(np.float32).tolist(), *[0.0] * (len(there[place]) - n)]
            assert rewards[place].tolist() == own_rewards
            for robot, info in enumerate(infos[place]):
                is_robot = robot < n
                done = is_over or (is_robot and bool(ended[robot]))
                assert dones[place][robot] == done
                if done:
                    last = rows[robot] if is_robot else np.zeros(140)
                    np.testing.assert_array_equal(info.pop("terminal_observation"), last)
                    assert ("episode" in info) == bool(there[place][robot])
                    info.pop("episode", None)
                assert info == {
                    "TimeLimit.truncated": is_robot and done and bool(cut[robot]),
                    "padding": not there[place][robot], "world": number, "n_robots": n,
                    "failed": int(is_robot and failed[robot]), **told,
                }  # fmt: skip
            if is_over:
                rows = world.reset_arrays()
            present = world.warehouse.state.robot_present
            assert env.present[place].tolist() == [
                *present,
                *[False] * (len(there[place]) - len(present)),
            ]
            np.testing.assert_array_equal(observations[place][: len(rows)], rows)
    assert sizes == {(0, 3), (1, 2), (1, 5), (2, 3)}


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


def test_the_example_runs() -> None:
    ran = doctest.testmod(sb3)
    assert ran.attempted > 5
    assert not ran.failed


def test_an_error_of_make_env_says_what_it_is_called_with() -> None:
    wrong: Any = SwarmLogisticsEnv
    with pytest.raises(SetupError) as caught:
        SwarmVecEnv(make_env=wrong)
    assert "called with the number of a world" in caught.value.__notes__[0]
