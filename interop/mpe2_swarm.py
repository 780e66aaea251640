"""MPE2's simple_spread with fewer agents than it could have, to tell whose failure it is."""

from __future__ import annotations

from typing import Any

import numpy as np
from mpe2 import simple_spread_v3
from pettingzoo import ParallelEnv

MAX_CYCLES = 20


class FewerAgents(ParallelEnv):  # type: ignore[misc]  # PettingZoo ships no types
    """Three agents are possible; `first` of them take part in the first episode, then `then`."""

    def __init__(self, first: int = 3, then: int = 2) -> None:
        self.env: Any = simple_spread_v3.parallel_env(
            max_cycles=MAX_CYCLES, continuous_actions=True
        )
        self.metadata = self.env.metadata
        self.possible_agents = list(self.env.possible_agents)
        self.observation_spaces = dict(self.env.observation_spaces)
        self.action_spaces = dict(self.env.action_spaces)
        self.render_mode = None
        self._n_agents, self._then = first, then

    def reset(self, seed: int | None = None, options: Any = None) -> tuple[Any, Any]:
        """Begin an episode."""
        observations, _ = self.env.reset(seed=seed, options=options)
        self.agents = self.possible_agents[: self._n_agents]
        self._n_agents = self._then
        return self._of_those_there(observations), self._infos()

    def step(self, actions: dict[str, Any]) -> Any:
        """Take a step."""
        full = {
            agent: actions.get(agent, np.zeros(space.shape, np.float32))
            for agent, space in self.action_spaces.items()
        }
        outcome = [self._of_those_there(part) for part in self.env.step(full)[:4]]
        outcome.append(self._infos())
        if not self.env.agents:
            self.agents = []
        return tuple(outcome)

    def observation_space(self, agent: str) -> Any:
        """Return the agent's space, always the same object."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> Any:
        """Return the agent's space, always the same object."""
        return self.action_spaces[agent]

    def close(self) -> None:
        """Close the environment."""
        self.env.close()

    def _infos(self) -> dict[str, Any]:
        # Not empty, as MPE2's are, since TorchRL reads infos before observations.
        return {agent: {"active": 1} for agent in self.agents}

    def _of_those_there(self, part: dict[str, Any]) -> dict[str, Any]:
        return {agent: part[agent] for agent in self.agents}
