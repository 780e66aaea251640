"""Small worlds with robots and items where a test wants them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

from swarm_logistics_env import Fault, Scenario, Warehouse
from swarm_logistics_env.compiler.kernels import uniform
from swarm_logistics_env.core.streams import row_keys
from swarm_logistics_env.world.warehouse import layout

Build = Callable[..., Warehouse]
Command = tuple[float, float, float, float]

STAY: Command = (0.0, 0.0, 0.0, 0.0)
HOLD: Command = (0.0, 0.0, 0.0, 1.0)
OPEN: Command = (0.0, 0.0, 0.0, -1.0)
EAST: Command = (1.0, 0.0, 0.0, 0.0)  # to the delivery area
WEST: Command = (-1.0, 0.0, 0.0, 0.0)
FAR = (1.0, 9.0)  # out of everybody's reach
INSIDE = 8.5  # x in the delivery area, which begins at 8 m
SMALL = Scenario(n_robots=8, n_items=12, warehouse_width=5, warehouse_height=4)


def steps(world: Warehouse, *commands: Command, times: int = 1) -> NDArray[np.float32]:
    """Take `times` steps, each robot with its command; return the last observations."""
    for _ in range(times):
        rows = world.step(commands)
    return rows


def follow(world: Warehouse, script: Iterable[Sequence[Command]]) -> Warehouse:
    """Take a step for each list of commands."""
    for commands in script:
        world.step(commands)
    return world


def ascending(seed: int, purpose: str, n_rows: int) -> NDArray[np.uint64]:
    """Return keys of streams, sorted by the first number of each."""
    keys = row_keys(seed, purpose, n_rows)
    return keys[np.argsort([uniform(key, 0) for key in keys])]


@pytest.fixture
def build(monkeypatch: pytest.MonkeyPatch) -> Build:
    """Return a maker of worlds that were just reset, with everything placed by hand.

    Items are requested in the order of their numbers; all robots look along +x and do not drift.
    """

    def make(
        robots: ArrayLike, items: ArrayLike, faults: Sequence[Fault] = (), **fields: Any
    ) -> Warehouse:
        robot_positions, item_positions = (
            np.array(rows, float).reshape(-1, 2) for rows in (robots, items)
        )
        n = len(robot_positions)
        monkeypatch.setattr(
            layout, "place_robots", lambda *_: (robot_positions.copy(), np.zeros(n))
        )
        monkeypatch.setattr(layout, "place_items", lambda *_: item_positions.copy())
        monkeypatch.setattr(layout, "row_keys", ascending)
        counts = {"n_robots": n, "n_items": len(item_positions)}
        world = Warehouse(Scenario(**{"heading_drift": 0.0, **counts, **fields}))
        world.reset(0, faults)
        return world

    return make
