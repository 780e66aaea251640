from __future__ import annotations

import copy
import hashlib
import os
import pickle
import subprocess
import sys
from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import Fault, Scenario, Warehouse
from swarm_logistics_env.errors import SetupError
from swarm_logistics_env.rendering import Renderer
from swarm_logistics_env.rendering.palette import (
    DELIVERING,
    LINK,
    MARKS,
    REQUESTED,
    RGB,
    SEARCHING,
    SHUFFLING,
)
from swarm_logistics_env.warehouse import FAILURE_MODES, WarehouseState
from swarm_logistics_env.warehouse.state import CARRIED, DELIVERED, NOBODY
from tests.rendering.conftest import Situation, situation

Frame = NDArray[np.uint8]


@pytest.fixture
def dummy_display(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    yield
    import pygame

    pygame.display.quit()


def frame(state: WarehouseState, scenario: Scenario, size: int = 400) -> Frame:
    return Renderer(scenario, "rgb_array", size).frame(state, scenario)


def arena(state: WarehouseState, scenario: Scenario, size: int = 400) -> Frame:
    """The part of a picture that shows the warehouse: no caption, no margin."""
    from swarm_logistics_env.rendering.picture import Projection  # loads pygame

    place = Projection.fitting(scenario, size, 0)
    return frame(state, scenario, size)[place.top : place.bottom, place.left : place.right]


def count(picture: Frame, colour: RGB) -> int:
    return int((picture == colour).all(axis=2).sum())


def give(state: WarehouseState, robot: int, item: int) -> None:
    state.robot_item[robot] = item
    state.item_carrier[item], state.item_status[item] = robot, CARRIED
    state.item_position[item] = state.robot_position[robot]


@pytest.mark.parametrize(
    ("width", "height", "expected", "n_robots"),
    [(10, 10, 800, 1), (5, 10, 420, 5), (20, 10, 800, 100)],
)
def test_frame_is_an_rgb_array_as_large_as_asked_for(
    width: float, height: float, expected: int, n_robots: int
) -> None:
    scenario = Scenario(
        n_robots=n_robots, n_items=10, warehouse_width=width, warehouse_height=height
    )
    world = Warehouse(scenario)
    world.reset(0)
    picture = frame(world.state, scenario, 800)
    assert picture.dtype == np.uint8
    assert picture.shape[1:] == (expected, 3)
    assert picture.shape[0] > 760 * min(1.0, height / width)
    assert picture.shape[0] % 2 == 0
    assert picture.flags.c_contiguous
    assert picture.flags.writeable
    # Its size depends on the warehouse alone.
    other = scenario.replace(n_items=4, delivery_width=1.0)
    world.reset(1, [Fault(mode, 1) for mode in FAILURE_MODES if mode != "removed"], other)
    assert frame(world.state, other, 800).shape == picture.shape


def digest() -> str:
    """Return what all frames of a run hash to."""
    world = Warehouse(Scenario(n_robots=12, n_items=20, n_obstacles=2))
    world.reset(3, [Fault("FM1", 2), Fault("dead", 1)])
    renderer = Renderer(world.scenario, "rgb_array", 400)
    found = hashlib.sha256()
    for _ in range(15):
        world.step(np.tile([1.0, 0.0, 0.3, 1.0], (12, 1)))
        found.update(renderer.frame(world.state, world.scenario).tobytes())
    return found.hexdigest()


def test_frames_are_the_same_in_two_processes() -> None:
    script = (
        "import sys; from swarm_logistics_env.rendering import Renderer\n"
        "assert 'pygame' not in sys.modules\n"  # it waits for the first renderer
        "from tests.rendering.test_renderer import digest\n"
        "print(digest())\n"
    )
    environment = {**os.environ, "PYTHONHASHSEED": "2", "PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-c", script]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    assert done.stdout == f"{digest()}\n"  # pygame's greeting is not printed


def test_frame_depends_on_the_state_alone() -> None:
    import pygame

    state, scenario = situation([[2, 2], [4, 4]])
    renderer = Renderer(scenario, "rgb_array", 400)
    pygame.display.quit()
    untouched = pickle.dumps(state)
    before = renderer.frame(state, scenario)
    assert pickle.dumps(state) == untouched
    assert not pygame.display.get_init()
    kept = before.copy()
    for twin in (pickle.loads(pickle.dumps(renderer)), copy.deepcopy(renderer)):
        assert np.array_equal(twin.frame(state, scenario), before)
    pygame.quit()  # by somebody else
    moved = copy.deepcopy(state)
    moved.robot_position[0] = [5.0, 1.0]
    assert not np.array_equal(renderer.frame(moved, scenario), before)
    assert np.array_equal(before, kept)  # an array of the caller's own
    assert np.array_equal(renderer.frame(state, scenario), before)
    renderer.close()
    renderer.close()
    state.time = 271.8  # words that were not written before
    assert not np.array_equal(renderer.frame(state, scenario), before)


def test_requested_item_is_plain_to_see() -> None:
    state, scenario = situation([[2, 2]], [[5, 5], [7, 7]])
    for place in (0.5, 0.7, 0.2):  # one item, the other, and that one on the robot
        if place == 0.7:
            state.requested = 1
        if place == 0.2:
            give(state, 0, 1)
        rows, columns = np.nonzero((arena(state, scenario, 800) == REQUESTED).all(axis=2))
        assert len(rows) > 250
        assert rows.mean() == pytest.approx((1.0 - place) * 760, abs=2)  # y points up
        assert columns.mean() == pytest.approx(place * 760, abs=2)
    state.requested, state.robot_item[0] = NOBODY, NOBODY
    state.item_status[:] = DELIVERED
    nothing = frame(state, scenario, 800)
    assert count(arena(state, scenario, 800), REQUESTED) == 0
    state.item_position[:] = [1.0, 8.0]
    assert np.array_equal(frame(state, scenario, 800), nothing)


def test_state_of_a_robot_has_its_colour() -> None:
    state, scenario = situation([[2, 2]], [[5, 5], [7, 7]])

    def colours() -> list[bool]:
        floor = arena(state, scenario, 800)
        return [count(floor, colour) > 20 for colour in (SEARCHING, SHUFFLING, DELIVERING)]

    assert colours() == [True, False, False]
    give(state, 0, 1)
    assert colours() == [False, True, False]
    state.requested = 1
    assert colours() == [False, False, True]


def test_heading_shows() -> None:
    from swarm_logistics_env.rendering.picture import Projection

    state, scenario = situation([[2, 2]])
    east = frame(state, scenario)
    state.robot_heading[:] = np.pi
    west = frame(state, scenario)
    assert not np.array_equal(east, west)
    # The robot's middle is the pixel the mirror goes through.
    column, row = map(round, Projection.fitting(scenario, 400, 0).points(state.robot_position)[0])
    around = slice(row - 12, row + 13), slice(column - 15, column + 16)
    assert np.array_equal(east[around], west[around][:, ::-1])


def test_timer_is_a_halo_that_fades() -> None:
    state, scenario = situation([[2, 2]])
    shown = []
    for age in (0.0, 3.0, 6.0, 9.0, np.nan):
        state.robot_timer[:] = age
        floor = arena(state, scenario).astype(int)
        shown.append(int((floor[..., 1] - floor[..., 0])[200:, :200].clip(0).sum()))  # greenness
    assert shown == sorted(set(shown), reverse=True)


def test_every_failure_mode_has_a_mark_of_its_own() -> None:
    assert set(MARKS) == set(FAILURE_MODES) - {"removed"}
    state, scenario = situation([[2, 2], [4, 4]])
    state.failure_modes = ((), ())
    grey = [0.299, 0.587, 0.114]  # they are told apart in print as well
    pictures = [arena(state, scenario) @ grey]
    state.failed[1] = True
    for mode in [*MARKS, "of_my_own"]:
        state.failure_modes = ((), (mode,))
        pictures.append(arena(state, scenario) @ grey)
        changed = pictures[0] != pictures[-1]
        assert changed.sum() > 40
        assert not changed[260:, :140].any()  # the healthy one looks as before
    assert len({np.rint(picture).tobytes() for picture in pictures}) == len(MARKS) + 2
    state.robot_present[:] = False
    assert count(arena(state, scenario), SEARCHING) == 0


def test_link_of_the_carrier() -> None:
    state, scenario = situation([[2, 2], [4, 4], [5, 2]], [[7, 7]])
    state.robot_told[:] = [np.nan, 3.0, 1.0]
    assert count(arena(state, scenario), LINK) == 0
    give(state, 0, 0)
    assert count(arena(state, scenario), LINK) > 100
    state.hears[0] = False
    assert count(arena(state, scenario), LINK) == 0


ONE: Situation = situation([[2, 2]])


@pytest.mark.usefixtures("dummy_display")
def test_window_shows_the_frame_and_closes_twice() -> None:
    import pygame

    with pytest.raises(SetupError, match="should be 'human'"):
        Renderer(ONE[1], "rgb_array", 300).show(*ONE)
    renderer = Renderer(ONE[1], "human", 300)
    renderer.show(*ONE)
    shown = pygame.surfarray.array3d(pygame.display.get_surface()).transpose(1, 0, 2)
    assert np.array_equal(shown, renderer.frame(*ONE))
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    for _ in range(2):  # that the user closed, it stays closed
        renderer.show(*ONE)
        assert not pygame.display.get_init()
    renderer.close()
    renderer.close()


def test_no_display_is_a_typed_error(monkeypatch: pytest.MonkeyPatch) -> None:
    import pygame

    with monkeypatch.context() as changed:
        changed.setenv("SDL_VIDEODRIVER", "no such driver")
        with pytest.raises(SetupError, match=r"needs a display .* 'rgb_array'"):
            Renderer(ONE[1], "human", 300).show(*ONE)
    # What SDL does on a machine without a display, wherever this test runs.
    monkeypatch.delenv("SDL_VIDEODRIVER", raising=False)
    monkeypatch.setattr(pygame.display, "init", lambda: None)
    monkeypatch.setattr(pygame.display, "get_driver", lambda: "offscreen")
    with pytest.raises(SetupError, match="needs a display"):
        Renderer(ONE[1], "human", 300).show(*ONE)


def test_wrong_arguments_and_a_missing_pygame_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    for mode, size, message in (
        ("ansi", 800, r"mode = 'ansi': should be one of \['rgb_array', 'human'\]"),
        ("rgb_array", 99, r"size = 99: should be 100 to 8000 \[px\]"),
        ("rgb_array", 8001, "size = 8001"),
    ):
        with pytest.raises(SetupError, match=message):
            Renderer(ONE[1], mode, size)  # type: ignore[arg-type]
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises(SetupError, match=r"pip install -c constraints.txt '\.\[render\]'"):
        Renderer(Scenario(), "rgb_array")
