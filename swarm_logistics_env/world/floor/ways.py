"""Ways home: how far every point of a floor is from the docks, along free floor."""

from __future__ import annotations

import functools
from typing import Annotated, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swarm_logistics_env.compiler.kernels import inlined_kernel, kernel

from .floor_plan import NO_DOCK, RACK, FloorPlan, Mask, floor_plan

Numbers = NDArray[np.float64]
Indices = NDArray[np.int64]


class Ways(NamedTuple):
    """Ways into the docks of a floor, for compiled code: rows of cells for the nearest dock first.

    Behind them stand those of dock 0, 1, ... where requests name docks. An empty room has no cells.
    """

    edge: float  # as `FloorMap.edge` [m]
    cell: float  # side of a cell [m]
    to_dock: Annotated[Numbers, "docks rows", "columns"]  # [m] of each cell's centre
    to_outside: Annotated[Numbers, "docks rows", "columns"]  # [m] to what is no dock
    is_dock: Annotated[Mask, "docks rows", "columns"]
    is_open: Annotated[Mask, "rows", "columns"]  # no racks


class FloorMap(Protocol):
    """What is where on a floor, for points (n, 2) [m].

    Attributes:
        edge: what `along` is at the border of a dock [m].
    """

    edge: float

    def is_free(self, points: ArrayLike) -> Mask:
        """Return whether points lie inside the warehouse and outside of walls and racks (n,)."""

    def along(self, points: ArrayLike, docks: ArrayLike = NO_DOCK) -> Numbers:
        """Return how far along the way into a dock points are (n,) [m].

        It grows by a metre with each metre of the way, `edge` at the dock's border.

        Args:
            docks: the numbers of the docks (n,), or one for all; `NO_DOCK`: the nearest one.
        """

    def ways(self, names_docks: bool) -> Ways:
        """Return what `way_along` reads, with each dock's own cells where requests name docks."""


class OpenFloor:
    """An empty room whose delivery area is a strip at the highest x.

    Args:
        width, height: of the room [m].
        edge: where the delivery area begins along x [m].
    """

    def __init__(self, width: float, height: float, edge: float) -> None:
        self._size = np.array([width, height])
        self.edge = edge

    def is_free(self, points: ArrayLike) -> Mask:
        """Return whether points lie inside the room (n,)."""
        xy = _points(points)
        return np.asarray(((xy >= 0.0) & (xy <= self._size)).all(axis=1))

    def along(self, points: ArrayLike, docks: ArrayLike = NO_DOCK) -> Numbers:
        """Return x (n,) [m], as there is one dock."""
        return _points(points)[:, 0]

    def ways(self, names_docks: bool) -> Ways:
        """Return what `way_along` reads: no cells."""
        no_cells = np.zeros((0, 0), np.bool_)
        return Ways(self.edge, 1.0, np.zeros((0, 0)), np.zeros((0, 0)), no_cells, no_cells)


