"""The arrays of one world, their shapes and units."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.scenario import Scenario

STORED, CARRIED, DELIVERED = 0, 1, 2
NOBODY = -1


@dataclass
class WarehouseState:
    """What is true in the warehouse now. N robots, I items; a row is one robot or item for good.

    The row of a robot that is absent holds zeros and `NOBODY`.
    """

    robot_present: NDArray[np.bool_]  # (N,)
    robot_position: NDArray[np.float64]  # (N, 2) [m]
    robot_velocity: NDArray[np.float64]  # (N, 2) [m/s]
    robot_heading: NDArray[np.float64]  # (N,) [rad], counterclockwise from +x, in (-pi, pi]
    robot_item: NDArray[np.int64]  # (N,) item carried, or NOBODY
    robot_memory: NDArray[np.int64]  # (N, memory_size) items last put down, newest first
    robot_timer: NDArray[np.float64]  # (N,) [s] since the delivery area, NaN when silent
    robot_told: NDArray[np.float64]  # (N,) [s] the timer it broadcasts, NaN when silent
    robot_in_delivery: NDArray[np.bool_]  # (N,) its centre is in the delivery area
    robot_contact: NDArray[np.bool_]  # (N,) touches a robot, a wall, an obstacle or, laden, an item
    item_status: NDArray[np.int64]  # (I,) STORED, CARRIED or DELIVERED
    item_position: NDArray[np.float64]  # (I, 2) [m], its carrier's while carried
    item_carrier: NDArray[np.int64]  # (I,) robot, or NOBODY
    obstacle_position: NDArray[np.float64]  # (n_obstacles, 2) [m]

    # What each robot can do now; failures take from it.
    max_speed: NDArray[np.float64]  # (N,) [m/s]
    max_turn_rate: NDArray[np.float64]  # (N,) [rad/s]
    ranger_range: NDArray[np.float64]  # (N,) [m], 0 when blind
    view_range: NDArray[np.float64]  # (N,) [m]
    lifts: NDArray[np.bool_]  # (N,)
    delivers: NDArray[np.bool_]  # (N,)
    sends: NDArray[np.bool_]  # (N,)
    hears: NDArray[np.bool_]  # (N,)
    honest: NDArray[np.bool_]  # (N,) False: tells timer 0 always
    obeys: NDArray[np.bool_]  # (N,) False: ignores its commands, the gripper's too
    failed: NDArray[np.bool_]  # (N,) any failure mode holds
    failure_modes: tuple[tuple[str, ...], ...]  # per robot, the modes that hold

    step: int = 0  # control steps since the start
    time: float = 0.0  # [s]
    requested: int = 0  # the item asked for now, or NOBODY when all are delivered
    delivery_times: list[float] = field(default_factory=list)  # [s], ascending
    delivered_by: list[int] = field(default_factory=list)  # robot, one per delivery
    anchoring_seconds: float = 0.0  # robot-seconds of working robots touching failed ones

    @property
    def n_robots(self) -> int:
        """Rows of robots, absent ones included."""
        return len(self.robot_position)

    @property
    def delivered(self) -> int:
        """Items delivered so far: the paper's performance P."""
        return len(self.delivery_times)


def empty_state(scenario: Scenario) -> WarehouseState:
    """Return a state of the right shapes: everybody able and present, nobody placed."""
    n, items = scenario.n_robots, scenario.n_items
    return WarehouseState(
        robot_present=np.ones(n, np.bool_),
        robot_position=np.zeros((n, 2)),
        robot_velocity=np.zeros((n, 2)),
        robot_heading=np.zeros(n),
        robot_item=np.full(n, NOBODY),
        robot_memory=np.full((n, scenario.memory_size), NOBODY),
        robot_timer=np.full(n, np.nan),
        robot_told=np.full(n, np.nan),
        robot_in_delivery=np.zeros(n, np.bool_),
        robot_contact=np.zeros(n, np.bool_),
        item_status=np.full(items, STORED),
        item_position=np.zeros((items, 2)),
        item_carrier=np.full(items, NOBODY),
        obstacle_position=np.zeros((scenario.n_obstacles, 2)),
        max_speed=np.full(n, scenario.max_speed),
        max_turn_rate=np.full(n, scenario.max_turn_rate),
        ranger_range=np.full(n, scenario.ranger_range),
        view_range=np.full(n, scenario.view_range),
        lifts=np.ones(n, np.bool_),
        delivers=np.ones(n, np.bool_),
        sends=np.ones(n, np.bool_),
        hears=np.ones(n, np.bool_),
        honest=np.ones(n, np.bool_),
        obeys=np.ones(n, np.bool_),
        failed=np.zeros(n, np.bool_),
        failure_modes=((),) * n,
    )
