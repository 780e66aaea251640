"""Lines that are drawn over the floor: trails, radio links, sensor beams."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pygame

from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.warehouse.state import NOBODY, WarehouseState

from . import palette, sprites
from .canvas import Point, draw_line, stamp
from .projection import Projection
from .readings import N_BEAMS, Trails, followed, ranges

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
    carrier = NOBODY
    if state.requested != NOBODY:
        carrier = int(state.item_carrier[state.requested])
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
