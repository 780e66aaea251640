"""A tiny parallel environment for the tests."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium.spaces import Box, Discrete
from numpy.typing import NDArray
from pettingzoo import ParallelEnv

from swarm_logistics_env.study.tasks import ParallelTask

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
        self.length, self.n_robots = length, n_robots
        self.rows = {f"robot_{row}": row for row in range(n_robots) if row not in without}
        self.possible_agents, self.agents = [*self.rows], list[str]()

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
        starts = self._rng.permutation(self.length * 2) % self.length
        self.cells = {agent: int(starts[row]) for agent, row in self.rows.items()}
        return self._observations(), {agent: {} for agent in self.agents}

    def step(self, actions: dict[str, Any]) -> tuple[dict[str, Any], ...]:
        luck, rewards = self._rng.random(self.n_robots), dict.fromkeys(self.agents, 0.0)
        for agent, cell in self.cells.items():
            step = {STAY: 0, WALK: int(luck[self.rows[agent]] < 0.8), BACK: -1}[actions[agent]]
            goal = max(0, cell + step)
            if goal in (0, cell) or goal not in self.cells.values():
                self.cells[agent], rewards[agent] = goal % self.length, float(goal == self.length)
        infos = {agent: {"distance": cell / 4} for agent, cell in self.cells.items()}
        never = dict.fromkeys(self.agents, False)
        return self._observations(), rewards, never, never, infos

    def _observations(self) -> dict[str, Any]:
        return {a: np.array([c, self.length], np.float32) for a, c in self.cells.items()}


class Walker:
    """Walks on, but not where it sees nothing."""

    def reset(self, n_robots: int, seed: int) -> None:
        self.n_robots = n_robots

    def act(self, observations: NDArray[np.float32]) -> NDArray[np.int64]:
        return np.where(observations[:, 1] > 0, WALK, STAY)


FAILURES = {"silent": STAY, "frozen": None, "blind": None, "noisy": 0.5, "removed": "without"}
OF_LANE: dict[str, Any] = {"name": "lane", "failures": FAILURES, "policies": {"walker": Walker}}
LANE = ParallelTask(Lane, n_robots=4, steps=40, parameters={"length": 6}, **OF_LANE)
