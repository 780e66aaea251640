"""Small pictures of what is drawn in the warehouse and its caption; each is drawn once.

They are drawn larger than they are shown, and shrunk, so that they are smooth at any size: pygame
smooths no shape, and draws small letters without the dot of an i.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
import pygame
from numpy.typing import NDArray
from pygame import Rect, Surface, Vector2

from .palette import (
    ACTIVITIES,
    BEAM,
    FLOOR,
    INK,
    ITEM,
    ITEM_EDGE,
    LINK,
    LOW_CHARGE,
    OBSTACLE,
    REQUESTED,
    RGB,
    TIMER,
)

Pixels = NDArray[np.uint8]  # (H, W, 3), red, green, blue

HALOS = 12  # ages of a timer that are told apart
_LARGER = 4  # times as large as they are shown


def new_canvas(width: int, height: int) -> Surface:
    """Return an opaque surface of that size [px], in memory."""
    return Surface((width, height), 0, 32)


def to_array(canvas: Surface) -> Pixels:
    """Return the pixels of a surface as an array of its own: (H, W, 3)."""
    width, height = canvas.get_size()
    pixels = np.empty((height, width, 3), np.uint8)
    pygame.image.frombuffer(pixels.data, (width, height), "RGB").blit(canvas, (0, 0))
    return pixels


def _sheet(reach: float, edge: RGB) -> Surface:
    """Return an empty square to draw on, which reaches so far [px] around its middle pixel.

    Args:
        edge: the colour of its outermost shape, into which shrinking mixes what lies beside it.
    """
    side = _LARGER * (2 * math.ceil(reach) + 1)
    sheet = Surface((side, side), pygame.SRCALPHA, 32)
    sheet.fill((*edge, 0))
    return sheet


def _disc(sheet: Surface, colour: tuple[int, ...], radius: float) -> None:
    pygame.draw.circle(sheet, colour, sheet.get_rect().center, _LARGER * radius)


def _square(sheet: Surface, half: float, is_requested: bool) -> None:
    edge, inside = (INK, REQUESTED) if is_requested else (ITEM_EDGE, ITEM)
    outer = Rect(0, 0, 2 * _LARGER * half, 2 * _LARGER * half)
    outer.center = sheet.get_rect().center
    width = _LARGER * max(1, round(0.2 * half))
    sheet.fill(edge, outer)
    sheet.fill(inside, outer.inflate(-2 * width, -2 * width))


def _shrink(sheet: Surface) -> Surface:
    width, height = sheet.get_size()
    size = max(1, round(width / _LARGER)), max(1, round(height / _LARGER))
    return pygame.transform.smoothscale(sheet, size)


@lru_cache(maxsize=2048)
def robot(radius: float, activity: str, heading: int, is_faulty: bool) -> Surface:
    """Return a disc with a nose, and its load; a faulty robot's edge is thick.

    Args:
        radius: [px].
        activity: a key of `ACTIVITIES`.
        heading: to the left from the right [degrees].
    """
    nose = 1.45 * radius + 1.0
    base = 0.5 * radius
    half_width = 0.6 * radius + 0.5
    sheet = _sheet(nose, INK)
    corners = Vector2(nose, 0.0), Vector2(base, half_width), Vector2(base, -half_width)
    middle = Vector2(sheet.get_rect().center)
    vertices = [middle + _LARGER * corner.rotate(-heading) for corner in corners]
    pygame.draw.polygon(sheet, INK, vertices)
    _disc(sheet, INK, radius)
    _disc(sheet, ACTIVITIES[activity], radius * (0.7 if is_faulty else 0.87) - 0.4)
    if activity != "searching":
        _square(sheet, 0.45 * radius, activity == "delivering")
    return _shrink(sheet)


KIND_OUTLINES = 4  # kinds of robots that outlines tell apart; further ones begin anew


@lru_cache(maxsize=256)
def outline(radius: float, kind: int) -> Surface:
    """Return what is about a robot of that radius [px], by the number of its kind.

    Nothing about the first kind, a ring about the second, then a square and a diamond.
    """
    reach = 1.45 * radius + 2.0
    sheet = _sheet(1.5 * reach, INK)
    width = round(_LARGER * max(1.2, 0.16 * radius))
    middle = Vector2(sheet.get_rect().center)
    shape = kind % KIND_OUTLINES
    if shape == 1:
        pygame.draw.circle(sheet, INK, middle, _LARGER * reach, width)
    elif shape > 1:
        arm = Vector2(_LARGER * reach * 1.3, 0.0)
        first = 45 if shape == 2 else 0
        corners = [middle + arm.rotate(first + 90 * side) for side in range(4)]
        pygame.draw.polygon(sheet, INK, corners, width)
    return _shrink(sheet)


@lru_cache(maxsize=256)
def halo(radius: float, age: int) -> Surface:
    """Return the glow about a robot of that radius [px]; `age` in [0, HALOS), oldest last."""
    strength = 1.0 - age / HALOS
    reach = round(radius * (1.5 + strength))
    sheet = _sheet(reach, TIMER)
    for ring in range(reach, 0, -1):
        fading = min(1.0, (reach - ring + 1) / (reach - radius))
        _disc(sheet, (*TIMER, round(255 * fading * (0.25 + 0.4 * strength))), ring)
    return _shrink(sheet)


@lru_cache(maxsize=256)
def item(half: float, is_requested: bool) -> Surface:
    """Return a square of about that half side [px]; its edges fall between pixels."""
    half = math.floor(half) + 0.5
    sheet = _sheet(half, ITEM)
    _square(sheet, half, is_requested)
    return _shrink(sheet)


@lru_cache(maxsize=256)
def target(radius: float) -> Surface:
    """Return the ring with four ticks about the requested item, `radius` [px] inside."""
    width = 0.8 + 0.1 * radius
    sheet = _sheet(radius + 4.0 * width, REQUESTED)
    area = sheet.get_rect()
    tick = round(_LARGER * width)
    pygame.draw.line(sheet, REQUESTED, area.midleft, area.midright, tick)
    pygame.draw.line(sheet, REQUESTED, area.midtop, area.midbottom, tick)
    _disc(sheet, REQUESTED, radius + width)
    _disc(sheet, (*REQUESTED, 0), radius)  # a hole
    return _shrink(sheet)


@lru_cache(maxsize=256)
def obstacle(radius: float) -> Surface:
    """Return a disc of that radius [px] with a cross, as a column on a plan."""
    sheet = _sheet(radius, INK)
    _disc(sheet, INK, radius)
    _disc(sheet, OBSTACLE, radius - 1.5)
    middle = Vector2(sheet.get_rect().center)
    arm = Vector2(_LARGER * (radius - 1.0), 0.0)
    for angle in (45, 135):
        ends = middle + arm.rotate(angle), middle - arm.rotate(angle)
        pygame.draw.line(sheet, INK, *ends, round(1.5 * _LARGER))
    return _shrink(sheet)


@lru_cache(maxsize=16)
def station(half: float, works: bool) -> Surface:
    """Return a charging station: a plate with a bolt, of half that side [px]; dead: crossed out."""
    sheet = _sheet(half, INK)
    plate = sheet.get_rect().inflate(-2 * _LARGER, -2 * _LARGER)
    pygame.draw.rect(sheet, INK, plate, border_radius=round(0.4 * half * _LARGER))
    inner = plate.inflate(-2.5 * _LARGER, -2.5 * _LARGER)
    pygame.draw.rect(sheet, FLOOR, inner, border_radius=round(0.3 * half * _LARGER))
    bolt = ((0.2, -0.75), (-0.5, 0.15), (-0.05, 0.15), (-0.2, 0.75), (0.5, -0.15), (0.05, -0.15))
    middle = Vector2(plate.center)
    corners = [middle + half * _LARGER * Vector2(corner) for corner in bolt]
    pygame.draw.polygon(sheet, BEAM if works else ITEM_EDGE, corners)
    if not works:
        ends = inner.topleft, inner.bottomright
        pygame.draw.line(sheet, INK, *ends, round(1.5 * _LARGER))
    return _shrink(sheet)


def charge_bar(canvas: Surface, at: Sequence[int], radius: float, charge: float) -> None:
    """Draw how full a robot's battery is, below it; little is told by its colour, too."""
    bar = Rect(0, 0, max(8, round(2.0 * radius)), max(4, round(0.45 * radius)))
    bar.midtop = (at[0], at[1] + round(1.25 * radius))
    pygame.draw.rect(canvas, INK, bar)
    inner = bar.inflate(-2, -2)
    pygame.draw.rect(canvas, FLOOR, inner)
    inner.width = round(charge * inner.width)
    pygame.draw.rect(canvas, TIMER if charge >= LOW_CHARGE else REQUESTED, inner)


