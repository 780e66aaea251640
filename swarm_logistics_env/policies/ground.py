"""What a controller that sees the whole warehouse knows of its ground, without a floor plan.

See `planned_ground` for worlds with racks.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.compiler.kernels import kernel
from swarm_logistics_env.policies.crowd import distances
from swarm_logistics_env.policies.routes import CELL, costmap, lookahead
from swarm_logistics_env.world.scenario import Scenario
from swarm_logistics_env.world.warehouse.state import WarehouseState

Numbers = NDArray[np.float64]
Mask = NDArray[np.bool_]


class Ground(Protocol):
    """Costs, docks and places of a ground. A `Mask` is of the cells of the route grid."""

    def costs(self, discs: Numbers) -> Numbers:
        """Return the cost of each cell among discs, see `routes.costmap`."""

    def dock_cells(self, dock: int) -> Mask:
        """Return the cells at which a way into a dock ends; `NOBODY`: into any."""

    def holding_cells(self, depth: float) -> Mask:
        """Return the cells at which a way ends to where robots hold items, `depth` [m] inside."""

    def velocity_inside(self, x: float, y: float, dock: int) -> Numbers | None:
        """Return the velocity (2,) in top speeds that takes a robot off a dock's border.

        None: it is not in the dock.
        """

    def point_home(self, cost: Numbers, far: Numbers, x: float, y: float) -> tuple[float, float]:
        """Return the point [m] to head for on the way into a dock, without braking at its border.

        Args:
            cost, far: of each cell, and of the way from it.
            x, y: where the robot is [m].
        """

    def points_to_hold(
        self, cost: Numbers, far: Numbers, position: Numbers, depth: float
    ) -> Numbers:
        """Return the points (K, 2) [m] to head for from positions (K, 2) to hold items."""

    def point_to(self, state: WarehouseState, robot: int, goal: Numbers) -> Numbers:
        """Return the point (2,) [m] to head for to get to a goal (2,), whatever moves around."""

    def ways_to(self, state: WarehouseState, goal: Numbers) -> Numbers:
        """Return how long each robot's way to a goal (2,) is (N,) [m]."""

    def resting_places(self, n_robots: int) -> Numbers:
        """Return where robots without an item to wait under disturb least (N, 2) [m]."""

    def slots(self, rows: tuple[float, ...], pitch: float) -> Numbers:
        """Return places for items in front of the docks (S, 2) [m].

        Args:
            rows: distances of the rows from a dock [m]; each stands in the gaps of the one before.
            pitch: from one to the next in a row [m].
        """


@kernel
def head_inside(
    cost: Numbers,
    far: Numbers,
    position: Numbers,
    edge: float,
    depth: float,
    deepest: float,
    points: Numbers,
) -> None:
    """Fill the points (K, 2) [m] to head for to hold an item `depth` [m] behind the edge."""
    for robot in range(len(position)):
        x, y = position[robot]
        if x >= edge:
            points[robot, 0] = deepest
            points[robot, 1] = y
        else:
            next_x, next_y = lookahead(cost, far, x, y)
            points[robot, 0] = next_x + (depth if next_x > edge - CELL else 0.0)
            points[robot, 1] = next_y


class OpenGround:
    """An empty room with a delivery area along one side."""

    def __init__(self, scenario: Scenario) -> None:
        self._scenario = scenario
        self._edge = scenario.storage_width
        self._dock_cells: Mask = np.zeros_like(self.costs(np.zeros((0, 4))), np.bool_)
        self._dock_cells[:, int(self._edge / CELL) :] = True

    def costs(self, discs: Numbers) -> Numbers:
        """Return the cost of each cell among discs."""
        scenario = self._scenario
        width = scenario.warehouse_width
        height = scenario.warehouse_height
        return costmap(width, height, scenario.robot_radius, discs)

    def dock_cells(self, dock: int) -> Mask:
        """Return the cells of the delivery area."""
        return self._dock_cells

    def holding_cells(self, depth: float) -> Mask:
        """Return the cells of the delivery area: any way into it goes on to any depth."""
        return self.dock_cells(0)

    def velocity_inside(self, x: float, y: float, dock: int) -> Numbers | None:
        """Return full speed inwards, as the area may have become narrower; None: it is outside."""
        return np.array([1.0, 0.0]) if x >= self._edge else None

    def point_home(self, cost: Numbers, far: Numbers, x: float, y: float) -> tuple[float, float]:
        """Return the point [m] to head for on the way into the area."""
        next_x, next_y = lookahead(cost, far, x, y)
        return next_x + (1.0 if next_x >= self._edge - CELL else 0.0), next_y

    def points_to_hold(
        self, cost: Numbers, far: Numbers, position: Numbers, depth: float
    ) -> Numbers:
        """Return the points (K, 2) [m] to head for from positions (K, 2) to hold items."""
        deepest = min(self._edge + depth, self._scenario.warehouse_width)
        points = np.empty((len(position), 2))
        head_inside(cost, far, position, self._edge, depth, deepest, points)
        return points

    def point_to(self, state: WarehouseState, robot: int, goal: Numbers) -> Numbers:
        """Return the goal, as nothing is in the way."""
        return goal

    def ways_to(self, state: WarehouseState, goal: Numbers) -> Numbers:
        """Return the straight distance of each robot (N,) [m]."""
        return distances(state.robot_position, goal)

    def resting_places(self, n_robots: int) -> Numbers:
        """Return positions along the wall opposite the delivery area (N, 2) [m]."""
        scenario = self._scenario
        pitch = 2 * scenario.robot_radius + 0.1
        per_file = max(int((scenario.warehouse_height - 0.1) / pitch), 1)
        file, rank = np.divmod(np.arange(n_robots), per_file)
        positions = np.stack([(file + 0.5) * pitch, (rank + 0.5) * pitch + 0.05], axis=1)
        return np.minimum(positions, [scenario.warehouse_width - pitch / 2, np.inf])

    def slots(self, rows: tuple[float, ...], pitch: float) -> Numbers:
        """Return straight rows of places along the delivery area (S, 2) [m]."""
        along = np.arange(0.5 * pitch, self._scenario.warehouse_height - 0.3, pitch)
        x = self._edge - np.repeat(rows, len(along))
        shifts = [0.5 * pitch * (row % 2) for row in range(len(rows))]
        return np.column_stack([x, np.concatenate([along + shift for shift in shifts])])
