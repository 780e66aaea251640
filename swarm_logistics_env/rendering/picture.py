"""The warehouse as a picture, and the lines below it that tell what cannot be seen in it."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from functools import lru_cache
from operator import attrgetter
from typing import NamedTuple

import numpy as np
import pygame
from numpy.typing import NDArray
from pygame import Surface

from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.warehouse.state import NOBODY, STORED, WarehouseState

from . import palette, sprites
from .sprites import Pixels, Point, badge, blank, draw_line, new_canvas, stamp, words

_MARGIN = 0.025  # a part of the picture's size, on each side


class Projection(NamedTuple):
    """The warehouse's place on a picture, x to the right and y up, as on paper.

    Attributes:
        scale: [px/m].
        left, top: the warehouse's upper left corner [px].
        right, bottom: its lower right corner [px].
        margin: between warehouse, caption and the picture's edges [px].
    """

    scale: float
    left: int
    top: int
    right: int
    bottom: int
    margin: int

    @classmethod
    def fitting(cls, scenario: Scenario, size: int, least_width: int) -> Projection:
        """Return the projection whose longer side is `size` [px], margins included.

        A warehouse narrower than `least_width` [px], margins included, stands in the middle of it.
        """
        margin = max(6, round(_MARGIN * size))
        width, height = scenario.warehouse_width, scenario.warehouse_height
        scale = (size - 2 * margin) / max(width, height)
        across, down = round(scale * width), round(scale * height)
        left = max(margin, (least_width - across) // 2)
        return cls(scale, left, margin, left + across, margin + down, margin)

    @property
    def width(self) -> int:
        """Width of the picture [px]; even, which films want."""
        width = self.right + self.left
        return width + width % 2

    def points(self, positions: NDArray[np.float64]) -> list[tuple[float, float]]:
        """Return positions (K, 2) [m] as K pixels, not rounded."""
        pixels = positions * (self.scale, -self.scale) + (self.left, self.bottom)
        return [(x, y) for x, y in pixels.tolist()]


# What decides the picture's layout.
_shape = attrgetter(
    "warehouse_width", "warehouse_height", "delivery_width",
    "robot_radius", "item_radius", "obstacle_radius",
)  # fmt: skip


class Picture:
    """Draws states of a warehouse; see `Renderer` for the arguments.

    Attributes:
        projection: the place of the warehouse on the picture.
        width, height: of the picture [px], caption included.
    """

    def __init__(self, scenario: Scenario, size: int) -> None:
        self._size = size
        self._lay_out(scenario)

    def draw(self, state: WarehouseState, scenario: Scenario) -> Surface:
        """Return the picture of `state`, which stays as it is until the next call."""
        if self._shape != _shape(scenario):
            self._lay_out(scenario)
        canvas, projection = self._canvas, self.projection
        canvas.blit(self._background, (0, 0))
        robots = projection.points(state.robot_position)
        items = projection.points(state.item_position)
        # Glow stops at the walls.
        canvas.set_clip(self._floor)
        obstacle = sprites.obstacle(self._obstacle_radius)
        stamp(canvas, ((obstacle, at) for at in projection.points(state.obstacle_position)))
        self._draw_halos(state, scenario, robots)
        item = sprites.item(self._item_half, False)
        stored = np.flatnonzero(state.item_status == STORED).tolist()
        stamp(canvas, ((item, items[number]) for number in stored))
        carrier = state.carrier
        if carrier != NOBODY and (leader := palette.followed(state, scenario, carrier)) != NOBODY:
            _draw_arrow(canvas, robots[carrier], robots[leader], self._robot_radius)
        canvas.set_clip(None)
        self._draw_robots(state, robots)
        self._draw_requested(state, items)
        self._draw_badges(state, robots)
        self._caption.draw(canvas, state, scenario)
        return canvas

    def _lay_out(self, scenario: Scenario) -> None:
        text_height = max(13, round(self._size / 38))
        margin = Projection.fitting(scenario, self._size, 0).margin
        least_width = Caption.least_width(text_height) + 2 * margin
        self.projection = projection = Projection.fitting(scenario, self._size, least_width)
        self._caption = Caption(
            margin, projection.bottom + margin, projection.width - 2 * margin, text_height
        )
        height = projection.bottom + margin + self._caption.height + margin // 2
        height += height % 2  # even, as the width
        self.width, self.height = projection.width, height
        self._canvas = new_canvas(projection.width, height)
        self._background = new_canvas(projection.width, height)
        self._background.blit(background(projection, scenario, height, text_height), (0, 0))
        self._caption.draw_legend(self._background)
        left, top = projection.left, projection.top
        self._floor = pygame.Rect(left, top, projection.right - left, projection.bottom - top)
        # Things stay visible in a warehouse that is drawn small.
        self._robot_radius = max(3.5, projection.scale * scenario.robot_radius)
        self._item_half = max(2.0, 0.8 * (projection.scale * scenario.item_radius))
        self._obstacle_radius = max(3.0, projection.scale * scenario.obstacle_radius)
        self._shape = _shape(scenario)

    def _draw_halos(self, state: WarehouseState, scenario: Scenario, robots: list[Point]) -> None:
        age = state.robot_timer / scenario.timer_limit
        glowing = np.flatnonzero(state.robot_present & (age < 1.0)).tolist()
        ages = (int(age[robot] * sprites.HALOS) for robot in glowing)
        halos = (sprites.halo(self._robot_radius, one) for one in ages)
        stamp(self._canvas, zip(halos, [robots[robot] for robot in glowing]))

    def _draw_robots(self, state: WarehouseState, robots: list[Point]) -> None:
        radius, stamps = self._robot_radius, []
        load = sprites.item(max(1.5, 0.45 * radius), False)
        faulty, headings = state.failed.tolist(), state.robot_heading.tolist()
        for robot in np.flatnonzero(state.robot_present).tolist():
            activity = palette.activity(state, robot)
            step = sprites.heading_step(headings[robot])
            body = sprites.robot(radius, palette.ACTIVITIES[activity], step, faulty[robot])
            stamps.append((body, robots[robot]))
            if activity == "shuffling":
                stamps.append((load, robots[robot]))
        stamp(self._canvas, stamps)

    def _draw_requested(self, state: WarehouseState, items: list[Point]) -> None:
        if state.requested == NOBODY:
            return
        at, radius = items[state.requested], self._robot_radius
        half = 1.4 * self._item_half if state.carrier == NOBODY else 0.5 * radius
        shown = sprites.target(1.9 * radius + 1.0), sprites.item(max(1.5, half), True)
        stamp(self._canvas, [(sprite, at) for sprite in shown])

    def _draw_badges(self, state: WarehouseState, robots: list[Point]) -> None:
        height = max(11, round(1.2 * self._robot_radius))
        away = 0.8 * self._robot_radius + 0.3 * height
        area = self._canvas.get_rect()
        for robot in np.flatnonzero(state.robot_present & state.failed).tolist():
            sprite = sprites.badge(palette.mark(state.failure_modes[robot]), height)
            x, y = robots[robot]
            place = sprite.get_rect(center=(round(x + away), round(y - away)))
            self._canvas.blit(sprite, place.clamp(area))


def background(
    projection: Projection, scenario: Scenario, height: int, text_height: int
) -> Surface:
    """Return the empty warehouse on a picture of that height [px]."""
    picture = np.full((height, projection.width, 3), palette.SURROUNDINGS, np.uint8)
    left, right = projection.left, projection.right
    top, bottom = projection.top, projection.bottom
    wall = max(2, projection.margin // 5)
    picture[top - wall : bottom + wall, left - wall : right + wall] = palette.INK
    floor = picture[top:bottom, left:right]
    floor[:] = palette.FLOOR
    for metre in range(1, math.ceil(scenario.warehouse_width)):
        floor[:, round(projection.scale * metre)] = palette.FLOOR_LINE
    for metre in range(1, math.ceil(scenario.warehouse_height)):
        floor[-round(projection.scale * metre)] = palette.FLOOR_LINE
    edge = round(projection.scale * scenario.storage_width)
    area = floor[:, edge:]
    area[:] = _hatched(area.shape[0], area.shape[1], period=max(6.0, 0.6 * projection.margin))
    area[:, : max(1, wall // 2)] = palette.DELIVERY_WORD
    size = (projection.width, height)
    surface = pygame.image.frombytes(picture.tobytes(), size, "RGB")
    name = pygame.transform.rotate(words("DELIVERY", text_height, palette.DELIVERY_WORD), 90)
    if area.shape[1] > 1.5 * name.get_width() and area.shape[0] > name.get_height():
        middle = (left + edge + area.shape[1] // 2, (top + bottom) // 2)
        place = name.get_rect(center=middle)
        surface.fill(palette.DELIVERY_AREA, place.inflate(6, 12))
        surface.blit(name, place)
    return surface


def _hatched(height: int, width: int, period: float) -> Pixels:
    y, x = np.ogrid[:height, :width]
    across = np.abs((x + y) / math.sqrt(2.0) % period - period / 2) - 0.06 * period
    cover = np.clip(0.5 - across, 0.0, 1.0)[..., None]
    colour = cover * palette.DELIVERY_HATCH + (1.0 - cover) * palette.DELIVERY_AREA
    return np.asarray(np.rint(colour), np.uint8)


def _draw_arrow(canvas: Surface, start: Point, end: Point, radius: float) -> None:
    width = max(2.0, radius / 3.5)
    way = np.subtract(end, start)
    length = math.hypot(*way)
    head = 4.0 + 2.5 * width
    # The tip stops short of the robot; robots that touch leave no room for an arrow.
    gap = radius + 2.0
    if length <= 2.0 * gap + head:
        return
    along = way / length
    tip = end - gap * along
    draw_line(canvas, np.array(start), tip - 0.8 * head * along, width)
    x_part, y_part = along.tolist()
    step = sprites.heading_step(math.atan2(-y_part, x_part))
    stamp(canvas, [(sprites.arrowhead(head, step), (tip[0], tip[1]))])


# The widest texts there may be, so that a picture's size does not change with what happens.
_WIDEST = ("time 0000.0 s", "N = 000", "P = 000 of 000")


class Caption:
    """Writes what cannot be seen in the warehouse itself.

    Args:
        left, top: its upper left corner [px].
        width: the longest line that fits [px].
        text_height: the height of letters [px].
    """

    def __init__(self, left: int, top: int, width: int, text_height: int) -> None:
        self._left, self._top = left, top
        self._width, self._text_height = width, text_height
        self._line = round(1.35 * text_height)
        self._places = self._flow([words(text, text_height) for text in _WIDEST])
        self._legend = _legend(text_height)
        self._legend_places = self._flow(self._legend)
        self._failures_line = self._places[-1][1] + 1
        self._legend_line = self._failures_line + 1
        self.height = (self._legend_line + self._legend_places[-1][1] + 1) * self._line

    @staticmethod
    def least_width(text_height: int) -> int:
        """Return the width [px] below which words would be cut."""
        return max(words(text, text_height).get_width() for text in _WIDEST)

    def draw_legend(self, canvas: Surface) -> None:
        """Draw what the colours mean, which never changes."""
        for entry, (x, line) in zip(self._legend, self._legend_places):
            self._put(canvas, entry, x, self._legend_line + line)

    def draw(self, canvas: Surface, state: WarehouseState, scenario: Scenario) -> None:
        """Write the scores and the failures of `state`."""
        total = "" if scenario.restock else f" of {scenario.n_items}"
        performance = f"P = {state.delivered}{total}"
        scores = f"time {state.time:.1f} s", f"N = {state.n_robots}", performance
        for text, (x, line) in zip(scores, self._places):
            self._put(canvas, words(text, self._text_height), x, line)
        self._draw_failures(canvas, state)

    def _draw_failures(self, canvas: Surface, state: WarehouseState) -> None:
        failed, text_height = int(state.failed.sum()), self._text_height
        chips = [words(f"failed: {failed}" if failed else "no failures", text_height)]
        counts = Counter(mode for modes in state.failure_modes for mode in modes)
        chips += [_failure(mode, count, text_height) for mode, count in counts.items()]
        more, gap = words("…", text_height), text_height // 2
        x = 0
        for place, chip in enumerate(chips):
            room = 0 if place == len(chips) - 1 else gap + more.get_width()
            if x + chip.get_width() + room > self._width:
                self._put(canvas, more, x, self._failures_line)
                return
            self._put(canvas, chip, x, self._failures_line)
            x += chip.get_width() + gap

    def _put(self, canvas: Surface, chip: Surface, x: int, line: int) -> None:
        middle = self._top + line * self._line + self._text_height // 2
        canvas.blit(chip, (self._left + x, middle - chip.get_height() // 2))

    def _flow(self, chips: Sequence[Surface]) -> list[tuple[int, int]]:
        """Return where these go: x [px] and number of the line."""
        places, x, line = [], 0, 0
        for chip in chips:
            width = chip.get_width()
            if x and x + width > self._width:
                x, line = 0, line + 1
            places.append((x, line))
            x += width + self._text_height
        return places


@lru_cache(maxsize=128)
def _failure(mode: str, count: int, text_height: int) -> Surface:
    name = words(f"{mode} ×{count}", text_height)
    if mode not in palette.MARKS:
        return name
    mark = badge(palette.MARKS[mode], round(0.7 * text_height))
    return _row([(mark,), (name,)], text_height // 5)


def _legend(text_height: int) -> tuple[Surface, ...]:
    radius = 0.42 * text_height
    load, asked_for = sprites.item(0.45 * radius, False), sprites.item(0.5 * radius, True)
    entries = {
        "searching": (sprites.robot(radius, palette.SEARCHING, 0, False),),
        "shuffling": (sprites.robot(radius, palette.SHUFFLING, 0, False), load),
        "delivering": (sprites.robot(radius, palette.DELIVERING, 0, False), asked_for),
        "requested item": (sprites.item(0.9 * radius, True),),
        "timer": (
            sprites.halo(0.6 * radius, 0),
            sprites.robot(0.6 * radius, palette.SEARCHING, 0, False),
        ),
    }
    return tuple(
        _row([pictures, (words(name, text_height),)], text_height // 4)
        for name, pictures in entries.items()
    )


def _row(stacks: Sequence[tuple[Surface, ...]], gap: int) -> Surface:
    """Return stacks of pictures side by side, each centred on the one it lies on."""
    width = sum(stack[0].get_width() for stack in stacks) + gap * (len(stacks) - 1)
    height = max(stack[0].get_height() for stack in stacks)
    row = blank(width, height)
    x = 0
    for stack in stacks:
        middle = (x + stack[0].get_width() // 2, height // 2)
        for picture in stack:
            row.blit(picture, picture.get_rect(center=middle))
        x += stack[0].get_width() + gap
    return row
