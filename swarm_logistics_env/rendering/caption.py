"""The lines below the warehouse: score, time, failures, and what the robots' colours mean."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from functools import lru_cache

import pygame

from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.warehouse.state import NOBODY, WarehouseState

from . import palette
from .sprites import badge, blank, halo, item, robot, words

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
