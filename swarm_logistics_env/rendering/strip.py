"""Deliveries over time: one staircase a run, on one axis."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import pygame

from . import palette
from .canvas import Point, draw_line, new_canvas
from .readings import Curve, Event
from .sprites import badge, words

_GRID_LINES = 4


def draw_strip(
    size: tuple[int, int],
    curves: Sequence[Curve],
    events: Sequence[Event],
    duration: float,
    text_height: int = 18,
) -> pygame.Surface:
    """Return the deliveries of several runs over time.

    Args:
        size: width and height [px].
        curves: the deliveries of each run.
        events: failures and repairs; each is marked on the time axis.
        duration: the end of the time axis [s].
    """
    width, height = size
    canvas = new_canvas(width, height)
    canvas.fill(palette.SURROUNDINGS)
    line = round(1.2 * text_height)
    top = _draw_names(canvas, curves, width, text_height) + line
    plot = pygame.Rect(
        2 * text_height,
        top,
        max(1, width - 3 * text_height),
        max(1, height - top - line - text_height // 3),
    )
    canvas.fill(palette.FLOOR, plot)
    most = _round_up(max((len(curve.times) for curve in curves), default=0))

    def place(time: float, count: float) -> Point:
        across = min(time / duration, 1.0)
        return plot.left + across * plot.width, plot.bottom - count / most * plot.height

    for step in range(_GRID_LINES + 1):
        share = step / _GRID_LINES
        x, _ = place(share * duration, 0)
        pygame.draw.line(canvas, palette.FLOOR_LINE, (round(x), plot.top), (round(x), plot.bottom))
        seconds = words(f"{share * duration:.4g} s", text_height, palette.INK)
        canvas.blit(
            seconds, seconds.get_rect(midtop=(round(x), plot.bottom + 3)).clamp(canvas.get_rect())
        )
    for count in (0, most):
        name = words(f"{count}", text_height, palette.INK)
        canvas.blit(name, name.get_rect(midright=(plot.left - 4, round(place(0, count)[1]))))
    last, row = -plot.width, 0
    for time, label in _marks(events, duration / plot.width):
        x = round(place(time, 0)[0])
        pygame.draw.line(canvas, palette.INK, (x, plot.top), (x, plot.bottom))
        sign = badge(label, round(0.75 * text_height))
        # Marks that would lie on one another are drawn one below the other.
        row = (row + 1) % 4 if x - last < sign.get_width() else 0
        last, y = x, plot.top + 2 + row * sign.get_height()
        canvas.blit(sign, sign.get_rect(midtop=(x, y)).clamp(plot))
    # Thin curves are drawn over thick ones, so that both are seen where two runs are the same.
    for curve in sorted(
        curves, key=lambda curve: -palette.RUNS[curve.style % len(palette.RUNS)][1]
    ):
        colour, thick = palette.RUNS[curve.style % len(palette.RUNS)]
        _draw_staircase(canvas, curve, place, colour, thick * max(1.0, text_height / 18))
    pygame.draw.rect(canvas, palette.INK, plot.inflate(2, 2), 1)
    return canvas


def _marks(events: Sequence[Event], apart: float) -> list[tuple[float, str]]:
    """Return times and labels, those of the same label within `apart` [s] as one."""
    groups: list[tuple[float, str, int]] = []
    for event in sorted(events, key=lambda event: event.time):
        if groups and groups[-1][1] == event.label and event.time - groups[-1][0] < apart:
            groups[-1] = (*groups[-1][:2], groups[-1][2] + 1)
        else:
            groups.append((event.time, event.label, 1))
    return [(time, label + (f" ×{count}" if count > 1 else "")) for time, label, count in groups]


def _draw_names(
    canvas: pygame.Surface, curves: Sequence[Curve], width: int, text_height: int
) -> int:
    """Write which curve is which; return the top of the last line of names [px]."""
    x, y = text_height // 2, text_height // 3
    for curve in curves:
        colour, thick = palette.RUNS[curve.style % len(palette.RUNS)]
        name = words(f"{curve.name}: {len(curve.times)} delivered", text_height, palette.INK)
        sample = round(1.5 * text_height)
        if x > text_height and x + sample + name.get_width() + 10 > width:
            x, y = text_height // 2, y + round(1.2 * text_height)
        middle = y + text_height // 2 - 2
        draw_line(canvas, colour, (x, middle), (x + sample, middle), thick + 1.0)
        canvas.blit(name, (x + sample + 6, y))
        x += sample + name.get_width() + 2 * text_height
    return y


def _draw_staircase(
    canvas: pygame.Surface,
    curve: Curve,
    place: Callable[[float, float], Point],
    colour: palette.RGB,
    width: float,
) -> None:
    before = place(0.0, 0)
    for count, time in enumerate(curve.times, 1):
        foot, head = place(time, count - 1), place(time, count)
        draw_line(canvas, colour, before, foot, width)
        draw_line(canvas, colour, foot, head, width)
        before = head
    draw_line(canvas, colour, before, place(curve.until, len(curve.times)), width)


def _round_up(count: int) -> int:
    """Return the least of 5, 10, 20, 50, 100, .. that holds `count`."""
    most = 5
    for factor in (2, 2, 2.5) * 12:
        if most >= count:
            break
        most = round(most * factor)
    return most
