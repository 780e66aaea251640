"""The warehouse as a picture, and the lines below it that tell what cannot be seen in it."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np
import pygame
from numpy.typing import NDArray
from pygame import Rect, Surface

from swarm_logistics_env.world.scenario import Scenario
from swarm_logistics_env.world.warehouse.state import NOBODY, STORED, WarehouseState

from . import palette, sprites
from .legend import LATE, OBSTACLE, legend
from .plan_picture import PlanPicture
from .plan_shapes import dock_hue
from .sprites import new_canvas, words

PixelPoint = tuple[int, int]  # [px]

_HEADING_STEP = 3  # [degrees] between headings that are told apart
# The widest scores there may be, so that a picture's size does not change with what happens.
_WIDEST = "time 0000.0 s    N = 000    P = 000 of 000"
_WIDEST_ORDERS = "    000 wait, 000 late"


def _has_times(scenario: Scenario) -> bool:
    """Return whether orders wait, or can be late."""
    return scenario.has_orders or scenario.has_due_times


class Picture:
    """Draws states of a warehouse; see `Renderer` for the arguments.

    Attributes:
        floor: the place of the warehouse on the picture [px].
        width, height: of the picture [px], caption included; even, which films want.
    """

    def __init__(self, scenario: Scenario, size: int) -> None:
        self._margin = max(4, round(size / 80))
        self._longer_side = size - 2 * self._margin
        self._lay_out(scenario)

    def draw(self, state: WarehouseState, scenario: Scenario) -> Surface:
        """Return the picture of `state`, which stays as it is until the next call."""
        if scenario is not self._scenario:
            self._lay_out(scenario)
        self._canvas.blit(self._background, (0, 0))
        robots = self._pixels(state.robot_position)
        items = self._pixels(state.item_position)
        # Glow stops at the walls.
        self._canvas.set_clip(self.floor)
        for at in self._pixels(state.obstacle_position):
            self._stamp(sprites.obstacle(self._obstacle_radius), at)
        self._draw_stations(state)
        self._draw_halos(state, robots)
        for number in np.flatnonzero(state.item_status == STORED).tolist():
            self._stamp(sprites.item(self._item_half, False), items[number])
        for carrier in np.flatnonzero(state.carries_requested).tolist():
            if (leader := palette.leader_of(state, scenario, carrier)) != NOBODY:
                reach = self._radii[leader]
                sprites.arrow(self._canvas, robots[carrier], robots[leader], reach)
        self._canvas.set_clip(None)
        self._draw_robots(state, robots)
        for number in np.flatnonzero(state.item_requested).tolist():
            if state.item_carrier[number] == NOBODY:
                self._stamp(sprites.item(1.4 * self._item_half, True), items[number])
            self._stamp(sprites.target(1.9 * self._robot_radius + 1.0), items[number])
        self._draw_named_docks(state, items)
        self._draw_late(state, items)
        self._draw_charges(state, robots)
        self._draw_badges(state, robots)
        self._write_caption(state)
        return self._canvas

    def _lay_out(self, scenario: Scenario) -> None:
        """Draw what changes with the scenario alone."""
        self._scenario = scenario
        margin = self._margin
        across = scenario.warehouse_width
        down = scenario.warehouse_height
        self._scale = scale = self._longer_side / max(across, down)
        # In a long warehouse words are as small as in a square of twice its shorter side.
        side = min(self._longer_side, 2.0 * scale * min(across, down))
        self._text_height = max(13, round(side / 37))
        self._line = round(1.35 * self._text_height)
        self._wall = max(2, self._text_height // 5)
        self.floor = Rect(0, margin, round(scale * across), round(scale * down))
        # A warehouse that is narrower than its caption stands in the middle above it.
        scores = _WIDEST + (_WIDEST_ORDERS if _has_times(scenario) else "")
        width = max(self.floor.width, words(scores, self._text_height).get_width()) + 2 * margin
        self.width = width + width % 2
        self.floor.centerx = self.width // 2
        # Things stay visible in a warehouse that is drawn small.
        self._radii = np.maximum(3.5, scale * scenario.of_robots("robot_radius")).tolist()
        self._robot_radius = max(self._radii)
        self._item_half = max(2.0, 0.8 * scale * scenario.item_radius)
        self._obstacle_radius = max(3.0, scale * scenario.obstacle_radius)
        self._caption = self.floor.bottom + margin + self._text_height // 2
        entries, height = self._legend()
        self.height = height + height % 2
        self._canvas = new_canvas(self.width, self.height)
        self._background = new_canvas(self.width, self.height)
        self._draw_floor(scenario)
        for picture, at in entries:
            self._background.blit(picture, picture.get_rect(midleft=at))

    def _draw_floor(self, scenario: Scenario) -> None:
        picture = self._background
        floor = self.floor
        scale = self._scale
        wall = self._wall
        picture.fill(palette.SURROUNDINGS)
        picture.fill(palette.INK, floor.inflate(2 * wall, 2 * wall))
        picture.fill(palette.FLOOR, floor)
        plan = scenario.plan
        plan_picture = None if plan is None else PlanPicture(plan, floor, scale)
        if plan_picture is not None:
            plan_picture.draw_areas(picture)
        for x in range(1, math.ceil(scenario.warehouse_width)):
            picture.fill(palette.FLOOR_LINE, (floor.left + scale * x, floor.top, 1, floor.height))
        for y in range(1, math.ceil(scenario.warehouse_height)):
            picture.fill(palette.FLOOR_LINE, (floor.left, floor.bottom - scale * y, floor.width, 1))
        if plan_picture is None:
            self._draw_delivery_area(floor.move(round(scale * scenario.storage_width), 0))
        else:
            plan_picture.draw_docks_and_solids(picture)

    def _draw_delivery_area(self, area: Rect) -> None:
        picture = self._background
        area = area.clip(self.floor)
        picture.set_clip(area)
        picture.fill(palette.DELIVERY_AREA)
        for x in range(area.left, area.right + area.height, 2 * max(4, self._margin)):
            ends = (x, area.top), (x - area.height, area.bottom)
            pygame.draw.line(picture, palette.DELIVERY_HATCH, *ends, 1 + self._margin // 10)
        picture.fill(palette.DELIVERY_WORD, (*area.topleft, max(1, self._wall // 2), area.height))
        name = words("DELIVERY", self._text_height, palette.DELIVERY_WORD)
        name = pygame.transform.rotate(name, 90)
        box = name.get_rect(center=area.center)
        picture.fill(palette.DELIVERY_AREA, box.inflate(6, 12))
        picture.blit(name, box)
        picture.set_clip(None)

    def _legend(self) -> tuple[list[tuple[Surface, PixelPoint]], int]:
        """Return pictures and words of the legend, each with its left end, and where it ends."""
        height = self._text_height
        marks = legend(self._scenario, height)
        entries = []
        x = self._margin
        y = self._caption + 2 * self._line
        for name, picture in marks.items():
            word = words(name, height)
            wide = picture.get_width() + height // 3
            if x + wide + word.get_width() > self.width - self._margin:
                x = self._margin
                y = y + self._line
            # Its height does not depend on whether there are obstacles.
            if name != OBSTACLE or self._scenario.n_obstacles:
                entries += [(picture, (x, y)), (word, (x + wide, y))]
            x += wide + word.get_width() + round(0.8 * height)
        return entries, y + self._line

    def _pixels(self, positions: NDArray[np.float64]) -> list[PixelPoint]:
        """Return positions (K, 2) [m] as K pixels."""
        pixels = positions * (self._scale, -self._scale) + self.floor.bottomleft
        return [(x, y) for x, y in np.rint(pixels).astype(int).tolist()]

    def _stamp(self, sprite: Surface, at: PixelPoint) -> None:
        self._canvas.blit(sprite, sprite.get_rect(center=at))

    def _draw_halos(self, state: WarehouseState, robots: list[PixelPoint]) -> None:
        age = state.robot_timer / self._scenario.timer_limit
        for robot in np.flatnonzero(state.robot_present & (age < 1.0)).tolist():
            sprite = sprites.halo(self._radii[robot], int(age[robot] * sprites.HALOS))
            self._stamp(sprite, robots[robot])

    def _draw_robots(self, state: WarehouseState, robots: list[PixelPoint]) -> None:
        steps = np.rint(np.degrees(state.robot_heading) / _HEADING_STEP).astype(int)
        headings = (_HEADING_STEP * steps % 360).tolist()
        for robot in np.flatnonzero(state.robot_present).tolist():
            activity = palette.activity(state, robot)
            is_faulty = bool(state.failed[robot])
            if state.robot_kind[robot]:
                outline = sprites.outline(self._radii[robot], int(state.robot_kind[robot]))
                self._stamp(outline, robots[robot])
            sprite = sprites.robot(self._radii[robot], activity, headings[robot], is_faulty)
            self._stamp(sprite, robots[robot])

    def _draw_stations(self, state: WarehouseState) -> None:
        half = max(5.0, 1.3 * self._robot_radius)
        works = state.stations_working
        for number, at in enumerate(self._pixels(state.batteries.station_position)):
            self._stamp(sprites.station(half, bool(works[number])), at)

    def _draw_charges(self, state: WarehouseState, robots: list[PixelPoint]) -> None:
        if self._scenario.battery is None:
            return
        charge = state.robot_charge.tolist()
        for robot in np.flatnonzero(state.robot_present).tolist():
            sprites.charge_bar(self._canvas, robots[robot], self._radii[robot], charge[robot])

    def _draw_badges(self, state: WarehouseState, robots: list[PixelPoint]) -> None:
        height = max(11, round(1.2 * self._robot_radius))
        for robot in np.flatnonzero(state.robot_present & state.failed).tolist():
            sprite = sprites.badge(palette.mark(state.failure_modes[robot]), height)
            x, y = robots[robot]
            away = round(0.8 * self._radii[robot] + 0.3 * height)
            box = sprite.get_rect(center=(x + away, y - away))
            self._canvas.blit(sprite, box.clamp(self._canvas.get_rect()))

    def _draw_named_docks(self, state: WarehouseState, items: list[PixelPoint]) -> None:
        """Draw the letter of the dock that a request names, below its item."""
        plan = self._scenario.plan
        if plan is None or not self._scenario.names_docks:
            return
        height = max(12, round(1.3 * self._robot_radius))
        away = round(1.3 * self._robot_radius + 0.5 * height)
        for number in np.flatnonzero(state.item_requested).tolist():
            dock = int(state.item_docks[number])
            if dock == NOBODY:
                continue
            _, _, colour = palette.dock_colours(dock_hue(dock))
            sprite = sprites.badge(plan.dock_names[dock], height, colour)
            x, y = items[number]
            box = sprite.get_rect(center=(x + away, y + away))
            self._canvas.blit(sprite, box.clamp(self._canvas.get_rect()))

    def _draw_late(self, state: WarehouseState, items: list[PixelPoint]) -> None:
        """Draw the mark of what is late, above the item."""
        height = max(12, round(1.3 * self._robot_radius))
        away = round(1.3 * self._robot_radius + 0.5 * height)
        for number in np.flatnonzero(state.item_late).tolist():
            x, y = items[number]
            sprite = sprites.badge(LATE, height)
            box = sprite.get_rect(center=(x - away, y - away))
            self._canvas.blit(sprite, box.clamp(self._canvas.get_rect()))

    def _write_caption(self, state: WarehouseState) -> None:
        total = "" if self._scenario.restock else f" of {self._scenario.n_items}"
        scores = f"time {state.time:.1f} s    N = {state.n_robots}    P = {state.delivered}{total}"
        if _has_times(self._scenario):
            scores += f"    {state.n_waiting} wait, {state.item_late.sum()} late"
        counts = Counter(mode for modes in state.failure_modes for mode in modes)
        entries = [f"{palette.mark((mode,))}: {mode} ×{n}" for mode, n in counts.items()]
        failures = (
            f"{state.failed.sum()} failed ({', '.join(entries)})" if entries else "no failures"
        )
        for line, text in enumerate((scores, failures)):
            written = words(text, self._text_height)
            at = self._margin, self._caption + line * self._line
            self._canvas.blit(written, written.get_rect(midleft=at))
