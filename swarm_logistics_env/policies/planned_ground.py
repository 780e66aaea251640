"""What a controller that sees the whole warehouse knows of its ground, with a floor plan.

What follows from the plan alone is computed once for all worlds that have it.
"""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.compiler.kernels import kernel
from swarm_logistics_env.policies.ground import Ground, Mask, Numbers, OpenGround
from swarm_logistics_env.policies.routes import (
    BLOCKED,
    CELL,
    CLEARANCE,
    cell_at,
    cost_to_go,
    costmap,
    lookahead,
)
from swarm_logistics_env.world.scenario import Scenario
from swarm_logistics_env.world.warehouse.floor_cells import (
    floor_map,
    floor_of,
    index_along,
    is_near_solid,
)
from swarm_logistics_env.world.warehouse.layout import is_clear_of_sides
from swarm_logistics_env.world.warehouse.state import NOBODY, WarehouseState
from swarm_logistics_env.world.warehouse.structs import Floor

SOLID = 1e6  # times the cost of an open cell: finite, so that a way leads out of it
BESIDE = 400.0  # nearer to racks than a robot's radius: rather through items, see `Central`
NEAR = 0.3  # [m] from here on a robot drives straight to its goal
ENTRY = 0.25  # [m] beyond a dock's border for which a robot heads
RESTING_GAP = 0.6  # [m] between the centres of resting robots, so that others get through
ROW_GAP = 0.9  # of the pitch, between places in different rows

Cell = tuple[int, int]


def ground_of(scenario: Scenario) -> Ground:
    """Return the ground of a scenario, before an episode."""
    return OpenGround(scenario) if scenario.floor is None else PlannedGround(scenario)


class _PlanCells(NamedTuple):
    """What follows from a plan, for each cell of the route grid."""

    cost: Numbers  # `SOLID` in walls and racks, `BESIDE` close to them
    dock: NDArray[np.int8]  # number of the dock, or NOBODY
    along: Numbers  # [m] on the way into the nearest dock; from 0 on it lies inside
    centres: Numbers  # (rows, columns, 2) [m]


class PlannedGround:
    """A ground with walls, racks and docks.

    Ways around obstacles, which stand for a whole episode, are remembered for the goals used last.
    """

    def __init__(self, scenario: Scenario) -> None:
        self._scenario = scenario
        self._cells = _plan_cells(scenario)
        self._cost: Numbers | None = None
        self._ways: dict[Cell, Numbers] = {}  # the one used last comes last
        self._most_ways = 2 * scenario.n_robots + 1

    def costs(self, discs: Numbers) -> Numbers:
        """Return the cost of each cell among discs."""
        scenario = self._scenario
        width = scenario.warehouse_width
        height = scenario.warehouse_height
        among_discs = costmap(width, height, scenario.robot_radius, discs)
        return np.asarray(np.maximum(among_discs, self._cells.cost))

    def dock_cells(self, dock: int) -> Mask:
        """Return the cells of a dock; `NOBODY`: of all."""
        docks = self._cells.dock
        return np.asarray(docks != NOBODY if dock == NOBODY else docks == dock)

    def holding_cells(self, depth: float) -> Mask:
        """Return the cells of each dock that lie so deep, or as deep as it goes."""
        cost, dock, along, _ = self._cells
        is_deep: Mask = np.zeros_like(dock, np.bool_)
        for number in np.unique(dock[dock != NOBODY]).tolist():
            is_dock = (dock == number) & (cost < SOLID)
            is_deep |= is_dock & (along >= min(depth, along[is_dock].max()))
        return is_deep

    def velocity_inside(self, x: float, y: float, dock: int) -> Numbers | None:
        """Return that a robot stands still; None: it is not in the dock."""
        is_inside = self.dock_cells(dock)[cell_at(self._cells.cost, x, y)]
        return np.zeros(2) if is_inside else None

    def point_home(self, cost: Numbers, far: Numbers, x: float, y: float) -> tuple[float, float]:
        """Return the point [m] to head for on the way into a dock."""
        next_x, next_y = lookahead(cost, far, x, y)
        distance = math.dist((x, y), (next_x, next_y))
        is_last = far[cell_at(far, next_x, next_y)] == 0.0
        stretch = 1.0 + ENTRY / distance if is_last and distance > 0.0 else 1.0
        return x + stretch * (next_x - x), y + stretch * (next_y - y)

    def points_to_hold(
        self, cost: Numbers, far: Numbers, position: Numbers, depth: float
    ) -> Numbers:
        """Return the points (K, 2) [m] to head for from positions (K, 2) to hold items."""
        points = position.copy()
        for robot, (x, y) in enumerate(position.tolist()):
            if far[cell_at(far, x, y)] != 0.0:
                points[robot] = lookahead(cost, far, x, y)
        return points

    def point_to(self, state: WarehouseState, robot: int, goal: Numbers) -> Numbers:
        """Return the point (2,) [m] to head for, around racks and obstacles."""
        far = self._ways_to_cell(state, goal)
        x, y = state.robot_position[robot].tolist()
        if far[cell_at(far, x, y)] * CELL < NEAR:
            return goal
        return np.array(lookahead(self._static_cost(state), far, x, y))

    def ways_to(self, state: WarehouseState, goal: Numbers) -> Numbers:
        """Return the length of each robot's way around racks and obstacles (N,) [m]."""
        far = self._ways_to_cell(state, goal)
        columns, rows = (state.robot_position / CELL).astype(np.int64).T
        n_rows, n_columns = far.shape
        cells = np.clip(rows, 0, n_rows - 1), np.clip(columns, 0, n_columns - 1)
        return np.asarray(CELL * far[cells])

    def resting_places(self, n_robots: int) -> Numbers:
        """Return positions far from the docks, with gaps if there is room for them (N, 2) [m]."""
        _, dock, along, centres = self._cells
        cost = self.costs(np.zeros((0, 4)))
        is_candidate = (cost == 1.0) & (dock == NOBODY)
        if not is_candidate.any():
            is_candidate = cost < SOLID
        candidates = centres[is_candidate][np.argsort(along[is_candidate], kind="stable")]
        for gap in (RESTING_GAP, 2.0 * self._scenario.robot_radius, 0.0):
            places = _spaced(candidates, gap, n_robots)
            if len(places) == n_robots:
                break
        return np.resize(places, (n_robots, 2))

    def slots(self, rows: tuple[float, ...], pitch: float) -> Numbers:
        """Return rows of places in front of the docks, past which laden robots get (S, 2) [m]."""
        _, dock, along, centres = self._cells
        scenario = self._scenario
        clearance = scenario.item_radius + 2.0 * scenario.robot_radius + CLEARANCE
        floor = floor_of(scenario)
        places = np.zeros((0, 2))
        for row in rows:
            is_in_row = (dock == NOBODY) & (np.abs(along + row) <= 0.5 * CELL)
            is_clear = [is_clear_of_sides(floor, x, y, clearance) for x, y in centres[is_in_row]]
            candidates = centres[is_in_row][np.array(is_clear, np.bool_)]
            from_others = np.linalg.norm(candidates[:, None] - places, axis=2)
            candidates = candidates[(from_others >= ROW_GAP * pitch).all(axis=1)]
            places = np.vstack([places, _spaced(candidates, pitch, len(candidates))])
        return places

    def _static_cost(self, state: WarehouseState) -> Numbers:
        if self._cost is None:
            reach = self._scenario.obstacle_radius + self._scenario.robot_radius + CLEARANCE
            n_obstacles = len(state.obstacle_position)
            sizes = np.tile([reach, BLOCKED], (n_obstacles, 1))
            self._cost = self.costs(np.column_stack([state.obstacle_position, sizes]))
        return self._cost

    def _ways_to_cell(self, state: WarehouseState, goal: Numbers) -> Numbers:
        """Return the cost of the way from each cell to the one in which a goal lies."""
        cost = self._static_cost(state)
        cell = cell_at(cost, goal[0], goal[1])
        far = self._ways.pop(cell, None)
        if far is None:
            is_goal: Mask = np.zeros_like(cost, np.bool_)
            is_goal[cell] = True
            far = cost_to_go(cost, is_goal)
            if len(self._ways) == self._most_ways:
                del self._ways[next(iter(self._ways))]
        self._ways[cell] = far
        return far


