"""However worlds are shared out among threads, they play the same."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.wrappers import (
    FaultInjection,
    IndicatorReward,
    ParameterChange,
    RunningMeans,
    Wrapper,
)

pytest.importorskip("stable_baselines3")


from swarm_logistics_env.adapters.sb3 import SwarmVecEnv

Played = Callable[[SwarmVecEnv, int], list[Any]]
Small = dict[str, Any]


def test_threads_and_the_number_of_worlds_change_nothing(
    wrapped: Callable[[int], Any], played: Played
) -> None:
    alone = played(SwarmVecEnv(make_env=wrapped, n_worlds=4, seed=3), 45)
    for threads in (2, 3, 9):
        env = SwarmVecEnv(make_env=wrapped, n_worlds=4, threads=threads, seed=3)
        np.testing.assert_equal(played(env, 45), alone)
        env.close()
        env.close()
    fewer = SwarmVecEnv(make_env=wrapped, n_worlds=2, seed=3).reset()
    np.testing.assert_array_equal(fewer, alone[0][: len(fewer)])
    assert not np.array_equal(alone[0][:6], alone[0][12:18])


def test_many_threads_and_worlds_of_very_different_sizes_change_nothing(
    small: Small, played: Played
) -> None:
    sizes = [1, 60, 2, 1, 20, 1]
    alone, many = (
        SwarmVecEnv(n_worlds=6, n_robots=sizes, threads=threads, seed=3, **small)
        for threads in (1, 8)
    )
    np.testing.assert_equal(played(many, 25), played(alone, 25))
    many.close()


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_a_copy_goes_on_as_the_original(
    wrapped: Callable[[int], Any], copied: Callable[[SwarmVecEnv], SwarmVecEnv]
) -> None:
    env = SwarmVecEnv(make_env=wrapped, n_worlds=2, threads=2, seed=0)
    env.reset()
    for _ in range(13):
        env.step(np.full((12, 4), 0.7))
    other = copied(env)
    for _ in range(30):
        mine, theirs = (each.step(np.full((12, 4), -0.4)) for each in (env, other))
        np.testing.assert_equal(list(mine[:3]), list(theirs[:3]))


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
    wrapped: Callable[[int], Any],
    played: Played,
    method: str,
    error: type[BaseException],
    monkeypatch: pytest.MonkeyPatch,
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
    np.testing.assert_equal(played(env, 25), trace)
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


def test_wrappers_change_commands_and_outcomes_however_worlds_are_stepped(small: Small) -> None:
    def trace(wrappers: list[Any], threads: int) -> list[Any]:
        def make_env(world: int) -> Any:
            env = SwarmLogisticsEnv(n_robots=2 + world, **small)
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


def test_worlds_share_running_means_whatever_the_threads(small: Small, played: Played) -> None:
    def played_with(threads: int) -> tuple[list[Any], RunningMeans]:
        means = RunningMeans(window=3)

        def make_env(world: int) -> Any:
            env: Any = SwarmLogisticsEnv(**small, n_robots=3, pickup_range=9.0, restock=True)
            env = FaultInjection(env, "FM1") if world % 2 else env
            return IndicatorReward(env, {"R": 1.0, "P": 0.1}, references=means)

        env = SwarmVecEnv(make_env=make_env, n_worlds=4, threads=threads, seed=0)
        trace = played(env, 130)
        assert env.env_is_wrapped(IndicatorReward) == [True] * 12
        env.close()
        return trace, means

    alone, means = played_with(1)
    np.testing.assert_equal(played_with(3)[0], alone)
    counts = {condition.n_failed: means.count(condition) for condition in means.conditions}
    assert counts == {0: 12, 1: 12}
