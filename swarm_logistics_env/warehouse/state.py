"""The arrays of one world, their shapes and units."""

from __future__ import annotations

from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.scenario import Scenario

STORED, CARRIED, DELIVERED = 0, 1, 2
NOBODY = -1

# Rows of the tables.
HEADING, TIMER, TOLD, HEARD, MAX_SPEED, MAX_TURN_RATE, RANGER_RANGE, VIEW_RANGE = range(8)
PRESENT, IN_DELIVERY, CONTACT, LIFTS, DELIVERS, SENDS, HEARS, HONEST, OBEYS, FAILED = range(10)
ITEM, LAST_IN_DELIVERY, PILE = range(3)
STATUS, CARRIER, COVERED = range(3)

T = TypeVar("T", bound=np.generic)


class Column(Generic[T]):
    """One named quantity in a table of several, each a contiguous run of the table's memory.

    Tables rather than single arrays, because every array handed to a kernel costs time.
    """

    def __init__(self, table: str, index: int) -> None:
        self.table, self.index = table, index

    def __get__(self, state: WarehouseState, owner: type[WarehouseState]) -> NDArray[T]:
        """Return the quantity as a view."""
        column: NDArray[T] = state.__dict__[self.table][self.index]
        return column

    def __set__(self, state: WarehouseState, values: NDArray[T]) -> None:
        """Copy `values` into the table."""
        state.__dict__[self.table][self.index] = values


class Array(Generic[T]):
    """One array: what is assigned to it is copied into it, as kernels know where it lies."""

    def __set_name__(self, owner: type[WarehouseState], name: str) -> None:
        """Take the attribute's name."""
        self.name = name

    def __get__(self, state: WarehouseState, owner: type[WarehouseState]) -> NDArray[T]:
        """Return the array."""
        array: NDArray[T] = state.__dict__[self.name]
        return array

    def __set__(self, state: WarehouseState, values: NDArray[T]) -> None:
        """Copy `values` into the array, which they become if there is none."""
        state.__dict__.setdefault(self.name, values)[...] = values


class WarehouseState:
    """What is true in the warehouse now. N robots, I items; a row is one robot or item for good.

    The row of a robot that is absent holds zeros and `NOBODY`.
    """

    robot_heading = Column[np.float64]("numbers", HEADING)  # (N,) [rad] from +x to the left, +-pi
    robot_timer = Column[np.float64]("numbers", TIMER)  # (N,) [s] since the area, NaN when silent
    robot_told = Column[np.float64]("numbers", TOLD)  # (N,) [s] told, NaN when silent
    robot_heard = Column[np.float64]("numbers", HEARD)  # (N,) [s] lowest heard, NaN when none
    max_speed = Column[np.float64]("numbers", MAX_SPEED)  # (N,) [m/s]
    max_turn_rate = Column[np.float64]("numbers", MAX_TURN_RATE)  # (N,) [rad/s]
    ranger_range = Column[np.float64]("numbers", RANGER_RANGE)  # (N,) [m], 0 when blind
    view_range = Column[np.float64]("numbers", VIEW_RANGE)  # (N,) [m]

    robot_present = Column[np.bool_]("flags", PRESENT)  # (N,)
    robot_in_delivery = Column[np.bool_]("flags", IN_DELIVERY)  # (N,) its centre is in the area
    robot_contact = Column[np.bool_]("flags", CONTACT)  # (N,) touches something solid to it
    # What each robot can do now; failures take from it, as from the ranges and speeds above.
    lifts = Column[np.bool_]("flags", LIFTS)  # (N,)
    delivers = Column[np.bool_]("flags", DELIVERS)  # (N,)
    sends = Column[np.bool_]("flags", SENDS)  # (N,)
    hears = Column[np.bool_]("flags", HEARS)  # (N,)
    honest = Column[np.bool_]("flags", HONEST)  # (N,) False: tells timer 0 always
    obeys = Column[np.bool_]("flags", OBEYS)  # (N,) False: ignores its commands, the gripper's too
    failed = Column[np.bool_]("flags", FAILED)  # (N,) any failure mode holds

    robot_item = Column[np.int64]("links", ITEM)  # (N,) item carried, or NOBODY
    last_in_delivery = Column[np.int64]("links", LAST_IN_DELIVERY)  # (N,) step, or NOBODY
    robot_pile = Column[np.int64]("links", PILE)  # (N,) towards one robot of those it touches
    item_status = Column[np.int64]("item_links", STATUS)  # (I,) STORED, CARRIED or DELIVERED
    item_carrier = Column[np.int64]("item_links", CARRIER)  # (I,) robot, or NOBODY
    item_covered = Column[np.int64]("item_links", COVERED)  # (I,) 1: stored, yet no obstacle; or 0

    numbers, links, item_links = Array[np.float64](), Array[np.int64](), Array[np.int64]()
    flags = Array[np.bool_]()
    robot_position = Array[np.float64]()  # (N, 2) [m]
    robot_velocity = Array[np.float64]()  # (N, 2) [m/s]
    robot_memory = Array[np.int64]()  # (N, memory_size) put down, newest first
    robot_message = Array[np.float64]()  # (N, message_size) in [-1, 1], broadcast
    item_position = Array[np.float64]()  # (I, 2) [m], its carrier's while carried
    obstacle_position = Array[np.float64]()  # (n_obstacles, 2) [m]

    def __init__(self, scenario: Scenario) -> None:
        n, items = scenario.n_robots, scenario.n_items
        self.numbers = np.full((8, n), np.nan)
        self.numbers[HEADING] = 0.0
        self.flags = np.ones((10, n), np.bool_)
        self.flags[[IN_DELIVERY, CONTACT, FAILED]] = False
        self.links = np.full((3, n), NOBODY)
        self.item_links = np.full((3, items), NOBODY)
        self.robot_position = np.zeros((n, 2))
        self.robot_velocity = np.zeros((n, 2))
        self.robot_memory = np.full((n, scenario.memory_size), NOBODY)
        self.robot_message = np.zeros((n, scenario.message_size))
        self.item_position = np.zeros((items, 2))
        self.item_status[:], self.item_covered[:] = STORED, 0
        self.obstacle_position = np.zeros((scenario.n_obstacles, 2))
        self.failure_modes: tuple[tuple[str, ...], ...] = ((),) * n  # per robot, those that hold
        self.step = 0  # control steps since the start
        self.time = 0.0  # [s]
        self.requested = 0  # the item asked for now, or NOBODY when all are delivered
        self.delivery_times: list[float] = []  # [s], ascending
        self.delivered_by: list[int] = []  # robot, one per delivery
        self.anchoring_seconds = 0.0  # robot-seconds of working robots touching failed ones

    @property
    def n_robots(self) -> int:
        """Rows of robots, absent ones included."""
        return len(self.robot_position)

    @property
    def delivered(self) -> int:
        """Items delivered so far: the paper's performance P."""
        return len(self.delivery_times)
