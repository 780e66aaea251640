"""Every robot of every world is a row of a VecEnv, however worlds are shared out among threads."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Fault
from swarm_logistics_env.core.errors import CommandError, SetupError, SwarmLogisticsError
from swarm_logistics_env.core.streams import key
from swarm_logistics_env.world.observations import N_COLUMNS
from swarm_logistics_env.wrappers import (
    DiscreteActions,
    FaultInjection,
    IndicatorReward,
    ParameterChange,
    RunningMeans,
    SwarmSize,
    Wrapper,
)
from tests.wrappers.conftest import brief, eastward, played, worlds, wrapped

pytest.importorskip("stable_baselines3")

from swarm_logistics_env.adapters.sb3 import SwarmVecEnv


def unlike(world: int) -> Any:
    """Return a world with indicators, one smaller than its largest, or one that a robot leaves."""
    if world == 0:
        faulty = FaultInjection(brief(n_robots=3), "FM1", 2)
        return IndicatorReward(faulty, "R", references=20.0)
    if world == 1:
        return SwarmSize(brief(n_robots=5), [2, 5])
    steady = {"stocking": 1.0, "contact": -1.0, "collision": -0.5}
    return Wrapper(brief(n_robots=3, faults=[Fault("removed", (1,), onset=0.5)], rewards=steady))


def test_rows_are_the_worlds_own_over_several_episodes_and_padding_is_zeros() -> None:
    env = SwarmVecEnv(make_env=unlike, n_worlds=3, seed=7)
    single_worlds, rng = [unlike(world) for world in range(3)], np.random.default_rng(0)
    shown = env.reset()
    assert env.rows_of_worlds == [slice(0, 3), slice(3, 8), slice(8, 11)]
    for number, (world, part) in enumerate(zip(single_worlds, env.rows_of_worlds)):
        rows = world.reset_arrays(key(7, "world", number) >> 1)
        np.testing.assert_array_equal(shown[part][: len(rows)], rows)
    sizes = set()
    for _ in range(125):
        copied = shown.copy()
        actions = rng.uniform(-1, 1, (11, 4)).astype(np.float32)
        before = env.present
        observations, rewards, dones, infos = env.step(actions)
        np.testing.assert_array_equal(shown, copied)  # what was returned stays as it was
        shown = observations
        assert observations.dtype == rewards.dtype == np.float32
        assert not observations[~env.present].any()
        for number, (world, part) in enumerate(zip(single_worlds, env.rows_of_worlds)):
            n = world.warehouse.state.n_robots
            sizes.add((number, n))
            rows, paid, ended, cut = world.step_arrays(actions[part][:n])
            is_over = not world.agents
            failed, episode_info = world.warehouse.state.failed.tolist(), world.episode_info
            own_rewards = [*paid.astype(np.float32).tolist(), *[0.0] * (len(before[part]) - n)]
            assert rewards[part].tolist() == own_rewards
            for robot, info in enumerate(infos[part]):
                is_robot = robot < n
                done = is_over or (is_robot and bool(ended[robot]))
                assert dones[part][robot] == done
                if done:
                    last = rows[robot] if is_robot else np.zeros(N_COLUMNS)
                    np.testing.assert_array_equal(info.pop("terminal_observation"), last)
                    assert ("episode" in info) == bool(before[part][robot])
                    info.pop("episode", None)
                assert info == {
                    "TimeLimit.truncated": is_robot and done and bool(cut[robot]),
                    "padding": not before[part][robot], "world": number, "n_robots": n,
                    "failed": int(is_robot and failed[robot]), "away": 0, **episode_info,
                }  # fmt: skip
            if is_over:
                rows = world.reset_arrays()
            present = np.flatnonzero(world.warehouse.state.robot_present)
            np.testing.assert_array_equal(np.flatnonzero(env.present[part]), present)
            np.testing.assert_array_equal(observations[part][: len(rows)], rows)
    assert sizes == {(0, 3), (1, 2), (1, 5), (2, 3)}


def test_a_seed_fixes_all_episodes_and_no_seed_none() -> None:
    env = worlds(2)
    trace = played(env, 45)
    assert not np.array_equal(trace[0], env.reset())  # goes on with the next episodes
    seeds = env.seed(0)
    assert seeds[0] == seeds[2] != seeds[3]
    np.testing.assert_equal(played(env, 45), trace)
    assert not np.array_equal(worlds(2, seed=None).reset(), trace[0])
    unknown = env.seed()
    assert unknown[0] == unknown[2] != unknown[3]
    assert env.seed() != unknown


def test_all_delivered_is_no_time_limit_and_nobody_left_ends_a_world() -> None:
    env = worlds(1, n_items=2, pickup_range=14.0, duration=60.0)
    env.reset()
    total, dones, infos = 0.0, np.zeros(3, np.bool_), []
    while not dones.any():
        _, rewards, dones, infos = env.step(eastward(env.worlds[0]))
        total += rewards[0]
    assert dones.all()
    assert [info["delivered"] for info in infos] == [total] * 3 == [2.0] * 3
    assert not any(info["TimeLimit.truncated"] for info in infos)
    env = worlds(1, faults=[Fault("removed", 3, onset=0.2)])
    env.reset()
    ends = [env.step(np.zeros((3, 4)))[2].all() for _ in range(4)]
    assert ends == [False, True, False, True]


def test_an_info_says_whether_its_robot_is_away() -> None:
    env = worlds(1, faults=[Fault("away", (1,), onset=0.1, duration=0.2)])
    env.reset()
    away = []
    for _ in range(5):
        *_, infos = env.step(np.zeros((3, 4)))
        away.append([info["away"] for info in infos])
    assert away == [[0, 1, 0], [0, 1, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]]


def test_infos_that_are_written_into_share_nothing() -> None:
    first, second = (worlds(2, 2) for _ in range(2))
    for env in (first, second):
        env.reset()
    for _ in range(21):
        *_, infos = first.step(np.zeros((4, 4)))
        assert not any("mine" in info for info in infos)
        infos[0]["mine"] = 1
        assert not any("mine" in info for info in infos[1:])
        assert not any("mine" in info for info in second.step(np.zeros((4, 4)))[-1])


def test_attributes_and_methods_are_reached_by_row() -> None:
    env = SwarmVecEnv(make_env=wrapped, n_worlds=2, seed=0)
    env.reset()
    assert env.get_attr("value", [6, 11]) == [env.worlds[1].value] * 2
    env.set_attr("max_cycles", 3, indices=7)
    assert [world.max_cycles for world in env.worlds] == [None, 3]
    assert env.env_is_wrapped(ParameterChange) == [False] * 6 + [True] * 6
    assert env.env_is_wrapped(SwarmSize, indices=0) == [True]
    assert len(env.env_method("state", indices=range(5, 7))) == 2
    rows = env.env_method("reset_arrays", 5, indices=[0, 1])
    assert rows[0] is rows[1]


def test_options_are_for_the_next_reset_only() -> None:
    env = worlds(2)
    faulty = {"faults": [Fault("FM1", (0,))]}
    env.set_options(faulty)
    for n_faults in (1, 0):
        env.reset()
        assert [len(world.warehouse.faults) for world in env.worlds] == [n_faults] * 2


@pytest.mark.parametrize("per", ["world", "row"])
def test_options_may_differ_by_world(per: str) -> None:
    env = worlds(2)
    faulty: dict[str, Any] = {"faults": [Fault("FM1", (0,))]}
    env.set_options([faulty, {}] if per == "world" else [faulty] * 3 + [{}] * 3)
    env.reset()
    assert [len(world.warehouse.faults) for world in env.worlds] == [1, 0]
    with pytest.raises(SetupError, match="options of the rows of world 1: should be the same"):
        env.set_options([{}] * 5 + [faulty])
    with pytest.raises(SetupError, match=r"options for 3: should be .* 2 worlds or .* 6 rows"):
        env.set_options([{}] * 3)


def test_masks_of_actions_are_those_of_each_row() -> None:
    def make_env(world: int) -> DiscreteActions:
        return DiscreteActions(SwarmSize(brief(n_robots=4), 3 + world))

    env = SwarmVecEnv(make_env=make_env, n_worlds=2, seed=0)
    env.reset()
    assert env.num_envs == 3 + 4
    env.step([11] + [0] * 6)  # the first robot holds
    masks = np.stack(env.env_method("action_masks"))
    assert masks.shape == (7, 13)
    assert (~masks).sum() == 1 == (~masks)[0, 11]
    assert env.metadata["render_fps"] == 10.0


def test_a_reset_or_seed_that_is_refused_changes_no_world() -> None:
    env = SwarmVecEnv(make_env=lambda world: brief(n_robots=(5, 3)[world]), n_worlds=2, seed=1)
    env.reset()
    untouched = copy.deepcopy(env)
    with pytest.raises(SetupError, match="seed = 'x'"):
        env.seed("x")  # type: ignore[arg-type]
    # The first world has room for as many, the second one has not.
    env.set_options({"scenario": {"n_robots": 4}})
    with pytest.raises(SwarmLogisticsError, match="4"):
        env.reset()
    env.set_options()
    actions = np.full((env.num_envs, 4), 0.5)
    for _ in range(3):
        for array, expected in zip(env.step(actions)[:3], untouched.step(actions)[:3]):
            assert array.tobytes() == expected.tobytes()
    assert env.reset().tobytes() == untouched.reset().tobytes()


def test_pictures_are_tiles_of_the_worlds() -> None:
    pytest.importorskip("pygame")
    env = worlds(2, 2, render_mode="rgb_array")
    env.reset()
    pictures = np.split(np.asarray(env.render()), 2)
    np.testing.assert_array_equal(pictures, [world.render() for world in env.worlds])
    env.close()


ONE = brief()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"threads": 1.5}, "threads = 1.5"),
        ({"n_robots": [1, 2, 3], "n_worlds": 2}, "1 to 2 sizes"),
        ({"make_env": lambda world: brief(), "n_robots": 3}, "one or the other"),
        ({"make_env": lambda world: world}, "make_env gave 0"),
        ({"make_env": lambda world: ONE}, "same environment twice"),
        ({"make_env": lambda world: brief(message_size=world)}, "one message_size"),
    ],
)
def test_wrong_arguments_are_refused(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(SetupError, match=message):
        SwarmVecEnv(**arguments)


def test_wrong_actions_are_refused_before_anything_happens() -> None:
    env = worlds(2)
    with pytest.raises(SetupError, match="step before reset"):
        env.step(np.zeros((6, 4)))
    env.reset()
    with pytest.raises(CommandError, match=r"actions of shape \(5, 4\)"):
        env.step(np.zeros((5, 4)))
    with pytest.raises(CommandError, match=r"actions\[0\] .* finite"):
        env.step(np.full((6, 4), np.nan))
    assert [world.warehouse.state.step for world in env.worlds] == [0, 0]


def made(make_env: Callable[[int], Any], n_worlds: int = 4, threads: int = 1) -> SwarmVecEnv:
    return SwarmVecEnv(make_env=make_env, n_worlds=n_worlds, threads=threads, seed=3)


def test_threads_and_the_number_of_worlds_change_nothing() -> None:
    alone = played(made(wrapped), 45)
    for threads in (2, 9):
        np.testing.assert_equal(played(made(wrapped, threads=threads), 45), alone)
    fewer = made(wrapped, 2).reset()
    np.testing.assert_array_equal(fewer, alone[0][: len(fewer)])
    assert not np.array_equal(alone[0][:6], alone[0][12:18])


def test_many_threads_and_worlds_of_very_different_sizes_change_nothing() -> None:
    alone, many = (worlds(6, [1, 60, 2, 1, 20, 1], threads=threads) for threads in (1, 8))
    np.testing.assert_equal(played(many, 25), played(alone, 25))


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_a_copy_goes_on_as_the_original(copied: Callable[[SwarmVecEnv], SwarmVecEnv]) -> None:
    env = made(wrapped, 2, threads=2)
    played(env, 13)
    other = copied(env)
    for _ in range(30):
        returned, returned_by_copy = (rows.step(np.full((12, 4), -0.4)) for rows in (env, other))
        np.testing.assert_equal(returned[:3], returned_by_copy[:3])


@pytest.mark.unmeasured
@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt])
@pytest.mark.parametrize("method", ["before_step", "after_step"])
def test_worlds_go_on_after_an_error_in_a_wrapper(
    method: str, error: type[BaseException], monkeypatch: pytest.MonkeyPatch
) -> None:
    def failing(*_: Any) -> Any:
        raise error("broken")

    env = made(wrapped, threads=3)
    trace = played(env, 25)
    monkeypatch.setattr(ParameterChange, method, failing)
    with pytest.raises(error, match="broken"):
        env.step(np.zeros((24, 4)))
    monkeypatch.undo()
    env.seed(3)
    np.testing.assert_equal(played(env, 25), trace)


class Halved(Wrapper):
    """Robots drive at half of what is asked and see themselves twice as far."""

    def before_step(self, commands: Any) -> Any:
        return np.asarray(commands) * [0.5, 0.5, 1.0, 1.0]

    def after_step(self, outcome: Any) -> Any:
        observations, rewards, *ends = outcome
        return observations * 2.0, rewards + 1.0, *ends


class HalvedByItself(Halved):
    """The same, but it cannot be shared out."""

    def step_arrays(self, commands: Any) -> Any:
        return super().step_arrays(commands)


def test_wrappers_change_commands_and_outcomes_however_worlds_are_stepped() -> None:
    def trace(first: Any, last: Any, threads: int) -> list[Any]:
        wrappers = [first, lambda env: env, last]
        env = made(lambda world: wrappers[world](brief(n_robots=2 + world)), 3, threads)
        seen = played(env, 65)  # within an episode
        return [*seen, *(world.unwrapped.warehouse.observe() for world in env.worlds)]

    shared_out = trace(Halved, Halved, threads=2)
    np.testing.assert_equal(trace(HalvedByItself, Halved, threads=2), shared_out)
    np.testing.assert_equal(trace(HalvedByItself, HalvedByItself, threads=1), shared_out)


def test_worlds_share_running_means_whatever_the_threads() -> None:
    def trace(threads: int) -> tuple[list[Any], list[int]]:
        means = RunningMeans(window=3)

        def make_env(world: int) -> Any:
            env: Any = brief(n_robots=3, pickup_range=9.0, restock=True)
            env = FaultInjection(env, "FM1") if world % 2 else env
            return IndicatorReward(env, {"R": 1.0, "P": 0.1}, references=means)

        seen = played(made(make_env, threads=threads), 130)
        return seen, [means.count(condition) for condition in means.conditions]

    alone = trace(1)
    assert alone[1] == [12, 12]
    np.testing.assert_equal(trace(3), alone)


def test_worlds_that_end_together_begin_anew_in_their_order_whatever_their_sizes() -> None:
    begun: list[int] = []

    class Noted(Wrapper):
        def begun(self, seed: int) -> None:
            begun.append(self.warehouse.state.n_robots)

    sizes = [2, 5, 1, 4]
    env = made(lambda world: Noted(brief(n_robots=sizes[world])), 4, 2)
    played(env, 41)
    assert begun == sizes * 3
