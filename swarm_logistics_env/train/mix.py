"""Episodes of several kinds, drawn anew each time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from swarm_logistics_env.environment.reset_options import faults_among, scenario_fields
from swarm_logistics_env.streams import generator
from swarm_logistics_env.train.settings import Conditions
from swarm_logistics_env.warehouse import Fault
from swarm_logistics_env.wrappers import Wrapper

if TYPE_CHECKING:
    from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv


class EpisodeMix(Wrapper):
    """Plays each episode under conditions drawn from several kinds, by the episode's seed.

    Args:
        env: the environment, or a wrapper of one.
        kinds: what is drawn from; none: every episode is as the environment has it.

    Raises:
        ScenarioError, SetupError: a scenario among them cannot be.
    """

    def __init__(self, env: SwarmLogisticsEnv | Wrapper, kinds: Sequence[Conditions]) -> None:
        super().__init__(env)
        self._kinds = tuple(kinds)
        weights = np.array([kind.weight for kind in kinds])
        self._shares = weights / weights.sum() if len(weights) else weights
        own = self.unwrapped.scenario
        for kind in kinds:
            for name, values in kind.scenario.items():
                for value in values:
                    self.env.declare_spaces(own.replace(**{name: value}))

    def plan(self, seed: int, options: dict[str, Any]) -> dict[str, Any]:
        """Return the options with this episode's conditions among them."""
        if not self._kinds:
            return options
        rng = generator(seed, "kind of episode")
        kind = self._kinds[int(rng.choice(len(self._kinds), p=self._shares))]
        drawn = {
            name: values[int(rng.integers(len(values)))] for name, values in kind.scenario.items()
        }
        faults = faults_among(options, self.unwrapped.faults)
        if kind.modes:
            mode = kind.modes[int(rng.integers(len(kind.modes)))]
            robots = kind.robots[int(rng.integers(len(kind.robots)))]
            faults = (*faults, Fault(mode, robots, onset=float(rng.uniform(*kind.onset))))
        return {**options, "scenario": {**drawn, **scenario_fields(options)}, "faults": faults}
