"""Small worlds with robots and items where a test wants them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike

from swarm_logistics_env import Fault, Scenario, Warehouse
from swarm_logistics_env.warehouse import layout


@pytest.fixture
def build(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Warehouse]:
    """Return a maker of worlds that were just reset, with everything placed by hand.

    Items are requested in the order of their numbers. All robots look along +x and do not drift,
    so that forward and left, in commands and observations, are x and y until one turns.
    """

    def make(
        robots: ArrayLike,
        items: ArrayLike,
        faults: Sequence[Fault] = (),
        obstacles: ArrayLike = (),
        **fields: Any,
    ) -> Warehouse:
        places, item_places, solids = (
            np.array(rows, dtype=np.float64).reshape(-1, 2) for rows in (robots, items, obstacles)
        )
        n, n_items = len(places), len(item_places)
        monkeypatch.setattr(layout, "place_robots", lambda *_: (places.copy(), np.zeros(n)))
        monkeypatch.setattr(layout, "place_items", lambda *_: item_places.copy())
        monkeypatch.setattr(layout, "place_obstacles", lambda *_: solids.copy())
        monkeypatch.setattr(layout, "draw_order", lambda *_: None)  # in the order of their numbers
        counts = {"n_robots": n, "n_items": n_items, "n_obstacles": len(solids)}
        scenario = Scenario(**{"heading_drift": 0.0, **counts, **fields})
        world = Warehouse(scenario)
        world.reset(0, faults)
        return world

    return make
