"""AgileRL: IPPO by its own training loop, in vectors of its own processes."""

from __future__ import annotations

import warnings
from typing import Any

import torch
from agilerl.algorithms import IPPO
from agilerl.training.train_multi_agent_on_policy import train_multi_agent_on_policy
from agilerl.vector.pz_async_vec_env import AsyncPettingZooVecEnv

from interop.conditions import CONDITIONS, MAX_CYCLES, played
from interop.results import passes, runs_with

STEPS = 4 * MAX_CYCLES


def main() -> None:
    """Train in every condition, in one environment and in two processes."""
    runs_with("agilerl", "torch", "pettingzoo", "gymnasium")
    warnings.simplefilter("ignore", DeprecationWarning)
    for name, make in CONDITIONS.items():
        env = make()
        train(env, env)
        passes(f"IPPO, {STEPS} steps, {played(name, env)}")
        vector = AsyncPettingZooVecEnv([make, make])
        train(vector, make())
        vector.close()
        passes(f"IPPO, {STEPS} steps in two processes, {name}")


def train(env: Any, like: Any) -> None:
    """Train for a few updates and check that the robots' policies have changed."""
    agents = like.possible_agents
    learner = IPPO(
        observation_spaces=[like.observation_space(agent) for agent in agents],
        action_spaces=[like.action_space(agent) for agent in agents],
        agent_ids=agents,
        batch_size=16,
        learn_step=MAX_CYCLES,
    )
    before = parameters(learner)
    [trained], fitness = train_multi_agent_on_policy(
        env,
        "swarm_logistics_v0",
        "IPPO",
        [learner],
        max_steps=STEPS,
        evo_steps=STEPS // 2,
        eval_steps=MAX_CYCLES,
        verbose=False,
    )
    after = parameters(trained)
    assert torch.isfinite(after).all()
    assert not torch.equal(after, before)
    assert fitness, fitness


def parameters(learner: IPPO) -> torch.Tensor:
    """Return all parameters of the policies as one vector."""
    each = [torch.nn.utils.parameters_to_vector(a.parameters()) for a in learner.actors.values()]
    return torch.cat(each).detach().clone()


if __name__ == "__main__":
    main()
