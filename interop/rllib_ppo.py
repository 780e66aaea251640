"""RLlib: PPO, one policy for all robots by `ParallelPettingZooEnv`, and one for the whole swarm."""

from __future__ import annotations

from typing import Any

import ray
from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.env.wrappers.pettingzoo_env import ParallelPettingZooEnv
from ray.tune.registry import register_env

from interop.conditions import CONDITIONS, MAX_CYCLES, plain, without_fixed_agents
from interop.mpe2_swarm import FewerAgents
from interop.results import fails_on_mpe2_too, passes, runs_with, same_line
from swarm_logistics_env.adapters import CentralEnv
from swarm_logistics_env.wrappers import SwarmSize

ITERATIONS = 2
CENTRAL = "swarm_logistics_central"
LEAVING = "2 of 5 robots leave at 1 s"


def make(config: Any) -> ParallelPettingZooEnv:
    """Return the environment as RLlib's workers make it."""
    makers = {LEAVING: lambda: SwarmSize(plain(), 5, leave=[(2, 1.0)]), **CONDITIONS}
    return ParallelPettingZooEnv(makers[config["condition"]]())


def make_central(config: Any) -> CentralEnv:
    """Return the swarm as one agent, with vectors, in the same conditions."""
    env = CONDITIONS[config["condition"]]()
    return CentralEnv(env, flat=True)


def main() -> None:
    """Train in every condition, with agents that leave, and as one agent."""
    runs_with("ray", "torch", "pettingzoo", "gymnasium")
    ray.init(num_cpus=1, include_dashboard=False)
    register_env("swarm_logistics_v0", make)
    register_env(CENTRAL, make_central)
    for name in (LEAVING, *CONDITIONS):
        train(name, "swarm_logistics_v0")
    for name in CONDITIONS:
        train(name, CENTRAL)
    proof = same_line(
        lambda: rollout(ParallelPettingZooEnv(without_fixed_agents(3))),
        lambda: rollout(ParallelPettingZooEnv(FewerAgents(first=2, then=3))),
    )
    fails_on_mpe2_too("ParallelPettingZooEnv, sizes that change, without FixedAgents", proof)
    ray.shutdown()


def rollout(env: Any) -> None:
    """Play a few episodes with random actions, as Ray's wrapper offers them."""
    for seed in range(8):
        observations, _ = env.reset(seed=seed)
        is_over = False
        while not is_over:
            actions = {agent: env.get_action_space(agent).sample() for agent in observations}
            observations, _, terminated, truncated, _ = env.step(actions)
            is_over = terminated["__all__"] or truncated["__all__"]


def train(name: str, env: str) -> None:
    """Train for two iterations and say how long the episodes were."""
    config = (
        PPOConfig()
        .environment(env, env_config={"condition": name})
        .env_runners(num_env_runners=0)
        .training(train_batch_size_per_learner=200, minibatch_size=100, num_epochs=2)
    )
    if env != CENTRAL:
        config = config.multi_agent(policies={"robot"}, policy_mapping_fn=lambda *_, **__: "robot")
    algorithm = config.build_algo()
    for _ in range(ITERATIONS):
        runners = algorithm.train()["env_runners"]
        length = runners["episode_len_mean"]
        assert length == MAX_CYCLES, length
    algorithm.stop()
    taken = runners["num_env_steps_sampled_lifetime"]
    form = "CentralEnv, flat" if env == CENTRAL else "ParallelPettingZooEnv"
    passes(f"{form}, PPO, {ITERATIONS} iterations, {taken:.0f} steps: {name}")


if __name__ == "__main__":
    main()
