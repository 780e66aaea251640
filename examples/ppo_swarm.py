"""PPO on a swarm: one network steers every robot, and robots of several worlds are one batch.

Needs the extra `train`. Untrained, P is 0 on all three new seeds; after 400,000 steps it was 2, 3
and 3, with Swarm D-T at 2 to 10: learning begins. `swarm-logistics train` goes further.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from stable_baselines3 import PPO

from swarm_logistics_env import Scenario, run_episode
from swarm_logistics_env.adapters import LogDeliveries, SwarmVecEnv

ARENA: dict[str, Any] = {
    "warehouse_width": 4.0,
    "warehouse_height": 4.0,
    "delivery_width": 1.0,
    "n_items": 15,
}
# Sparse deliveries alone teach nothing for long; these terms sum to what a delivery is made of.
REWARDS = {"delivery": 1.0, "lift_requested": 1.0, "approach": 0.5}


class Learned:
    """A model of stable-baselines3 as a policy."""

    def __init__(self, model):
        self.model = model

    def reset(self, n_robots, seed):
        self.model.set_random_seed(seed)

    def act(self, observations):
        commands, _ = self.model.predict(observations, deterministic=False)
        return np.asarray(commands, dtype=np.float64)


def main(total_timesteps=500_000, duration=60.0, seed=0):
    # Swarms of 3 and 6 side by side: rows do not depend on N, so one network serves both.
    env = SwarmVecEnv(
        n_worlds=4, n_robots=[3, 6], seed=seed, duration=duration, rewards=REWARDS, **ARENA
    )
    model = PPO("MlpPolicy", env, n_steps=128, batch_size=576, gamma=0.99, seed=seed, device="cpu")
    model.learn(total_timesteps, callback=LogDeliveries())
    scenario = Scenario(n_robots=6, duration=duration, **ARENA)
    delivered = [run_episode(scenario, Learned(model), seed).delivered for seed in range(3)]
    print(f"P on three new seeds: {delivered}")
    return delivered


if __name__ == "__main__":
    main()
