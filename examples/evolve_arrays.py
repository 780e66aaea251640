"""A learning loop on the array methods: an evolution strategy moves Swarm D-T's two rates.

One row a robot, no dicts: observations (N, D) in, commands (N, 4) out.
"""

from __future__ import annotations

import numpy as np

from swarm_logistics_env import policies, swarm_logistics_v0
from swarm_logistics_env.policies.policy import start

START = {"taxis_gain": 0.3, "drop_rate": 0.5}


def episode_return(env, logarithms, seed):
    """Play one episode with these rates and return what every robot earned on average."""
    rates = dict(zip(START, np.exp(logarithms).tolist()))
    policy = policies.load("swarm-dt", **rates)
    observations = env.reset_arrays(seed=seed)
    start(policy, env.warehouse.scenario, seed)
    total = 0.0
    while env.agents:
        observations, rewards, *_ends = env.step_arrays(policy.act(observations))
        total += rewards.mean()
    return total


def main(generations=20, pairs=6, duration=200.0):
    env = swarm_logistics_v0.parallel_env(duration=duration)
    rng = np.random.default_rng(0)
    logarithms = np.log(list(START.values()))
    for generation in range(generations):
        steps = rng.normal(0.0, 0.3, size=(pairs, len(logarithms)))
        # Both directions on the same seed: what differs is the step, not the luck.
        gains = [
            episode_return(env, logarithms + step, seed=generation * pairs + pair)
            - episode_return(env, logarithms - step, seed=generation * pairs + pair)
            for pair, step in enumerate(steps)
        ]
        gains = np.array(gains) / max(np.abs(gains).max(), 1e-9)
        logarithms = logarithms + 0.3 * (gains @ steps) / pairs
        rates = dict(zip(START, np.exp(logarithms).round(2).tolist()))
        print(f"generation {generation}: {rates}")
    print(f"return on a new seed: {episode_return(env, logarithms, seed=10_000):.1f}")
    return rates


if __name__ == "__main__":
    main()
