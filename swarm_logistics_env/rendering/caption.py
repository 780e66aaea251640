"""The lines below the warehouse, and the strip of deliveries over time: one staircase a run."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from functools import lru_cache

import pygame

from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.warehouse.state import NOBODY, WarehouseState

from . import palette
from .readings import Curve, Event
from .sprites import Point, badge, blank, draw_line, halo, item, new_canvas, robot, words

# The widest texts there may be, so that a picture's size does not change with what happens.
_WIDEST = ("time 0000.0 s", "N = 000", "P = 000 of 000", "requested: item 000")
_MOST_LEGEND_LINES = 2


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
        self._places = self._flow([self._words(text) for text in _WIDEST])
        self._legend = _legend(text_height)
        self._legend_places = self._flow(self._legend)
        self._failures_line = self._places[-1][1] + 1
        self._legend_line = self._failures_line + 1
        lines = self._legend_line
        legend_lines = self._legend_places[-1][1] + 1
        if legend_lines <= _MOST_LEGEND_LINES:
            lines += legend_lines
        else:
            self._legend = ()
        self.height = lines * self._line

    @staticmethod
    def least_width(text_height: int) -> int:
        """Return the width [px] below which words would be cut."""
        return max(words(text, text_height, palette.INK).get_width() for text in _WIDEST)

    def draw_legend(self, canvas: pygame.Surface) -> None:
        """Draw what the colours mean, which never changes, where there is room for it."""
        for entry, (x, line) in zip(self._legend, self._legend_places):
            self._put(canvas, entry, x, self._legend_line + line)

    def draw(self, canvas: pygame.Surface, state: WarehouseState, scenario: Scenario) -> None:
        """Write the scores and the failures of `state`."""
        for text, (x, line) in zip(_scores(state, scenario), self._places, strict=True):
            self._put(canvas, self._words(text), x, line)
        self._draw_failures(canvas, state)

    def _draw_failures(self, canvas: pygame.Surface, state: WarehouseState) -> None:
        failed = int(state.failed.sum())
        chips = [self._words(f"failed: {failed}" if failed else "no failures")]
        counts = Counter(mode for modes in state.failure_modes for mode in modes)
        chips += [_failure(mode, count, self._text_height) for mode, count in counts.items()]
        more, gap = self._words("…"), self._text_height // 2
        x = 0
        for place, chip in enumerate(chips):
            room = 0 if place == len(chips) - 1 else gap + more.get_width()
            if x + chip.get_width() + room > self._width:
                self._put(canvas, more, x, self._failures_line)
                return
            self._put(canvas, chip, x, self._failures_line)
            x += chip.get_width() + gap

    def _put(self, canvas: pygame.Surface, chip: pygame.Surface, x: int, line: int) -> None:
        middle = self._top + line * self._line + self._text_height // 2
        canvas.blit(chip, (self._left + x, middle - chip.get_height() // 2))

    def _flow(self, chips: Sequence[pygame.Surface]) -> list[tuple[int, int]]:
        """Return where these go: x [px] and number of the line."""
        places, x, line = [], 0, 0
        for width in [chip.get_width() for chip in chips]:
            if x and x + width > self._width:
                x, line = 0, line + 1
            places.append((x, line))
            x += width + self._text_height
        return places

    def _words(self, text: str) -> pygame.Surface:
        return words(text, self._text_height, palette.INK)


@lru_cache(maxsize=128)
def _failure(mode: str, count: int, text_height: int) -> pygame.Surface:
    name = words(f"{mode} ×{count}", text_height, palette.INK)
    if mode not in palette.MARKS:
        return name
    return _row(
        [(badge(palette.MARKS[mode], round(0.7 * text_height)),), (name,)], text_height // 5
    )


def _legend(text_height: int) -> tuple[pygame.Surface, ...]:
    radius = 0.42 * text_height
    load, asked_for = item(0.45 * radius, False), item(0.5 * radius, True)
    entries: list[pygame.Surface] = []
    for name, pictures in {
        "searching": (robot(radius, palette.SEARCHING, 0, False),),
        "shuffling": (robot(radius, palette.SHUFFLING, 0, False), load),
        "delivering": (robot(radius, palette.DELIVERING, 0, False), asked_for),
        "requested item": (item(0.9 * radius, True),),
        "timer": (halo(0.6 * radius, 0), robot(0.6 * radius, palette.SEARCHING, 0, False)),
    }.items():
        entries.append(_row([pictures, (words(name, text_height, palette.INK),)], text_height // 4))
    return tuple(entries)


def _row(stacks: Sequence[tuple[pygame.Surface, ...]], gap: int) -> pygame.Surface:
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


def _scores(state: WarehouseState, scenario: Scenario) -> tuple[str, ...]:
    if state.requested == NOBODY:
        requested = "all delivered"
    else:
        requested = f"requested: item {state.requested}"
    total = "" if scenario.restock else f" of {scenario.n_items}"
    return (
        f"time {state.time:.1f} s",
        f"N = {state.n_robots}",
        f"P = {state.delivered}{total}",
        requested,
    )


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
