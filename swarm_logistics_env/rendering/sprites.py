"""Small pictures of what is drawn in the warehouse and its caption; each is painted once.

Shapes are painted from signed distances, so that they are smooth at any size: an array holds the
distance [px] from each pixel's centre to the shape's edge, negative inside. Angles are clockwise
from the right [rad], as on a screen.

Surfaces in memory, and what pygame lacks to draw on them well.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from functools import lru_cache
from typing import ParamSpec

import numpy as np
import pygame
from numpy.typing import NDArray
from pygame import Surface

from .palette import FLOOR, INK, ITEM, ITEM_EDGE, LINK, OBSTACLE, REQUESTED, RGB, TIMER

Point = tuple[float, float]  # [px]
Pixels = NDArray[np.uint8]  # (H, W, 3), red, green, blue; or (H, W, 4), with opacity

# The bytes are in the order red, green, blue, as in sprites: drawing is ten times faster so.
_MASKS = (0xFF, 0xFF00, 0xFF0000, 0)


def new_canvas(width: int, height: int) -> Surface:
    """Return an opaque surface of that size [px]."""
    return Surface((width, height), 0, 32, _MASKS)


def stamp(canvas: Surface, stamps: Iterable[tuple[Surface, Point]]) -> None:
    """Draw sprites, each with its middle at the pixel nearest to its point."""
    placed = []
    for sprite, (x, y) in stamps:
        width, height = sprite.get_size()
        placed.append((sprite, (round(x) - width // 2, round(y) - height // 2)))
    canvas.blits(placed, False)


def draw_line(
    canvas: Surface, start: NDArray[np.float64], end: NDArray[np.float64], width: float
) -> None:
    """Draw a line of that width [px] as several thin ones, because pygame smooths only those."""
    x_part, y_part = end - start
    across = np.array([y_part, -x_part]) / math.hypot(x_part, y_part)
    half = (width - 1.0) / 2
    for offset in np.linspace(-half, half, 1 + math.ceil(4.0 * half)):
        ends = np.array([start, end]) + offset * across
        pygame.draw.aaline(canvas, LINK, *ends.tolist())


def to_array(canvas: Surface) -> Pixels:
    """Return the pixels of a surface as an array of its own: (H, W, 3)."""
    width, height = canvas.get_size()
    pixels = np.empty((height, width, 3), np.uint8)
    pygame.image.frombuffer(pixels.data, (width, height), "RGB").blit(canvas, (0, 0))
    return pixels


HEADINGS = 120  # headings that are told apart
HALOS = 12  # ages of a timer that are told apart
_LETTERS = 4  # times as large as they are shown

P = ParamSpec("P")
Distance = NDArray[np.float64]  # (H, W) [px]
Layer = tuple[Distance, RGB, float]  # a shape, its colour, its opacity in [0, 1]


def pixels(reach: float) -> tuple[Distance, Distance]:
    """Return x (1, W) and y (H, 1) [px] of a square that reaches so far around its middle pixel."""
    half = math.ceil(reach) + 1
    axis = np.arange(-half, half + 1, dtype=np.float64)
    return axis[None, :], axis[:, None]


def disc(x: Distance, y: Distance, radius: float) -> Distance:
    """Return the distance to a disc about the origin."""
    return np.hypot(x, y) - radius


def ring(x: Distance, y: Distance, radius: float, width: float) -> Distance:
    """Return the distance to a ring about the origin, `radius` to the middle of its width."""
    return np.abs(np.hypot(x, y) - radius) - width / 2


def box(x: Distance, y: Distance, half_width: float, half_height: float) -> Distance:
    """Return the distance to an upright box about the origin."""
    return np.maximum(np.abs(x) - half_width, np.abs(y) - half_height)


def pill(x: Distance, y: Distance, half_width: float, radius: float) -> Distance:
    """Return the distance to a box with round ends, `half_width` and `radius` from the origin."""
    return np.hypot(np.maximum(np.abs(x) - (half_width - radius), 0.0), y) - radius


def wedge(
    x: Distance, y: Distance, angle: float, tip: float, base: float, half_width: float
) -> Distance:
    """Return the distance to a triangle that points along `angle`.

    Its tip and its base, of twice the half width, lie `tip` and `base` from the origin.
    """
    along = x * math.cos(angle) + y * math.sin(angle)
    across = np.abs(y * math.cos(angle) - x * math.sin(angle))
    length = tip - base
    slope = math.hypot(length, half_width)
    sides: Distance = ((along - tip) * half_width + across * length) / slope
    return np.maximum(sides, base - along)


def painted(*layers: Layer) -> Pixels:
    """Return the layers, the first lowest, as straight RGBA (H, W, 4)."""
    shape = np.broadcast_shapes(*(distance.shape for distance, _, _ in layers))
    colour, alpha = np.zeros((*shape, 3)), np.zeros((*shape, 1))
    for distance, rgb, opacity in layers:
        cover = (np.clip(0.5 - distance, 0.0, 1.0) * opacity)[..., None]
        colour = np.array(rgb) * cover + colour * (1.0 - cover)
        alpha = cover + alpha * (1.0 - cover)
    straight = np.divide(colour, alpha, out=np.zeros_like(colour), where=alpha > 0.0)
    return np.asarray(np.rint(np.dstack([straight, 255.0 * alpha])), np.uint8)


def _sprite(paint: Callable[P, Pixels]) -> Callable[P, Surface]:
    @lru_cache(maxsize=2048)
    def surface(*args: P.args, **kwargs: P.kwargs) -> Surface:
        return _surface(paint(*args, **kwargs))

    # The cache's type forgets the parameters.
    return surface  # type: ignore[return-value]


def _surface(rgba: Pixels) -> Surface:
    return pygame.image.frombytes(rgba.tobytes(), rgba.shape[1::-1], "RGBA")


def blank(width: int, height: int) -> Surface:
    """Return a picture of that size [px] with nothing on it."""
    return _surface(np.zeros((height, width, 4), np.uint8))


@_sprite
def robot(radius: float, colour: RGB, heading: int, is_faulty: bool) -> Pixels:
    """Return a disc with a nose; a faulty robot's edge is thick.

    Args:
        radius: [px].
        heading: in `HEADINGS`ths of a turn, to the left from the right.
    """
    edge = radius * (0.3 if is_faulty else 0.13) + 0.4
    nose = radius * 1.45 + 1.0
    x, y = pixels(nose)
    turned = -2.0 * math.pi * heading / HEADINGS
    return painted(
        (wedge(x, y, turned, nose, radius * 0.5, radius * 0.6 + 0.5), INK, 1.0),
        (disc(x, y, radius), INK, 1.0),
        (disc(x, y, radius - edge), colour, 1.0),
    )


@_sprite
def halo(radius: float, age: int) -> Pixels:
    """Return the glow about a robot of that radius [px]; `age` in [0, HALOS), oldest last."""
    strength = 1.0 - age / HALOS
    reach = radius * (1.5 + 1.0 * strength)
    x, y = pixels(reach)
    fading = np.clip((reach - np.hypot(x, y)) / (reach - radius), 0.0, 1.0)
    glow = painted((disc(x, y, reach), TIMER, 0.25 + 0.4 * strength))
    glow[..., 3] = np.rint(glow[..., 3] * fading**0.7)
    return glow


@_sprite
def item(half: float, is_requested: bool) -> Pixels:
    """Return a square of about that half side [px]; its edges fall between pixels."""
    half = math.floor(half) + 0.5
    x, y = pixels(half)
    inner = half - max(1, round(0.2 * half))
    edge, colour = ITEM_EDGE, ITEM
    if is_requested:
        edge, colour = INK, REQUESTED
    return painted((box(x, y, half, half), edge, 1.0), (box(x, y, inner, inner), colour, 1.0))


@_sprite
def target(radius: float) -> Pixels:
    """Return the ring with four ticks about the requested item, `radius` [px] inside."""
    width = 0.8 + 0.1 * radius
    reach = radius + 4.0 * width
    x, y = pixels(reach)
    middle = (radius + reach) / 2
    arm = reach - middle
    # The distance to one tick on each axis is that to both.
    beside = box(np.abs(x) - middle, y, arm, width / 2)
    above = box(x, np.abs(y) - middle, width / 2, arm)
    shape = np.minimum.reduce([ring(x, y, radius + width / 2, width), beside, above])
    # A white edge keeps it apart from whatever lies below.
    return painted((shape - 1.0, FLOOR, 0.8), (shape, REQUESTED, 1.0))


@_sprite
def obstacle(radius: float) -> Pixels:
    """Return a solid disc of that radius [px]."""
    x, y = pixels(radius)
    return painted((disc(x, y, radius), INK, 1.0), (disc(x, y, radius - 2.0), OBSTACLE, 1.0))


@_sprite
def arrowhead(length: float, heading: int) -> Pixels:
    """Return a triangle of that length [px] with its tip in the middle of the picture."""
    x, y = pixels(1.2 * length)
    turned = -2.0 * math.pi * heading / HEADINGS
    return painted((wedge(x, y, turned, 0.0, -length, 0.45 * length), LINK, 1.0))


def heading_step(angle: float) -> int:
    """Return an angle [rad], to the left from the right, in `HEADINGS`ths of a turn."""
    return round(angle * HEADINGS / (2.0 * math.pi)) % HEADINGS


@lru_cache(maxsize=512)
def words(text: str, height: int, colour: RGB = INK) -> Surface:
    """Return a line of text of that height [px], in the font that pygame brings along."""
    # A font is not kept, because a pygame.quit() elsewhere would make it unusable.
    pygame.font.init()
    # Text is drawn larger and shrunk, because pygame draws small letters without the dot of an i.
    large = pygame.font.Font(None, _LETTERS * height).render(text, True, colour)
    width, tall = large.get_size()
    size = max(1, round(width / _LETTERS)), max(1, round(tall / _LETTERS))
    small = pygame.transform.smoothscale(large, size)
    # The bytes are in the order of the picture's own, which is drawn ten times as fast.
    return pygame.image.frombytes(pygame.image.tobytes(small, "RGBA"), size, "RGBA")


@lru_cache(maxsize=256)
def badge(mark: str, height: int) -> Surface:
    """Return a mark in white on a black pill of that height [px]."""
    text = words(mark, round(1.25 * height), FLOOR)
    text = text.subsurface(text.get_bounding_rect())
    radius = height / 2
    half_width = max(radius, text.get_width() / 2 + 0.3 * height)
    x, y = pixels(half_width)
    y = y[np.abs(y[:, 0]) <= radius + 2.0]
    edge, inside = pill(x, y, half_width + 1.0, radius + 1.0), pill(x, y, half_width, radius)
    surface = _surface(painted((edge, FLOOR, 0.9), (inside, INK, 1.0)))
    surface.blit(text, text.get_rect(center=surface.get_rect().center))
    return surface
