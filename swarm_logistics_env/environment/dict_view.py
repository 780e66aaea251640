"""PettingZoo's methods with dicts, as a view of an environment's array methods."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NoReturn

import numpy as np
from gymnasium.spaces import Box, Space
from numpy.typing import ArrayLike, NDArray
from pettingzoo import ParallelEnv

from swarm_logistics_env.errors import SetupError
from swarm_logistics_env.warehouse import Warehouse

from .requests import gathered

Observations = dict[str, NDArray[np.float32]]
Infos = dict[str, dict[str, float]]
ArrayStep = tuple[NDArray[np.float32], NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_]]


class DictView(ParallelEnv[str, NDArray[np.float32], NDArray[np.float32]]):  # type: ignore[misc]  # PettingZoo ships no types
    """`reset` and `step` for classes that have `reset_arrays` and `step_arrays`.

    So a wrapper that changes the arrays changes the dicts, too.
    """

    agents: list[str]
    warehouse: Warehouse
    is_begun: bool

    def reset_arrays(
        self, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> NDArray[np.float32]:
        """Begin an episode and return the first observations (N, D)."""
        raise NotImplementedError

    def step_arrays(self, commands: ArrayLike) -> ArrayStep:
        """Take one control period; afterwards `agents` are those that go on."""
        raise NotImplementedError

    @property
    def episode_info(self) -> dict[str, float]:
        """The entries of every agent's infos that are about the episode; keys never change."""
        raise NotImplementedError

    @property
    def n_rows(self) -> int:
        """The number of rows of the arrays in this episode: its robots, also absent ones."""
        return self.warehouse.state.n_robots

    @property
    def observation_spaces(self) -> dict[str, Box]:
        """The observation space of every possible agent."""
        return {agent: self.observation_space(agent) for agent in self.possible_agents}

    @property
    def action_spaces(self) -> dict[str, Space[Any]]:
        """The action space of every possible agent."""
        return {agent: self.action_space(agent) for agent in self.possible_agents}

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, Infos]:
        """Begin an episode; see `reset_arrays`. Returns observations and infos by agent.

        Each agent has a dict of infos of its own. It contains numbers, with the same keys at
        every step: "failed" is 1 while any failure mode holds for the robot, else 0; "delivered"
        is the number of items that the whole swarm has delivered; wrappers add `episode_info`.
        """
        observations = self.reset_arrays(seed, options)
        agents = self.agents
        return {agent: observations[_row(agent)] for agent in agents}, self._infos(agents)

    def step(
        self, actions: Mapping[str, ArrayLike]
    ) -> tuple[Observations, dict[str, float], dict[str, bool], dict[str, bool], Infos]:
        """Take one control period; see `step_arrays`.

        Args:
            actions: one command (4,) for every agent in `agents`. Commands for possible agents
                that are not present are ignored, because trainers of fixed size send them.

        Returns:
            Observations, rewards, terminations, truncations and infos (see `reset`) of the agents
            that were present.

        Raises:
            CommandError: `actions` is not a dict, or a command is missing, belongs to an unknown
                agent, cannot be read, has the wrong shape or is not finite.
            SetupError: there was no reset, or the episode is over.
        """
        agents = self.agents
        if not agents:
            self.refuse_to_step()
        wanted = self.action_space(agents[0]).shape
        commands = gathered(actions, agents, self.possible_agents, wanted)
        outcome: tuple[NDArray[Any], ...]
        if len(agents) == self.n_rows:
            outcome = self.step_arrays(commands)
        else:
            rows = [_row(agent) for agent in agents]
            placed = np.zeros((self.n_rows, *wanted))
            placed[rows] = commands
            outcome = tuple(part[rows] for part in self.step_arrays(placed))
        observations, rewards, terminations, truncations = outcome
        return (
            dict(zip(agents, observations, strict=True)),
            dict(zip(agents, rewards.tolist(), strict=True)),
            dict(zip(agents, terminations.tolist(), strict=True)),
            dict(zip(agents, truncations.tolist(), strict=True)),
            self._infos(agents),
        )

    def refuse_to_step(self) -> NoReturn:
        """Raise the SetupError that says why nobody can take a step."""
        when = "after the end of the episode" if self.is_begun else "before reset"
        raise SetupError(f"step {when}: call reset(seed) first")

    def _infos(self, agents: list[str]) -> Infos:
        # Robots do not sense who failed; infos are for those who train or evaluate them.
        sound = {"failed": 0, **self.episode_info}
        infos = {agent: sound.copy() for agent in agents}
        for agent in agent_names(np.flatnonzero(self.warehouse.state.failed).tolist()):
            if agent in infos:
                infos[agent]["failed"] = 1
        return infos


def agent_names(rows: Sequence[int]) -> list[str]:
    """Return the names of the robots in these rows."""
    return [f"robot_{row}" for row in rows]


def _row(agent: str) -> int:
    return int(agent[6:])
