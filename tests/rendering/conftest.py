"""States with robots and items where a test wants them, without a world that moves them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from swarm_logistics_env import Scenario
from swarm_logistics_env.warehouse import WarehouseState

Situation = tuple[WarehouseState, Scenario]


def situation(robots: ArrayLike, items: ArrayLike = ((5, 5),), **fields: Any) -> Situation:
    """Return a state: all robots present and sound, silent, looking along +x."""
    places, item_places = (
        np.array(rows, dtype=np.float64).reshape(-1, 2) for rows in (robots, items)
    )
    scenario = Scenario(n_robots=len(places), n_items=len(item_places), **fields)
    state = WarehouseState(scenario)
    state.robot_position, state.item_position = places, item_places
    state.sends[:], state.hears[:] = True, True
    return state, scenario