class PlannedFloor:
    """A floor with racks and walls; lengths of ways are those over cells' centres.

    A way goes from a cell to any of its eight neighbours, and past no rack's corner, so it is up to
    8 % longer than the shortest one. Within half a cell of a rack it does not change towards it.

    Args:
        plan: of the floor.
    """

    edge = 0.0

    def __init__(self, plan: FloorPlan) -> None:
        self._plan = plan
        self._is_open = plan.kind > RACK
        self._fields: dict[int, tuple[Numbers, Numbers, Mask]] = {}

    def is_free(self, points: ArrayLike) -> Mask:
        """Return whether points lie inside the plan and outside of walls and racks (n,)."""
        xy = _points(points)
        size = self._plan.width, self._plan.height
        inside = ((xy >= 0.0) & (xy <= size)).all(axis=1)
        rows, columns = self._cells(xy / self._plan.cell_size)
        free: Mask = inside & (self._plan.kind[rows, columns] > RACK)
        return free

    def along(self, points: ArrayLike, docks: ArrayLike = NO_DOCK) -> Numbers:
        """Return the depth in a dock, or less than 0, the way to it (n,) [m]; see `FloorMap`."""
        cells = _points(points) / self._plan.cell_size
        numbers = np.asarray(docks)
        along = np.empty(len(cells))
        if numbers.ndim == 0:
            self._fill(along, cells, int(numbers))
            return along
        for dock in np.unique(numbers).tolist():
            is_for_dock = numbers == dock
            of_dock = np.empty(is_for_dock.sum())
            self._fill(of_dock, cells[is_for_dock], dock)
            along[is_for_dock] = of_dock
        return along

    def ways(self, names_docks: bool) -> Ways:
        """Return what `way_along` reads, with each dock's own cells where requests name docks."""
        n_docks = len(self._plan.dock_names) if names_docks else 0
        fields = [self._far(dock) for dock in range(NO_DOCK, n_docks)]
        return Ways(
            edge=self.edge,
            cell=self._plan.cell_size,
            to_dock=np.concatenate([to_dock for to_dock, _, _ in fields]),
            to_outside=np.concatenate([to_outside for _, to_outside, _ in fields]),
            is_dock=np.concatenate([is_dock for _, _, is_dock in fields]),
            is_open=self._is_open,
        )

    def _fill(self, along: Numbers, cells: Numbers, dock: int) -> None:
        """Fill how far along the way into a dock points are (n,) [m], given in cells (n, 2)."""
        to_dock, to_outside, is_dock = self._far(dock)
        _fill_along(to_dock, to_outside, is_dock, self._is_open, self._plan.cell_size, cells, along)

    def _far(self, dock: int) -> tuple[Numbers, Numbers, Mask]:
        """Return how far cells are from a dock and from what is outside of it [m]; which it has."""
        if dock not in self._fields:
            is_dock = self._plan.dock >= 0 if dock == NO_DOCK else self._plan.dock == dock
            goals = is_dock, self._is_open & ~is_dock
            to_dock, to_outside = (
                _distances(self._is_open, goal, self._plan.cell_size) for goal in goals
            )
            self._fields[dock] = to_dock, to_outside, is_dock
        return self._fields[dock]

    def _cells(self, cells: Numbers) -> tuple[Indices, Indices]:
        """Return rows and columns of points, given in cells; outside counts as the edge."""
        n_rows, n_columns = self._plan.kind.shape
        columns, rows = np.clip(cells.astype(np.int64), 0, (n_columns - 1, n_rows - 1)).T
        return rows, columns


@functools.lru_cache(maxsize=64)
def planned_floor(text: str, cell_size: float, robot_diameter: float) -> PlannedFloor:
    """Return the floor of a plan, computed once; see `floor_plan` for the arguments."""
    return PlannedFloor(floor_plan(text, cell_size, robot_diameter))


def _points(points: ArrayLike) -> Numbers:
    return np.asarray(points, np.float64).reshape(-1, 2)


_ALL, _FIRST, _LAST = slice(None), slice(None, -1), slice(1, None)
# Pairs of neighbours as parts of a grid: up, right, and the two askew.
_PAIRS = (
    ((_FIRST, _ALL), (_LAST, _ALL)),
    ((_ALL, _FIRST), (_ALL, _LAST)),
    ((_FIRST, _FIRST), (_LAST, _LAST)),
    ((_FIRST, _LAST), (_LAST, _FIRST)),
)


def _distances(may_pass: Mask, is_goal: Mask, cell_size: float) -> Numbers:
    """Return how far each cell's centre is from the nearest goal's, along cells that may be passed.

    Where no way leads to one, as far as the farthest cell.
    """
    from scipy.sparse import csr_array  # late: an empty room needs none of scipy
    from scipy.sparse.csgraph import dijkstra

    # Of 32 bits, as scipy 1.14 takes no graph with others.
    numbers = np.arange(may_pass.size, dtype=np.int32).reshape(may_pass.shape)
    starts = []
    ends = []
    lengths = []
    for (rows, columns), (next_rows, next_columns) in _PAIRS:
        is_way = may_pass[rows, columns] & may_pass[next_rows, next_columns]
        length = cell_size
        if _ALL not in (rows, columns):  # past no corner: both cells beside are open
            is_way &= may_pass[rows, next_columns] & may_pass[next_rows, columns]
            length *= 2.0**0.5
        starts.append(numbers[rows, columns][is_way])
        ends.append(numbers[next_rows, next_columns][is_way])
        lengths.append(np.full(len(starts[-1]), length))
    graph = csr_array(
        (np.concatenate(lengths), (np.concatenate(starts), np.concatenate(ends))),
        shape=(may_pass.size, may_pass.size),
    )
    goals = np.flatnonzero(is_goal)
    far = np.asarray(dijkstra(graph, directed=False, indices=goals, min_only=True))
    farthest = far[np.isfinite(far)].max()
    return np.asarray(np.minimum(far, farthest).reshape(may_pass.shape))


