"""A plain PPO loop over PettingZoo's dicts, in the style of its CleanRL tutorial."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import torch
from torch import nn

from interop.conditions import CONDITIONS, MAX_CYCLES, played
from interop.results import passes, runs_with

EPISODES = 6
EPOCHS = 2
BATCH = 50
DISCOUNT, TRACE, CLIP = 0.99, 0.95, 0.2


def main() -> None:
    """Learn in every condition."""
    runs_with("torch", "pettingzoo", "gymnasium")
    for name, make in CONDITIONS.items():
        env = make()
        learn(env)
        passes(f"PPO over the dicts, {EPISODES} updates, {played(name, env)}")


def learn(env: Any) -> None:
    """Collect an episode, update on it, several times over."""
    torch.manual_seed(0)
    agents = env.possible_agents
    n_inputs = env.observation_space(agents[0]).shape[0]
    n_outputs = env.action_space(agents[0]).shape[0]
    actor = nn.Sequential(nn.Linear(n_inputs, 64), nn.Tanh(), nn.Linear(64, n_outputs))
    critic = nn.Sequential(nn.Linear(n_inputs, 64), nn.Tanh(), nn.Linear(64, 1))
    log_deviation = nn.Parameter(torch.zeros(n_outputs))
    learned = [*actor.parameters(), *critic.parameters(), log_deviation]
    optimizer = torch.optim.Adam(learned, lr=2.5e-4)

    def distribution(observations: torch.Tensor) -> Any:
        return torch.distributions.Normal(actor(observations), log_deviation.exp())

    for episode in range(EPISODES):
        rows: dict[str, list[torch.Tensor]] = {
            name: [] for name in ("observation", "action", "log_probability", "reward", "value")
        }
        observations, _ = env.reset(seed=episode)
        while env.agents:
            with torch.no_grad():
                observation = batch(observations, agents)
                policy = distribution(observation)
                action = policy.sample()
                rows["observation"].append(observation)
                rows["action"].append(action)
                rows["log_probability"].append(policy.log_prob(action).sum(-1))
                rows["value"].append(critic(observation).squeeze(-1))
            actions = dict(zip(agents, action.numpy(), strict=True))
            observations, rewards, terminations, truncations, _ = env.step(actions)
            rows["reward"].append(batch(rewards, agents))
        assert not any(terminations.values()), terminations
        assert all(truncations.values()), truncations
        taken = {name: torch.stack(steps) for name, steps in rows.items()}
        assert taken["reward"].shape == (MAX_CYCLES, len(agents)), taken["reward"].shape

        with torch.no_grad():  # cut by time, so the last value counts on
            following = critic(batch(observations, agents)).squeeze(-1)
        advantages = torch.zeros_like(taken["reward"])
        ahead = torch.zeros(len(agents))
        for step in reversed(range(MAX_CYCLES)):
            error = taken["reward"][step] + DISCOUNT * following - taken["value"][step]
            ahead = error + DISCOUNT * TRACE * ahead
            advantages[step] = ahead
            following = taken["value"][step]
        flat = {name: part.flatten(0, 1) for name, part in taken.items()}
        advantage = advantages.flatten()
        returns = advantage + flat["value"]

        for _epoch in range(EPOCHS):
            for chosen in torch.split(torch.randperm(len(advantage)), BATCH):
                policy = distribution(flat["observation"][chosen])
                new = policy.log_prob(flat["action"][chosen]).sum(-1)
                ratio = (new - flat["log_probability"][chosen]).exp()
                scaled = advantage[chosen]
                scaled = (scaled - scaled.mean()) / (scaled.std() + 1e-8)
                gain = torch.min(ratio * scaled, ratio.clamp(1 - CLIP, 1 + CLIP) * scaled).mean()
                value = critic(flat["observation"][chosen]).squeeze(-1)
                loss = 0.5 * (value - returns[chosen]).square().mean() - gain
                optimizer.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(learned, 0.5)
                optimizer.step()
        assert torch.isfinite(loss), loss


def batch(parts: Mapping[str, Any], agents: Sequence[str]) -> torch.Tensor:
    """Return what each agent got as one tensor, a row for each."""
    return torch.as_tensor(np.stack([parts[agent] for agent in agents]), dtype=torch.float32)


if __name__ == "__main__":
    main()
