"""PPO of stable-baselines3, its wrappers and callbacks on a VecEnv of worlds; normalised rows."""

from __future__ import annotations

import doctest
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

import torch
from stable_baselines3 import PPO
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.logger import configure
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv, VecCheckNan, VecMonitor, VecNormalize

from swarm_logistics_env.adapters import CentralEnv, SwarmVecNormalize, sb3
from swarm_logistics_env.adapters.sb3 import SwarmVecEnv
from swarm_logistics_env.adapters.sb3_learning import LogDeliveries
from swarm_logistics_env.core.errors import SetupError
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.wrappers import SwarmSize
from tests.wrappers.conftest import brief, worlds

# Infos tell episodes as a Monitor would, so stable-baselines3 warns of a VecMonitor around them.
pytestmark = pytest.mark.filterwarnings("ignore:The environment is already wrapped with a `Mon")

torch.set_num_threads(1)  # as a training does; nets this small are slower on several

STEADY = {"contact": -1.0, "own_delivery": 1.0}


def ppo(env: Any, n_steps: int, **arguments: Any) -> Any:
    return PPO(
        "MlpPolicy", env, n_steps=n_steps, seed=0, policy_kwargs={"net_arch": [16]}, **arguments
    )


@pytest.mark.unmeasured
def test_learning_twice_gives_equal_parameters_whatever_the_threads() -> None:
    def parameters(n_steps: int, threads: int) -> list[Any]:
        # Rollouts are cut in mid-episode.
        env = worlds(3, [2, 5], threads=threads, seed=None)
        model = ppo(env, 32, batch_size=96, n_epochs=2).learn(n_steps)
        return [tensor.numpy() for tensor in model.policy.state_dict().values()]

    first = parameters(400, 2)
    np.testing.assert_equal(parameters(400, 2), first)
    np.testing.assert_equal(parameters(400, 1), first)
    assert not np.array_equal(parameters(200, 2)[0], first[0])


def test_their_wrappers_callbacks_and_evaluation_work() -> None:
    env = VecNormalize(VecMonitor(VecCheckNan(worlds(2, threads=2)), info_keywords=("delivered",)))
    model = ppo(env, 25, batch_size=50)
    model.learn(2 * 150)
    assert {episode["l"] for episode in model.ep_info_buffer} == {20}
    assert {"delivered"} <= model.ep_info_buffer[0].keys()
    mean, _ = evaluate_policy(model, env, n_eval_episodes=6)
    assert np.isfinite(mean)


def in_padding() -> SwarmVecEnv:
    def make_env(world: int) -> SwarmSize:
        return SwarmSize(brief(n_robots=8, rewards=STEADY), [2, 8], leave=[(1, 1.0)])

    return SwarmVecEnv(make_env=make_env, n_worlds=3, seed=0)


def test_robots_ends_are_those_that_a_monitor_finds() -> None:
    env, monitored = in_padding(), VecMonitor(in_padding())
    rng = np.random.default_rng(0)
    env.reset(), monitored.reset()
    lengths, returns = set(), set()
    for step in range(70):
        if step == 50:  # in mid-episode
            env.reset(), monitored.reset()
        actions = rng.uniform(-1, 1, (24, 4))
        *_, dones, infos = env.step(actions)
        *_, monitored_infos = monitored.step(actions)
        for done, info, monitored_info in zip(dones, infos, monitored_infos, strict=True):
            assert ("episode" in info) == (done and not info["padding"])
            if "episode" in info:
                ended, expected = info["episode"], monitored_info["episode"]
                assert (ended["r"], ended["l"]) == (expected["r"], expected["l"])
                assert ended["delivered"] == info["delivered"]
                lengths.add(ended["l"])
                returns.add(ended["r"])
    assert lengths == {10, 20}
    assert len(returns) > 1


