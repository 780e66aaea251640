"""Surfaces in memory, and what pygame lacks to draw on them well."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import pygame
from numpy.typing import NDArray

from .palette import RGB

Point = tuple[float, float]  # [px]

# The bytes are in the order red, green, blue, as in sprites: drawing is ten times faster so.
_MASKS = (0xFF, 0xFF00, 0xFF0000, 0)


def new_canvas(width: int, height: int) -> pygame.Surface:
    """Return an opaque surface of that size [px]."""
    return pygame.Surface((width, height), 0, 32, _MASKS)


def stamp(canvas: pygame.Surface, stamps: Iterable[tuple[pygame.Surface, Point]]) -> None:
    """Draw sprites, each with its middle at the pixel nearest to its point."""
    placed = []
    for sprite, (x, y) in stamps:
        width, height = sprite.get_size()
        placed.append((sprite, (round(x) - width // 2, round(y) - height // 2)))
    canvas.blits(placed, False)


def draw_line(canvas: pygame.Surface, colour: RGB, start: Point, end: Point, width: float) -> None:
    """Draw a line of that width [px] as several thin ones, because pygame smooths only those."""
    length = math.hypot(end[0] - start[0], end[1] - start[1])
    if length == 0.0:
        return
    x_part, y_part = (end[1] - start[1]) / length, (start[0] - end[0]) / length
    half = (width - 1.0) / 2
    for offset in np.linspace(-half, half, 1 + math.ceil(4.0 * half)).tolist():
        pygame.draw.aaline(
            canvas,
            colour,
            (start[0] + offset * x_part, start[1] + offset * y_part),
            (end[0] + offset * x_part, end[1] + offset * y_part),
        )


def to_array(canvas: pygame.Surface) -> NDArray[np.uint8]:
    """Return the pixels of a surface as an array of its own: (H, W, 3)."""
    width, height = canvas.get_size()
    pixels = np.empty((height, width, 3), np.uint8)
    pygame.image.frombuffer(pixels.data, (width, height), "RGB").blit(canvas, (0, 0))
    return pixels