def arrow(canvas: Surface, start: Sequence[int], end: Sequence[int], radius: float) -> None:
    """Draw an arrow from a robot to another, whose radius is `radius`, all in [px]."""
    width = max(2.0, radius / 3.5)
    head = 4.0 + 2.5 * width
    offset = Vector2(end) - start
    # The tip stops short of the robot; robots that touch leave no room for an arrow.
    tip = offset.length() - radius - 2.0
    if tip < radius + head:
        return
    half = width / 2
    neck = tip - head
    side = [(0.0, half), (neck, half), (neck, 0.45 * head), (tip, 0.0)]
    corners = side + [(x, -y) for x, y in reversed(side)]
    angle = Vector2(1.0, 0.0).angle_to(offset)
    vertices = [Vector2(corner).rotate(angle) + start for corner in corners]
    # Whole pixels: else the smooth edges lie beside the shape.
    shape = [(round(x), round(y)) for x, y in vertices]
    pygame.draw.polygon(canvas, LINK, shape)
    pygame.draw.aalines(canvas, LINK, True, shape)


def _render_text(text: str, height: float, colour: RGB) -> Surface:
    # A font is not kept, because a pygame.quit() elsewhere would make it unusable.
    pygame.font.init()
    return pygame.font.Font(None, round(_LARGER * height)).render(text, True, colour)


@lru_cache(maxsize=512)
def words(text: str, height: int, colour: RGB = INK) -> Surface:
    """Return a line of text of that height [px], in the font that pygame brings along."""
    return _shrink(_render_text(text, height, colour))


@lru_cache(maxsize=256)
def badge(mark: str, height: int, colour: RGB = INK) -> Surface:
    """Return a mark in white on a pill of that height [px] and colour."""
    text = _render_text(mark, 1.25 * height, FLOOR)
    letters = text.get_bounding_rect()
    tall = _LARGER * height
    pill = Rect(_LARGER, _LARGER, max(tall, letters.width + 0.6 * tall), tall)
    sheet = Surface((pill.width + 2 * _LARGER, pill.height + 2 * _LARGER), pygame.SRCALPHA, 32)
    sheet.fill((*FLOOR, 0))
    pygame.draw.rect(sheet, FLOOR, sheet.get_rect(), border_radius=tall)
    pygame.draw.rect(sheet, colour, pill, border_radius=tall)
    sheet.blit(text, letters.move(Vector2(pill.center) - letters.center).topleft, letters)
    return _shrink(sheet)
