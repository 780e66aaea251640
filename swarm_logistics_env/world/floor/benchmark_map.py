"""Maps of public benchmarks as plans: MovingAI's (Sturtevant 2012) and League of Robot Runners'.

Both are grids under a head of `type`, `height`, `width` and `map`. The League marks places of
goods "E" and work stations "S". Where a map has none of these, its free floor within 2 m of the
side of the highest x is the dock, and the rest of the largest connected part is storage.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable

import numpy as np

STRIP = 4  # cells of the dock: 2 m of the usual 0.5 m
_BLOCKED = "@OTW"  # out of bounds, trees, and water that no way on land enters
_SIGNS = ".GS@OTWE"
_HEAD_LINE = re.compile(r"\s*(type|height|width)[ \t]+\S", re.IGNORECASE)


def is_benchmark_map(text: str) -> bool:
    """Return whether a text is a map of one of these benchmarks."""
    return _HEAD_LINE.match(text) is not None


def rows_of_benchmark_map(text: str) -> list[str]:
    """Return the rows of the plan that a benchmark's map makes.

    Blanks at line ends and empty lines count for nothing.

    Raises:
        ValueError: it has no such head, not the size that its head says, or a sign that these
            benchmarks do not have; names the line of the file.
    """
    from scipy import ndimage

    lines = [(number, line.rstrip()) for number, line in enumerate(text.splitlines(), start=1)]
    lines = [(number, line) for number, line in lines if line]
    width, height, n_head = _read_head(lines)
    grid = lines[n_head:]
    refuse_unknown_signs(grid, _SIGNS, f"should be one of {' '.join(_SIGNS)}")
    widths = {len(row) for _, row in grid}
    if len(widths) == 1 and (widths, len(grid)) != ({width}, height):
        raise ValueError(
            f"the map's head says {width} x {height} cells, its rows are {widths.pop()} x "
            f"{len(grid)}"
        )
    for number, row in grid:
        if len(row) != width:
            raise ValueError(
                f"line {number} has {len(row)} cells: should have {width}, as the map's head says"
            )
    if len(grid) != height:
        raise ValueError(f"the map's head says {height} rows, it has {len(grid)}")
    signs = np.array([list(row) for _, row in grid])
    is_open = ~np.isin(signs, list(_BLOCKED))
    if not is_open.any():
        raise ValueError("the map has no free cell")
    plan = np.where(is_open, ".", "#")
    if (signs == "E").any() and (signs == "S").any():
        plan[signs == "E"] = ":"
        plan[signs == "S"] = "A"
    else:
        parts, _ = ndimage.label(is_open)
        largest = parts == np.argmax(np.bincount(parts[parts > 0]))
        last_column = int(np.flatnonzero(largest.any(axis=0))[-1])
        plan[largest] = ":"
        strip = largest[:, max(last_column + 1 - STRIP, 0) : last_column + 1]
        plan[:, max(last_column + 1 - STRIP, 0) : last_column + 1][strip] = "A"
    return ["".join(row) for row in plan.tolist()]


def _read_head(lines: Iterable[tuple[int, str]]) -> tuple[int, int, int]:
    """Return width and height of a map [cells], and how many lines its head has."""
    sizes: dict[str, int] = {}
    for n_lines, (number, line) in enumerate(lines, start=1):
        match line.lower().split():
            case ["map"] if len(sizes) == 2:
                return sizes["width"], sizes["height"], n_lines
            case ["type", _]:
                continue
            case ["height" | "width" as name, size] if size.isdecimal() and name not in sizes:
                sizes[name] = int(size)
            case _:
                raise ValueError(
                    f"line {number}: {line[:40]!r} is not of the head of a map: should be "
                    '"type NAME", "height ROWS" and "width COLUMNS", each once, then "map"'
                )
    raise ValueError('the map has no line "map", under which its rows should stand')


def refuse_unknown_signs(
    lines: Iterable[tuple[int, str]], signs: Collection[str], remedy: str
) -> None:
    """Raise ValueError at the first sign that is none of a plan or a map.

    Args:
        lines: of the file, with their numbers.
        signs: those that are known.
        remedy: ends the message.
    """
    for number, row in lines:
        for column, sign in enumerate(row, start=1):
            if sign not in signs:
                raise ValueError(f"line {number}, column {column}: {sign!r} is no cell: {remedy}")
