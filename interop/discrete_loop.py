"""A loop in the style of EPyMARL: tuples of agents, actions by number, value decomposition."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from torch import nn

from interop.conditions import CONDITIONS, MAX_CYCLES, played
from interop.results import passes, runs_with
from swarm_logistics_env.wrappers import DiscreteActions

EPISODES = 12
BATCH = 64
DISCOUNT = 0.99


class TupleEnv:
    """What EPyMARL makes of a parallel environment: tuples over agents, in a fixed order."""

    def __init__(self, env: Any) -> None:
        self.env = env
        env.reset(seed=0)
        self.agents = list(env.agents)
        assert self.agents == env.possible_agents
        self.n_actions = int(env.action_spaces[self.agents[0]].n)
        self.n_inputs = int(env.observation_spaces[self.agents[0]].shape[0])

    def reset(self, seed: int) -> tuple[Any, ...]:
        """Begin an episode and return an observation for each agent."""
        observations, _ = self.env.reset(seed=seed)
        return tuple(observations[agent] for agent in self.agents)

    def step(self, actions: list[int]) -> tuple[tuple[Any, ...], list[float], bool, bool]:
        """Return observations and rewards of all agents, and whether the episode is over or cut."""
        outcome = self.env.step(dict(zip(self.agents, actions, strict=True)))
        observations, rewards, terminations, truncations, _ = outcome
        assert list(observations) == self.agents
        return (
            tuple(observations[agent] for agent in self.agents),
            [rewards[agent] for agent in self.agents],
            all(terminations.values()),
            all(truncations.values()),
        )


def main() -> None:
    """Learn for a few episodes in every condition."""
    runs_with("torch", "pettingzoo", "gymnasium")
    for name, make in CONDITIONS.items():
        env = make(DiscreteActions)
        steps, loss = learn(TupleEnv(env))
        assert np.isfinite(loss), loss
        passes(f"VDN as in EPyMARL, actions by number, {steps} steps, {played(name, env)}")


def learn(env: TupleEnv) -> tuple[int, float]:
    """Learn one network for all agents, the sum of whose values is the team's."""
    torch.manual_seed(0)
    rng = np.random.default_rng(0)
    network = nn.Sequential(nn.Linear(env.n_inputs, 64), nn.ReLU(), nn.Linear(64, env.n_actions))
    before = parameters(network)
    optimizer = torch.optim.Adam(network.parameters(), lr=5e-4)
    kept: list[tuple[Any, ...]] = []
    last = 0.0
    for episode in range(EPISODES):
        seen = np.stack(env.reset(episode))
        is_over = is_cut = False
        while not (is_over or is_cut):
            with torch.no_grad():
                values = network(torch.as_tensor(seen))
            explored = rng.random(len(seen)) < 0.5
            drawn = rng.integers(env.n_actions, size=len(seen))
            actions = np.where(explored, drawn, values.argmax(1).numpy())
            rows, rewards, is_over, is_cut = env.step(actions.tolist())
            following = np.stack(rows)
            kept.append((seen, actions, np.float32(sum(rewards)), following, is_over))
            seen = following
        chosen = [kept[place] for place in rng.integers(len(kept), size=BATCH)]
        before_, taken, paid, after, over = (
            torch.as_tensor(np.stack(part)) for part in zip(*chosen, strict=True)
        )
        told = network(before_).gather(2, taken.unsqueeze(2)).squeeze(2).sum(1)
        with torch.no_grad():
            best = network(after).max(2).values.sum(1)
        loss = (told - paid - DISCOUNT * best * ~over).square().mean()
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        last = float(loss.detach())
    assert len(kept) == EPISODES * MAX_CYCLES, len(kept)
    assert not torch.equal(parameters(network), before)
    return len(kept), last


def parameters(network: nn.Module) -> torch.Tensor:
    """Return all parameters of a network as one vector."""
    return nn.utils.parameters_to_vector(network.parameters()).detach().clone()


if __name__ == "__main__":
    main()
