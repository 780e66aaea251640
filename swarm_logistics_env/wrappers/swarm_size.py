"""A wrapper for swarms of several sizes, and for robots that leave."""

from __future__ import annotations

import operator
from collections.abc import Sequence
from typing import Any

import numpy as np

from swarm_logistics_env.environment.dict_view import agent_names
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.environment.reset_options import faults_among, scenario_fields
from swarm_logistics_env.errors import SetupError
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.streams import generator
from swarm_logistics_env.warehouse import Fault

from .sampling import Distribution, Sampler
from .wrapper import Wrapper


class SwarmSize(Wrapper):
    """Plays each episode with a swarm size of its own, and lets robots leave.

    `possible_agents` are those of the largest swarm, or `max_robots` of the environment if that
    is more. A robot that leaves terminates, and is gone from `agents` for the rest of the episode.
    The robots that leave first are those that would fail first (see `Fault`), so that P_S and P_F
    of one seed are about the same robots. A size in the options of a reset replaces the drawn one.

    Args:
        env: the environment, or a wrapper of one.
        sizes: the swarm size N, a list to draw from in each episode, or a function of a numpy
            Generator.
        within: (smallest, largest) size that a function returns; required with a function.
        leave: pairs (robots, time [s]): at each time that many more robots leave.

    Raises:
        ScenarioError: a swarm of such a size is not allowed.
        SetupError: a function comes without `within`, more robots leave than there are, or all of
            them leave at 0 s.
        FaultError: a time of leaving is not allowed.

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
        sizes: int | Sequence[int] | Distribution,
        *,
        within: tuple[int, int] | None = None,
        leave: Sequence[tuple[int, float]] = (),
    ) -> None:
        super().__init__(env)
        if isinstance(sizes, tuple | range):
            sizes = list(sizes)
        self._size = Sampler("n_robots", sizes, within)
        pairs = _departures(leave)
        self._leaving = sum(robots for robots, _ in pairs)
        self._absent = sum(robots for robots, time in pairs if time == 0.0)
        # The sets are nested: the first m + k robots contain the m that have left.
        in_all = np.cumsum([robots for robots, _ in pairs], dtype=np.int64).tolist()
        self._departures = tuple(
            Fault("removed", count, onset=time) for count, (_, time) in zip(in_all, pairs)
        )
        self.scenarios: tuple[Scenario, ...] = tuple(
            dict.fromkeys(
                known.replace(n_robots=size)
                for known in self.env.scenarios
                for size in self._size.ends
            )
        )
        for scenario in self.scenarios:
            self.declare_spaces(scenario)
        sizes_announced = (scenario.n_robots for scenario in self.scenarios)
        largest = max(self.unwrapped.max_robots or 0, *sizes_announced)
        self.unwrapped.possible_agents = agent_names(range(largest))

    def plan(self, seed: int, options: dict[str, Any]) -> dict[str, Any]:
        """Return the options with this episode's size and departures among them."""
        size = self._size.sample(generator(seed, "swarm size", self._place()))
        faults = (*faults_among(options, self.unwrapped.faults), *self._departures)
        scenario = {"n_robots": size, **scenario_fields(options)}
        return {**options, "scenario": scenario, "faults": faults}

    def declare_spaces(self, scenario: Scenario) -> None:
        """Widen the spaces for `scenario`; see `SwarmLogisticsEnv.declare_spaces`.

        Raises:
            SetupError: more robots are to leave than `scenario` has, or all of them at 0 s.
        """
        if self._absent >= scenario.n_robots:
            raise SetupError(
                f"leave: {self._absent} robots at 0 s, should be fewer than n_robots = "
                f"{scenario.n_robots}, or the episode would begin with nobody"
            )
        if self._leaving > scenario.n_robots:
            raise SetupError(
                f"leave: {self._leaving} robots in all, should be at most n_robots = "
                f"{scenario.n_robots}"
            )
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
