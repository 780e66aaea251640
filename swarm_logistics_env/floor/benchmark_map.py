"""Maps of public benchmarks as plans: MovingAI's (Sturtevant 2012) and League of Robot Runners'.

Both are grids under a head of `type`, `height`, `width` and `map`. The League marks places of
goods "E" and work stations "S". Where a map has none of these, its free floor within 2 m of the
side of the highest x is the dock, and the rest of the largest connected part is storage.
"""

from __future__ import annotations

import re

import numpy as np

STRIP = 4  # cells of the dock: 2 m of the usual 0.5 m
_BLOCKED = "@OTW"  # out of bounds, trees, and water that no way on land enters
_HEAD = re.compile(r"\s*type\s+\w+\s+height\s+(\d+)\s+width\s+(\d+)\s+map\s*?\n", re.IGNORECASE)


def is_benchmark_map(text: str) -> bool:
    """Return whether a text is a map of one of these benchmarks."""
    return re.match(r"\s*type\s", text) is not None


def rows_of_benchmark_map(text: str) -> list[str]:
    """Return the rows of the plan that a benchmark's map makes.

    Raises:
        ValueError: it has no such head, or not the size that its head says.
    """
    from scipy import ndimage

    head = _HEAD.match(text)
    if head is None:
        raise ValueError(
            'a map of a benchmark should begin with "type", "height", "width" and "map"'
        )
    height, width = map(int, head.groups())
    rows = text[head.end() :].rstrip("\n").replace("\r", "").split("\n")
    if len(rows) != height or {len(row) for row in rows} != {width}:
        raise ValueError(f"the map's head says {width} x {height} cells, its rows are others")
    signs = np.array([list(row) for row in rows])
    is_open = ~np.isin(signs, list(_BLOCKED))
    if not is_open.any():
        raise ValueError("the map has no free cell")
    plan = np.where(is_open, ".", "#")
    if (signs == "E").any() and (signs == "S").any():
        plan[signs == "E"], plan[signs == "S"] = ":", "A"
    else:
        parts, _ = ndimage.label(is_open)
        largest = parts == np.argmax(np.bincount(parts[parts > 0]))
        last_column = int(np.flatnonzero(largest.any(axis=0))[-1])
        plan[largest] = ":"
        strip = largest[:, max(last_column + 1 - STRIP, 0) : last_column + 1]
        plan[:, max(last_column + 1 - STRIP, 0) : last_column + 1][strip] = "A"
    return ["".join(row) for row in plan.tolist()]
