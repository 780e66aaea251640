"""A floor plan: one character a cell, read, checked, and what follows from it for a world.

    #  wall        :  storage: items start here and come back
    =  rack        +  start: robots start here; without any, in storage and on free floor
    .  free        *  charging station, in the middle of its cell
                   A to Z  delivery areas; cells with the same letter are one dock

The first line is the side of the highest y. The world's outer walls stand around the plan.
"""

from __future__ import annotations

import codecs
import math
import re
from collections.abc import Iterable, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.core.errors import suggest

from .benchmark_map import is_benchmark_map, refuse_unknown_signs, rows_of_benchmark_map

WALL, RACK, FREE, STORAGE, START, DOCK, STATION = range(
    7
)  # kinds of cells; the first two are solid
NO_DOCK = -1
MOST_CELLS = 1_024  # along a side: the largest maps of MovingAI
_KINDS = {"#": WALL, "=": RACK, ".": FREE, ":": STORAGE, "+": START, "*": STATION}
_DOCKS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
_FOLDER = Path(__file__).parent / "plans"
_ROW_END = "/"  # of the rows of a plan within a single line
_NARROW = 1e-6  # [m] of rounding

Cells = NDArray[np.int8]  # (rows, columns); row 0 is at y = 0
Mask = NDArray[np.bool_]


def plan_names() -> list[str]:
    """Return the names of the plans that the package ships."""
    return sorted(path.stem for path in _FOLDER.glob("*.txt"))


def plan_text(floor: str) -> str:
    """Return a floor's value in its one form: a shipped name, or the rows joined by "/".

    Args:
        floor: a shipped name, a file (a plan, or a map of MovingAI or the League of Robot Runners),
            or the rows of a plan, between line breaks or "/".

    Raises:
        ValueError: it is none of these, or the file cannot be read; says what would be right.
    """
    if floor in plan_names():
        return floor
    if "\n" not in floor and is_file(floor):
        try:
            floor = read_text(Path(floor))
        except (OSError, UnicodeError) as error:
            raise ValueError(f"cannot read the plan: {error}") from None
    elif "\n" not in floor and not _looks_like_rows(floor):
        raise ValueError(
            "should be a shipped plan, a file, or rows of a plan" + suggest(floor, plan_names())
        )
    if is_benchmark_map(floor):
        return _ROW_END.join(rows_of_benchmark_map(floor))
    rows = [row.rstrip() for row in floor.rstrip().lstrip("\r\n").splitlines()]
    return _ROW_END.join(rows)


def read_text(path: Path) -> str:
    """Return a file's text, in UTF-8 or, with a byte-order mark, UTF-16."""
    content = path.read_bytes()
    is_utf_16 = content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    return content.decode("utf-16" if is_utf_16 else "utf-8-sig")


def floor_title(text: str) -> str:
    """Return how a table names a floor: its rows are too long for that."""
    rows = re.split(r"\n|/", text.strip("\n"))
    if re.search(r"\.[a-z0-9]+$", text):  # the path of a file, which has no rows
        return text
    return (
        text
        if not _looks_like_rows(text) and len(rows) == 1
        else f"plan of {len(rows[0])} x {len(rows)} cells"
    )


PLAN_SIZES = ("warehouse_width", "warehouse_height", "delivery_width")


def with_plan_sizes(fields: Mapping[str, Any], chosen: Mapping[str, Any]) -> dict[str, Any]:
    """Return the given fields of a scenario with its floor in its one form and the sizes it makes.

    Args:
        fields: of the whole scenario, by name.
        chosen: those of them that somebody set.

    Raises:
        ValueError: the plan cannot be, or a size is given that is not the plan's.
    """
    try:
        return _with_sizes(fields, chosen)
    except ValueError as error:
        raise ValueError(f"Scenario.floor = {floor_title(fields['floor'])}: {error}") from None


