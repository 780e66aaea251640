from __future__ import annotations

import copy
import hashlib
import os
import pickle
import subprocess
import sys
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import Fault, Scenario, Warehouse
from swarm_logistics_env.errors import SetupError
from swarm_logistics_env.rendering import Renderer
from swarm_logistics_env.rendering.palette import (
    BEAM,
    DELIVERING,
    LINK,
    MARKS,
    REQUESTED,
    RGB,
    SEARCHING,
    SHUFFLING,
    TIMER,
)
from swarm_logistics_env.rendering.readings import Projection
from swarm_logistics_env.warehouse import FAILURE_MODES, WarehouseState
from swarm_logistics_env.warehouse.state import CARRIED, DELIVERED, NOBODY

Situation = tuple[WarehouseState, Scenario]
Frame = NDArray[np.uint8]

FRAMES = """
import hashlib
import numpy as np
from swarm_logistics_env import Fault, Scenario, Warehouse
from swarm_logistics_env.rendering import Renderer
world = Warehouse(Scenario(n_robots=12, n_items=20, n_obstacles=2))
world.reset(3, [Fault("FM1", 2), Fault("dead", 1)])
renderer = Renderer(world.scenario, "rgb_array", 400, show_beams_of=0, trails=True, all_links=True)
digest = hashlib.sha256()
for step in range(15):
    world.step(np.tile([1.0, 0.0, 0.3, 1.0], (12, 1)))
    digest.update(renderer.frame(world.state, world.scenario).tobytes())
print(digest.hexdigest())
"""


