"""The warehouse as a picture, with its lines over the floor: trails, radio links, sensor beams."""

from __future__ import annotations

import itertools
import math
from operator import attrgetter

import numpy as np
import pygame

from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.warehouse.state import NOBODY, STORED, WarehouseState

from . import palette, sprites
from .caption import Caption
from .readings import N_BEAMS, Projection, Trails, activity, followed, ranges
from .sprites import Point, draw_line, new_canvas, stamp, words

# What decides the picture's layout.
_shape = attrgetter(
    "warehouse_width", "warehouse_height", "delivery_width",
    "robot_radius", "item_radius", "obstacle_radius",
)  # fmt: skip


class Picture:
    """Draws states of a warehouse; see `Renderer` for the arguments.

    Attributes:
        trails: the robots' paths so far, or None; each state that is noted or drawn is added.
        projection: the place of the warehouse on the picture.
    """

    def __init__(
        self,
        scenario: Scenario,
        size: int,
        show_beams_of: int | None,
        trails: bool,
        all_links: bool,
    ) -> None:
        self._size, self._show_beams_of, self._all_links = size, show_beams_of, all_links
        self.trails = Trails() if trails else None
        self._lay_out(scenario)

    @property
    def width(self) -> int:
        """Width of the picture [px]."""
        return self._canvas.get_width()

    @property
    def height(self) -> int:
        """Height of the picture [px], caption included."""
        return self._canvas.get_height()

    def note(self, state: WarehouseState) -> None:
        """Let trails lead through a state that is not drawn."""
        if self.trails is not None:
            self.trails.note(state)

    def draw(self, state: WarehouseState, scenario: Scenario) -> pygame.Surface:
        """Return the picture of `state`, which stays as it is until the next call."""
        if self._shape != _shape(scenario):
            self._lay_out(scenario)
        canvas, projection = self._canvas, self.projection
        canvas.blit(self._background, (0, 0))
        robots = projection.points(state.robot_position)
        items = projection.points(state.item_position)
        # Glow and beams stop at the walls.
        canvas.set_clip(self._floor)
        if self.trails is not None:
            self.trails.note(state)
            draw_trails(canvas, projection, self.trails)
        obstacle = sprites.obstacle(self._obstacle_radius)
        stamp(canvas, ((obstacle, at) for at in projection.points(state.obstacle_position)))
        self._draw_halos(state, scenario, robots)
        item = sprites.item(self._item_half, False)
        stored = np.flatnonzero(state.item_status == STORED).tolist()
        stamp(canvas, ((item, items[number]) for number in stored))
        draw_links(canvas, state, scenario, robots, self._robot_radius, all_links=self._all_links)
        watched = self._show_beams_of
        if watched is not None and watched < state.n_robots and state.robot_present[watched]:
            draw_beams(canvas, state, scenario, robots[watched], watched, projection)
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
        self._canvas = new_canvas(projection.width, height)
        self._background = new_canvas(projection.width, height)
        self._background.blit(background(projection, scenario, height, text_height), (0, 0))
        self._caption.draw_legend(self._background)
        left, top = projection.left, projection.top
        self._floor = pygame.Rect(left, top, projection.right - left, projection.bottom - top)
        # Things stay visible in a warehouse that is drawn small.
        self._robot_radius = max(3.5, projection.length(scenario.robot_radius))
        self._item_half = max(2.0, 0.8 * projection.length(scenario.item_radius))
        self._obstacle_radius = max(3.0, projection.length(scenario.obstacle_radius))
        self._shape = _shape(scenario)

    def _draw_halos(self, state: WarehouseState, scenario: Scenario, robots: list[Point]) -> None:
        age = state.robot_timer / scenario.timer_limit
        glowing = np.flatnonzero(state.robot_present & (age < 1.0)).tolist()
        stamp(
            self._canvas,
            (
                (sprites.halo(self._robot_radius, int(age[robot] * sprites.HALOS)), robots[robot])
                for robot in glowing
            ),
        )

    def _draw_robots(self, state: WarehouseState, robots: list[Point]) -> None:
        radius, stamps = self._robot_radius, []
        load = sprites.item(max(1.5, 0.45 * radius), False)
        faulty, headings = state.failed.tolist(), state.robot_heading.tolist()
        carried = state.robot_item.tolist()
        for robot in np.flatnonzero(state.robot_present).tolist():
            colour = palette.ACTIVITIES[activity(state, robot)]
            step = sprites.heading_step(headings[robot])
            body = sprites.robot(radius, colour, step, faulty[robot])
            stamps.append((body, robots[robot]))
            if carried[robot] not in (NOBODY, state.requested):
                stamps.append((load, robots[robot]))
        stamp(self._canvas, stamps)

    def _draw_requested(self, state: WarehouseState, items: list[Point]) -> None:
        if state.requested == NOBODY:
            return
        at = items[state.requested]
        is_carried = state.carrier != NOBODY
        half = 0.5 * self._robot_radius if is_carried else 1.4 * self._item_half
        stamp(
            self._canvas,
            [
                (sprites.target(1.9 * self._robot_radius + 1.0), at),
                (sprites.item(max(1.5, half), True), at),
            ],
        )

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


