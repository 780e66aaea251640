"""Ways around obstacles on a grid of cells, for a controller that sees the whole warehouse."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.compiler.kernels import kernel

CELL = 0.125  # [m]
LOOKAHEAD = 16  # cells
BLOCKED = 40.0  # times the cost of an open cell: a way through is better than none
CROWDED = 4.0
CLEARANCE = 0.03  # [m] kept from what a laden robot must not touch


@kernel
def discs_among(
    robots: NDArray[np.float64],
    stands: NDArray[np.bool_],
    robot_radius: float,
    obstacles: NDArray[np.float64],
    obstacle_radius: float,
    items: NDArray[np.float64],
    lies: NDArray[np.bool_],
    item_radius: float,
) -> NDArray[np.float64]:
    """Return the discs (S, 4), see `costmap`, in which the centre of a robot would touch something.

    Args:
        robots, obstacles, items: their centres (K, 2) [m].
        stands, lies: which robots and items count (K,).
    """
    discs = np.empty((len(robots) + len(obstacles) + len(items), 4))
    n_discs = 0
    reach = robot_radius + CLEARANCE
    for robot in range(len(robots)):
        if stands[robot]:
            discs[n_discs, :2] = robots[robot]
            discs[n_discs, 2] = robot_radius + reach
            discs[n_discs, 3] = CROWDED
            n_discs += 1
    for obstacle in range(len(obstacles)):
        discs[n_discs, :2] = obstacles[obstacle]
        discs[n_discs, 2] = obstacle_radius + reach
        discs[n_discs, 3] = BLOCKED
        n_discs += 1
    for item in range(len(items)):
        if lies[item]:
            discs[n_discs, :2] = items[item]
            discs[n_discs, 2] = item_radius + reach
            discs[n_discs, 3] = BLOCKED
            n_discs += 1
    return discs[:n_discs]


@kernel
def costmap(
    width: float, height: float, radius: float, discs: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the cost of each cell (rows, columns) for the centre of a robot of `radius` [m].

    The cost is 1 in the open and `BLOCKED` along the walls. `discs` (S, 4) are x, y and radius
    [m] and the cost within.
    """
    rows = math.ceil(height / CELL)
    columns = math.ceil(width / CELL)
    cost = np.ones((rows, columns))
    for disc in range(discs.shape[0]):
        x = discs[disc, 0]
        y = discs[disc, 1]
        reach = discs[disc, 2]
        for row in range(max(int((y - reach) / CELL), 0), min(int((y + reach) / CELL) + 1, rows)):
            for column in range(
                max(int((x - reach) / CELL), 0), min(int((x + reach) / CELL) + 1, columns)
            ):
                dx = (column + 0.5) * CELL - x
                dy = (row + 0.5) * CELL - y
                if dx * dx + dy * dy < reach * reach:
                    cost[row, column] = max(cost[row, column], discs[disc, 3])
    # How many columns lie too near to the left wall, and to the right one.
    n_left = 0
    n_right = 0
    while n_left < columns and (n_left + 0.5) * CELL < radius:
        n_left += 1
    while n_right < columns and (columns - n_right - 0.5) * CELL > width - radius:
        n_right += 1
    for row in range(rows):
        y = (row + 0.5) * CELL
        if y < radius or y > height - radius:
            cost[row] = BLOCKED
        cost[row, :n_left] = BLOCKED
        cost[row, columns - n_right :] = BLOCKED
    return cost


