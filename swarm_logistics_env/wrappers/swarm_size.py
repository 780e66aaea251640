"""Wrappers for swarms of several sizes, for robots that leave, and for agents that stay."""

from __future__ import annotations

import operator
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swarm_logistics_env.core.errors import SetupError
from swarm_logistics_env.core.streams import generator
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.environment.requests import (
    check_somebody_is_there,
    faults_among,
    numbers_of,
    scenario_fields,
)
from swarm_logistics_env.environment.spaces import ArrayStep, InfosByRobot, agent_names
from swarm_logistics_env.world.scenario import Scenario
from swarm_logistics_env.world.warehouse import Fault
from swarm_logistics_env.world.warehouse.faults import failed_robots

from .action_forms import ACTION_MASK, STAY
from .wrapper import Wrapper, as_choices, draw


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
        observations = self._pad(super().reset_arrays(seed, options))
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
        shape = (self.n_rows, *(self.action_space("robot_0").shape or ()))
        rows = numbers_of(commands, "commands", shape)
        observations, rewards, _, truncations = super().step_arrays(
            rows[: self.warehouse.state.n_robots]
        )
        is_over = not self.env.agents
        is_cut = is_over and bool(truncations.any())
        if is_over:
            self.agents = []
        return (
            self._pad(observations),
            self._pad(rewards),
            np.full(self.n_rows, is_over and not is_cut),
            np.full(self.n_rows, is_cut),
        )

    @property
    def robot_info(self) -> dict[str, NDArray[Any]]:
        """Its entries have P rows; who is not there may only stay."""
        padded = {name: self._pad(rows) for name, rows in self.env.robot_info.items()}
        if ACTION_MASK in padded:
            padded[ACTION_MASK][self.warehouse.state.n_robots :, STAY] = 1
        return padded

    def _pad(self, rows: NDArray[Any]) -> NDArray[Any]:
        padded = np.zeros((self.n_rows, *rows.shape[1:]), rows.dtype)
        padded[: len(rows)] = rows
        return padded

    def _infos(self, agents: list[str]) -> InfosByRobot:
        infos = super()._infos(agents)
        present = self.warehouse.state.robot_present.tolist()
        for row, agent in enumerate(agents):
            infos[agent]["active"] = int(row < len(present) and present[row])
        return infos


class SwarmSize(Wrapper):
    """Plays each episode with a swarm size of its own, and lets robots leave.

    `possible_agents` are those of the largest swarm, or `max_robots` of the environment if that
    is more. A robot that leaves terminates, and is gone from `agents` for the rest of the episode.
    The robots that leave first are those that would fail first (see `Fault`), so that P_S and P_F
    of one seed are about the same robots. A size in the options of a reset replaces the drawn one.

    Args:
        env: the environment, or a wrapper of one.
        sizes: the swarm size N, or a list to draw from in each episode.
        leave: pairs (robots, time [s]): at each time that many more robots leave.

    Raises:
        ScenarioError: a swarm of such a size is not allowed.
        SetupError: no size is listed, or all robots leave at 0 s.
        FaultError: a time of leaving is not allowed, or more robots leave than there are.

    Example:
        >>> from swarm_logistics_env import swarm_logistics_v0
        >>> env = SwarmSize(swarm_logistics_v0.parallel_env(), [5, 12], leave=[(2, 100.0)])
        >>> observations, infos = env.reset(seed=0)
        >>> len(observations) in (5, 12), len(env.possible_agents)
        (True, 12)
    """

    def __init__(
        self,
        env: SwarmLogisticsEnv | Wrapper,
        sizes: int | Sequence[int],
        *,
        leave: Sequence[tuple[int, float]] = (),
    ) -> None:
        super().__init__(env)
        self._sizes = as_choices("n_robots", list(sizes) if isinstance(sizes, Sequence) else sizes)
        pairs = _departures(leave)
        # The sets are nested: the first m + k robots contain the m that have left.
        in_all = np.cumsum([robots for robots, _ in pairs], dtype=np.int64).tolist()
        self._departures = tuple(
            Fault("removed", count, onset=time) for count, (_, time) in zip(in_all, pairs)
        )
        self.scenarios: tuple[Scenario, ...] = self._declare("n_robots", self._sizes)
        largest = max(
            self.unwrapped.max_robots or 0, *(scenario.n_robots for scenario in self.scenarios)
        )
        self.unwrapped.possible_agents = agent_names(range(largest))

    def plan(self, seed: int, options: dict[str, Any]) -> dict[str, Any]:
        """Return the options with this episode's size and departures among them."""
        size = draw(self._sizes, generator(seed, "swarm size", self._n_alike_inside()))
        faults = (*faults_among(options, self.unwrapped.faults), *self._departures)
        scenario = {"n_robots": size, **scenario_fields(options)}
        return {**options, "scenario": scenario, "faults": faults}

    def declare_spaces(self, scenario: Scenario) -> None:
        """Widen the spaces for `scenario`; see `SwarmLogisticsEnv.declare_spaces`.

        Raises:
            FaultError: more robots are to leave than `scenario` has.
            SetupError: all of them are to leave at 0 s.
        """
        for fault in self._departures:
            failed_robots(fault, 0, scenario)
        check_somebody_is_there(self._departures, 0, scenario)
        self.env.declare_spaces(scenario)


def _departures(leave: Sequence[tuple[int, float]]) -> list[tuple[int, float]]:
    try:
        pairs = [(operator.index(robots), float(time)) for robots, time in leave]
    except (TypeError, ValueError):
        raise SetupError(
            f"leave = {leave!r}: should be pairs (robots, time [s]), as [(2, 100.0)]"
        ) from None
    for robots, _ in pairs:
        if robots < 1:
            raise SetupError(f"leave = {leave!r}: should name at least one robot each time")
    return sorted(pairs, key=lambda pair: pair[1])
