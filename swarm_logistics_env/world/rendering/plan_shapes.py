"""What of a floor plan is drawn, in metres: pictures and the page in the browser draw the same."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.world.floor import FloorPlan
from swarm_logistics_env.world.floor.floor_plan import RACK, START, STORAGE, WALL, merged_boxes

from .palette import DOCK_HUES

Boxes = NDArray[np.float64]  # (n, 4) lowest x and y, highest x and y [m]


class DockPart(NamedTuple):
    """A connected part of a dock: each has the dock's letter on it.

    Attributes:
        letter: the dock's.
        hue: name of its colour in the palette.
        boxes: what it covers.
        letter_box: its widest box, in whose middle the letter stands (4,) [m].
    """

    letter: str
    hue: str
    boxes: Boxes
    letter_box: NDArray[np.float64]


class PlanShapes(NamedTuple):
    """Boxes of each kind of cell."""

    walls: Boxes
    racks: Boxes
    storage: Boxes
    start: Boxes
    docks: tuple[DockPart, ...]


def plan_shapes(plan: FloorPlan) -> PlanShapes:
    """Return the shapes of a plan."""
    kind = plan.kind
    walls, racks, storage, start = (
        _boxes(plan, kind == drawn) for drawn in (WALL, RACK, STORAGE, START)
    )
    return PlanShapes(walls, racks, storage, start, _dock_parts(plan))


def _boxes(plan: FloorPlan, mask: NDArray[np.bool_]) -> Boxes:
    return np.asarray(merged_boxes(mask) * plan.cell_size, np.float64)


def dock_hue(dock: int) -> str:
    """Return the name of a dock's colour; those of more docks than hues repeat."""
    return DOCK_HUES[dock % len(DOCK_HUES)]


def _dock_parts(plan: FloorPlan) -> tuple[DockPart, ...]:
    from scipy import ndimage  # late: an empty room needs none of scipy

    parts = []
    for dock, letter in enumerate(plan.dock_names):
        labels, n_parts = ndimage.label(plan.dock == dock)
        for label in range(1, n_parts + 1):
            boxes = _boxes(plan, labels == label)
            sides = boxes[:, 2:] - boxes[:, :2]
            widest = np.lexsort((sides.max(axis=1), sides.min(axis=1)))[-1]
            parts.append(DockPart(letter, dock_hue(dock), boxes, boxes[widest]))
    return tuple(parts)