@functools.lru_cache(maxsize=8)
def _plan_cells(scenario: Scenario) -> _PlanCells:
    """Return the cells of a scenario's plan, computed once for all worlds that have it."""
    floor = floor_of(scenario)
    n_rows = math.ceil(scenario.warehouse_height / CELL)
    n_columns = math.ceil(scenario.warehouse_width / CELL)
    cost = np.ones((n_rows, n_columns))
    dock = np.full((n_rows, n_columns), NOBODY, np.int8)
    fill_cells(floor, scenario.robot_radius, cost, dock)
    rows, columns = np.mgrid[:n_rows, :n_columns]
    centres = CELL * (np.stack([columns, rows], axis=2) + 0.5)
    along = floor_map(scenario).along(centres).reshape(cost.shape)
    return _PlanCells(cost, dock, along, centres)


@kernel
def fill_cells(floor: Floor, radius: float, cost: Numbers, dock: NDArray[np.int8]) -> None:
    """Fill the cost and the dock of each cell of the route grid, for robots of `radius` [m]."""
    for row in range(cost.shape[0]):
        y = (row + 0.5) * CELL
        plan_row = index_along(y, floor.cell, floor.n_rows)
        for column in range(cost.shape[1]):
            x = (column + 0.5) * CELL
            plan_column = index_along(x, floor.cell, floor.n_columns)
            dock[row, column] = floor.dock[plan_row, plan_column]
            if floor.is_solid[plan_row, plan_column]:
                cost[row, column] = SOLID
            elif is_near_solid(floor, x, y, radius):
                cost[row, column] = BESIDE


def _spaced(candidates: Numbers, gap: float, most: int) -> Numbers:
    """Return at most so many candidates (n, 2), the first ones, each `gap` [m] from the others."""
    chosen: list[Numbers] = []
    while len(candidates) and len(chosen) < most:
        chosen.append(candidates[0])
        from_chosen = np.linalg.norm(candidates - candidates[0], axis=1)
        candidates = candidates[1:][from_chosen[1:] >= gap]
    return np.array(chosen).reshape(-1, 2)
