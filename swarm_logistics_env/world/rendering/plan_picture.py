"""A floor plan on a picture's background: storage, start, docks, walls, and racks like shelves."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pygame
from numpy.typing import NDArray
from pygame import Rect, Surface

from swarm_logistics_env.world.floor import FloorPlan

from .palette import INK, PLAN_COLOURS, dock_colours
from .plan_shapes import Boxes, DockPart, plan_shapes
from .sprites import words

_BAY = 1.0  # [m] about, from post to post of a rack
_SLATS = 4  # of a bay, if its picture is large enough
_LEAST_GAP = 5  # [px] between them


class PlanPicture:
    """Draws a plan's areas below the floor's lines, and what stands on the floor above them.

    Args:
        plan: the floor plan.
        floor: the place of the warehouse on the picture [px].
        scale: of the picture [px/m].
    """

    def __init__(self, plan: FloorPlan, floor: Rect, scale: float) -> None:
        self._shapes = plan_shapes(plan)
        self._floor = floor
        self._scale = scale
        self._cell = scale * plan.cell_size
        self._edge = max(1, round(0.07 * self._cell))

    def draw_areas(self, picture: Surface) -> None:
        """Draw storage and start, over which the floor's lines go."""
        for box in self._rects(self._shapes.storage):
            picture.fill(PLAN_COLOURS["STORAGE"], box)
        for box in self._rects(self._shapes.start):
            picture.fill(PLAN_COLOURS["START"], box)
            self._draw_crosses(picture, box)

    def draw_docks_and_solids(self, picture: Surface) -> None:
        """Draw docks, walls and racks."""
        picture.set_clip(self._floor)
        for part in self._shapes.docks:
            self._draw_dock(picture, part)
        walls, racks = ([*self._rects(boxes)] for boxes in (self._shapes.walls, self._shapes.racks))
        reach = max(1, round(0.16 * self._cell))
        for box in walls + racks:
            picture.fill(PLAN_COLOURS["SHADOW"], box.move(reach, reach))
        for box in racks:
            self._draw_rack(picture, box)
        # All edges first, so that none is left where two boxes of a wall meet.
        for box in walls:
            picture.fill(INK, box.inflate(2 * self._edge, 2 * self._edge))
        for box in walls:
            picture.fill(PLAN_COLOURS["WALL"], box)
        picture.set_clip(None)

    def _rects(self, boxes: Boxes) -> Iterator[Rect]:
        """Yield boxes as pixels; boxes that touch have no gap between them."""
        return (self._rect(box) for box in boxes)

    def _rect(self, box: NDArray[np.float64]) -> Rect:
        low_x, low_y, high_x, high_y = (round(self._scale * float(side)) for side in box)
        left, bottom = self._floor.bottomleft
        return Rect(left + low_x, bottom - high_y, high_x - low_x, high_y - low_y)

    def _draw_crosses(self, picture: Surface, box: Rect) -> None:
        arm = max(1, round(0.12 * self._cell))
        for row in range(round(box.height / self._cell)):
            for column in range(round(box.width / self._cell)):
                x = box.left + round((column + 0.5) * self._cell)
                y = box.top + round((row + 0.5) * self._cell)
                picture.fill(PLAN_COLOURS["START_CROSS"], (x - arm, y, 2 * arm + 1, 1))
                picture.fill(PLAN_COLOURS["START_CROSS"], (x, y - arm, 1, 2 * arm + 1))

    def _draw_dock(self, picture: Surface, part: DockPart) -> None:
        tint, hatch, word = dock_colours(part.hue)
        gap = max(8, round(0.35 * self._cell))
        for box in self._rects(part.boxes):
            box = box.clip(self._floor)
            picture.set_clip(box)
            picture.fill(tint)
            # The same lines in all boxes, so that they go on from one to the next.
            first = (box.left + box.top) // gap
            for number in range(first, (box.right + box.bottom) // gap + 1):
                x = number * gap - box.top
                ends = (x, box.top), (x - box.height, box.bottom)
                pygame.draw.line(picture, hatch, *ends, max(1, gap // 10))
        picture.set_clip(self._floor)
        box = self._rect(part.letter_box)
        height = min(round(0.8 * min(box.size)), 3 * self._floor.height // 20)
        if height >= 8:
            letter = words(part.letter, height, word)
            picture.blit(letter, letter.get_rect(center=box.center))

    def _draw_rack(self, picture: Surface, box: Rect) -> None:
        """Draw a frame with posts, and slats across it between them."""
        edge = self._edge
        picture.fill(PLAN_COLOURS["RACK_EDGE"], box)
        inner = box.inflate(-2 * edge, -2 * edge)
        picture.fill(PLAN_COLOURS["RACK"], inner)
        is_upright = box.height > box.width
        length = inner.height if is_upright else inner.width
        n_bays = max(1, round(length / (self._scale * _BAY)))
        n_slats = min(_SLATS, int(length / n_bays / _LEAST_GAP)) or 1
        for number in range(1, n_bays * n_slats):
            away = round(number * (length + edge) / (n_bays * n_slats)) - edge
            colour = PLAN_COLOURS["RACK_SLAT" if number % n_slats else "RACK_EDGE"]
            if is_upright:
                picture.fill(colour, (inner.left, inner.top + away, inner.width, edge))
            else:
                picture.fill(colour, (inner.left + away, inner.top, edge, inner.height))
