"""Ways around obstacles on a grid of cells, for a controller that sees the whole warehouse."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.kernels import kernel

CELL = 0.125  # [m]
LOOKAHEAD = 16  # cells
BLOCKED = 40.0  # times the cost of an open cell: a way through is better than none
CROWDED = 4.0
CLEARANCE = 0.03  # [m] kept from what a laden robot must not touch


@kernel
def costmap(
    width: float, height: float, radius: float, discs: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the cost of each cell (rows, columns) for the centre of a robot of `radius` [m].

    The cost is 1 in the open and `BLOCKED` along the walls. `discs` (S, 4) are x, y and radius
    [m] and the cost within.
    """
    rows, columns = math.ceil(height / CELL), math.ceil(width / CELL)
    cost = np.ones((rows, columns))
    for disc in range(discs.shape[0]):
        x, y, reach = discs[disc, 0], discs[disc, 1], discs[disc, 2]
        for row in range(max(int((y - reach) / CELL), 0), min(int((y + reach) / CELL) + 1, rows)):
            for column in range(
                max(int((x - reach) / CELL), 0), min(int((x + reach) / CELL) + 1, columns)
            ):
                dx, dy = (column + 0.5) * CELL - x, (row + 0.5) * CELL - y
                if dx * dx + dy * dy < reach * reach:
                    cost[row, column] = max(cost[row, column], discs[disc, 3])
    for row in range(rows):
        y = (row + 0.5) * CELL
        for column in range(columns):
            x = (column + 0.5) * CELL
            if x < radius or y < radius or x > width - radius or y > height - radius:
                cost[row, column] = BLOCKED
    return cost


@kernel
def cost_to_go(cost: NDArray[np.float64], goal: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the cost of the cheapest way from each cell to a `goal` cell, in cells.

    It sweeps over the grid in four orders until no cell gets cheaper; in the open few are enough.
    """
    rows, columns = cost.shape
    # A border that no way leads through spares the sweeps a check of every neighbour.
    far = np.full((rows + 2, columns + 2), np.inf)
    far[1:-1, 1:-1] = np.where(goal, 0.0, np.inf)
    # Rows that may get cheaper: a visit that changed nothing need not be repeated until a
    # neighbouring row has changed.
    may_change = np.zeros(rows + 2, np.bool_)
    for row in range(rows):
        if goal[row].any():
            may_change[row : row + 3] = True
    through_others = np.empty(columns)
    while may_change[1:-1].any():
        for order in range(4):
            for i in range(rows):
                row = i + 1 if order % 2 == 0 else rows - i
                if may_change[row]:
                    may_change[row] = False
                    if cheapen_row(far, cost[row - 1], row, order < 2, through_others):
                        may_change[row - 1 : row + 2] = True
    return far[1:-1, 1:-1].copy()


@kernel
def cheapen_row(
    far: NDArray[np.float64],
    steps: NDArray[np.float64],
    row: int,
    is_forwards: bool,
    through_others: NDArray[np.float64],
) -> bool:
    """Make cells of a row as cheap as their neighbours allow; return whether one became cheaper.

    Args:
        far: the cost from each cell, with a border (rows + 2, columns + 2).
        steps: the cost of each cell of the row (columns,).
        through_others: scratch (columns,).
    """
    above, here, below = far[row - 1], far[row], far[row + 1]
    columns = len(steps)
    for column in range(columns):
        straight = min(above[column + 1], below[column + 1])
        aslant_above = min(above[column], above[column + 2])
        aslant = min(aslant_above, min(below[column], below[column + 2]))
        step = steps[column]
        through_others[column] = min(straight + step, aslant + 1.4142135623730951 * step)
    has_changed = False
    for j in range(columns):
        column = j if is_forwards else columns - 1 - j
        beside = min(here[column], here[column + 2]) + steps[column]
        best = min(through_others[column], beside)
        if best < here[column + 1] - 1e-9:
            here[column + 1] = best
            has_changed = True
    return has_changed


@kernel
def cell_at(grid: NDArray[np.float64], x: float, y: float) -> tuple[int, int]:
    """Return row and column of the cell of a grid in which (x, y) [m] lies, or that is nearest."""
    rows, columns = grid.shape
    return min(max(int(y / CELL), 0), rows - 1), min(max(int(x / CELL), 0), columns - 1)


@kernel
def lookahead(
    cost: NDArray[np.float64],
    far: NDArray[np.float64],
    x: float,
    y: float,
) -> tuple[float, float]:
    """Return the point [m] to head for from (x, y) [m]: the farthest cell ahead in a straight line.

    A line counts as straight as long as no cell on it costs more than those the way leads through.
    """
    rows, columns = cost.shape
    first = cell_at(cost, x, y)
    row, column = first
    goal_x, goal_y = (column + 0.5) * CELL, (row + 0.5) * CELL
    dearest = 1.0
    for step in range(LOOKAHEAD):
        next_row, next_column, least = row, column, far[row, column] + 1e-9
        for down in range(-1, 2):
            for right in range(-1, 2):
                r, c = row + down, column + right
                if r < 0 or c < 0 or r >= rows or c >= columns or (down == 0 and right == 0):
                    continue
                length = 1.4142135623730951 if down != 0 and right != 0 else 1.0
                through = far[r, c] + length * cost[row, column]
                if through < least:
                    next_row, next_column, least = r, c, through
        if next_row == row and next_column == column:
            break
        row, column = next_row, next_column
        dearest = max(dearest, cost[row, column])
        to_x, to_y = (column + 0.5) * CELL, (row + 0.5) * CELL
        length = math.sqrt((to_x - x) ** 2 + (to_y - y) ** 2)
        n_samples = int(length / (0.4 * CELL)) + 1
        is_open = True
        for sample in range(1, n_samples + 1):
            part = sample / n_samples
            r, c = cell_at(cost, x + part * (to_x - x), y + part * (to_y - y))
            if (r, c) != first and cost[r, c] > dearest:
                is_open = False
                break
        if not is_open and step > 0:
            break
        goal_x, goal_y = to_x, to_y
        if cost[row, column] >= BLOCKED:
            break
    return goal_x, goal_y
