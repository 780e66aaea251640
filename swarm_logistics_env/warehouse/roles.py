"""What each robot is doing, as faults that strike by role ask it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .structs import NOBODY

if TYPE_CHECKING:
    from .state import WarehouseState

ROLES = {
    "carrier": "carries the requested item",
    "neighbour": "the carrier sees it with its cameras",
    "in_area": "in the delivery area",
    "shuffling": "carries an item that is not requested",
    "searching": "empty, anywhere else",
}


def roles_of(state: WarehouseState) -> NDArray[np.str_]:
    """Return the role of each robot now, a key of `ROLES`, shape (N,); "" for an absent robot.

    A robot that fits several roles has the first of them.
    """
    roles = np.full(state.n_robots, "searching", dtype="<U9")
    roles[state.robot_item != NOBODY] = "shuffling"
    roles[state.robot_in_delivery] = "in_area"
    carrier = _carrier(state)
    if carrier != NOBODY:
        to_carrier = state.robot_position - state.robot_position[carrier]
        is_near = np.hypot(*to_carrier.T) <= state.view_range[carrier]
        roles[is_near] = "neighbour"
        roles[carrier] = "carrier"
    roles[~state.robot_present] = ""
    return roles


def robots_in_role(state: WarehouseState, role: str, count: int) -> NDArray[np.int64]:
    """Return the numbers of `count` robots, ascending: those in the role first.

    Among robots alike, those nearest to the requested item come first; so the sets of 1, 2, 3
    robots are nested.
    """
    distance = np.zeros(state.n_robots)
    if state.requested != NOBODY:
        away = state.robot_position - state.item_position[state.requested]
        distance = np.hypot(*away.T)
    is_other = roles_of(state) != role
    order = np.lexsort((distance, is_other, ~state.robot_present))
    return np.sort(order[:count]).astype(np.int64)


def _carrier(state: WarehouseState) -> int:
    asked = state.requested
    return int(state.item_carrier[asked]) if asked != NOBODY else NOBODY
