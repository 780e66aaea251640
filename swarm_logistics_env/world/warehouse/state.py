"""The state of one world, by the names that everybody outside this folder uses."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.compiler.numba_fence import IS_MISSING
from swarm_logistics_env.compiler.packing import blank
from swarm_logistics_env.core.errors import SetupError
from swarm_logistics_env.world.scenario import Scenario

from .contacts import ContactMeasures, contact_measures
from .failure_modes import Capabilities
from .orders import OrderMeasures, order_measures
from .structs import (
    CARRIED,
    DELIVERED,
    DUE,
    NOBODY,
    STORED,
    Batteries,
    Claims,
    ContactCounts,
    Flags,
    Integers,
    Items,
    Numbers,
    Orders,
    Progress,
    Robots,
    lengths_of,
)

__all__ = ["CARRIED", "DELIVERED", "NOBODY", "STORED", "WarehouseState"]


class WarehouseState:
    """What is true in the warehouse now. N robots, I items; a row is one robot or item for good.

    `structs` tells of every array its shape and unit. The row of a robot that is absent holds
    zeros and `NOBODY`. What is assigned to an array's name is copied into the array, as kernels
    know where it lies.
    """

    robot_kind: Integers
    robot_radius: Numbers
    robot_mass: Numbers
    robot_position: Numbers
    robot_velocity: Numbers
    robot_heading: Numbers
    robot_heading_drift: Numbers
    robot_turn_rate: Numbers
    robot_present: Flags
    robot_away: Flags
    robot_in_delivery: Flags
    robot_contact: Flags
    robot_item: Integers
    robot_memory: Integers
    robot_timer: Numbers
    robot_told: Numbers
    robot_heard: Numbers
    robot_message: Numbers
    robot_is_empty: Flags
    last_in_delivery: Integers
    failed: Flags

    max_speed: Numbers
    max_turn_rate: Numbers
    max_acceleration: Numbers
    is_holonomic: Flags
    ranger_range: Numbers
    view_range: Numbers
    lifts: Flags
    delivers: Flags
    sends: Flags
    hears: Flags

    item_position: Numbers
    item_status: Integers
    item_carrier: Integers
    item_covered: Integers

    open_requests: Integers
    requested_docks: Integers

    def __init__(self, scenario: Scenario) -> None:
        if IS_MISSING:
            raise SetupError("the package numba is missing: a world needs it, robots do not")
        lengths = lengths_of(scenario)
        self.robots = robots = blank(Robots, lengths)
        self.able = blank(Capabilities, lengths)
        self.batteries = blank(Batteries, lengths)
        self.items = blank(Items, lengths)
        self.progress = blank(Progress, lengths)
        self.orders = blank(Orders, lengths)
        self.contacts = blank(ContactCounts, lengths)
        robots.present[:] = True
        robots.kind[:] = scenario.kind_numbers(scenario.n_robots)
        robots.radius[:] = scenario.of_robots("robot_radius")
        robots.mass[:] = scenario.of_robots("robot_mass")
        for nobody in (robots.item, robots.memory, robots.last_in_delivery, self.items.carrier):
            nobody[...] = NOBODY
        for silent in (robots.timer, robots.told, robots.heard, robots.told_before):
            silent[...] = np.nan
        robots.frozen_beams[...] = np.nan
        self.batteries.station[:] = NOBODY
        self.progress.asked_last[0] = NOBODY
        self.orders.shape[:] = scenario.order_shape
        self.orders.open[:, DUE] = np.inf
        for prefix, structure in (("robot_", self.robots), ("", self.able), ("item_", self.items)):
            for name, array in structure._asdict().items():
                setattr(self, prefix + name, array)
        self.failed = self.robots.failed
        self.last_in_delivery = self.robots.last_in_delivery
        self.open_requests = self.progress.requested
        self.requested_docks = self.progress.requested_dock
        self.requested_docks[:] = NOBODY
        self.obstacle_position = np.zeros((scenario.n_obstacles, 2))  # [m]
        # Per robot, the failure modes that hold.
        self.failure_modes: tuple[tuple[str, ...], ...] = ((),) * scenario.n_robots
        self.delivery_times: list[float] = []  # [s], ascending
        self.delivered_by: list[int] = []  # robot, one per delivery
        self.delivered_due: list[float] = []  # [s] when each was due; infinite: never

    def take_conditions(self, scenario: Scenario) -> None:
        """Take over those conditions that stand in arrays, as a reset or a change has them."""
        self.progress.last_step[0] = scenario.n_steps
        self.batteries.n_dead[0] = scenario.dead_stations

    def note_deliveries(self, claims: Claims, count: int) -> None:
        """Note the deliveries of a step: when, by whom, and when each was due."""
        self.delivery_times += [self.time] * count
        self.delivered_by += claims.delivered_by[:count].tolist()
        self.delivered_due += claims.delivered[:count, DUE].tolist()

    def __setattr__(self, name: str, value: object) -> None:
        if isinstance(self.__dict__.get(name), np.ndarray):
            self.__dict__[name][...] = value
        else:
            super().__setattr__(name, value)

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
    def item_requested(self) -> Flags:
        """Which items are asked for (I,): a request for them is open."""
        is_requested = np.zeros(len(self.item_status), np.bool_)
        is_requested[self.open_requests[self.open_requests != NOBODY]] = True
        return is_requested

    @property
    def item_docks(self) -> Integers:
        """The dock that the oldest request for each item names (I,), or NOBODY."""
        docks = np.full(len(self.item_status), NOBODY)
        is_open = self.open_requests != NOBODY
        docks[self.open_requests[is_open][::-1]] = self.requested_docks[is_open][::-1]
        return docks

    @property
    def item_late(self) -> Flags:
        """Which items are asked for by a request that is overdue (I,)."""
        is_late = np.zeros(len(self.item_status), np.bool_)
        is_overdue = (self.open_requests != NOBODY) & (self.orders.open[:, DUE] < self.time)
        is_late[self.open_requests[is_overdue]] = True
        return is_late

    @property
    def n_waiting(self) -> int:
        """Orders that came and are not asked for yet."""
        return int(self.orders.n_waiting[0])

    @property
    def in_episode(self) -> Flags:
        """Which robots take part (N,): they are in the arena, or away and come back."""
        takes_part: Flags = self.robot_present | self.robot_away
        return takes_part

    @property
    def carries_requested(self) -> Flags:
        """Which robots carry an item that is asked for (N,)."""
        carries: Flags = (self.robot_item != NOBODY) & self.item_requested[self.robot_item]
        return carries

    @property
    def anchoring_seconds(self) -> float:
        """Seconds for which working robots touched failed ones, summed over robots."""
        return float(self.progress.anchoring_seconds[0])

    @property
    def contact_measures(self) -> ContactMeasures:
        """How often robots ran into each other so far, how deep, and their accelerations."""
        return contact_measures(self.contacts, self.step, self.time)

    @property
    def order_measures(self) -> OrderMeasures:
        """How the orders were served so far."""
        return order_measures(self.orders, self.time, self.delivery_times, self.delivered_due)

    @property
    def robot_charge(self) -> Numbers:
        """Share of what each battery holds now that is left in it (N,); 1: no robot has one."""
        if not len(self.batteries.energy):
            return np.ones(self.n_robots)
        holds = np.maximum(self.able.battery, np.finfo(np.float64).tiny)
        return np.minimum(self.batteries.energy / holds, 1.0)

    @property
    def stations_working(self) -> Flags:
        """Which charging stations are not dead (S,)."""
        works: Flags = self.batteries.station_rank >= self.batteries.n_dead[0]
        return works

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
    carries = state.carries_requested
    for carrier in np.flatnonzero(carries).tolist():
        to_carrier = state.robot_position - state.robot_position[carrier]
        is_near = np.hypot(*to_carrier.T) <= state.view_range[carrier]
        roles[is_near] = "neighbour"
    roles[carries] = "carrier"
    roles[~state.robot_present] = ""
    return roles


def robots_in_role(state: WarehouseState, role: str, count: int) -> NDArray[np.int64]:
    """Return the numbers of `count` robots, ascending: those in the role first.

    Among robots alike, those nearest to a requested item come first; so the sets of 1, 2, 3
    robots are nested.
    """
    distance = np.zeros(state.n_robots)
    if state.requested != NOBODY:
        away = state.robot_position[:, None] - state.item_position[state.item_requested]
        distance = np.hypot(*away.T).min(axis=0)
    is_other = roles_of(state) != role
    order = np.lexsort((distance, is_other, ~state.robot_present))
    return np.sort(order[:count]).astype(np.int64)
