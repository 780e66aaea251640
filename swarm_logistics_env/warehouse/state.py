"""The state of one world, by the names that everybody outside this folder uses."""

from __future__ import annotations

from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.scenario import Scenario

from .packing import blank
from .structs import (
    CARRIED,
    DELIVERED,
    NOBODY,
    STORED,
    Capabilities,
    Items,
    Progress,
    blank_robots,
    lengths_of,
)

__all__ = ["CARRIED", "DELIVERED", "NOBODY", "STORED", "WarehouseState"]

T = TypeVar("T", bound=np.generic)


class Quantity(Generic[T]):
    """An array of a structure; what is assigned is copied into it, as kernels know where it lies.

    Args:
        structure: the state's attribute that holds the structure.
        name: the structure's field, where shape and unit are told.
    """

    def __init__(self, structure: str, name: str) -> None:
        self.structure, self.name = structure, name

    def __get__(self, state: WarehouseState, owner: type[WarehouseState]) -> NDArray[T]:
        """Return the array."""
        array: NDArray[T] = getattr(state.__dict__[self.structure], self.name)
        return array

    def __set__(self, state: WarehouseState, values: NDArray[T]) -> None:
        """Copy `values` into the array."""
        getattr(state.__dict__[self.structure], self.name)[...] = values


class WarehouseState:
    """What is true in the warehouse now. N robots, I items; a row is one robot or item for good.

    `structs` tells of every array its shape and unit. The row of a robot that is absent holds
    zeros and `NOBODY`.
    """

    robot_position = Quantity[np.float64]("robots", "position")
    robot_velocity = Quantity[np.float64]("robots", "velocity")
    robot_heading = Quantity[np.float64]("robots", "heading")
    robot_heading_drift = Quantity[np.float64]("robots", "heading_drift")
    robot_present = Quantity[np.bool_]("robots", "present")
    robot_in_delivery = Quantity[np.bool_]("robots", "in_delivery")
    robot_contact = Quantity[np.bool_]("robots", "contact")
    robot_item = Quantity[np.int64]("robots", "item")
    robot_memory = Quantity[np.int64]("robots", "memory")
    robot_timer = Quantity[np.float64]("robots", "timer")
    robot_told = Quantity[np.float64]("robots", "told")
    robot_heard = Quantity[np.float64]("robots", "heard")
    robot_message = Quantity[np.float64]("robots", "message")
    last_in_delivery = Quantity[np.int64]("robots", "last_in_delivery")
    failed = Quantity[np.bool_]("robots", "failed")

    max_speed = Quantity[np.float64]("able", "max_speed")
    max_turn_rate = Quantity[np.float64]("able", "max_turn_rate")
    ranger_range = Quantity[np.float64]("able", "ranger_range")
    view_range = Quantity[np.float64]("able", "view_range")
    lifts = Quantity[np.bool_]("able", "lifts")
    delivers = Quantity[np.bool_]("able", "delivers")
    sends = Quantity[np.bool_]("able", "sends")
    hears = Quantity[np.bool_]("able", "hears")

    item_position = Quantity[np.float64]("items", "position")
    item_status = Quantity[np.int64]("items", "status")
    item_carrier = Quantity[np.int64]("items", "carrier")
    item_covered = Quantity[np.int64]("items", "covered")

    open_requests = Quantity[np.int64]("progress", "requested")

    def __init__(self, scenario: Scenario) -> None:
        lengths = lengths_of(scenario)
        self.robots = blank_robots(lengths)
        self.able = blank(Capabilities, lengths)
        self.items = blank(Items, lengths)
        self.items.carrier[:] = NOBODY
        self.progress = blank(Progress, lengths)
        self.progress.asked_last[0] = NOBODY
        self.obstacle_position = np.zeros((scenario.n_obstacles, 2))  # [m]
        # Per robot, the failure modes that hold.
        self.failure_modes: tuple[tuple[str, ...], ...] = ((),) * scenario.n_robots
        self.delivery_times: list[float] = []  # [s], ascending
        self.delivered_by: list[int] = []  # robot, one per delivery

    @property
    def step(self) -> int:
        """Control steps since the start."""
        return int(self.progress.step[0])

    @property
    def time(self) -> float:
        """Seconds since the start."""
        return float(self.progress.time[0])

    @property
    def requested(self) -> int:
        """The item of the oldest request, or NOBODY."""
        return int(self.progress.requested[0])

    @property
    def anchoring_seconds(self) -> float:
        """Seconds for which working robots touched failed ones, summed over robots."""
        return float(self.progress.anchoring_seconds[0])

    @property
    def n_robots(self) -> int:
        """Rows of robots, absent ones included."""
        return len(self.robots.position)

    @property
    def carrier(self) -> int:
        """The robot that carries the item of the oldest request, or NOBODY."""
        return NOBODY if self.requested == NOBODY else int(self.item_carrier[self.requested])

    @property
    def delivered(self) -> int:
        """Items delivered so far: the paper's performance P."""
        return len(self.delivery_times)


def roles_of(state: WarehouseState) -> NDArray[np.str_]:
    """Return the role of each robot now, of `faults.ROLES`, shape (N,); "" for an absent robot.

    A robot that fits several roles has the first of them.
    """
    roles = np.full(state.n_robots, "searching", dtype="<U9")
    roles[state.robot_item != NOBODY] = "shuffling"
    roles[state.robot_in_delivery] = "in_area"
    carrier = state.carrier
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
