"""Normalised rows: statistics of robots alone."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor, VecNormalize

from swarm_logistics_env.adapters import CentralEnv, SwarmVecEnv, SwarmVecNormalize
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.errors import SetupError
from swarm_logistics_env.wrappers import SwarmSize

STEADY = {"contact": -1.0, "own_delivery": 1.0}


def padded(world: int) -> Any:
    env = SwarmLogisticsEnv(n_robots=8, n_items=10, duration=2.0, rewards=STEADY)
    return SwarmSize(env, [2, 8], leave=[(1, 1.0)])


def made(**arguments: Any) -> Any:
    venv = SwarmVecEnv(make_env=padded, n_worlds=3, seed=0)
    return SwarmVecNormalize(VecMonitor(venv), **arguments)


def test_statistics_are_those_of_rows_that_are_robots() -> None:
    env = made(gamma=0.5)
    bare = SwarmVecEnv(make_env=padded, n_worlds=3, seed=0)
    rng = np.random.default_rng(0)
    env.reset()
    seen, returns = [bare.reset()[bare.present]], np.zeros(24)
    earned, n_padding = [], 0
    for _ in range(50):
        actions = rng.uniform(-1, 1, (24, 4))
        env.step(actions)
        acting = bare.present
        rows, rewards, dones, _ = bare.step(actions)
        seen.append(rows[bare.present])
        n_padding += int((~bare.present).sum())
        returns = 0.5 * returns + rewards
        earned.append(returns[acting])
        returns = np.where(dones, 0.0, returns)
    assert n_padding > 100
    assert env.obs_rms.count == pytest.approx(sum(map(len, seen)), abs=1e-3)
    every = np.concatenate(seen).astype(np.float64)
    np.testing.assert_allclose(env.obs_rms.mean, every.mean(axis=0), atol=1e-4)
    np.testing.assert_allclose(env.obs_rms.var, every.var(axis=0), atol=1e-2)
    paid = np.concatenate(earned)
    assert paid.std() > 0.0
    assert env.ret_rms.mean == pytest.approx(paid.mean(), abs=1e-4)


def test_without_padding_it_is_theirs() -> None:
    ours, theirs = (
        kind(SwarmVecEnv(n_worlds=2, n_robots=3, duration=2.0, rewards=STEADY, seed=0))
        for kind in (SwarmVecNormalize, VecNormalize)
    )
    ours.reset(), theirs.reset()
    rng = np.random.default_rng(0)
    for _ in range(30):
        actions = rng.uniform(-1, 1, (6, 4))
        for part, wanted in zip(ours.step(actions)[:3], theirs.step(actions)[:3]):
            np.testing.assert_array_equal(part, wanted)


def test_statistics_are_saved_and_loaded(tmp_path: Any) -> None:
    env = made()
    env.reset()
    env.step(np.zeros((24, 4)))
    env.save(str(tmp_path / "statistics.pkl"))
    again = SwarmVecNormalize.load(
        str(tmp_path / "statistics.pkl"), SwarmVecEnv(make_env=padded, n_worlds=3, seed=0)
    )
    np.testing.assert_array_equal(again.obs_rms.mean, env.obs_rms.mean)
    again.reset()
    again.step(np.zeros((24, 4)))
    assert again.obs_rms.count > env.obs_rms.count


def test_other_environments_are_refused() -> None:
    with pytest.raises(SetupError, match="should be a SwarmVecEnv"):
        SwarmVecNormalize(DummyVecEnv([lambda: CentralEnv(n_robots=2, flat=True)]))
