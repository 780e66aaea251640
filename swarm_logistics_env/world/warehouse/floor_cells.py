"""The cells of a floor plan in a world: what is solid, what is in sight, which dock is where.

In an empty room there are no cells, and whoever asks goes by the warehouse's sides alone.
"""

from __future__ import annotations

import functools
import math

import numpy as np

from swarm_logistics_env.compiler.kernels import inlined_kernel, kernel, uniform
from swarm_logistics_env.world.floor import floor_plan
from swarm_logistics_env.world.floor.floor_plan import RACK, STORAGE, merged_boxes
from swarm_logistics_env.world.floor.ways import FloorMap, OpenFloor, planned_floor
from swarm_logistics_env.world.scenario import Scenario

from .structs import NOBODY, Flags, Floor, Integers, Numbers, World

_FARTHEST = 127  # of `Floor.gap`
_BLOCK = 0.5  # of the beams' reach: small blocks have few boxes near, large ones need less memory


def floor_of(scenario: Scenario) -> Floor:
    """Return the cells of a scenario's floor; worlds of the same plan share them."""
    if scenario.floor is None:
        return _EMPTY_ROOM
    reach = scenario.ranger_reach * max(scenario.sensing_mix)
    return _cells_of(scenario.floor, scenario.cell_size, 2.0 * scenario.robot_radius, reach)


def floor_map(scenario: Scenario) -> FloorMap:
    """Return what is where on a scenario's floor, for points."""
    if scenario.floor is None:
        width = scenario.warehouse_width
        height = scenario.warehouse_height
        return OpenFloor(width, height, scenario.storage_width)
    return planned_floor(scenario.floor, scenario.cell_size, 2.0 * scenario.robot_radius)


@functools.lru_cache(maxsize=64)
def _cells_of(text: str, cell_size: float, robot_diameter: float, reach: float) -> Floor:
    from scipy import ndimage  # late: an empty room needs none of scipy

    plan = floor_plan(text, cell_size, robot_diameter)
    is_solid = plan.kind <= RACK
    gap = np.full(is_solid.shape, _FARTHEST)
    if is_solid.any():
        gap = np.asarray(ndimage.distance_transform_cdt(~is_solid, metric="chessboard"))
    boxes = merged_boxes(is_solid).astype(np.float64) * cell_size
    corners = boxes[:, [0, 1, 2, 1, 2, 3, 0, 3]].reshape(-1, 2)
    block = max(_BLOCK * reach, cell_size)
    n_block_rows, n_block_columns = (math.ceil(n * cell_size / block) for n in is_solid.shape)
    n_blocks = n_block_columns, n_block_rows
    first_near, near = _boxes_near_blocks(boxes, block, n_blocks, reach)
    return Floor(
        cell=cell_size,
        n_columns=is_solid.shape[1],
        n_rows=is_solid.shape[0],
        is_solid=np.ascontiguousarray(is_solid),
        gap=np.minimum(gap, _FARTHEST).astype(np.int8),
        solids_below=np.pad(is_solid.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0))),
        dock=np.ascontiguousarray(plan.dock),
        storage=_columns_and_rows((plan.kind == STORAGE) & plan.reachable),
        start=_columns_and_rows(plan.start_cells),
        n_docks=len(plan.dock_names),
        corners=np.ascontiguousarray(corners),
        block=block,
        n_block_columns=n_block_columns,
        n_block_rows=n_block_rows,
        first_near=first_near,
        near=near,
    )


