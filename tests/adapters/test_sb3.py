"""Every robot of every world as a row of stable-baselines3's VecEnv."""

from __future__ import annotations

import copy
import doctest
import pickle
import subprocess
import sys
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Fault
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.errors import CommandError, ScenarioError, SetupError
from swarm_logistics_env.streams import key
from swarm_logistics_env.wrappers import (
    FaultInjection,
    IndicatorReward,
    ParameterChange,
    RunningMeans,
    SwarmSize,
    Wrapper,
)

pytest.importorskip("stable_baselines3")

import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import VecCheckNan, VecMonitor, VecNormalize

from swarm_logistics_env.adapters import sb3
from swarm_logistics_env.adapters.sb3 import SwarmVecEnv

SMALL: dict[str, Any] = {
    "warehouse_width": 6.0,
    "warehouse_height": 5.0,
    "n_items": 10,
    "duration": 2.0,
}


def small_env(**arguments: Any) -> SwarmLogisticsEnv:
    return SwarmLogisticsEnv(**{**SMALL, **arguments})


ONE = small_env()


@pytest.fixture(autouse=True)
def one_thread() -> Iterator[None]:
    """Nets this small are slower on several threads, the more so beside other tests."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


def played(env: SwarmVecEnv, steps: int) -> list[Any]:
    """All that `steps` random steps after a reset return."""
    rng = np.random.default_rng(0)
    trace: list[Any] = [env.reset()]
    for _ in range(steps):
        observations, rewards, dones, infos = env.step(rng.uniform(-1, 1, (env.num_envs, 4)))
        trace += [observations, rewards, dones]
        trace += [
            info.get("terminal_observation", np.zeros(0))
            for info, done in zip(infos, dones)
            if done
        ]
    return trace


def assert_same(one: list[Any], other: list[Any]) -> None:
    assert len(one) == len(other)
    for mine, theirs in zip(one, other):
        np.testing.assert_array_equal(mine, theirs)


def test_rows_are_the_worlds_own_over_several_episodes() -> None:
    sizes = [3, 5]
    env = SwarmVecEnv(n_worlds=3, n_robots=sizes, seed=7, **SMALL)
    assert env.num_envs == 3 + 5 + 3
    worlds = [small_env(n_robots=size) for size in (3, 5, 3)]
    rng = np.random.default_rng(0)
    first = [world.reset_arrays(key(7, "world", w) >> 1) for w, world in enumerate(worlds)]
    np.testing.assert_array_equal(env.reset(), np.concatenate(first))
    for step in range(1, 48):
        actions = rng.uniform(-1, 1, (11, 4)).astype(np.float32)
        observations, rewards, dones, infos = env.step(actions)
        outcomes = [
            world.step_arrays(part)
            for world, part in zip(worlds, np.split(actions, np.cumsum([3, 5])))
        ]
        last = np.concatenate([outcome[0] for outcome in outcomes])
        np.testing.assert_array_equal(rewards, np.concatenate([o[1] for o in outcomes]))
        assert dones.all() == dones.any() == (step % 20 == 0)
        if step % 20 == 0:
            for row, info in enumerate(infos):
                np.testing.assert_array_equal(info["terminal_observation"], last[row])
                assert info["TimeLimit.truncated"] is True
                assert info["padding"] is False
                assert info["n_robots"] == sizes[info["world"] % 2]
            last = np.concatenate([world.reset_arrays() for world in worlds])
        else:
            for info, world in zip(infos, env._worlds.world_of.tolist()):
                assert info == {
                    "TimeLimit.truncated": False, "padding": False, "failed": 0, "world": world,
                    "n_robots": sizes[world % 2], "delivered": info["delivered"],
                }  # fmt: skip
        np.testing.assert_array_equal(observations, last)
        assert observations.dtype == rewards.dtype == np.float32
        assert env.observation_space.contains(observations[0])


def wrapped(world: int) -> Any:
    env: Any = small_env(n_robots=4)
    env = FaultInjection(env, "FM1", onset=[0.0, 0.5])
    env = SwarmSize(env, [3, 6], leave=[(1, 0.7)])
    return ParameterChange(env, "max_speed", [1.0, 2.0], at=0.3) if world % 2 else env


def test_threads_and_the_number_of_worlds_change_nothing() -> None:
    alone = played(SwarmVecEnv(make_env=wrapped, n_worlds=4, seed=3), 45)
    for threads in (2, 3, 9):
        env = SwarmVecEnv(make_env=wrapped, n_worlds=4, threads=threads, seed=3)
        assert_same(played(env, 45), alone)
        env.close()
        env.close()
    fewer = SwarmVecEnv(make_env=wrapped, n_worlds=2, seed=3).reset()
    np.testing.assert_array_equal(fewer, alone[0][: len(fewer)])
    assert not np.array_equal(alone[0][:6], alone[0][12:18])


def test_many_threads_and_worlds_of_very_different_sizes_change_nothing() -> None:
    sizes = [1, 60, 2, 1, 20, 1]
    alone, many = (
        SwarmVecEnv(n_worlds=6, n_robots=sizes, threads=threads, seed=3, **SMALL)
        for threads in (1, 8)
    )
    assert_same(played(many, 25), played(alone, 25))
    many.close()


def test_a_seed_fixes_all_episodes_and_no_seed_none() -> None:
    env = SwarmVecEnv(n_worlds=2, n_robots=3, seed=0, **SMALL)
    trace = played(env, 45)
    assert not np.array_equal(trace[0], env.reset())  # goes on with the next episodes
    seeds = env.seed(0)
    assert seeds[0] == seeds[2] != seeds[3]
    assert_same(played(env, 45), trace)
    other = SwarmVecEnv(n_worlds=2, n_robots=3, **SMALL)
    assert not np.array_equal(other.reset(), trace[0])
    other.seed(1)
    assert not np.array_equal(other.reset(), trace[0])


def test_a_removed_robot_is_done_once_and_then_padding() -> None:
    faults = [Fault("removed", (1,), onset=0.5)]
    env = SwarmVecEnv(n_worlds=2, n_robots=3, faults=faults, seed=0, **SMALL)
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
    def make_env(world: int) -> Any:
        return SwarmSize(small_env(), [2, 5])

    env = SwarmVecEnv(make_env=make_env, n_worlds=1, seed=0)
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
    env = SwarmVecEnv(n_worlds=1, n_robots=3, n_items=2, pickup_range=14.0, duration=60.0, seed=0)
    env.reset()
    total, dones, infos = 0.0, np.zeros(3, np.bool_), []
    while not dones.any():
        heading = env.worlds[0].warehouse.state.robot_heading
        east = np.stack([np.cos(heading), -np.sin(heading), 0 * heading, 1 + 0 * heading], axis=1)
        _, rewards, dones, infos = env.step(east)
        total += rewards[0]
    assert dones.all()
    assert total == 2.0
    assert all(info["delivered"] == 2 for info in infos)
    assert not any(info["TimeLimit.truncated"] for info in infos)

    for onset, length in ((0.2, 2), (0.1, 1)):
        faults = [Fault("removed", 3, onset=onset)]
        env = SwarmVecEnv(n_worlds=1, n_robots=3, faults=faults, seed=0, **SMALL)
        env.reset()
        ends = [env.step(np.zeros((3, 4)))[2].all() for _ in range(4)]
        assert ends == [(step % length) == 0 for step in range(1, 5)]


def test_infos_that_are_written_into_share_nothing() -> None:
    first, second = (SwarmVecEnv(n_worlds=2, n_robots=2, seed=0, **SMALL) for _ in range(2))
    for env in (first, second):
        env.reset()
    for _ in range(21):
        *_, infos = first.step(np.zeros((4, 4)))
        keys = [set(info) - {"terminal_observation", "mine"} for info in infos]
        assert keys == [set(first.reset_infos[0])] * 4
        assert not any("mine" in info for info in infos)
        infos[0]["mine"] = 1
        assert not any("mine" in info for info in infos[1:])
        assert not any("mine" in info for info in second.step(np.zeros((4, 4)))[-1])


def test_actions_that_cannot_be_read_are_refused() -> None:
    env = SwarmVecEnv(n_worlds=1, n_robots=2, seed=0, **SMALL)
    env.reset()
    with pytest.raises(CommandError, match=r"actions \(type Tensor, dtype torch.bfloat16"):
        env.step_async(torch.zeros((2, 4), dtype=torch.bfloat16))


def test_what_was_returned_stays_as_it_was() -> None:
    env = SwarmVecEnv(n_worlds=2, n_robots=3, seed=0, **SMALL)
    before = env.reset()
    kept = before.copy()
    after, rewards, *_ = env.step(np.ones((6, 4)))
    rewards += 5.0
    assert not np.array_equal(before, after)
    np.testing.assert_array_equal(before, kept)
    assert not env.step(np.ones((6, 4)))[1].any()


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
    env = SwarmVecEnv(n_worlds=2, n_robots=3, seed=0, **SMALL)
    env.set_options({"faults": [Fault("FM1", (0,))]})
    env.reset()
    assert [len(world.warehouse.faults) for world in env.worlds] == [1, 1]
    env.set_options([{}, {"faults": [Fault("FM1", (0,))]}])
    env.reset()
    assert [len(world.warehouse.faults) for world in env.worlds] == [0, 1]
    env.reset()
    assert [len(world.warehouse.faults) for world in env.worlds] == [0, 0]
    with pytest.raises(SetupError, match="3 options"):
        env.set_options([{}, {}, {}])
    env.set_options({"scenario": {"n_robots": 4}})
    with pytest.raises(SetupError, match="n_robots = 4: should be at most 3"):
        env.reset()


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_a_copy_goes_on_as_the_original(copied: Callable[[SwarmVecEnv], SwarmVecEnv]) -> None:
    env = SwarmVecEnv(make_env=wrapped, n_worlds=2, threads=2, seed=0)
    env.reset()
    for _ in range(13):
        env.step(np.full((12, 4), 0.7))
    other = copied(env)
    for _ in range(30):
        mine, theirs = (each.step(np.full((12, 4), -0.4)) for each in (env, other))
        assert_same(list(mine[:3]), list(theirs[:3]))


def test_pictures_are_tiles_of_the_worlds() -> None:
    pytest.importorskip("pygame")
    env = SwarmVecEnv(n_worlds=2, n_robots=2, render_mode="rgb_array", seed=0, **SMALL)
    env.reset()
    picture, single = env.render(), env.worlds[0].render()
    assert picture is not None
    assert single is not None
    assert picture.shape == (2 * single.shape[0], single.shape[1], 3)
    np.testing.assert_array_equal(picture[: single.shape[0]], single)
    env.close()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"n_worlds": 0}, "n_worlds = 0"),
        ({"threads": 1.5}, "threads = 1.5"),
        ({"n_robots": []}, r"n_robots = \[\]"),
        ({"n_robots": [1, 2, 3], "n_worlds": 2}, "1 to 2 sizes"),
        ({"make_env": wrapped, "n_robots": 3}, "one or the other"),
        ({"make_env": lambda world: world}, "make_env gave 0"),
        ({"make_env": lambda world: ONE}, "same environment twice"),
        ({"make_env": lambda world: small_env(message_size=world)}, "one message_size"),
        ({"seed": "a"}, "seed = 'a'"),
    ],
)
def test_wrong_arguments_are_refused(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(SetupError, match=message):
        SwarmVecEnv(**arguments)
    with pytest.raises(ScenarioError, match="n_robots"):
        SwarmVecEnv(n_robot=3)


@pytest.mark.parametrize(
    "actions", [np.zeros(4), np.zeros((5, 4)), np.full((6, 4), np.nan), [["a"] * 4] * 6]
)
def test_wrong_actions_are_refused_before_anything_happens(actions: Any) -> None:
    env = SwarmVecEnv(n_worlds=2, n_robots=3, seed=0, **SMALL)
    with pytest.raises(SetupError, match="step before reset"):
        env.step(np.zeros((6, 4)))
    env.reset()
    with pytest.raises(CommandError):
        env.step(actions)
    assert [world.warehouse.state.step for world in env.worlds] == [0, 0]


def test_what_a_world_raises_is_raised() -> None:
    class Broken(SwarmLogisticsEnv):
        def step_arrays(self, commands: Any) -> Any:
            raise RuntimeError("broken")

    for broken in (0, 3):
        makers = [SwarmLogisticsEnv] * 4
        makers[broken] = Broken
        env = SwarmVecEnv(make_env=lambda world: makers[world](n_robots=2), n_worlds=4, threads=3)  # noqa: B023
        env.reset()
        with pytest.raises(RuntimeError, match="broken"):
            env.step(np.zeros((8, 4)))


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt])
@pytest.mark.parametrize("method", ["before_step", "after_step"])
def test_worlds_go_on_after_an_error_in_a_wrapper(
    method: str, error: type[BaseException], monkeypatch: pytest.MonkeyPatch
) -> None:
    def failing(*_: Any) -> Any:
        raise error("broken")

    env = SwarmVecEnv(make_env=wrapped, n_worlds=4, threads=3, seed=3)
    trace = played(env, 25)
    monkeypatch.setattr(ParameterChange, method, failing)
    with pytest.raises(error, match="broken"):
        env.step(np.zeros((24, 4)))
    monkeypatch.undo()
    env.seed(3)
    assert_same(played(env, 25), trace)
    env.close()


class Halved(Wrapper):
    """Robots drive at half of what is asked and see themselves twice as far."""

    def before_step(self, commands: Any) -> Any:
        return np.asarray(commands) * [0.5, 0.5, 1.0, 1.0]

    def after_step(self, outcome: Any) -> Any:
        observations, rewards, *ends = outcome
        return observations * 2.0, rewards + 1.0, *ends


class HalvedByItself(Wrapper):
    """The same, without the methods that let worlds be shared out."""

    def step_arrays(self, commands: Any) -> Any:
        halved = np.asarray(commands) * [0.5, 0.5, 1.0, 1.0]
        observations, rewards, *ends = super().step_arrays(halved)
        return observations * 2.0, rewards + 1.0, *ends


def test_wrappers_change_commands_and_outcomes_however_worlds_are_stepped() -> None:
    def trace(wrappers: list[Any], threads: int) -> list[Any]:
        def make_env(world: int) -> Any:
            env = SwarmLogisticsEnv(n_robots=2 + world, **SMALL)
            return env if wrappers[world] is None else wrappers[world](env)

        env = SwarmVecEnv(make_env=make_env, n_worlds=3, threads=threads, seed=3)
        seen = [env.reset()]
        rng = np.random.default_rng(0)
        for _ in range(60):
            seen += env.step(rng.uniform(-1.0, 1.0, (9, 4)))[:3]
        own = [world.unwrapped.warehouse.observe() for world in env.worlds]
        env.close()
        return [*seen, *own]

    shared_out = trace([Halved, None, Halved], threads=2)
    for wrappers, threads in (
        ([Halved, None, Halved], 1),
        ([HalvedByItself, None, Halved], 2),
        ([HalvedByItself, None, HalvedByItself], 1),
    ):
        for mine, theirs in zip(shared_out, trace(wrappers, threads), strict=True):
            np.testing.assert_array_equal(mine, theirs)


def learned(n_steps: int, threads: int = 2) -> Any:
    # Rollouts are cut in mid-episode.
    env = SwarmVecEnv(n_worlds=3, n_robots=[2, 5], threads=threads, **SMALL)
    model = PPO(
        "MlpPolicy", env, n_steps=32, batch_size=96, n_epochs=2, seed=0,
        policy_kwargs={"net_arch": [16]},
    )  # fmt: skip
    return model.learn(n_steps)


def parameters(model: Any) -> list[Any]:
    return [tensor.numpy() for tensor in model.policy.state_dict().values()]


def test_learning_twice_gives_equal_parameters_whatever_the_threads() -> None:
    first = parameters(learned(4000))
    assert_same(parameters(learned(4000)), first)
    assert_same(parameters(learned(4000, threads=1)), first)
    shorter = parameters(learned(2000))
    assert any(not np.array_equal(one, other) for one, other in zip(first, shorter, strict=True))


class Ends(BaseCallback):  # type: ignore[misc]  # not in the environment of the type check
    """Collects what the infos of done rows say."""

    def _on_step(self) -> bool:
        self.ends = getattr(self, "ends", [])
        self.ends += [info for info in self.locals["infos"] if "episode" in info]
        return True


def test_their_wrappers_callbacks_and_evaluation_work() -> None:
    env = VecNormalize(
        VecMonitor(
            VecCheckNan(SwarmVecEnv(n_worlds=2, n_robots=3, threads=2, **SMALL)),
            info_keywords=("delivered", "n_robots", "padding"),
        )
    )
    model = PPO(
        "MlpPolicy", env, n_steps=25, batch_size=50, seed=0, policy_kwargs={"net_arch": [16]}
    )
    seen = Ends()
    model.learn(2 * 150, callback=seen)
    assert len(seen.ends) == 12
    assert {info["episode"]["l"] for info in seen.ends} == {20}
    assert {info["episode"]["n_robots"] for info in seen.ends} == {3}
    assert env.get_attr("render_mode") == [None] * 6
    mean, _ = evaluate_policy(model, env, n_eval_episodes=6)
    assert np.isfinite(mean)


def test_worlds_share_running_means_whatever_the_threads() -> None:
    def played_with(threads: int) -> tuple[list[Any], RunningMeans]:
        means = RunningMeans(window=3)

        def make_env(world: int) -> Any:
            env: Any = small_env(n_robots=3, pickup_range=9.0, restock=True)
            env = FaultInjection(env, "FM1") if world % 2 else env
            return IndicatorReward(env, {"R": 1.0, "P": 0.1}, references=means)

        env = SwarmVecEnv(make_env=make_env, n_worlds=4, threads=threads, seed=0)
        trace = played(env, 130)
        assert env.env_is_wrapped(IndicatorReward) == [True] * 12
        env.close()
        return trace, means

    alone, means = played_with(1)
    assert_same(played_with(3)[0], alone)
    counts = {condition.n_failed: means.count(condition) for condition in means.conditions}
    assert counts == {0: 12, 1: 12}


def test_the_end_of_an_episode_tells_indicators_and_references() -> None:
    env = SwarmVecEnv(
        make_env=lambda world: IndicatorReward(small_env(n_robots=3), "R", references=20.0),
        n_worlds=2,
        seed=0,
    )
    env.set_options([{}, {"faults": [Fault("FM1", 2)]}])
    env.reset()
    returns = np.zeros(6)
    for _ in range(20):
        _, rewards, _, infos = env.step(np.zeros((6, 4)))
        returns += rewards
    assert infos[0]["R_tested"] == infos[0]["R"] == 0
    assert infos[3]["R_tested"] == 1
    assert infos[3]["R"] == pytest.approx(-1 + 2 / 3)
    assert infos[3]["R_P_o"] == 20.0
    assert infos[3]["n_failed"] == 2
    assert returns == pytest.approx([0.0] * 3 + [-1 + 2 / 3] * 3)


def test_asking_for_adapters_does_not_load_torch() -> None:
    script = (
        "import sys, swarm_logistics_env.adapters as a; a.CentralEnv; print(*sys.modules);"
        "a.SwarmVecEnv; assert 'torch' in sys.modules"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert not {"torch", "stable_baselines3"} & set(done.stdout.split())


def test_the_example_runs() -> None:
    ran = doctest.testmod(sb3)
    assert ran.attempted > 5
    assert not ran.failed
