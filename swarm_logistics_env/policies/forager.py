"""Forager: Swarm D-T where every item is wanted, the scripted policy of the foraging task."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import observations as row
from swarm_logistics_env.policies.swarm_dt import SwarmDT


class Forager(SwarmDT):
    """Searches and heads home as Swarm D-T does, with whatever item it carries.

    It never puts an item down: what it lifts it takes to the neighbour with the lowest timer.
    """

    def act(self, observations: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return commands (N, 4) for observation rows (N, D)."""
        rows = observations.copy()
        rows[:, row.CARRYING_REQUESTED] = rows[:, row.CARRYING]
        return super().act(rows)
