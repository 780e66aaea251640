"""A cell grid over the warehouse, so that looking for what is near costs the same at any size.

`fill` sorts points into square cells (counting sort). Points of a cell, and of neighbouring cells
in a row, lie side by side in `Grid.members`, so one look-around reads a few runs of memory.
"""

from __future__ import annotations

import math

import numpy as np

from swarm_logistics_env.compiler.kernels import inlined_kernel, kernel

from .structs import Flags, Grid, Nearby, Numbers


def blank_grid(width: float, height: float, cell: float, n_points: int) -> Grid:
    """Return an empty grid for `n_points` points, of cells at least `cell` wide [m]."""
    # More cells than points buys nothing: widen the cells of an arena that is nearly empty.
    cell = max(cell, math.sqrt(width * height / (4.0 * n_points + 16.0)))
    n_columns = math.ceil(width / cell)
    n_rows = math.ceil(height / cell)
    return Grid(
        cell=cell,
        n_columns=n_columns,
        n_rows=n_rows,
        start=np.zeros(n_columns * n_rows + 1, np.int64),
        members=np.zeros(n_points, np.int64),
        position=np.zeros((2, n_points)),
    )


# If there are so few points, all are looked at, because one run is faster than several.
_FEW = 80


@inlined_kernel
def cell_along(coordinate: float, cell: float, n_cells: int) -> int:
    """Return the index of the cell that holds `coordinate`; outside counts as the edge."""
    return min(max(int(coordinate / cell), 0), n_cells - 1)


@inlined_kernel
def look_around(grid: Grid, x: float, y: float, reach: float, left_out: int, nearby: Nearby) -> int:
    """List in `nearby` the points within `reach` [m] of (x, y), but for `left_out`; how many."""
    if grid.start[-1] <= _FEW:
        return look_through(grid, (0, grid.start[-1]), (x, y), reach, left_out, nearby, 0)
    n_found = 0
    left = cell_along(x - reach, grid.cell, grid.n_columns)
    right = cell_along(x + reach, grid.cell, grid.n_columns)
    bottom = cell_along(y - reach, grid.cell, grid.n_rows)
    top = cell_along(y + reach, grid.cell, grid.n_rows)
    for row in range(bottom, top + 1):
        first = row * grid.n_columns
        run = grid.start[first + left], grid.start[first + right + 1]
        n_found = look_through(grid, run, (x, y), reach, left_out, nearby, n_found)
    return n_found


@inlined_kernel
def look_through(
    grid: Grid,
    run: tuple[int, int],
    centre: tuple[float, float],
    reach: float,
    left_out: int,
    nearby: Nearby,
    n_found: int,
) -> int:
    """Append to `nearby`, which lists `n_found`, those of a run of points that `look_around` wants.

    Returns how many are listed then.
    """
    for slot in range(run[0], run[1]):
        dx = grid.position[0, slot] - centre[0]
        dy = grid.position[1, slot] - centre[1]
        square = dx * dx + dy * dy
        # Written always and counted only if near: no branch to mispredict.
        nearby.slot[n_found] = slot
        nearby.square[n_found] = square
        n_found += int((square <= reach * reach) & (grid.members[slot] != left_out))
    return n_found


@inlined_kernel
def cell_of(grid: Grid, x: float, y: float) -> int:
    """Return the number of the cell that holds (x, y), row by row."""
    column = cell_along(x, grid.cell, grid.n_columns)
    return cell_along(y, grid.cell, grid.n_rows) * grid.n_columns + column


@kernel
def fill(grid: Grid, position: Numbers, included: Flags) -> None:
    """Sort the included points of `position` (n, 2) into the grid's cells."""
    start = grid.start
    start[:] = 0
    for point in range(len(position)):
        if included[point]:
            start[cell_of(grid, position[point, 0], position[point, 1])] += 1
    total = 0
    for index in range(len(start)):
        total += start[index]
        start[index] = total
    # Backwards, so that each cell lists its points in ascending order: ties never depend on memory.
    for point in range(len(position) - 1, -1, -1):
        if included[point]:
            x = position[point, 0]
            y = position[point, 1]
            cell = cell_of(grid, x, y)
            start[cell] -= 1
            grid.members[start[cell]] = point
            grid.position[0, start[cell]] = x
            grid.position[1, start[cell]] = y
