"""PPO of stable-baselines3 on a swarm: one network steers every robot, all worlds are one batch.

Needs the extra `train`. Robots read and command in the frame of their motion. After 500,000 steps,
half a minute of a free core, P was 69, 62 and 64 on three new seeds; Swarm D-T had 27, 26 and 26.
"""

from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO

from swarm_logistics_env import Scenario, policies, run_episode
from swarm_logistics_env.adapters import LogDeliveries, SwarmVecEnv, SwarmVecNormalize
from swarm_logistics_env.core.streams import row_keys
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.world.motion import MotionView
from swarm_logistics_env.wrappers import MotionFrame

ARENA: dict[str, Any] = {"warehouse_width": 6.0, "warehouse_height": 5.0, "delivery_width": 1.5}
# Sparse deliveries alone teach nothing for long; these terms sum to what a delivery is made of.
REWARDS = {
    "own_delivery": 1.0, "lift_requested": 1.0, "approach": 0.5, "stocking": 0.2, "contact": -0.05
}  # fmt: skip


class Learned:
    """A network that learned through MotionFrame and SwarmVecNormalize, as a policy to be judged.

    It keeps arrays, not the environment, because a policy is copied for every run.
    """

    def __init__(self, model: PPO, mean: Any, variance: Any) -> None:
        self.model, self.mean, self.deviation = model, mean, np.sqrt(variance + 1e-8)

    def configure(self, scenario):  # what a robot's maker writes into it
        self.frame = MotionView(scenario)

    def reset(self, n_robots, seed):
        self.model.set_random_seed(seed)
        self.frame.begin(row_keys(seed, "ppo_swarm", n_robots))

    def act(self, observations):
        rows = (self.frame.read(observations) - self.mean) / self.deviation
        outputs, _ = self.model.predict(np.clip(rows, -10.0, 10.0), deterministic=False)
        return self.frame.command(outputs)


def main(total_timesteps=500_000, duration=200.0, seed=0):
    torch.set_num_threads(1)  # networks this small are slower on several
    scenario = Scenario(n_robots=10, n_items=8, restock=True, duration=duration, **ARENA)
    worlds = SwarmVecEnv(
        make_env=lambda _: MotionFrame(SwarmLogisticsEnv(scenario, rewards=REWARDS)),
        n_worlds=8,
        seed=seed,
    )
    env = SwarmVecNormalize(worlds)
    settings = {"n_steps": 64, "batch_size": 1280, "n_epochs": 6, "gamma": 0.98}
    model = PPO("MlpPolicy", env, learning_rate=1e-3, seed=seed, device="cpu", **settings)
    model.learn(total_timesteps, callback=LogDeliveries())
    learned = Learned(model, env.obs_rms.mean, env.obs_rms.var)
    seeds = range(1000, 1003)
    deliveries = [run_episode(scenario, learned, seed).delivered for seed in seeds]
    scripted = [run_episode(scenario, policies.load("swarm-dt"), seed).delivered for seed in seeds]
    print(f"P on three new seeds: {deliveries}; Swarm D-T's on the same: {scripted}")
    return deliveries, scripted


if __name__ == "__main__":
    main()
