"""The places at which robots wait while a central controller has no work for them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.warehouse.state import NOBODY, STORED, WarehouseState


class WaitingPlaces:
    """Gives each robot an item to wait under, spread out, or a place at the wall.

    Unladen robots drive under items, which laden ones have to go around anyway.
    """

    def __init__(self, n_robots: int) -> None:
        self._item = np.full(n_robots, NOBODY)

    def places(
        self, state: WarehouseState, worker: int, scenario: Scenario
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Return where each robot should wait (N, 2) [m], and which have an item to wait under.

        Args:
            worker: the robot that has no time to wait, or NOBODY.
        """
        free = state.item_status == STORED
        if state.requested != NOBODY:
            free[state.requested] = False
        waits = state.robot_present.copy()
        if worker != NOBODY:
            waits[worker] = False
        item = self._item
        item[~waits | ~free[item]] = NOBODY
        is_taken = np.zeros(len(free), np.bool_)
        is_taken[item[item != NOBODY]] = True
        for robot in np.flatnonzero(waits & (item == NOBODY)).tolist():
            candidates = np.flatnonzero(free & ~is_taken)
            if not len(candidates):
                break
            item[robot] = _loneliest(state, robot, candidates, is_taken)
            is_taken[item[robot]] = True
        has_item = item != NOBODY
        at_the_wall = _rank_and_file(len(item), scenario)
        return np.where(has_item[:, None], state.item_position[item], at_the_wall), has_item


def _loneliest(
    state: WarehouseState, robot: int, candidates: NDArray[np.int64], is_taken: NDArray[np.bool_]
) -> int:
    """Return the candidate farthest from all that are taken, less half the way to it."""
    places = state.item_position[candidates]
    way = np.linalg.norm(places - state.robot_position[robot], axis=1)
    if not is_taken.any():
        return int(candidates[way.argmin()])
    gaps = np.linalg.norm(places[:, None] - state.item_position[is_taken], axis=2).min(axis=1)
    return int(candidates[(gaps - 0.5 * way).argmax()])


def _rank_and_file(n_robots: int, scenario: Scenario) -> NDArray[np.float64]:
    """Return places along the wall opposite the delivery area (N, 2) [m]."""
    pitch = 2 * scenario.robot_radius + 0.1
    per_file = max(int((scenario.warehouse_height - 0.1) / pitch), 1)
    file, rank = np.divmod(np.arange(n_robots), per_file)
    places = np.stack([(file + 0.5) * pitch, (rank + 0.5) * pitch + 0.05], axis=1)
    return np.minimum(places, [scenario.warehouse_width - pitch / 2, np.inf])