_TRAIL_SHADES = 5


def draw_trails(canvas: pygame.Surface, projection: Projection, trails: Trails) -> None:
    """Draw the paths of the robots; older parts are paler."""
    past = trails.positions()
    times, n_robots, _ = past.shape
    pixels = np.array(projection.points(past.reshape(-1, 2))).reshape(times, n_robots, 2)
    borders = np.linspace(0, times - 1, _TRAIL_SHADES + 1).round().astype(int).tolist()
    for shade, (first, last) in enumerate(itertools.pairwise(borders)):
        colour = palette.mixed(palette.FLOOR, palette.TRAIL, (shade + 1) / _TRAIL_SHADES)
        for robot in range(n_robots):
            run = pixels[first : last + 1, robot]
            if len(run) > 1 and not np.isnan(run).any():
                pygame.draw.aalines(canvas, colour, False, run.tolist())


def draw_links(
    canvas: pygame.Surface,
    state: WarehouseState,
    scenario: Scenario,
    robots: list[Point],
    radius: float,
    *,
    all_links: bool,
) -> None:
    """Draw an arrow from the requested item's carrier to the neighbour it follows.

    Args:
        robots: the places of the robots on the picture [px].
        radius: the radius of a robot [px].
        all_links: whether to draw thin arrows from all other robots as well.
    """
    carrier = state.carrier
    if all_links:
        for robot in range(state.n_robots):
            leader = followed(state, scenario, robot)
            if robot != carrier and leader != NOBODY:
                _draw_arrow(canvas, robots[robot], robots[leader], radius, 1.0)
    if carrier != NOBODY:
        leader = followed(state, scenario, carrier)
        if leader != NOBODY:
            _draw_arrow(canvas, robots[carrier], robots[leader], radius, max(2.0, radius / 3.5))


def draw_beams(
    canvas: pygame.Surface,
    state: WarehouseState,
    scenario: Scenario,
    at: Point,
    robot: int,
    projection: Projection,
) -> None:
    """Draw how far each beam of a robot, which is at `at` [px], reaches, and its view range."""
    reach = float(state.ranger_range[robot])
    nearest = ranges(state, scenario, robot).min(axis=0)
    dot = sprites.dot(max(2.0, projection.length(scenario.robot_radius) / 4.0), palette.BEAM)
    hits = []
    for beam, distance in enumerate(nearest.tolist()):
        angle = float(state.robot_heading[robot]) + 2.0 * math.pi * beam / N_BEAMS
        far = projection.length(distance)
        end = (at[0] + far * math.cos(angle), at[1] - far * math.sin(angle))
        draw_line(canvas, palette.BEAM, at, end, 1.0)
        if distance < reach:
            hits.append((dot, end))
    stamp(canvas, hits)
    view = projection.length(float(state.view_range[robot]))
    if view > 0.0:
        stamp(canvas, [(sprites.circle(view, 1.5, palette.BEAM), at)])


def _draw_arrow(
    canvas: pygame.Surface, start: Point, end: Point, radius: float, width: float
) -> None:
    length = math.hypot(end[0] - start[0], end[1] - start[1])
    head = 4.0 + 2.5 * width
    # The tip stops short of the robot; robots that touch leave no room for an arrow.
    gap = radius + 2.0
    if length <= 2.0 * gap + head:
        return
    x_part, y_part = (end[0] - start[0]) / length, (end[1] - start[1]) / length
    tip = (end[0] - gap * x_part, end[1] - gap * y_part)
    base = (tip[0] - 0.8 * head * x_part, tip[1] - 0.8 * head * y_part)
    draw_line(canvas, palette.LINK, start, base, width)
    step = sprites.heading_step(math.atan2(-y_part, x_part))
    stamp(canvas, [(sprites.arrowhead(head, step, palette.LINK), tip)])
