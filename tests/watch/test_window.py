from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import Scenario, policies
from swarm_logistics_env.errors import SetupError
from swarm_logistics_env.rendering.renderer import load_pygame
from swarm_logistics_env.watch import Session

load_pygame()

import pygame  # noqa: E402 - without its greeting

from swarm_logistics_env.watch.window import WatchWindow  # noqa: E402


class Hands:
    """Presses keys and clicks, as a user of the window would."""

    def __init__(self, session: Session, window: WatchWindow) -> None:
        self.session, self.window = session, window

    def press(self, text: str, code: int | None = None) -> bool:
        code = pygame.key.key_code(text) if code is None else code
        pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=code, unicode=text, mod=0))
        return self.window.turn(0.0)

    def click(self, at: tuple[int, int], button: int = 1) -> None:
        pygame.event.post(pygame.event.Event(pygame.MOUSEBUTTONDOWN, pos=at, button=button))
        assert self.window.turn(0.0)

    def place(self, robot: int) -> tuple[int, int]:
        picture, corner = self.window._picture, self.window._picture_place
        assert picture is not None
        places = self.session.run.world.state.robot_position[robot : robot + 1]
        x, y = picture.projection.points(places)[0]
        return round(x) + corner.left, round(y) + corner.top

    def pixels(self, place: pygame.Rect) -> NDArray[np.uint8]:
        screen = pygame.display.get_surface()
        return pygame.surfarray.array3d(screen.subsurface(place)).copy()


@pytest.fixture
def hands(monkeypatch: pytest.MonkeyPatch) -> Iterator[Hands]:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    session = Session(Scenario(n_robots=10), lambda: policies.load("swarm-dt"))
    window = WatchWindow(session, "swarm-dt", (900, 700))
    window.turn(0.0)
    yield Hands(session, window)
    window.close()


def test_click_selects_and_right_click_breaks_and_repairs(hands: Hands) -> None:
    hands.window.turn(0.15)
    assert hands.session.run.world.state.step == 1
    hands.click(hands.place(4))
    assert hands.session.selected == 4
    assert not hands.session.run.world.state.failed.any()
    strip = hands.pixels(hands.window._strip_place)
    hands.click(hands.place(4), button=3)
    assert hands.session.run.world.state.failure_modes[4] == ("FM4",)
    assert not np.array_equal(hands.pixels(hands.window._strip_place), strip)
    hands.click(hands.place(4), button=3)
    assert not hands.session.run.world.state.failed.any()
    hands.click((hands.window._room.left + 2, hands.window._room.top + 2))
    assert hands.session.selected is None


def test_panel_chooses_the_mode_breaks_and_repairs(hands: Hands) -> None:
    panel, corner = hands.window._panel, hands.window._panel_place
    hands.click(hands.place(2))
    for place, _ in list(panel._buttons)[4:]:  # after those of size and width: modes, then two
        hands.click((corner.left + place.centerx, corner.top + place.centery))
    assert hands.session.mode == "removed"
    assert [event.mode for event in hands.session.events] == ["removed"]
    assert hands.session.selected is None


def test_keys(hands: Hands) -> None:
    session = hands.session
    assert hands.press(" ", pygame.K_SPACE)
    assert session.paused
    assert hands.press("", pygame.K_RIGHT)
    assert session.run.world.state.step == 1
    assert hands.press("n")
    assert session.seed == 1
    assert hands.press("]")
    assert session.scenario.n_robots == 11
    assert hands.press("W", pygame.K_w)
    assert session.scenario.delivery_width == 1.75
    hands.click(hands.place(0))
    hands.press("b")
    assert session.run.world.state.failed[0]
    hands.press("", pygame.K_ESCAPE)
    assert session.selected is None
    assert not hands.press("q")


@pytest.mark.parametrize("key", ["h", "l"])
def test_what_the_view_itself_shows_comes_and_goes(hands: Hands, key: str) -> None:
    for _ in range(100):
        hands.session.step()
    hands.window.turn(0.0)
    whole = pygame.display.get_surface().get_rect()
    before = hands.pixels(whole)
    hands.press(key)
    assert not np.array_equal(hands.pixels(whole), before)
    hands.press(key)
    assert np.array_equal(hands.pixels(whole), before)


def test_trails(hands: Hands) -> None:
    hands.press("t")
    for _ in range(10):
        hands.window.turn(0.1)
    with_trails = hands.pixels(hands.window._room)
    hands.session.pause()
    hands.press("t")
    assert not np.array_equal(hands.pixels(hands.window._room), with_trails)


def test_wheel_shows_the_rest_of_the_row(hands: Hands) -> None:
    hands.click(hands.place(1))
    top = hands.pixels(hands.window._panel_place)
    for _ in range(30):
        pygame.event.post(pygame.event.Event(pygame.MOUSEWHEEL, x=0, y=-1))
        hands.window.turn(0.0)
    assert not np.array_equal(hands.pixels(hands.window._panel_place), top)
    for _ in range(30):
        pygame.event.post(pygame.event.Event(pygame.MOUSEWHEEL, x=0, y=1))
        hands.window.turn(0.0)
    assert np.array_equal(hands.pixels(hands.window._panel_place), top)


@pytest.mark.parametrize("size", [(640, 480), (1600, 600), (700, 1200)])
def test_any_size_holds_the_whole_picture(hands: Hands, size: tuple[int, int]) -> None:
    pygame.event.post(pygame.event.Event(pygame.VIDEORESIZE, size=size, w=size[0], h=size[1]))
    hands.window.turn(0.0)
    whole = pygame.Rect((0, 0), size)
    assert pygame.display.get_surface().get_size() == size
    assert hands.window._room.contains(hands.window._picture_place)
    places = (hands.window._room, hands.window._panel_place, hands.window._strip_place)
    assert whole.unionall(places) == whole
    assert sum(place.width * place.height for place in places) == whole.width * whole.height
    hands.click(hands.place(3))
    assert hands.session.selected == 3


def test_closing_the_window_ends_it(hands: Hands) -> None:
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    hands.window.run()
    assert not pygame.display.get_init()


def test_no_display_names_the_way_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "no such driver")
    session = Session(Scenario(n_robots=1), lambda: policies.load("swarm-dt"))
    with pytest.raises(SetupError, match=r"needs a display .* use --web$"):
        WatchWindow(session, "swarm-dt")
