"""A policy at work in a warehouse, one control period at a time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.errors import CommandError, PolicyError
from swarm_logistics_env.policies.policy import Policy, decide, start
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.warehouse import Fault, Warehouse


class Play:
    """An episode in the making: the same bits as `run_episode` if nobody interferes.

    Attributes:
        world: the warehouse; its scenario and faults may be changed between two steps.
        seed: of the episode.

    Raises:
        FaultError, ScenarioError: as `Warehouse.reset`.
    """

    def __init__(
        self, scenario: Scenario, policy: Policy, seed: int, faults: Sequence[Fault] = ()
    ) -> None:
        self.world = Warehouse(scenario)
        self._policy, self.seed = policy, seed
        self._observations = self.world.reset(seed, faults)
        start(policy, scenario, seed)

    @property
    def is_over(self) -> bool:
        """Whether the time is up or everything is delivered."""
        return self.world.is_over_time or self.world.all_delivered

    def sensed(self, robot: int) -> NDArray[np.float32]:
        """Return the observation row (D,) that `robot` acts on next."""
        row: NDArray[np.float32] = self._observations[robot]
        return row

    def step(self) -> None:
        """Take one control period; nothing once the episode is over.

        Raises:
            PolicyError: the policy returned commands of the wrong shape, or not finite.
        """
        if self.is_over:
            return
        commands = decide(self._policy, self._observations, self.world.state)
        try:
            self._observations = self.world.step(commands)
        except CommandError as error:
            raise PolicyError(
                f"{type(self._policy).__name__} at {self.world.state.time:g} s: {error}"
            ) from error
