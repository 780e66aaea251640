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
from tests.adapters.conftest import played, small, worlds, wrapped

pytest.importorskip("stable_baselines3")


from swarm_logistics_env.adapters.sb3 import SwarmVecEnv


def made(make_env: Callable[[int], Any], n_worlds: int = 4, threads: int = 1) -> SwarmVecEnv:
    return SwarmVecEnv(make_env=make_env, n_worlds=n_worlds, threads=threads, seed=3)


def test_threads_and_the_number_of_worlds_change_nothing() -> None:
    alone = played(made(wrapped), 45)
    for threads in (2, 9):
        env = made(wrapped, threads=threads)
        np.testing.assert_equal(played(env, 45), alone)
        env.close()
        env.close()
    fewer = made(wrapped, 2).reset()
    np.testing.assert_array_equal(fewer, alone[0][: len(fewer)])
    assert not np.array_equal(alone[0][:6], alone[0][12:18])


def test_many_threads_and_worlds_of_very_different_sizes_change_nothing() -> None:
    alone, many = (worlds(6, [1, 60, 2, 1, 20, 1], threads=threads) for threads in (1, 8))
    np.testing.assert_equal(played(many, 25), played(alone, 25))
    many.close()


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_a_copy_goes_on_as_the_original(copied: Callable[[SwarmVecEnv], SwarmVecEnv]) -> None:
    env = made(wrapped, 2, threads=2)
    played(env, 13)
    other = copied(env)
    for _ in range(30):
        mine, theirs = (each.step(np.full((12, 4), -0.4)) for each in (env, other))
        np.testing.assert_equal(mine[:3], theirs[:3])


def test_what_a_world_raises_is_raised() -> None:
    class Broken(SwarmLogisticsEnv):
        def step_arrays(self, commands: Any) -> Any:
            raise RuntimeError("broken")

    for broken in (0, 3):
        kinds = [SwarmLogisticsEnv] * 4
        kinds[broken] = Broken
        env = made(lambda world, kinds=kinds: kinds[world](n_robots=2), threads=3)  # type: ignore[misc]
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

    env = made(wrapped, threads=3)
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


class HalvedByItself(Halved):
    """The same, but it cannot be shared out."""

    def step_arrays(self, commands: Any) -> Any:
        return super().step_arrays(commands)


def test_wrappers_change_commands_and_outcomes_however_worlds_are_stepped() -> None:
    def trace(first: Any, last: Any, threads: int) -> list[Any]:
        wrappers = [first, lambda env: env, last]
        env = made(lambda world: wrappers[world](small(n_robots=2 + world)), 3, threads)
        seen = played(env, 60)
        seen += [world.unwrapped.warehouse.observe() for world in env.worlds]
        env.close()
        return seen

    shared_out = trace(Halved, Halved, threads=2)
    np.testing.assert_equal(trace(Halved, Halved, threads=1), shared_out)
    np.testing.assert_equal(trace(HalvedByItself, Halved, threads=2), shared_out)
    np.testing.assert_equal(trace(HalvedByItself, HalvedByItself, threads=1), shared_out)


def test_worlds_share_running_means_whatever_the_threads() -> None:
    def trace(threads: int) -> tuple[list[Any], RunningMeans]:
        means = RunningMeans(window=3)

        def make_env(world: int) -> Any:
            env: Any = small(n_robots=3, pickup_range=9.0, restock=True)
            env = FaultInjection(env, "FM1") if world % 2 else env
            return IndicatorReward(env, {"R": 1.0, "P": 0.1}, references=means)

        env = made(make_env, threads=threads)
        seen = played(env, 130)
        env.close()
        return seen, means

    alone, means = trace(1)
    np.testing.assert_equal(trace(3)[0], alone)
    counts = {condition.n_failed: means.count(condition) for condition in means.conditions}
    assert counts == {0: 12, 1: 12}
