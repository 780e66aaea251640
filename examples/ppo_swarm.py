"""PPO of stable-baselines3 on a swarm: one network steers every robot, all worlds are one batch.

Needs the extra `train`. Robots read and command in the frame of their motion, whose numbers are of
the size that a network likes: statistics of `VecNormalize` around it make the result worse.
"""

from pathlib import Path
from typing import Any

import torch
from stable_baselines3 import PPO

from swarm_logistics_env import Scenario, policies, run_episode, swarm_logistics_v0
from swarm_logistics_env.adapters import LogDeliveries, SwarmVecEnv

ARENA: dict[str, Any] = {"warehouse_width": 6.0, "warehouse_height": 5.0, "delivery_width": 1.5}
# Sparse deliveries alone teach nothing for long; these terms sum to what a delivery is made of.
REWARDS = {
    "own_delivery": 1.0, "lift_requested": 1.0, "approach": 0.5, "stocking": 0.2, "contact": -0.05
}  # fmt: skip


def main(total_timesteps=500_000, duration=200.0, seed=0, file="swarm.zip"):
    torch.set_num_threads(1)  # networks this small are slower on several
    scenario = Scenario(n_robots=10, n_items=8, restock=True, duration=duration, **ARENA)
    worlds = SwarmVecEnv(
        make_env=lambda _: swarm_logistics_v0.parallel_env(
            scenario, view="motion", rewards=REWARDS
        ),
        n_worlds=8,
        seed=seed,
    )
    settings = {"n_steps": 64, "batch_size": 1280, "n_epochs": 6, "gamma": 0.98}
    model = PPO("MlpPolicy", worlds, learning_rate=1e-3, seed=seed, device="cpu", **settings)
    model.learn(total_timesteps, callback=LogDeliveries())
    model.save(file)
    scenario_file = Path(file).with_suffix(".json")
    scenario_file.write_text(scenario.to_json())
    learned = policies.of(model, frame=True)  # its most likely action; `judge` plays it as well
    seeds = range(1000, 1003)
    deliveries = [run_episode(scenario, learned, seed).delivered for seed in seeds]
    scripted = [run_episode(scenario, policies.load("homing"), seed).delivered for seed in seeds]
    print(f"P on three new seeds: {deliveries}; homing's on the same: {scripted}")
    print(f"Judge it: swarm-logistics judge {file} --frame --trust-code --scenario {scenario_file}")
    return deliveries, scripted


if __name__ == "__main__":
    main()