def test_evaluations_count_the_episodes_of_robots_alone() -> None:
    class Still:
        def predict(self, rows: Any, **_: object) -> Any:
            return np.zeros((len(rows), 4)), None

    env, twin = in_padding(), in_padding()
    returns, lengths = evaluate_policy(Still(), env, 48, return_episode_rewards=True)
    assert env.env_is_wrapped(Monitor) == [True] * 24
    ended: list[list[Any]] = [[] for _ in range(24)]
    twin.reset()
    while min(map(len, ended)) < 2:
        for row, info in enumerate(twin.step(np.zeros((24, 4)))[-1]):
            if "episode" in info:
                ended[row].append((info["episode"]["r"], info["episode"]["l"]))
    counted = sorted(pair for row in ended for pair in row[:2])
    assert sorted(zip(returns, lengths)) == counted


@pytest.mark.parametrize("monitor", [lambda env: env, VecMonitor])
def test_learners_log_returns_lengths_and_deliveries_by_themselves(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, monitor: Any
) -> None:
    monkeypatch.setattr(SwarmLogisticsEnv, "episode_info", {"delivered": 7})
    model = ppo(monitor(worlds(2, 4, rewards={"contact": -1.0})), 50, batch_size=50)
    model.set_logger(configure(str(tmp_path), ["json"]))
    model.learn(400, callback=LogDeliveries())
    model.logger.close()
    logged = json.loads((tmp_path / "progress.json").read_text())
    returns = [episode["r"] for episode in model.ep_info_buffer]
    assert logged["rollout/ep_rew_mean"] == pytest.approx(np.mean(returns))
    assert logged["rollout/ep_len_mean"] == 20
    assert logged["rollout/delivered_mean"] == 7


def test_statistics_are_those_of_rows_that_are_robots(tmp_path: Path) -> None:
    env, bare = SwarmVecNormalize(VecMonitor(in_padding()), gamma=0.5), in_padding()
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
    every, paid = np.concatenate(seen).astype(np.float64), np.concatenate(earned)
    np.testing.assert_allclose(env.obs_rms.mean, every.mean(axis=0), atol=1e-4)
    np.testing.assert_allclose(env.obs_rms.var, every.var(axis=0), atol=1e-2)
    assert paid.std() > 0.0
    assert env.ret_rms.mean == pytest.approx(paid.mean(), abs=1e-4)
    env.save(str(tmp_path / "statistics.pkl"))
    again = SwarmVecNormalize.load(str(tmp_path / "statistics.pkl"), in_padding())
    np.testing.assert_array_equal(again.obs_rms.mean, env.obs_rms.mean)


def test_padding_stays_zeros_when_it_is_normalized() -> None:
    env = SwarmVecNormalize(in_padding())
    rng = np.random.default_rng(0)
    rows, n_padding, n_ended = env.reset(), 0, 0
    for _ in range(50):
        present = env.venv.present
        assert not rows[~present].any()
        assert rows[present].any(axis=1).all()
        raw = env.get_original_obs()
        np.testing.assert_allclose(env.unnormalize_obs(rows)[~present], raw[~present])
        n_padding += int((~present).sum())
        rows, _, dones, infos = env.step(rng.uniform(-1, 1, (24, 4)))
        for row in np.flatnonzero(dones).tolist():
            if infos[row]["padding"]:
                assert not infos[row]["terminal_observation"].any()
                n_ended += 1
    assert min(n_padding, n_ended) > 10


def test_without_padding_it_is_theirs() -> None:
    swarm, plain = (kind(worlds(2, rewards=STEADY)) for kind in (SwarmVecNormalize, VecNormalize))
    swarm.reset(), plain.reset()
    rng = np.random.default_rng(0)
    for _ in range(30):
        actions = rng.uniform(-1, 1, (6, 4))
        np.testing.assert_equal(swarm.step(actions)[:3], plain.step(actions)[:3])


def test_other_environments_are_refused() -> None:
    with pytest.raises(SetupError, match="should be a SwarmVecEnv"):
        SwarmVecNormalize(DummyVecEnv([lambda: CentralEnv(n_robots=2, flat=True)]))


def test_the_examples_run() -> None:
    ran = doctest.testmod(sb3)
    assert ran.attempted > 5
    assert not ran.failed
