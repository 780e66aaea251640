"""The column beside the warehouse: what runs, failure modes to choose from, what a robot senses."""

from __future__ import annotations

from collections.abc import Callable

import pygame

from swarm_logistics_env.rendering.canvas import new_canvas
from swarm_logistics_env.rendering.palette import (
    BEAM,
    FLOOR,
    INK,
    ITEM,
    MARKS,
    RGB,
    SURROUNDINGS,
)
from swarm_logistics_env.rendering.sprites import badge, words
from swarm_logistics_env.warehouse import FAILURE_MODES
from swarm_logistics_env.watch.inspection import activity, observation_words
from swarm_logistics_env.watch.keys import press
from swarm_logistics_env.watch.session import Session

Act = Callable[[Session], None]

_LARGE, _NORMAL, _SMALL = 24, 19, 16  # text heights [px]
_GAP = 8
_VALUES_AT = 0.46  # of the panel's width


class Panel:
    """Draws itself from a session, and knows what a click on it means.

    Attributes:
        scroll: lines of the inspected row that are scrolled away.
    """

    def __init__(self) -> None:
        self.scroll = 0
        self._buttons: list[tuple[pygame.Rect, Act]] = []

    def click(self, session: Session, at: tuple[int, int]) -> None:
        """Do what stands at a pixel of the panel, if anything does."""
        for place, act in self._buttons:
            if place.collidepoint(at):
                act(session)
                return

    def draw(self, session: Session, title: str, size: tuple[int, int]) -> pygame.Surface:
        """Return the panel at that size [px]; `title` names the policy."""
        self._canvas, self._buttons, self._y = new_canvas(*size), [], _GAP
        self._canvas.fill(SURROUNDINGS)
        self._draw_head(session, title)
        self._draw_modes(session)
        self._draw_robot(session)
        return self._canvas

    def _draw_head(self, session: Session, title: str) -> None:
        self._line(f"{title}, seed {session.seed}", _LARGE)
        if session.is_over:
            pace = "over: n next seed, 0 this one again"
        else:
            pace = "paused" if session.paused else "playing"
            pace += f" at {session.speed:g} times real time"
        self._line(pace)
        scenario = session.scenario
        self._row(
            f"N = {scenario.n_robots}",
            ("–", lambda s: _press(s, "[")),
            ("+", lambda s: _press(s, "]")),
        )
        self._row(
            f"delivery area {scenario.delivery_width:g} m",
            ("–", lambda s: _press(s, "W")),
            ("+", lambda s: _press(s, "w")),
        )
        self._paragraph(session.note, 3)

    def _draw_modes(self, session: Session) -> None:
        self._line("Break robots in mode (click to choose)")
        half, top = self._width // 2, self._y
        modes = list(FAILURE_MODES)
        rows = (len(modes) + 1) // 2
        for place, mode in enumerate(modes):
            column, row = divmod(place, rows)
            rect = pygame.Rect(_GAP + column * half, top + row * 22, half - 4, 20)
            self._button(rect, mode, _choosing(mode), chosen=mode == session.mode)
            sign = badge(MARKS.get(mode, "–"), 12)
            self._canvas.blit(sign, sign.get_rect(midright=(rect.right - 4, rect.centery)))
        self._y = top + rows * 22 + 2
        description = FAILURE_MODES[session.mode].description
        self._paragraph(f"{session.mode}: {description}", 2)

    def _draw_robot(self, session: Session) -> None:
        robot = session.selected
        if robot is None:
            self._line("Click a robot to see what it senses.", _NORMAL)
            self._line("h shows all keys.", _NORMAL)
            return
        state, scenario = session.run.world.state, session.scenario
        modes = " ".join(state.failure_modes[robot]) or "sound"
        self._line(f"Robot {robot}: {activity(state, robot)}, {modes}", _LARGE)
        half = self._width // 2
        self._button(
            pygame.Rect(_GAP, self._y, half - 4, 24), f"break: {session.mode} (b)", _press_b
        )
        self._button(pygame.Rect(_GAP + half, self._y, half - 4, 24), "repair (r)", _press_r)
        self._y += 24 + _GAP
        lines = []
        values_at = round(_VALUES_AT * self._width)
        for name, text in observation_words(session.run.sensed(robot), scenario):
            pieces = wrapped(text, _SMALL, self._width - values_at, 9)
            lines += [
                (name if first else "", piece)
                for first, piece in zip([True] + [False] * len(pieces), pieces)
            ]
        room = max(1, (self._canvas.get_height() - self._y - _GAP) // _SMALL)
        self.scroll = max(0, min(self.scroll, len(lines) - room + 1 if len(lines) > room else 0))
        shown = lines[self.scroll : self.scroll + room]
        if self.scroll + room < len(lines):
            shown[-1:] = [("…", "wheel: the rest")]
        for name, text in shown:
            if name:
                self._put(words(name, _SMALL, INK), _GAP)
            self._put(words(text, _SMALL, INK), _GAP + values_at)
            self._y += _SMALL

    @property
    def _width(self) -> int:
        return self._canvas.get_width() - 2 * _GAP

    def _put(self, picture: pygame.Surface, x: int) -> None:
        self._canvas.blit(picture, (x, self._y))

    def _line(self, text: str, height: int = _NORMAL, colour: RGB = INK) -> None:
        for line in wrapped(text, height, self._width, 1):
            self._put(words(line, height, colour), _GAP)
        self._y += round(1.15 * height)

    def _paragraph(self, text: str, n_lines: int) -> None:
        """Write small text; what follows stands in the same place however long it is."""
        after = self._y + n_lines * round(1.15 * _SMALL) + _GAP // 2
        for line in wrapped(text, _SMALL, self._width, n_lines):
            self._line(line, _SMALL)
        self._y = after

    def _row(self, text: str, *buttons: tuple[str, Act]) -> None:
        self._put(words(text, _NORMAL, INK), _GAP)
        for place, (name, act) in enumerate(buttons):
            left = _GAP + self._width - 34 * (len(buttons) - place)
            self._button(pygame.Rect(left, self._y - 3, 30, 20), name, act)
        self._y += 24

    def _button(self, rect: pygame.Rect, text: str, act: Act, *, chosen: bool = False) -> None:
        self._canvas.fill(BEAM if chosen else FLOOR, rect)
        pygame.draw.rect(self._canvas, INK if chosen else ITEM, rect, 2 if chosen else 1)
        name = words(text, _NORMAL, INK)
        place = name.get_rect(midleft=(rect.left + 7, rect.centery + 1))
        if len(text) == 1:
            place.center = rect.center
        self._canvas.blit(name, place)
        self._buttons.append((rect, act))


def wrapped(text: str, height: int, width: int, most: int) -> list[str]:
    """Return `text` as at most so many lines of that width [px]; … where it is cut."""
    lines: list[str] = []
    for word in text.split():
        longer = f"{lines[-1]} {word}" if lines else word
        if lines and words(longer, height, INK).get_width() <= width:
            lines[-1] = longer
        else:
            lines.append(word)
    if len(lines) > most:
        lines = [*lines[: most - 1], f"{lines[most - 1]} …"]
    return lines


def _press(session: Session, key: str) -> None:
    press(session, key)


def _press_b(session: Session) -> None:
    session.break_robot()


def _press_r(session: Session) -> None:
    session.repair_robot()


def _choosing(mode: str) -> Act:
    return lambda session: session.choose_mode(mode)
