"""PPO of stable-baselines3, its wrappers and callbacks on a VecEnv of worlds."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.logger import configure
from stable_baselines3.common.vec_env import VecCheckNan, VecMonitor, VecNormalize

from swarm_logistics_env.adapters.sb3 import LogDeliveries, SwarmVecEnv
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.wrappers import SwarmSize, Wrapper

Played = Callable[[SwarmVecEnv, int], list[Any]]
Small = dict[str, Any]


def learned(small: Small, n_steps: int, threads: int = 2) -> Any:
    # Rollouts are cut in mid-episode.
    env = SwarmVecEnv(n_worlds=3, n_robots=[2, 5], threads=threads, **small)
    model = PPO(
        "MlpPolicy", env, n_steps=32, batch_size=96, n_epochs=2, seed=0,
        policy_kwargs={"net_arch": [16]},
    )  # fmt: skip
    return model.learn(n_steps)


def parameters(model: Any) -> list[Any]:
    return [tensor.numpy() for tensor in model.policy.state_dict().values()]


def test_learning_twice_gives_equal_parameters_whatever_the_threads(small: Small) -> None:
    first = parameters(learned(small, 1000))
    np.testing.assert_equal(parameters(learned(small, 1000)), first)
    np.testing.assert_equal(parameters(learned(small, 1000, threads=1)), first)
    shorter = parameters(learned(small, 500))
    assert any(not np.array_equal(one, other) for one, other in zip(first, shorter, strict=True))


class Ends(BaseCallback):  # type: ignore[misc]  # not in the environment of the type check
    """Collects what the infos of done rows say."""

    def _on_step(self) -> bool:
        self.ends = getattr(self, "ends", [])
        self.ends += [info for info in self.locals["infos"] if "episode" in info]
        return True


def test_their_wrappers_callbacks_and_evaluation_work(small: Small) -> None:
    env = VecNormalize(
        VecMonitor(
            VecCheckNan(SwarmVecEnv(n_worlds=2, n_robots=3, threads=2, **small)),
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


def test_robots_ends_are_those_that_a_monitor_finds(small: Small) -> None:
    def make_env(world: int) -> Any:
        env = SwarmLogisticsEnv(**small, n_robots=4, rewards={"delivery": 1.0, "contact": -0.1})
        return SwarmSize(env, [3, 4], leave=[(1, 0.7)])

    own = SwarmVecEnv(make_env=make_env, n_worlds=3, seed=0)
    monitored = VecMonitor(SwarmVecEnv(make_env=make_env, n_worlds=3, seed=0))
    rng = np.random.default_rng(0)
    own.reset(), monitored.reset()
    lengths, returns = set(), set()
    for step in range(70):
        if step == 50:  # in mid-episode
            own.reset(), monitored.reset()
        actions = rng.uniform(-1, 1, (12, 4))
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
    assert lengths == {7, 20}
    assert len(returns) > 1


class Delivering(Wrapper):
    """Tells of seven deliveries."""

    @property
    def episode_info(self) -> dict[str, float]:
        return {"delivered": 7}


def test_learners_log_returns_lengths_and_deliveries_by_themselves(
    small: Small, tmp_path: Path
) -> None:
    rewards = {"contact": -1.0}
    env = SwarmVecEnv(
        make_env=lambda _: Delivering(SwarmLogisticsEnv(**small, n_robots=4, rewards=rewards)),
        n_worlds=2,
        seed=0,
    )
    model = PPO("MlpPolicy", env, n_steps=50, batch_size=50, policy_kwargs={"net_arch": [16]})
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