@kernel
def _fill_along(
    to_dock: Numbers,
    to_outside: Numbers,
    is_dock: Mask,
    is_open: Mask,
    cell_size: float,
    cells: Numbers,
    along: Numbers,
) -> None:
    """Fill how far along the way into a dock points are (n,) [m]; see `FloorMap.along`.

    Args:
        to_dock, to_outside: distances of each cell's centre [m].
        is_dock, is_open: which cells are the dock's, and which are no racks.
        cell_size: [m].
        cells: x and y of the points (n, 2) in cells.
    """
    for point in range(len(cells)):
        x = cells[point, 0]
        y = cells[point, 1]
        along[point] = _along_cells(to_dock, to_outside, is_dock, is_open, cell_size, x, y)


@kernel
def way_along(ways: Ways, point: Numbers, dock: int) -> float:
    """Return how far along the way into a dock a point (2,) is [m]; see `FloorMap.along`."""
    n_rows = len(ways.is_open)
    if n_rows == 0:
        return float(point[0])
    rows = slice((dock - NO_DOCK) * n_rows, (dock - NO_DOCK + 1) * n_rows)
    x = point[0] / ways.cell
    y = point[1] / ways.cell
    return _along_cells(
        ways.to_dock[rows], ways.to_outside[rows], ways.is_dock[rows], ways.is_open, ways.cell, x, y
    )


@kernel
def _along_cells(
    to_dock: Numbers,
    to_outside: Numbers,
    is_dock: Mask,
    is_open: Mask,
    cell_size: float,
    x: float,
    y: float,
) -> float:
    """Return how far along the way into a dock a point is [m], given in cells."""
    # A dock begins half a cell before the centre of its first cell.
    half = 0.5 * cell_size
    n_rows, n_columns = is_open.shape
    column = min(max(int(x), 0), n_columns - 1)
    row = min(max(int(y), 0), n_rows - 1)
    if is_dock[row, column]:
        return max(_at_point(to_outside, is_open, row, column, x, y) - half, 0.0)
    return -max(_at_point(to_dock, is_open, row, column, x, y) - half, 0.0)


@inlined_kernel
def _at_point(far: Numbers, is_open: Mask, row: int, column: int, x: float, y: float) -> float:
    """Return the distance of a point, bilinear between the centres of the cells around it.

    Beside a rack it is that of the cell itself, so that nothing leaks through.

    Args:
        far: distance of each cell's centre [m].
        is_open: which cells are no racks.
        row, column: of the cell that the point lies in.
        x, y: of the point, in cells.
    """
    n_rows, n_columns = is_open.shape
    # From the cell's centre, within +-0.5.
    aside_x = min(max(x, 0.0), n_columns) - column - 0.5
    aside_y = min(max(y, 0.0), n_rows) - row - 0.5
    weight_x = abs(aside_x)
    weight_y = abs(aside_y)
    next_column = min(max(column + (-1 if aside_x < 0.0 else 1), 0), n_columns - 1)
    next_row = min(max(row + (-1 if aside_y < 0.0 else 1), 0), n_rows - 1)
    at_cell = far[row, column]
    along_x = far[row, next_column] if is_open[row, next_column] else at_cell
    along_y = far[next_row, column] if is_open[next_row, column] else at_cell
    askew = along_x + along_y - at_cell
    if is_open[row, next_column] and is_open[next_row, column] and is_open[next_row, next_column]:
        askew = far[next_row, next_column]
    near_y = (1.0 - weight_x) * at_cell + weight_x * along_x
    far_y = (1.0 - weight_x) * along_y + weight_x * askew
    return float((1.0 - weight_y) * near_y + weight_y * far_y)
