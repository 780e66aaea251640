"""PPO of stable-baselines3, its wrappers and callbacks on a VecEnv of worlds; normalised rows."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.logger import configure
from stable_baselines3.common.vec_env import DummyVecEnv, VecCheckNan, VecMonitor, VecNormalize

from swarm_logistics_env.adapters import CentralEnv, SwarmVecNormalize
from swarm_logistics_env.adapters.sb3 import LogDeliveries, SwarmVecEnv
from swarm_logistics_env.errors import SetupError
from swarm_logistics_env.wrappers import SwarmSize, Wrapper
from tests.adapters.conftest import small, worlds

STEADY = {"contact": -1.0, "own_delivery": 1.0}


def ppo(env: Any, n_steps: int, **arguments: Any) -> Any:
    return PPO(
        "MlpPolicy", env, n_steps=n_steps, seed=0, policy_kwargs={"net_arch": [16]}, **arguments
    )


def test_learning_twice_gives_equal_parameters_whatever_the_threads() -> None:
    def parameters(n_steps: int, threads: int) -> list[Any]:
        # Rollouts are cut in mid-episode.
        env = worlds(3, [2, 5], threads=threads, seed=None)
        model = ppo(env, 32, batch_size=96, n_epochs=2).learn(n_steps)
        return [tensor.numpy() for tensor in model.policy.state_dict().values()]

    first = parameters(1000, 2)
    np.testing.assert_equal(parameters(1000, 2), first)
    np.testing.assert_equal(parameters(1000, 1), first)
    shorter = parameters(500, 2)
    assert any(not np.array_equal(one, other) for one, other in zip(first, shorter, strict=True))


class Ends(BaseCallback):  # type: ignore[misc]  # not in the environment of the type check
    """Collects what the infos of done rows say."""

    def _on_step(self) -> bool:
        self.ends = getattr(self, "ends", [])
        self.ends += [info for info in self.locals["infos"] if "episode" in info]
        return True


def test_their_wrappers_callbacks_and_evaluation_work() -> None:
    keywords = ("delivered", "n_robots", "padding")
    env = VecNormalize(VecMonitor(VecCheckNan(worlds(2, threads=2)), info_keywords=keywords))
    model, seen = ppo(env, 25, batch_size=50), Ends()
    model.learn(2 * 150, callback=seen)
    assert len(seen.ends) == 12
    assert {info["episode"]["l"] for info in seen.ends} == {20}
    assert {info["episode"]["n_robots"] for info in seen.ends} == {3}
    assert env.get_attr("render_mode") == [None] * 6
    mean, _ = evaluate_policy(model, env, n_eval_episodes=6)
    assert np.isfinite(mean)


def padded(world: int) -> Any:
    return SwarmSize(small(n_robots=8, rewards=STEADY), [2, 8], leave=[(1, 1.0)])


def in_padding() -> SwarmVecEnv:
    return SwarmVecEnv(make_env=padded, n_worlds=3, seed=0)


def test_robots_ends_are_those_that_a_monitor_finds() -> None:
    own, monitored = in_padding(), VecMonitor(in_padding())
    rng = np.random.default_rng(0)
    own.reset(), monitored.reset()
    lengths, returns = set(), set()
    for step in range(70):
        if step == 50:  # in mid-episode
            own.reset(), monitored.reset()
        actions = rng.uniform(-1, 1, (24, 4))
        *_, dones, infos = own.step(actions)
        *_, others = monitored.step(actions)
        for done, info, other in zip(dones, infos, others, strict=True):
            assert ("episode" in info) == (done and not info["padding"])
            if "episode" in info:
                ended, found = info["episode"], other["episode"]
                assert (ended["r"], ended["l"]) == (found["r"], found["l"])
                assert ended["delivered"] == info["delivered"]
                assert ended["t"] > 0.0
                lengths.add(ended["l"])
                returns.add(ended["r"])
    assert lengths == {10, 20}
    assert len(returns) > 1


class Delivering(Wrapper):
    """Tells of seven deliveries."""

    @property
    def episode_info(self) -> dict[str, float]:
        return {"delivered": 7}


def test_learners_log_returns_lengths_and_deliveries_by_themselves(tmp_path: Path) -> None:
    def make_env(world: int) -> Delivering:
        return Delivering(small(n_robots=4, rewards={"contact": -1.0}))

    model = ppo(SwarmVecEnv(make_env=make_env, n_worlds=2, seed=0), 50, batch_size=50)
    model.set_logger(configure(str(tmp_path), ["json"]))
    seen = Ends()
    model.learn(400, callback=[seen, LogDeliveries()])
    model.logger.close()
    told = json.loads((tmp_path / "progress.json").read_text())
    returns = [info["episode"]["r"] for info in seen.ends]
    assert told["rollout/ep_rew_mean"] == pytest.approx(np.mean(returns))
    assert told["rollout/ep_len_mean"] == 20
    assert told["rollout/delivered_mean"] == 7


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
    again.reset()
    again.step(np.zeros((24, 4)))
    assert again.obs_rms.count > env.obs_rms.count


def test_without_padding_it_is_theirs() -> None:
    ours, theirs = (kind(worlds(2, rewards=STEADY)) for kind in (SwarmVecNormalize, VecNormalize))
    ours.reset(), theirs.reset()
    rng = np.random.default_rng(0)
    for _ in range(30):
        actions = rng.uniform(-1, 1, (6, 4))
        np.testing.assert_equal(ours.step(actions)[:3], theirs.step(actions)[:3])


def test_other_environments_are_refused() -> None:
    with pytest.raises(SetupError, match="should be a SwarmVecEnv"):
        SwarmVecNormalize(DummyVecEnv([lambda: CentralEnv(n_robots=2, flat=True)]))
