"""Central control with a stock: items lie beside the delivery area or are held in it.

A robot that waits under an item far from the delivery area lifts it. It holds the item inside, or
puts it down at a free slot where enough robots hold one. The slots are two rows in front of the
area, with gaps between them that laden robots drive through. The others wait under items and work
on requests as in `central`.

The constants are fitted, for the most deliveries in the paper's world with `restock` at N = 25.
Only seeds from 400,000 to 400,002 were used.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.kernels import kernel
from swarm_logistics_env.policies.central import REPLAN, Central
from swarm_logistics_env.policies.routes import cost_to_go
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.warehouse.floor_cells import floor_map
from swarm_logistics_env.warehouse.state import NOBODY, STORED, WarehouseState

# Lengths in m.
HELD_SHARE = 0.5  # of the robots hold items at most
SLOT_PITCH = 0.6
ROWS = (0.35, 0.85)  # distances of the rows of slots from the area
SLOT_RADIUS = 0.2  # an item this near takes a slot
SLOT_IN_SIGHT = 1.0  # from here on a robot drives straight to its slot
ARRIVAL_RADIUS = 0.1
HOLDING_DEPTH = 0.4  # of robots that hold items, in the area


class CentralStock(Central):
    """Central control that takes items to the delivery area before anybody asks; needs the state.

    Example:
        >>> from swarm_logistics_env import Scenario, run_episode
        >>> run_episode(Scenario(n_robots=5, duration=20.0), CentralStock(), seed=0).delivered > 0
        True
    """

    laden_wait = False

    def configure(self, scenario: Scenario) -> None:
        """Take the sizes of the warehouse and of the robots, and the floor plan."""
        super().configure(scenario)
        self._floor = floor_map(scenario)
        self._slots = self._ground.slots(ROWS, SLOT_PITCH)

    def reset(self, n_robots: int, seed: int) -> None:
        """Begin an episode without stock; nothing here is random."""
        super().reset(n_robots, seed)
        self._slot = np.full(n_robots, NOBODY)  # to which each robot takes its item
        self._home_planned_at = -np.inf

    def _stock(
        self,
        state: WarehouseState,
        is_idle: NDArray[np.bool_],
        goals: NDArray[np.float64],
        gripper: NDArray[np.float64],
    ) -> None:
        """Let waiting robots lift items, and laden ones take theirs to a slot or hold it inside."""
        position = state.robot_position
        # Who carries the requested item without being trusted to deliver it lets it go.
        laden = is_idle & (state.robot_item != NOBODY) & (state.robot_item != state.requested)
        self._slot[~laden] = NOBODY
        slots = self._slots
        is_free = self._are_free(state, slots)
        most_held = int(HELD_SHARE * state.n_robots)
        n_held = int((laden & (self._slot == NOBODY)).sum())

        item = self._waits_under
        along = self._floor.along(state.item_position)
        is_far = along < self._floor.edge - ROWS[-1] - SLOT_PITCH
        room = int(is_free.sum()) + most_held - n_held
        away = np.linalg.norm(state.item_position[item] - position, axis=1)
        may_lift = is_idle & (item != NOBODY) & is_far[item] & (away < ARRIVAL_RADIUS)
        gripper[np.flatnonzero(may_lift)[: max(room, 0)]] = 1.0

        if not laden.any():
            return
        if state.time >= self._home_planned_at + REPLAN - 1e-6:
            unladen = state.robot_present & ~laden
            self._home_cost = self._costs_among(state, unladen, carries=True)
            holding = self._ground.holding_cells(HOLDING_DEPTH)
            self._home_cost_to_go = cost_to_go(self._home_cost, holding)
            self._home_planned_at = state.time
        for robot in np.flatnonzero(laden & (self._slot == NOBODY)).tolist():
            if n_held <= most_held or not is_free.any():
                break
            distances = np.linalg.norm(slots - position[robot], axis=1)
            self._slot[robot] = np.where(is_free, distances, np.inf).argmin()
            is_free[self._slot[robot]] = False
            n_held -= 1
        gripper[laden] = 0.0
        goals[laden] = self._ground.points_to_hold(
            self._home_cost, self._home_cost_to_go, position[laden], HOLDING_DEPTH
        )
        for robot in np.flatnonzero(laden & (self._slot != NOBODY)).tolist():
            slot = slots[self._slot[robot]]
            distance = math.dist(slot, position[robot])
            if distance < SLOT_IN_SIGHT:
                goals[robot] = self._ground.point_to(state, robot, slot)
            if distance < ARRIVAL_RADIUS:
                gripper[robot] = -1.0

    def _are_free(self, state: WarehouseState, slots: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which slots have no item and no robot on its way with one (S,)."""
        is_free = np.ones(len(slots), np.bool_)
        take_slots(slots, state.item_position, state.item_status == STORED, is_free)
        is_free[self._slot[self._slot != NOBODY]] = False
        return is_free


@kernel
def take_slots(
    slots: NDArray[np.float64],
    item_position: NDArray[np.float64],
    is_stored: NDArray[np.bool_],
    is_free: NDArray[np.bool_],
) -> None:
    """Note of each slot (S,) that it is not free if an item that is stored (M,) lies in it."""
    for slot in range(len(slots)):
        for item in range(len(item_position)):
            x = slots[slot, 0] - item_position[item, 0]
            y = slots[slot, 1] - item_position[item, 1]
            if is_stored[item] and math.sqrt(x * x + y * y) <= SLOT_RADIUS:
                is_free[slot] = False