def _with_sizes(fields: Mapping[str, Any], chosen: Mapping[str, Any]) -> dict[str, Any]:
    text = plan_text(fields["floor"])
    numbers = fields["cell_size"], fields["robot_radius"]
    if not all(isinstance(number, int | float) and number > 0 for number in numbers):
        return {**chosen, "floor": text}  # the fields' own checks say what is wrong
    cell_size, robot_radius = map(float, numbers)
    plan = floor_plan(text, cell_size, 2.0 * robot_radius)
    sizes = dict(zip(PLAN_SIZES, (plan.width, plan.height, plan.delivery_width), strict=True))
    for name, size in sizes.items():
        if chosen.get(name, size) != size:
            raise ValueError(
                f"{name} = {chosen[name]} should be left out, as the plan makes it {size:g} m"
            )
    return {**chosen, **sizes, "floor": text}


def is_file(text: str) -> bool:
    """Return whether a text is the path of a file."""
    try:
        return Path(text).is_file()
    except (OSError, ValueError):  # too long for a path, or with a null
        return False


def _looks_like_rows(text: str) -> bool:
    return ":" in text and set(text) <= set(_KINDS) | set(_DOCKS) | {_ROW_END}


class FloorPlan(NamedTuple):
    """A plan's cells, and the size of each.

    Attributes:
        kind: of every cell (rows, columns), row 0 at y = 0.
        dock: which dock a cell belongs to, by its place in `dock_names`, or `NO_DOCK`.
        dock_names: letters of the docks, in the alphabet's order.
        reachable: which cells a robot can get into from the docks.
        cell_size: side of a cell [m].
    """

    kind: Cells
    dock: Cells
    dock_names: tuple[str, ...]
    reachable: Mask
    cell_size: float

    @property
    def width(self) -> float:
        """Along x [m]."""
        return float(self.kind.shape[1] * self.cell_size)

    @property
    def height(self) -> float:
        """Along y [m]."""
        return float(self.kind.shape[0] * self.cell_size)

    @property
    def delivery_width(self) -> float:
        """Width of a strip along the whole height with the area of all docks [m]."""
        return float(np.sum(self.kind == DOCK) * self.cell_size / len(self.kind))

    @property
    def storage_area(self) -> float:
        """Area of the storage cells [m2]."""
        return int((self.kind == STORAGE).sum()) * self.cell_size * self.cell_size

    @property
    def start_cells(self) -> Mask:
        """Cells in which robots start."""
        is_start = self.kind == START
        if not is_start.any():
            is_start = (self.kind == STORAGE) | (self.kind == FREE)
        starts: Mask = is_start & self.reachable
        return starts

    @property
    def start_name(self) -> str:
        """What the cells are in which robots start."""
        has_start = bool((self.kind == START).any())
        return 'start cells ("+")' if has_start else 'storage (":") and free floor (".")'

    @property
    def start_area(self) -> float:
        """Area of the cells in which robots start [m2]."""
        return int(self.start_cells.sum()) * self.cell_size * self.cell_size


@lru_cache(maxsize=64)
def floor_plan(text: str, cell_size: float, robot_diameter: float) -> FloorPlan:
    """Return the plan of a floor's value (see `plan_text`), checked.

    Args:
        text: a shipped name, or rows joined by "/".
        cell_size: side of a cell [m].
        robot_diameter: of a robot, laden or not [m].

    Raises:
        ValueError: it cannot be a warehouse; names the line and the column.
    """
    if text in plan_names():
        text = plan_text((_FOLDER / f"{text}.txt").read_text(encoding="utf-8"))
    if cell_size < 0.5 * robot_diameter:
        raise ValueError(
            f"cell_size = {cell_size} m should be at least a robot's radius, "
            f"{0.5 * robot_diameter:g} m, or a crowd presses robots through racks"
        )
    rows = text.split(_ROW_END)
    _check_rows(rows)
    letters = np.array([list(row) for row in rows])[::-1]
    kind = np.full(letters.shape, DOCK, np.int8)
    dock = np.full(letters.shape, NO_DOCK, np.int8)
    for sign, code in _KINDS.items():
        kind[letters == sign] = code
    names = tuple(sorted(set(letters[kind == DOCK].tolist())))
    for number, name in enumerate(names):
        dock[letters == name] = number
    for code, what in ((DOCK, "dock (a letter from A to Z)"), (STORAGE, 'storage (":")')):
        if not (kind == code).any():
            raise ValueError(f"the plan has no {what}: should have at least one cell of it")
    _check_reached(kind, _reachable(kind, 1), "no way leads from {} to {}")
    reachable = _reachable(kind, math.ceil(robot_diameter / cell_size - _NARROW))
    narrow = f"the way from {{}} to {{}} is narrower than a robot, {robot_diameter:g} m"
    _check_reached(kind, reachable, narrow)
    return FloorPlan(kind, dock, names, reachable, cell_size)