@pytest.fixture
def dummy_display(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    yield
    import pygame

    pygame.display.quit()


def frame(situation: Situation, size: int = 400, **options: bool | int) -> Frame:
    state, scenario = situation
    renderer = Renderer(scenario, "rgb_array", size, **options)  # type: ignore[arg-type]
    return renderer.frame(state, scenario)


def count(picture: Frame, colour: RGB) -> int:
    return int((picture == colour).all(axis=2).sum())


def arena(picture: Frame, scenario: Scenario, size: int = 400) -> Frame:
    """The part of a picture that shows the warehouse: no caption, no margin."""
    place = Projection.fitting(scenario, size, 0)
    return picture[place.top : place.bottom, place.left : place.right]


def give(state: WarehouseState, robot: int, item: int) -> None:
    state.robot_item[robot] = item
    state.item_carrier[item], state.item_status[item] = robot, CARRIED
    state.item_position[item] = state.robot_position[robot]


@pytest.mark.parametrize(
    ("width", "height", "expected"), [(10, 10, 800), (5, 10, 420), (20, 10, 800), (10, 20, 420)]
)
@pytest.mark.parametrize("n_robots", [1, 5, 100])
def test_frame_is_an_rgb_array_as_large_as_asked_for(
    width: float, height: float, expected: int, n_robots: int
) -> None:
    scenario = Scenario(
        n_robots=n_robots, n_items=10, warehouse_width=width, warehouse_height=height
    )
    world = Warehouse(scenario)
    world.reset(0)
    picture = frame((world.state, scenario), 800)
    assert picture.dtype == np.uint8
    assert picture.shape[1:] == (expected, 3)
    assert picture.shape[0] > 760 * min(1.0, height / width)
    assert picture.shape[0] % 2 == 0
    assert picture.flags.c_contiguous
    assert picture.flags.writeable


def test_size_of_a_picture_depends_on_the_warehouse_alone() -> None:
    small = Scenario(n_robots=1, n_items=1, delivery_width=1.0)
    world = Warehouse(small)
    renderer = Renderer(small, "rgb_array", 500)
    world.reset(0)
    shape = renderer.frame(world.state, small).shape
    large = small.replace(n_robots=100, n_items=60, delivery_width=3.0)
    world.reset(1, [Fault(mode, 3) for mode in FAILURE_MODES], large)
    assert renderer.frame(world.state, large).shape == shape
    tall = small.replace(warehouse_height=20.0)
    world.reset(2, (), tall)
    assert renderer.frame(world.state, tall).shape != shape


def test_frames_are_the_same_in_two_processes() -> None:
    digests = {
        subprocess.run(
            [sys.executable, "-c", FRAMES],
            env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed in ("1", "2")
    }
    assert len(digests) == 1
    assert len(digests.pop().strip()) == 64  # only the digest: pygame's greeting is not printed


def test_frame_depends_on_the_state_alone(situation: Callable[..., Situation]) -> None:
    state, scenario = situation([[2, 2], [4, 4]], [[6, 6]])
    renderer = Renderer(scenario, "rgb_array", 400)
    before = renderer.frame(state, scenario)
    kept = before.copy()
    moved = copy.deepcopy(state)
    moved.robot_position[0] = [5.0, 1.0]
    assert not np.array_equal(renderer.frame(moved, scenario), before)
    assert np.array_equal(before, kept)  # an array of the caller's own
    assert np.array_equal(renderer.frame(state, scenario), before)


def test_drawing_changes_nothing() -> None:
    world = Warehouse(Scenario(n_robots=5))
    world.reset(0, [Fault("FM3", 1)])
    before = pickle.dumps(world.state)
    renderer = Renderer(world.scenario, "rgb_array", 300, show_beams_of=1, trails=True)
    renderer.frame(world.state, world.scenario)
    assert pickle.dumps(world.state) == before


def test_y_points_up(situation: Callable[..., Situation]) -> None:
    state, scenario = situation([[1, 9]], [[5, 5]])
    rows, columns = np.nonzero((arena(frame((state, scenario)), scenario) == SEARCHING).all(axis=2))
    assert rows.mean() == pytest.approx(0.1 * 380, abs=2)
    assert columns.mean() == pytest.approx(0.1 * 380, abs=2)


def test_requested_item_is_plain_to_see(situation: Callable[..., Situation]) -> None:
    state, scenario = situation([[2, 2]], [[5, 5], [7, 7]])
    stored = frame((state, scenario), 800)
    state.requested = 1
    other = frame((state, scenario), 800)
    state.requested = NOBODY
    state.item_status[:] = DELIVERED
    nothing = frame((state, scenario), 800)
    floor = [arena(picture, scenario, 800) for picture in (stored, other, nothing)]
    assert count(floor[0], REQUESTED) > 300
    assert count(floor[1], REQUESTED) > 300
    assert not np.array_equal(floor[0], floor[1])
    assert count(floor[2], REQUESTED) == 0


def test_requested_item_is_plain_to_see_when_carried(situation: Callable[..., Situation]) -> None:
    state, scenario = situation([[2, 2]], [[5, 5]])
    give(state, 0, 0)
    floor = arena(frame((state, scenario), 800), scenario, 800)
    assert count(floor, REQUESTED) > 250
    rows, columns = np.nonzero((floor == REQUESTED).all(axis=2))
    assert rows.mean() == pytest.approx(0.8 * 760, abs=2)
    assert columns.mean() == pytest.approx(0.2 * 760, abs=2)


def test_delivered_item_is_gone(situation: Callable[..., Situation]) -> None:
    state, scenario = situation([[2, 2]], [[5, 5], [7, 7]])
    state.item_status[1] = DELIVERED
    there = frame((state, scenario))
    state.item_position[1] = [1.0, 8.0]
    assert np.array_equal(frame((state, scenario)), there)


def test_state_of_a_robot_has_its_colour(situation: Callable[..., Situation]) -> None:
    state, scenario = situation([[2, 2]], [[5, 5], [7, 7]])

    def colours() -> list[bool]:
        floor = arena(frame((state, scenario), 800), scenario, 800)
        return [count(floor, colour) > 20 for colour in (SEARCHING, SHUFFLING, DELIVERING)]

    assert colours() == [True, False, False]
    give(state, 0, 1)
    assert colours() == [False, True, False]
    state.requested = 1
    assert colours() == [False, False, True]


def test_states_differ_in_grey() -> None:
    colours = (SEARCHING, SHUFFLING, DELIVERING)
    greys = sorted(np.dot(colour, [0.299, 0.587, 0.114]) for colour in colours)
    assert np.diff(greys).min() > 50


def test_heading_shows(situation: Callable[..., Situation]) -> None:
    state, scenario = situation([[2, 2]], [[5, 5]])
    east = frame((state, scenario))
    state.robot_heading[:] = np.pi
    west = frame((state, scenario))
    assert not np.array_equal(east, west)
    # The robot's middle is the pixel the mirror goes through.
    column = round(Projection.fitting(scenario, 400, 0).points(state.robot_position)[0][0])
    around = slice(column - 15, column + 16)
    row = arena(east, scenario).shape[0] - 76 + 10
    band = slice(row - 12, row + 13)
    assert np.array_equal(east[band, around], west[band, around][:, ::-1])


def test_timer_is_a_halo_that_fades(situation: Callable[..., Situation]) -> None:
    state, scenario = situation([[2, 2]], [[5, 5]])

    def greenness() -> int:
        floor = arena(frame((state, scenario)), scenario).astype(int)
        return int((floor[..., 1] - floor[..., 0])[200:, :200].clip(0).sum())

    silent = greenness()
    shown = []
    for age in (0.0, 3.0, 6.0, 9.0):
        state.robot_timer[:] = age
        shown.append(greenness())
    assert shown == sorted(shown, reverse=True)
    assert len(set(shown)) == 4
    assert shown[-1] > silent
    assert TIMER[1] > TIMER[0]


@pytest.mark.parametrize("mode", [mode for mode in FAILURE_MODES if mode != "removed"])
def test_faulty_robot_differs_from_a_healthy_one(
    mode: str, situation: Callable[..., Situation]
) -> None:
    state, scenario = situation([[2, 2], [4, 4]], [[5, 5]])
    healthy = arena(frame((state, scenario)), scenario)
    state.failure_modes = ((), (mode,))
    state.failed[1] = True
    faulty = arena(frame((state, scenario)), scenario)
    changed = (healthy != faulty).any(axis=2)
    assert changed.sum() > 40
    assert not changed[260:, :140].any()  # the healthy one looks as before


def test_every_failure_mode_has_a_mark_of_its_own(situation: Callable[..., Situation]) -> None:
    assert set(MARKS) == set(FAILURE_MODES) - {"removed"}
    assert len(set(MARKS.values())) == len(MARKS)
    state, scenario = situation([[2, 2]], [[5, 5]])
    state.failed[:] = True
    pictures = set()
    for mode in MARKS:
        state.failure_modes = ((mode,),)
        grey = arena(frame((state, scenario)), scenario) @ [0.299, 0.587, 0.114]
        pictures.add(hashlib.sha256(np.rint(grey).astype(np.uint8).tobytes()).digest())
    assert len(pictures) == len(MARKS)


def test_unknown_failure_modes_are_drawn_by_name(situation: Callable[..., Situation]) -> None:
    state, scenario = situation([[2, 2]], [[5, 5]])
    state.failed[:] = True
    state.failure_modes = (("of_my_own",),)
    assert frame((state, scenario)).shape == frame(situation([[2, 2]], [[5, 5]])).shape


def test_absent_robot_is_not_drawn(situation: Callable[..., Situation]) -> None:
    state, scenario = situation([[2, 2], [4, 4]], [[7, 7]])
    state.robot_present[:] = False
    state.robot_position[:] = 0.0
    floor = arena(frame((state, scenario), show_beams_of=1), scenario)
    assert count(floor, SEARCHING) == 0
    assert count(floor, BEAM) == 0


def test_link_of_the_carrier(situation: Callable[..., Situation]) -> None:
    state, scenario = situation([[2, 2], [4, 4], [5, 2]], [[7, 7]])
    state.robot_told[:] = [np.nan, 3.0, 1.0]

    def linked(**options: bool) -> int:
        return count(arena(frame((state, scenario), **options), scenario), LINK)

    assert linked() == 0
    assert linked(all_links=True) > 10
    give(state, 0, 0)
    assert linked() > 100
    state.hears[0] = False
    assert linked() == 0


def test_beams_and_trails_are_drawn_when_asked_for() -> None:
    world = Warehouse(Scenario(n_robots=4))
    world.reset(0)
    plain = Renderer(world.scenario, "rgb_array", 400)
    beams = Renderer(world.scenario, "rgb_array", 400, show_beams_of=2)
    trails = Renderer(world.scenario, "rgb_array", 400, trails=True)
    for _ in range(5):
        expected = plain.frame(world.state, world.scenario)
        trailing = trails.frame(world.state, world.scenario)
        world.step(np.tile([1.0, 0.0, 0.0, 0.0], (4, 1)))
    assert not np.array_equal(trailing, expected)
    assert count(arena(beams.frame(world.state, world.scenario), world.scenario), BEAM) > 100
    # An episode that begins anew has no trail yet.
    world.reset(0)
    again = trails.frame(world.state, world.scenario)
    assert np.array_equal(again, plain.frame(world.state, world.scenario))


def test_all_delivered_is_drawn(situation: Callable[..., Situation]) -> None:
    state, scenario = situation([[2, 2]], [[5, 5]])
    before = frame((state, scenario))
    state.requested = NOBODY
    after = frame((state, scenario))
    caption = Projection.fitting(scenario, 400, 0).bottom + 10
    assert not np.array_equal(before[caption:], after[caption:])


def test_survives_a_pygame_quit_of_somebody_else(situation: Callable[..., Situation]) -> None:
    import pygame

    state, scenario = situation([[2, 2]], [[5, 5]])
    renderer = Renderer(scenario, "rgb_array", 300)
    before = renderer.frame(state, scenario)
    pygame.quit()
    assert np.array_equal(renderer.frame(state, scenario), before)
    state.time = 271.8  # words that were not written before
    assert not np.array_equal(renderer.frame(state, scenario), before)


def test_pickle_and_copy_draw_the_same(situation: Callable[..., Situation]) -> None:
    state, scenario = situation([[2, 2]], [[5, 5]])
    renderer = Renderer(scenario, "rgb_array", 300, show_beams_of=0)
    expected = renderer.frame(state, scenario)
    for twin in (pickle.loads(pickle.dumps(renderer)), copy.deepcopy(renderer)):
        assert np.array_equal(twin.frame(state, scenario), expected)


def test_close_twice(situation: Callable[..., Situation]) -> None:
    state, scenario = situation([[2, 2]], [[5, 5]])
    renderer = Renderer(scenario, "rgb_array", 300)
    renderer.close()
    renderer.close()
    assert renderer.frame(state, scenario).shape[1] == 300


def test_rgb_array_opens_no_display(situation: Callable[..., Situation]) -> None:
    import pygame

    pygame.display.quit()
    frame(situation([[2, 2]], [[5, 5]]))
    assert not pygame.display.get_init()


@pytest.mark.usefixtures("dummy_display")
def test_window_shows_the_frame_and_closes_twice(situation: Callable[..., Situation]) -> None:
    import pygame

    state, scenario = situation([[2, 2]], [[5, 5]])
    renderer = Renderer(scenario, "human", 300)
    renderer.show(state, scenario)
    shown = pygame.surfarray.array3d(pygame.display.get_surface()).transpose(1, 0, 2)
    assert np.array_equal(shown, renderer.frame(state, scenario))
    renderer.close()
    renderer.close()
    assert not pygame.display.get_init()


@pytest.mark.usefixtures("dummy_display")
def test_window_that_the_user_closed_stays_closed(situation: Callable[..., Situation]) -> None:
    import pygame

    state, scenario = situation([[2, 2]], [[5, 5]])
    renderer = Renderer(scenario, "human", 300)
    renderer.show(state, scenario)
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    renderer.show(state, scenario)
    assert not pygame.display.get_init()
    renderer.show(state, scenario)
    assert not pygame.display.get_init()
    renderer.close()


def test_no_display_is_a_typed_error(
    monkeypatch: pytest.MonkeyPatch, situation: Callable[..., Situation]
) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "no such driver")
    state, scenario = situation([[2, 2]], [[5, 5]])
    renderer = Renderer(scenario, "human", 300)
    with pytest.raises(SetupError, match=r"needs a display .* 'rgb_array'"):
        renderer.show(state, scenario)


def test_display_that_nobody_sees_is_a_typed_error(
    monkeypatch: pytest.MonkeyPatch, situation: Callable[..., Situation]
) -> None:
    import pygame

    # What SDL does on a machine without a display, wherever this test runs.
    monkeypatch.delenv("SDL_VIDEODRIVER", raising=False)
    monkeypatch.setattr(pygame.display, "init", lambda: None)
    monkeypatch.setattr(pygame.display, "get_driver", lambda: "offscreen")
    state, scenario = situation([[2, 2]], [[5, 5]])
    with pytest.raises(SetupError, match="needs a display"):
        Renderer(scenario, "human", 300).show(state, scenario)


@pytest.mark.parametrize(
    ("mode", "size", "beams", "message"),
    [
        ("ansi", 800, None, r"mode = 'ansi': should be one of \['rgb_array', 'human'\]"),
        ("rgb_array", 3, None, r"size = 3: should be 100 to 8000 \[px\]"),
        ("rgb_array", 9000, None, "size = 9000"),
        ("rgb_array", 800, 5, "show_beams_of = 5: should be None or a robot, 0 to 4"),
        ("rgb_array", 800, -1, "show_beams_of = -1"),
    ],
)
def test_wrong_arguments(mode: str, size: int, beams: int | None, message: str) -> None:
    with pytest.raises(SetupError, match=message):
        Renderer(Scenario(n_robots=5), mode, size, show_beams_of=beams)  # type: ignore[arg-type]


def test_show_needs_the_human_mode(situation: Callable[..., Situation]) -> None:
    state, scenario = situation([[2, 2]], [[5, 5]])
    with pytest.raises(SetupError, match="should be 'human'"):
        Renderer(scenario, "rgb_array", 300).show(state, scenario)


def test_missing_pygame_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises(SetupError, match=r"pip install 'swarm-logistics-env\[render\]'"):
        Renderer(Scenario(), "rgb_array")


def test_pygame_waits_for_the_first_renderer() -> None:
    script = (
        "import sys; from swarm_logistics_env import Scenario\n"
        "from swarm_logistics_env.rendering import Renderer\n"
        "assert 'pygame' not in sys.modules\n"
        "Renderer(Scenario(), 'rgb_array', 200)\n"
        "assert 'pygame' in sys.modules\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == ""
