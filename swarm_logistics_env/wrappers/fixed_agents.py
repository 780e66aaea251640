"""A wrapper that keeps the same agents from the first step to the last."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swarm_logistics_env.environment.commands import as_array
from swarm_logistics_env.environment.dict_view import ArrayStep, Infos
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.errors import CommandError

from .wrapper import Wrapper


class FixedAgents(Wrapper):
    """Keeps all possible agents until the end of every episode, as some trainers require.

    Arrays have a row for each of the P `possible_agents`. If the robot of an agent is not in this
    episode, or has left it, the agent stays: its observation is zeros, its reward is 0, its command
    is ignored, and its infos say "active" 0 instead of 1. All agents end together. They are
    truncated when the time is up, and terminated when everything is delivered or no robot is
    left. This wrapper has to be the outermost.

    Args:
        env: the environment, or a wrapper of one.

    Raises:
        SetupError: `env` is something else, or has such a wrapper already.

    Example:
        >>> from swarm_logistics_env import swarm_logistics_v0
        >>> env = FixedAgents(swarm_logistics_v0.parallel_env(n_robots=3, max_robots=5))
        >>> observations, infos = env.reset(seed=0)
        >>> {agent: info["active"] for agent, info in infos.items()}
        {'robot_0': 1, 'robot_1': 1, 'robot_2': 1, 'robot_3': 0, 'robot_4': 0}
    """

    is_outermost = True

    def __init__(self, env: SwarmLogisticsEnv | Wrapper) -> None:
        super().__init__(env)
        self.agents: list[str] = []

    @property
    def n_rows(self) -> int:
        """Rows of the arrays: P, one for each possible agent."""
        return len(self.possible_agents)

    def reset_arrays(
        self, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> NDArray[np.float32]:
        """Begin an episode and return the first observations (P, D)."""
        observations = self._padded(super().reset_arrays(seed, options))
        self.agents = list(self.possible_agents)
        return observations

    def step_arrays(self, commands: ArrayLike) -> ArrayStep:
        """Take one control period with commands (P, 4).

        Returns:
            Observations (P, D), rewards (P,), terminations (P,) and truncations (P,), of which all
            or none are True.

        Raises:
            CommandError: wrong shape, not readable or not finite; nothing has happened then.
            SetupError: there was no reset, or the episode is over.
        """
        given = as_array(commands, "commands")
        wanted = (self.n_rows, *self.action_space("robot_0").shape)
        if given.shape != wanted:
            raise CommandError(f"commands of shape {given.shape}: should be {wanted}")
        observations, rewards, _, truncations = super().step_arrays(
            given[: self.warehouse.state.n_robots]
        )
        is_over = not self.env.agents
        is_cut = is_over and bool(truncations.any())
        if is_over:
            self.agents = []
        return (
            self._padded(observations),
            self._padded(rewards),
            np.full(self.n_rows, is_over and not is_cut),
            np.full(self.n_rows, is_cut),
        )

    def _padded(self, rows: NDArray[Any]) -> NDArray[Any]:
        padded = np.zeros((self.n_rows, *rows.shape[1:]), rows.dtype)
        padded[: len(rows)] = rows
        return padded

    def _infos(self, agents: list[str]) -> Infos:
        infos = super()._infos(agents)
        present = self.warehouse.state.robot_present.tolist()
        for place, agent in enumerate(agents):
            infos[agent]["active"] = int(place < len(present) and present[place])
        return infos
