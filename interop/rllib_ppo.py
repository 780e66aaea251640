"""RLlib: two iterations of PPO, one policy for all robots, through `ParallelPettingZooEnv`."""

from __future__ import annotations

from typing import Any

import ray
from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.env.wrappers.pettingzoo_env import ParallelPettingZooEnv
from ray.tune.registry import register_env

from interop.versions import versions
from swarm_logistics_env import swarm_logistics_v0
from swarm_logistics_env.wrappers import SwarmSize

ITERATIONS = 2


MAX_CYCLES = 50


def make(config: Any) -> ParallelPettingZooEnv:
    """Return the environment as RLlib's workers make it."""
    env = swarm_logistics_v0.parallel_env(n_robots=5, max_cycles=MAX_CYCLES)
    if config["varies"]:
        env = SwarmSize(env, [3, 5], leave=[(2, 1.0)])
    return ParallelPettingZooEnv(env)


def main() -> None:
    """Train in a swarm of fixed size, then in one of 3 or 5 robots of whom 2 leave."""
    print(versions("ray", "torch", "pettingzoo", "gymnasium"))
    ray.init(num_cpus=1, include_dashboard=False)
    register_env("swarm_logistics_v0", make)
    for varies in (False, True):
        train(varies)
    ray.shutdown()


def train(varies: bool) -> None:
    """Train for two iterations and say how long the episodes were."""
    config = (
        PPOConfig()
        # Its check of the environment expects the same agents after every reset, so it passes or
        # fails by the sizes that happen to be drawn.
        .environment(
            "swarm_logistics_v0", env_config={"varies": varies}, disable_env_checking=varies
        )
        .env_runners(num_env_runners=0)
        .multi_agent(policies={"robot"}, policy_mapping_fn=lambda *_, **__: "robot")
        .training(train_batch_size_per_learner=200, minibatch_size=100, num_epochs=2)
    )
    algorithm = config.build_algo()
    name = "size varies, robots leave" if varies else "fixed size"
    for iteration in range(1, ITERATIONS + 1):
        runners = algorithm.train()["env_runners"]
        length = runners["episode_len_mean"]
        assert length == MAX_CYCLES, length
        taken = runners["num_env_steps_sampled_lifetime"]
        print(f"{name}, iteration {iteration}: {taken:.0f} steps, episodes of {length:.0f}")
    algorithm.stop()


if __name__ == "__main__":
    main()
