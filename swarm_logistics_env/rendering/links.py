"""The neighbour that a robot follows: the one that tells the lowest timer."""

from __future__ import annotations

import numpy as np

from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.warehouse.state import NOBODY, WarehouseState


def followed(state: WarehouseState, scenario: Scenario, robot: int) -> int:
    """Return the neighbour whose timer is the lowest that `robot` hears, or NOBODY.

    If several tell the same, it is the nearest of them.
    """
    if not (state.robot_present[robot] and state.hears[robot]):
        return NOBODY
    offset = state.robot_position - state.robot_position[robot]
    square = (offset * offset).sum(axis=1)
    heard = state.robot_present & state.sends & (square <= scenario.radio_range**2)
    heard &= ~np.isnan(state.robot_told)
    heard[robot] = False
    candidates = np.flatnonzero(heard)
    if not candidates.size:
        return NOBODY
    order = np.lexsort((square[candidates], state.robot_told[candidates]))
    return int(candidates[order[0]])
