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

from swarm_logistics_env.compiler.kernels import kernel
from swarm_logistics_env.policies.central import REPLAN, Central
from swarm_logistics_env.policies.crowd import distance_to
from swarm_logistics_env.policies.routes import cost_to_go
from swarm_logistics_env.world.scenario import Scenario
from swarm_logistics_env.world.warehouse.floor_cells import floor_map
from swarm_logistics_env.world.warehouse.state import NOBODY, STORED, WarehouseState

# Lengths in m.
HELD_SHARE = 0.5  # of the robots hold items at most
SLOT_PITCH = 0.6
ROWS = (0.35, 0.85)  # distances of the rows of slots from the area
SLOT_RADIUS = 0.2  # an item this near takes a slot
SLOT_IN_SIGHT = 1.0  # from here on a robot drives straight to its slot
ARRIVAL_RADIUS = 0.1
HOLDING_DEPTH = 0.4  # of robots that hold items, in the area

Numbers = NDArray[np.float64]
Slots = NDArray[np.int64]


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
        # Items up to here, as the floor measures ways, are far from a dock [m].
        self._far_from = self._floor.edge - ROWS[-1] - SLOT_PITCH

    def reset(self, n_robots: int, seed: int) -> None:
        """Begin an episode without stock; nothing here is random."""
        super().reset(n_robots, seed)
        self._slot = np.full(n_robots, NOBODY)  # to which each robot takes its item
        self._home_planned_at = -np.inf

    def _stock(
        self,
        state: WarehouseState,
        is_idle: NDArray[np.bool_],
        goals: Numbers,
        gripper: Numbers,
    ) -> None:
        """Let waiting robots lift items, and laden ones take theirs to a slot or hold it inside."""
        position = state.robot_position
        laden, n_laden, n_held = find_laden(is_idle, state.robot_item, state.requested, self._slot)
        slots = self._slots
        is_free, n_free = free_slots(slots, state.item_position, state.item_status, self._slot)
        most_held = int(HELD_SHARE * state.n_robots)

        lift_far_items(
            position, state.item_position, self._floor.along(state.item_position), self._far_from,
            self._waits_under, is_idle, n_free + most_held - n_held, gripper,
        )  # fmt: skip

        if n_laden == 0:
            return
        if state.time >= self._home_planned_at + REPLAN - 1e-6:
            unladen = state.robot_present & ~laden
            self._home_cost = self._costs_among(state, unladen, carries=True)
            holding = self._ground.holding_cells(HOLDING_DEPTH)
            self._home_cost_to_go = cost_to_go(self._home_cost, holding)
            self._home_planned_at = state.time
        send_to_slots(position, laden, slots, n_held - most_held, is_free, self._slot)
        gripper[laden] = 0.0
        goals[laden] = self._ground.points_to_hold(
            self._home_cost, self._home_cost_to_go, position[laden], HOLDING_DEPTH
        )
        away = ways_to_slots(position, slots, self._slot)
        for robot in np.flatnonzero(away < SLOT_IN_SIGHT).tolist():
            goals[robot] = self._ground.point_to(state, robot, slots[self._slot[robot]])
        gripper[away < ARRIVAL_RADIUS] = -1.0


@kernel
def find_laden(
    is_idle: NDArray[np.bool_], robot_item: NDArray[np.int64], requested: int, slot: Slots
) -> tuple[NDArray[np.bool_], int, int]:
    """Return which idle robots carry a stored item (N,), how many, and how many without a slot.

    Who carries the requested item without being trusted to deliver it lets it go.

    Args:
        slot: of each robot (N,), or `NOBODY`; those of the others are given back.
    """
    is_laden = np.empty(len(is_idle), np.bool_)
    n_laden = 0
    n_held = 0
    for robot in range(len(is_idle)):
        item = robot_item[robot]
        is_laden[robot] = is_idle[robot] and item != NOBODY and item != requested
        if not is_laden[robot]:
            slot[robot] = NOBODY
            continue
        n_laden += 1
        n_held += int(slot[robot] == NOBODY)
    return is_laden, n_laden, n_held


@kernel
def lift_far_items(
    position: Numbers,
    item_position: Numbers,
    along: Numbers,
    far_from: float,
    waits_under: NDArray[np.int64],
    is_idle: NDArray[np.bool_],
    most: int,
    gripper: Numbers,
) -> None:
    """Close the grippers (N,) of at most so many idle robots under items far from a dock.

    Args:
        along: where each item is, as the floor measures ways (M,) [m]; far ones below `far_from`.
    """
    n_lifting = 0
    for robot in range(len(position)):
        item = waits_under[robot]
        if n_lifting >= most or not is_idle[robot] or item == NOBODY:
            continue
        if along[item] >= far_from:
            continue
        x, y = item_position[item]
        if distance_to(x, y, position[robot]) < ARRIVAL_RADIUS:
            gripper[robot] = 1.0
            n_lifting += 1


@kernel
def send_to_slots(
    position: Numbers,
    laden: NDArray[np.bool_],
    slots: Numbers,
    most: int,
    is_free: NDArray[np.bool_],
    slot: Slots,
) -> None:
    """Send at most so many laden robots without a slot to the nearest free slots (S, 2) [m].

    Args:
        is_free: which slots are (S,); changed.
        slot: of each robot (N,), or `NOBODY`; changed.
    """
    n_sent = 0
    for robot in range(len(position)):
        if n_sent >= most:
            return
        if not laden[robot] or slot[robot] != NOBODY:
            continue
        nearest = NOBODY
        least = math.inf
        for number in range(len(slots)):
            distance = distance_to(slots[number, 0], slots[number, 1], position[robot])
            if is_free[number] and distance < least:
                nearest = number
                least = distance
        if nearest == NOBODY:
            return
        slot[robot] = nearest
        is_free[nearest] = False
        n_sent += 1


@kernel
def ways_to_slots(position: Numbers, slots: Numbers, slot: Slots) -> Numbers:
    """Return how far each robot is from its slot (N,) [m]; infinite if it has none."""
    away = np.full(len(position), np.inf)
    for robot in range(len(position)):
        if slot[robot] != NOBODY:
            x, y = slots[slot[robot]]
            away[robot] = distance_to(x, y, position[robot])
    return away


@kernel
def free_slots(
    slots: Numbers, item_position: Numbers, item_status: NDArray[np.int64], slot: Slots
) -> tuple[NDArray[np.bool_], int]:
    """Return which slots (S, 2) [m] have neither an item nor a robot on its way (S,), and how many.

    Args:
        item_position, item_status: of each item (M, 2) [m], (M,).
        slot: to which each robot is on its way (N,), or `NOBODY`.
    """
    is_free = np.ones(len(slots), np.bool_)
    for number in range(len(slots)):
        for item in range(len(item_position)):
            away = distance_to(slots[number, 0], slots[number, 1], item_position[item])
            if item_status[item] == STORED and away <= SLOT_RADIUS:
                is_free[number] = False
    for robot in range(len(slot)):
        if slot[robot] != NOBODY:
            is_free[slot[robot]] = False
    return is_free, is_free.sum()
