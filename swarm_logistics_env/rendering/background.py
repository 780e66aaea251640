"""The part of a picture that does not move: floor, metre lines, delivery area and walls."""

from __future__ import annotations

import math

import numpy as np
import pygame

from swarm_logistics_env.scenario import Scenario

from . import palette
from .projection import Projection
from .sprites import words


def background(
    projection: Projection, scenario: Scenario, height: int, text_height: int
) -> pygame.Surface:
    """Return the empty warehouse on a picture of that height [px]."""
    picture = np.empty((height, projection.width, 3), np.uint8)
    picture[:] = palette.SURROUNDINGS
    left, right = projection.left, projection.right
    top, bottom = projection.top, projection.bottom
    wall = max(2, projection.margin // 5)
    picture[top - wall : bottom + wall, left - wall : right + wall] = palette.INK
    floor = picture[top:bottom, left:right]
    floor[:] = palette.FLOOR
    for metre in range(1, math.ceil(scenario.warehouse_width)):
        floor[:, round(projection.length(metre))] = palette.FLOOR_LINE
    for metre in range(1, math.ceil(scenario.warehouse_height)):
        floor[-round(projection.length(metre))] = palette.FLOOR_LINE
    edge = round(projection.length(scenario.storage_width))
    area = floor[:, edge:]
    area[:] = _hatched(area.shape[0], area.shape[1], period=max(6.0, 0.6 * projection.margin))
    area[:, : max(1, wall // 2)] = palette.DELIVERY_WORD
    size = (projection.width, height)
    surface = pygame.image.frombytes(picture.tobytes(), size, "RGB")
    name = pygame.transform.rotate(words("DELIVERY", text_height, palette.DELIVERY_WORD), 90)
    if area.shape[1] > 1.5 * name.get_width() and area.shape[0] > name.get_height():
        middle = (left + edge + area.shape[1] // 2, (top + bottom) // 2)
        surface.fill(palette.DELIVERY_AREA, name.get_rect(center=middle).inflate(6, 12))
        surface.blit(name, name.get_rect(center=middle))
    return surface


def _hatched(
    height: int, width: int, period: float
) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    x, y = np.arange(width)[np.newaxis, :], np.arange(height)[:, np.newaxis]
    across = np.abs((x + y) / math.sqrt(2.0) % period - period / 2) - 0.06 * period
    cover = np.clip(0.5 - across, 0.0, 1.0)[..., np.newaxis]
    colour = np.array(palette.DELIVERY_HATCH) * cover + np.array(palette.DELIVERY_AREA) * (
        1.0 - cover
    )
    return np.rint(colour).astype(np.uint8)