def _boxes_near_blocks(
    boxes: Numbers, block: float, shape: tuple[int, int], reach: float
) -> tuple[Integers, Integers]:
    """Return which boxes lie within `reach` [m] along x and y of each square block of the floor.

    Args:
        boxes: (n, 4) lowest x and y and highest x and y [m].
        shape: numbers of blocks along x and y.

    Returns:
        Where the boxes of each block, row after row, begin in the second array, and the boxes.
    """
    n_columns, n_rows = shape
    limits = np.array(shape) - 1
    first = np.clip(np.floor((boxes[:, :2] - reach) / block).astype(np.int64), 0, limits)
    last = np.clip(np.floor((boxes[:, 2:] + reach) / block).astype(np.int64), 0, limits)
    n_wide, n_high = (last - first + 1).T
    n_blocks = n_wide * n_high  # that each box is near to
    box = np.repeat(np.arange(len(boxes)), n_blocks)
    rank = np.arange(n_blocks.sum()) - np.repeat(n_blocks.cumsum() - n_blocks, n_blocks)
    columns = first[box, 0] + rank % n_wide[box]
    blocks = (first[box, 1] + rank // n_wide[box]) * n_columns + columns
    order = np.argsort(blocks, kind="stable")
    starts = np.searchsorted(blocks[order], np.arange(n_columns * n_rows + 1))
    return starts.astype(np.int64), np.ascontiguousarray(box[order])


def _columns_and_rows(mask: Flags) -> Integers:
    return np.ascontiguousarray(np.argwhere(mask)[:, ::-1].astype(np.int64))


_EMPTY_ROOM = Floor(
    cell=1.0,
    n_columns=0,
    n_rows=0,
    is_solid=np.zeros((0, 0), np.bool_),
    gap=np.zeros((0, 0), np.int8),
    solids_below=np.zeros((1, 1), np.int64),
    dock=np.zeros((0, 0), np.int8),
    storage=np.zeros((0, 2), np.int64),
    start=np.zeros((0, 2), np.int64),
    n_docks=1,
    corners=np.zeros((0, 2)),
    block=1.0,
    n_block_columns=0,
    n_block_rows=0,
    first_near=np.zeros(1, np.int64),
    near=np.zeros(0, np.int64),
)


@inlined_kernel
def index_along(coordinate: float, cell: float, n_cells: int) -> int:
    """Return the column of x, or the row of y, of cells or blocks; outside counts as the edge."""
    return min(max(int(coordinate / cell), 0), n_cells - 1)


@inlined_kernel
def dock_at(world: World, x: float, y: float) -> int:
    """Return the number of the dock at a point [m], or NOBODY; an empty room has one, 0."""
    floor = world.floor
    if floor.n_columns == 0:
        return 0 if x >= world.parameters.storage_width else NOBODY
    column = index_along(x, floor.cell, floor.n_columns)
    return int(floor.dock[index_along(y, floor.cell, floor.n_rows), column])


@kernel
def is_near_solid(floor: Floor, x: float, y: float, distance: float) -> bool:
    """Return whether a wall or rack of the plan lies nearer than `distance` [m] to a point."""
    if is_all_free(floor, x, y, distance):
        return False
    left = index_along(x - distance, floor.cell, floor.n_columns)
    right = index_along(x + distance, floor.cell, floor.n_columns)
    bottom = index_along(y - distance, floor.cell, floor.n_rows)
    top = index_along(y + distance, floor.cell, floor.n_rows)
    for row in range(bottom, top + 1):
        for column in range(left, right + 1):
            if floor.is_solid[row, column]:
                low_x = column * floor.cell
                low_y = row * floor.cell
                dx = max(low_x - x, 0.0, x - (low_x + floor.cell))
                dy = max(low_y - y, 0.0, y - (low_y + floor.cell))
                if dx * dx + dy * dy < distance * distance:
                    return True
    return False


@kernel
def free_way(floor: Floor, x: float, y: float, step_x: float, step_y: float, reach: float) -> float:
    """Return how far a ray is free of walls and racks, `reach` at most, in lengths of its step.

    Cell after cell (Amanatides and Woo 1987).

    Args:
        x, y: where it begins, inside the plan [m].
        step_x, step_y: its step [m]; of length 1 m, `reach` and the result are in m.
    """
    cell = floor.cell
    column = index_along(x, cell, floor.n_columns)
    row = index_along(y, cell, floor.n_rows)
    right = 1 if step_x > 0.0 else -1
    up = 1 if step_y > 0.0 else -1
    # How far along the ray its next borders are, and how far apart they follow each other.
    every_x = cell / abs(step_x) if step_x != 0.0 else math.inf
    every_y = cell / abs(step_y) if step_y != 0.0 else math.inf
    next_x = ((column + (right > 0)) * cell - x) / step_x if step_x != 0.0 else math.inf
    next_y = ((row + (up > 0)) * cell - y) / step_y if step_y != 0.0 else math.inf
    while True:
        if next_x < next_y:
            distance = next_x
            column = column + right
            next_x += every_x
        else:
            distance = next_y
            row = row + up
            next_y += every_y
        is_outside = column < 0 or row < 0 or column >= floor.n_columns or row >= floor.n_rows
        if distance >= reach or is_outside:
            return reach
        if floor.is_solid[row, column]:
            return max(distance, 0.0)


@inlined_kernel
def is_all_free(floor: Floor, x: float, y: float, reach: float) -> bool:
    """Return whether no wall and no rack can be within `reach` [m] of a point."""
    column = index_along(x, floor.cell, floor.n_columns)
    row = index_along(y, floor.cell, floor.n_rows)
    return bool((floor.gap[row, column] - 1) * floor.cell >= reach)


@inlined_kernel
def is_free_between(floor: Floor, x: float, y: float, other_x: float, other_y: float) -> bool:
    """Return whether no cell is solid of the rectangle of cells that two points [m] span."""
    left = index_along(min(x, other_x), floor.cell, floor.n_columns)
    right = index_along(max(x, other_x), floor.cell, floor.n_columns) + 1
    bottom = index_along(min(y, other_y), floor.cell, floor.n_rows)
    top = index_along(max(y, other_y), floor.cell, floor.n_rows) + 1
    below = floor.solids_below
    within = below[top, right] - below[top, left] - below[bottom, right] + below[bottom, left]
    return bool(within == 0)


@kernel
def is_in_sight(world: World, x: float, y: float, other_x: float, other_y: float) -> bool:
    """Return whether no wall and no rack of the plan stands between two points [m]."""
    floor = world.floor
    if floor.n_columns == 0:
        return True
    if is_free_between(floor, x, y, other_x, other_y):
        return True
    # With the whole way as the step, 1 is the other point.
    return free_way(floor, x, y, other_x - x, other_y - y, 1.0) >= 1.0


@inlined_kernel
def draw_in_cells(
    floor: Floor, cells: Integers, key: np.uint64, attempt: int
) -> tuple[float, float]:
    """Return the place [m] that a stream draws at an attempt, uniformly in some of the cells."""
    cell = cells[int(uniform(key, 3 * attempt) * len(cells))]
    x = (cell[0] + uniform(key, 3 * attempt + 1)) * floor.cell
    return x, (cell[1] + uniform(key, 3 * attempt + 2)) * floor.cell