@kernel
def cost_to_go(cost: NDArray[np.float64], goal: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the cost of the cheapest way from each cell to a `goal` cell, in cells.

    It sweeps over the grid in four orders until no cell gets cheaper; in the open few are enough,
    if the first ones lead away from the goal. Scipy's `dijkstra` takes 50 times as long, which a
    controller that plans anew every 0.3 s would feel, and rounds otherwise.
    """
    rows, columns = cost.shape
    # A border that no way leads through spares the sweeps a check of every neighbour.
    far = np.full((rows + 2, columns + 2), np.inf)
    # Rows that may get cheaper: a visit that changed nothing need not be repeated until a
    # neighbouring row has changed.
    may_change = np.zeros(rows + 2, np.bool_)
    right_of_middle = 0  # columns from the middle to the goal's cells, summed and doubled
    for row in range(rows):
        n_goals = 0
        for column in range(columns):
            if goal[row, column]:
                n_goals += 1
                right_of_middle += 2 * column - columns + 1
                far[row + 1, column + 1] = 0.0
        if n_goals > 0:
            may_change[row : row + 3] = True
    goal_is_left = right_of_middle < 0
    limits = np.empty(columns)
    costs = np.empty(columns)
    while may_change[1:-1].any():
        for order in range(4):
            for i in range(rows):
                row = i + 1 if order % 2 == 0 else rows - i
                if may_change[row]:
                    may_change[row] = False
                    is_forwards = (order < 2) == goal_is_left
                    if cheapen_row(far, cost[row - 1], row, is_forwards, limits, costs):
                        may_change[row - 1 : row + 2] = True
    return far[1:-1, 1:-1].copy()


@kernel
def cheapen_row(
    far: NDArray[np.float64],
    steps: NDArray[np.float64],
    row: int,
    is_forwards: bool,
    limits: NDArray[np.float64],
    costs: NDArray[np.float64],
) -> bool:
    """Make cells of a row as cheap as their neighbours allow; return whether one became cheaper.

    The cell visited before a cell is the only neighbour that changes on the way. So all others are
    looked at first, several cells by one instruction.

    Args:
        far: the cost from each cell, with a border (rows + 2, columns + 2).
        steps: the cost of each cell of the row (columns,).
        limits, costs: scratch (columns,): the cell visited before makes a cell cheaper if the way
            through it costs less than the limit; otherwise the cell's cost is that in `costs`.
    """
    above = far[row - 1]
    middle = far[row]
    below = far[row + 1]
    columns = len(steps)
    offset = 2 if is_forwards else 0  # columns from the left neighbour to the one visited next
    n_cheaper = 0
    for column in range(columns):
        straight = min(min(above[column + 1], below[column + 1]), middle[column + offset])
        aslant_above = min(above[column], above[column + 2])
        aslant = min(aslant_above, min(below[column], below[column + 2]))
        step = steps[column]
        before = middle[column + 1]
        through_others = min(straight + step, aslant + 1.4142135623730951 * step)
        is_cheaper = through_others < before - 1e-9
        n_cheaper += int(is_cheaper)
        costs[column] = through_others if is_cheaper else before
        limits[column] = min(through_others, before - 1e-9)
    cost = math.inf
    for j in range(columns):
        column = j if is_forwards else columns - 1 - j
        through_last = cost + steps[column]
        # A branch, as the processor foresees it; a minimum would wait for the cell before.
        if through_last < limits[column]:
            cost = through_last
            n_cheaper += 1
        else:
            cost = costs[column]
        middle[column + 1] = cost
    return n_cheaper > 0


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
    goal_x = (column + 0.5) * CELL
    goal_y = (row + 0.5) * CELL
    dearest = 1.0
    for step in range(LOOKAHEAD):
        next_row = row
        next_column = column
        least = far[row, column] + 1e-9
        for down in range(-1, 2):
            for right in range(-1, 2):
                r = row + down
                c = column + right
                if r < 0 or c < 0 or r >= rows or c >= columns or (down == 0 and right == 0):
                    continue
                length = 1.4142135623730951 if down != 0 and right != 0 else 1.0
                through = far[r, c] + length * cost[row, column]
                if through < least:
                    next_row = r
                    next_column = c
                    least = through
        if next_row == row and next_column == column:
            break
        row = next_row
        column = next_column
        dearest = max(dearest, cost[row, column])
        to_x = (column + 0.5) * CELL
        to_y = (row + 0.5) * CELL
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
        goal_x = to_x
        goal_y = to_y
        if cost[row, column] >= BLOCKED:
            break
    return goal_x, goal_y
