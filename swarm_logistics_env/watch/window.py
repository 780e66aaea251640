"""A session in a window: keys, mouse, the warehouse, a panel beside it, a strip below."""

from __future__ import annotations

import pygame

from swarm_logistics_env.rendering.palette import FLOOR, INK, SURROUNDINGS
from swarm_logistics_env.rendering.picture import Picture
from swarm_logistics_env.rendering.sprites import words
from swarm_logistics_env.rendering.strip import draw_strip
from swarm_logistics_env.rendering.window import open_display
from swarm_logistics_env.watch.keys import HELP, KEYS, LINKS, MOUSE, QUIT, TRAILS, press
from swarm_logistics_env.watch.panel import Panel
from swarm_logistics_env.watch.session import Session

FRAME_RATE = 30.0  # [1/s]
_LEAST_SIZE = (640, 480)
_PANEL_WIDTH, _STRIP_HEIGHT = 380, 150
_NAMES = {pygame.K_RIGHT: "ArrowRight", pygame.K_ESCAPE: "Escape", pygame.K_SPACE: " "}
_LEFT, _RIGHT = 1, 3
_CLICK_REACH = 2.0  # robot radii


class WatchWindow:
    """Shows a session until the user has enough of it.

    Args:
        session: what is watched.
        title: names the policy.
        size: of the window [px]; default: what fits on the screen.

    Raises:
        SetupError: there is no display.
    """

    def __init__(self, session: Session, title: str, size: tuple[int, int] | None = None) -> None:
        open_display("swarm-logistics watch", instead="use --web")
        self._session, self._title, self._panel = session, title, Panel()
        self._shows_help, self._trails, self._links = False, False, False
        if size is None:
            screen = pygame.display.Info()
            size = min(1240, screen.current_w - 40), min(900, screen.current_h - 100)
        self._set_size(size)

    def run(self) -> None:
        """Play and show until the window is closed or `q` is pressed."""
        clock, elapsed = pygame.time.Clock(), 0.0
        try:
            while self.turn(elapsed):
                elapsed = clock.tick(FRAME_RATE) / 1000.0
        finally:
            self.close()

    def turn(self, elapsed: float) -> bool:
        """Do what was pressed, let `elapsed` wall seconds pass, show; False: that was the end."""
        for event in pygame.event.get():
            if event.type == pygame.QUIT:
                return False
            if event.type == pygame.KEYDOWN and not self._key(event):
                return False
            if event.type == pygame.MOUSEBUTTONDOWN:
                self._click(event.pos, event.button)
            elif event.type == pygame.MOUSEWHEEL:
                self._panel.scroll -= 3 * event.y
            elif event.type == pygame.VIDEORESIZE:
                self._set_size(event.size)
        self._session.play(min(elapsed, 0.2), budget=0.6 / FRAME_RATE)
        self._draw()
        return True

    def close(self) -> None:
        """Close the window; harmless when called twice."""
        pygame.display.quit()

    def _set_size(self, size: tuple[int, int]) -> None:
        width, height = max(size[0], _LEAST_SIZE[0]), max(size[1], _LEAST_SIZE[1])
        pygame.display.set_mode((width, height), pygame.RESIZABLE)
        panel = min(_PANEL_WIDTH, width // 2)
        strip = min(_STRIP_HEIGHT, height // 4)
        self._strip_place = pygame.Rect(0, height - strip, width - panel, strip)
        self._panel_place = pygame.Rect(width - panel, 0, panel, height)
        self._room = pygame.Rect(0, 0, width - panel, height - strip)
        self._picture: Picture | None = None

    def _draw(self) -> None:
        session, screen = self._session, pygame.display.get_surface()
        scenario = session.scenario
        if self._picture is None:
            self._picture = Picture.fitting(scenario, *self._room.size)
        picture = self._picture
        picture.selected = picture.show_beams_of = session.selected
        picture.all_links = self._links
        picture.trails = session.trails if self._trails else None
        drawn = picture.draw(session.run.world.state, scenario)
        screen.fill(SURROUNDINGS)
        self._picture_place = drawn.get_rect(center=self._room.center)
        screen.blit(drawn, self._picture_place)
        strip = draw_strip(
            self._strip_place.size, session.curves, session.events, scenario.duration
        )
        screen.blit(strip, self._strip_place)
        screen.blit(
            self._panel.draw(session, self._title, self._panel_place.size), self._panel_place
        )
        if self._shows_help:
            _draw_help(screen)
        pygame.display.flip()

    def _key(self, event: pygame.event.Event) -> bool:
        name = _NAMES.get(event.key, event.unicode)
        if name == QUIT:
            return False
        if name == HELP or (self._shows_help and name == "Escape"):
            self._shows_help = not self._shows_help
        elif name == TRAILS:
            self._trails = not self._trails
        elif name == LINKS:
            self._links = not self._links
        else:
            press(self._session, name)
        return True

    def _click(self, at: tuple[int, int], button: int) -> None:
        if button not in (_LEFT, _RIGHT) or self._picture is None:
            return
        if self._shows_help:
            self._shows_help = False
        elif self._panel_place.collidepoint(at):
            place = at[0] - self._panel_place.left, at[1] - self._panel_place.top
            self._panel.click(self._session, place)
        elif self._room.collidepoint(at):
            place = at[0] - self._picture_place.left, at[1] - self._picture_place.top
            x, y = self._picture.projection.position(place)
            reach = max(
                _CLICK_REACH * self._session.scenario.robot_radius,
                10.0 / self._picture.projection.scale,
            )
            robot = self._session.robot_at(x, y, reach)
            breaks = button == _RIGHT or pygame.key.get_mods() & pygame.KMOD_SHIFT
            if robot is not None and breaks:
                self._session.toggle_robot(robot)
            else:
                self._session.select(robot)


def _draw_help(screen: pygame.Surface) -> None:
    rows = [(key.label, key.meaning) for key in KEYS] + list(MOUSE)
    line = min(22, (screen.get_height() - 40) // len(rows))
    height = line - 2
    keys = [words(name, height, INK) for name, _ in rows]
    meanings = [words(meaning, height, INK) for _, meaning in rows]
    column = max(key.get_width() for key in keys) + 20
    width = column + max(meaning.get_width() for meaning in meanings) + 40
    area = pygame.Rect(0, 0, width, line * len(rows) + 30)
    area.center = screen.get_rect().center
    screen.fill(FLOOR, area)
    pygame.draw.rect(screen, INK, area, 2)
    for place, (key, meaning) in enumerate(zip(keys, meanings)):
        y = area.top + 15 + line * place
        screen.blit(key, (area.left + 20, y))
        screen.blit(meaning, (area.left + 20 + column, y))