def _check_rows(rows: list[str]) -> None:
    if len(rows) > MOST_CELLS or len(rows[0]) > MOST_CELLS:
        raise ValueError(
            f"a plan of {len(rows[0])} x {len(rows)} cells: should be at most "
            f"{MOST_CELLS} x {MOST_CELLS}"
        )
    signs = " ".join(_KINDS)
    lines = [*enumerate(rows, start=1)]
    remedy = f"should be one of {signs} or a letter from A to Z"
    refuse_unknown_signs(lines, {*_KINDS, *_DOCKS}, remedy)
    for line, row in lines:
        if len(row) != len(rows[0]):
            raise ValueError(
                f"line {line} has {len(row)} cells: should have as many as line 1, {len(rows[0])}"
            )
    if not rows[0]:
        raise ValueError("the plan is empty: should have at least one cell")


def _reachable(kind: Cells, n_wide: int) -> Mask:
    """Return the cells that a square of `n_wide` cells covers on ways between docks and storage."""
    from scipy import ndimage  # late: an empty room needs none of scipy

    is_open = kind > RACK
    square = np.ones((n_wide, n_wide), np.bool_)
    # Where a square's lowest corner may stand, and the parts that its ways connect.
    n_rows, n_columns = kind.shape
    fits = np.zeros_like(is_open)
    if n_wide <= min(n_rows, n_columns):
        windows = np.lib.stride_tricks.sliding_window_view(is_open, square.shape)
        fits[: n_rows - n_wide + 1, : n_columns - n_wide + 1] = windows.all(axis=(2, 3))
    parts = np.asarray(ndimage.label(fits)[0], np.int32)
    covered_by = _spread(parts, n_wide)
    of_docks = set(np.unique(covered_by[kind == DOCK]).tolist()) - {0}
    of_storage = set(np.unique(covered_by[kind == STORAGE]).tolist())
    is_used = np.isin(parts, sorted(of_docks & of_storage))
    reached: Mask = _spread(is_used.astype(np.int32), n_wide) > 0
    return reached


def _spread(corners: NDArray[np.int32], n_wide: int) -> NDArray[np.int32]:
    """Return the number of a square that covers each cell, by the numbers at lowest corners."""
    n_rows, n_columns = corners.shape
    covered = np.zeros_like(corners)
    for down in range(n_wide):
        for right in range(n_wide):
            moved = corners[: n_rows - down, : n_columns - right]
            part = covered[down:, right:]
            np.maximum(part, moved, out=part)
    return covered


def _check_reached(kind: Cells, reached: Mask, problem: str) -> None:
    ways = ((DOCK, "this dock", "storage"), (STORAGE, "this storage", "a dock"))
    starts = ((START, "this start", "a dock"), (STATION, "this station", "a dock"))
    for code, origin, goal in (*ways, *starts):
        rows, columns = np.nonzero((kind == code) & ~reached)
        if len(rows):
            first = int(np.lexsort((columns, -rows))[0])  # from the first line on
            line = len(kind) - int(rows[first])
            column = int(columns[first]) + 1
            raise ValueError(f"line {line}, column {column}: {problem.format(origin, goal)}")


def merged_boxes(is_solid: Mask) -> NDArray[np.int64]:
    """Return rectangles that together cover the solid cells, each cell once.

    Returns:
        (n, 4) first column, first row, and those behind the last ones.
    """
    boxes: list[tuple[int, int, int, int]] = []
    growing: dict[tuple[int, int], int] = {}  # first row of runs of columns that go on
    for row in range(len(is_solid) + 1):
        runs = set(_runs(is_solid[row])) if row < len(is_solid) else set()
        boxes += [(a, growing.pop((a, b)), b, row) for a, b in list(growing) if (a, b) not in runs]
        for run in runs:
            growing.setdefault(run, row)
    return np.array(sorted(boxes), np.int64).reshape(-1, 4)


def _runs(is_solid: Mask) -> Iterable[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], is_solid, [False]])))
    return zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
