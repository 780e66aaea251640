"""A cell grid over the warehouse, so that looking for what is near costs the same at any size.

`fill` sorts points into square cells (counting sort). Points of a cell, and of neighbouring cells
in a row, lie side by side in `members`, so one look-around reads a few runs of memory.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.kernels import kernel


class Grid:
    """The cells over a warehouse and which of `n_points` points stand in each.

    Attributes:
        start: (n_columns * n_rows + 1,) where each cell's points begin in `members`.
        members: (n_points,) point numbers, cell by cell, row by row of cells.
        places: (n_points, 2) where they are [m], in the same order.
        size: [cells along x, cells along y].
        cell: side of a cell [m].
    """

    def __init__(self, width: float, height: float, cell: float, n_points: int) -> None:
        # More cells than points buys nothing: widen the cells of an arena that is nearly empty.
        self.cell = max(cell, math.sqrt(width * height / (4.0 * n_points + 16.0)))
        self.size = np.array(
            [math.ceil(width / self.cell), math.ceil(height / self.cell)], dtype=np.int64
        )
        self.start = np.zeros(int(self.size[0] * self.size[1]) + 1, dtype=np.int64)
        self.members = np.zeros(n_points, dtype=np.int64)
        self.places = np.zeros((n_points, 2))


@kernel
def cell_along(coordinate: float, cell: float, n_cells: int) -> int:
    """Return the index of the cell that holds `coordinate`; outside counts as the edge."""
    return min(max(int(coordinate / cell), 0), n_cells - 1)


@kernel
def look_around(
    x: float,
    y: float,
    reach: float,
    left_out: int,
    cell: float,
    size: NDArray[np.int64],
    start: NDArray[np.int64],
    members: NDArray[np.int64],
    places: NDArray[np.float64],
    found: NDArray[np.int64],
    squares: NDArray[np.float64],
) -> int:
    """List the points within `reach` [m] of (x, y), but for `left_out`; returns how many.

    `found` and `squares`, longer than there are points, get where the points stand in `members`
    and `places`, and the squares of their distances [m^2].
    """
    n_found, limit = 0, reach * reach
    left = cell_along(x - reach, cell, size[0])
    right = cell_along(x + reach, cell, size[0])
    top = cell_along(y + reach, cell, size[1])
    for row in range(cell_along(y - reach, cell, size[1]), top + 1):
        for index in range(start[row * size[0] + left], start[row * size[0] + right + 1]):
            dx, dy = places[index, 0] - x, places[index, 1] - y
            square = dx * dx + dy * dy
            # Written always and counted only if near: no branch to mispredict.
            found[n_found] = index
            squares[n_found] = square
            n_found += int((square <= limit) & (members[index] != left_out))
    return n_found


@kernel
def fill(
    position: NDArray[np.float64],
    included: NDArray[np.bool_],
    cell: float,
    size: NDArray[np.int64],
    start: NDArray[np.int64],
    members: NDArray[np.int64],
    places: NDArray[np.float64],
) -> None:
    """Sort the included points of `position` (n, 2) into the grid's cells."""
    start[:] = 0
    for point in range(position.shape[0]):
        if included[point]:
            column = cell_along(position[point, 0], cell, size[0])
            row = cell_along(position[point, 1], cell, size[1])
            start[row * size[0] + column] += 1
    total = 0
    for index in range(start.shape[0]):
        total += start[index]
        start[index] = total
    # Backwards, so that each cell lists its points in ascending order: ties never depend on memory.
    for point in range(position.shape[0] - 1, -1, -1):
        if included[point]:
            column = cell_along(position[point, 0], cell, size[0])
            row = cell_along(position[point, 1], cell, size[1])
            start[row * size[0] + column] -= 1
            place = start[row * size[0] + column]
            members[place] = point
            places[place, 0] = position[point, 0]
            places[place, 1] = position[point, 1]
