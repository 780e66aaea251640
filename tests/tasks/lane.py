"""A tiny parallel environment for the tests: robots walk along a lane and deliver at its end."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium.spaces import Box, Discrete
from numpy.typing import NDArray
from pettingzoo import ParallelEnv

from swarm_logistics_env.tasks import ParallelTask

STAY, WALK, BACK = range(3)
OBSERVATIONS = Box(0.0, np.inf, (2,), np.float32)
ACTIONS = Discrete(3)


class Lane(ParallelEnv[str, Any, Any]):  # type: ignore[misc]
    """Each robot starts at a random cell; at the end it delivers and starts again at cell 0.

    A step forward succeeds with probability 0.8. Only one robot may stand on a cell beyond 0, so
    robots that stand still are in the way.
    """

    metadata = {"name": "lane", "is_parallelizable": True}  # noqa: RUF012 - PettingZoo's form
    render_mode = None

    def __init__(self, n_robots: int, length: int = 6, without: tuple[int, ...] = ()) -> None:
        self.length, self.n_robots, self._without = length, n_robots, without
        self.rows = [row for row in range(n_robots) if row not in without]
        self.possible_agents = [f"robot_{row}" for row in self.rows]
        self.agents: list[str] = []

    def observation_space(self, agent: str) -> Box:
        return OBSERVATIONS

    def action_space(self, agent: str) -> Discrete:
        return ACTIONS

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        if seed is not None:
            self._rng = np.random.default_rng(seed)
        self.agents = self.possible_agents[:]
        starts = self._rng.permutation(self.length * 2)[: self.n_robots] % self.length
        self.cells = [int(starts[row]) for row in self.rows]
        return self._observations(), {agent: {} for agent in self.agents}

    def step(self, actions: dict[str, Any]) -> tuple[dict[str, Any], ...]:
        luck = self._rng.random(self.n_robots)
        rewards = dict.fromkeys(self.agents, 0.0)
        for place, agent in enumerate(self.agents):
            step = {STAY: 0, WALK: int(luck[self.rows[place]] < 0.8), BACK: -1}[actions[agent]]
            goal = max(0, self.cells[place] + step)
            if goal > 0 and goal != self.cells[place] and goal in self.cells:
                continue
            self.cells[place] = goal
            if goal == self.length:
                self.cells[place], rewards[agent] = 0, 1.0
        infos = {
            agent: {"distance": self.cells[place] / 4} for place, agent in enumerate(self.agents)
        }
        never = dict.fromkeys(self.agents, False)
        return self._observations(), rewards, never, never, infos

    def _observations(self) -> dict[str, NDArray[np.float32]]:
        return {
            agent: np.array([cell, self.length], dtype=np.float32)
            for agent, cell in zip(self.agents, self.cells)
        }


class Walker:
    """Walks on, but not where it sees nothing."""

    def reset(self, n_robots: int, seed: int) -> None:
        self.n_robots = n_robots

    def act(self, observations: NDArray[np.float32]) -> NDArray[np.int64]:
        return np.where(observations[:, 1] > 0, WALK, STAY)


FAILURES = {"silent": STAY, "frozen": None, "blind": None, "noisy": 0.5, "removed": "without"}
LANE = ParallelTask(
    Lane,
    name="lane",
    n_robots=4,
    steps=40,
    parameters={"length": 6},
    failures=FAILURES,
    policies={"walker": Walker},
)
