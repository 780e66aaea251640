from __future__ import annotations

import copy
import hashlib
import os
import pickle
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

from swarm_logistics_env import Fault, Scenario, Warehouse
from swarm_logistics_env.core.errors import SetupError
from swarm_logistics_env.world.rendering import Renderer, palette
from swarm_logistics_env.world.warehouse import FAILURE_MODES, WarehouseState
from swarm_logistics_env.world.warehouse.state import CARRIED, DELIVERED, NOBODY
from swarm_logistics_env.world.warehouse.structs import DUE

Frame = NDArray[np.uint8]
FROZEN = Path(__file__).parents[2] / "frozen"
RECORDED_WITH = "2.6.1"  # of pygame


def situation(robots: ArrayLike, items: ArrayLike = ((5, 5),)) -> tuple[WarehouseState, Scenario]:
    """Return a state, without a world: all robots present and sound, silent, looking along +x."""
    places, item_places = (np.array(rows, float).reshape(-1, 2) for rows in (robots, items))
    scenario = Scenario(n_robots=len(places), n_items=len(item_places))
    state = WarehouseState(scenario)
    state.robot_position, state.item_position = places, item_places
    state.sends[:], state.hears[:] = True, True
    return state, scenario


def frame(state: WarehouseState, scenario: Scenario, size: int = 400) -> Frame:
    return Renderer(scenario, "rgb_array", size).frame(state, scenario)


def arena(state: WarehouseState, scenario: Scenario, size: int = 400) -> Frame:
    """The part of a picture that shows the warehouse: no caption, no margin."""
    from swarm_logistics_env.world.rendering.picture import Picture  # loads pygame

    floor = Picture(scenario, size).floor
    return frame(state, scenario, size)[floor.top : floor.bottom, floor.left : floor.right]


def count(picture: Frame, colour: palette.RGB) -> int:
    return int((picture == colour).all(axis=2).sum())


def give(state: WarehouseState, robot: int, item: int) -> None:
    state.robot_item[robot] = item
    state.item_carrier[item], state.item_status[item] = robot, CARRIED
    state.item_position[item] = state.robot_position[robot]


def test_frame_is_an_rgb_array_as_large_as_asked_for() -> None:
    scenario = Scenario(n_robots=5, warehouse_width=5, warehouse_height=10)
    world = Warehouse(scenario)
    world.reset(0)
    picture = frame(world.state, scenario, 800)
    assert picture.dtype == np.uint8
    assert picture.shape[1:] == (410, 3)
    assert picture.shape[0] > 760
    assert picture.shape[0] % 2 == 0  # as films want it
    # Its size depends on the warehouse alone.
    other = scenario.replace(n_items=4, n_obstacles=2, delivery_width=1.0)
    world.reset(1, [Fault(mode, 1) for mode in palette.MARKS if mode != "cell_fades"], other)
    assert frame(world.state, other, 800).shape == picture.shape


def digest() -> str:
    """Return what all frames of a run hash to."""
    world = Warehouse(Scenario(n_robots=12, n_items=20, n_obstacles=2))
    world.reset(3, [Fault("FM1", 2), Fault("dead", 1)])
    renderer = Renderer(world.scenario, "rgb_array", 400)
    frames_hash = hashlib.sha256()
    for _ in range(15):
        world.step(np.tile([1.0, 0.0, 0.3, 1.0], (12, 1)))
        frames_hash.update(renderer.frame(world.state, world.scenario).tobytes())
    return frames_hash.hexdigest()


def room() -> Frame:
    """A busy room: every activity, halos of two ages, a link, marks, obstacles and requests."""
    fields: dict[str, Any] = {"n_robots": 6, "n_items": 5, "n_requests": 2}
    scenario = Scenario(**fields, n_obstacles=2, obstacle_radius=0.4, radio_range=6.0)
    state: Any = WarehouseState(scenario)
    state.robot_position = [[1, 1], [3, 4], [5, 8], [7, 2], [8.5, 6], [2, 7]]
    state.robot_heading = [0.0, 0.8, 2.0, -1.2, 3.1, -2.4]
    state.item_position = [[4.2, 1.1], [2, 5.5], [5.5, 5], [1, 9], [7, 7]]
    state.obstacle_position = [[4, 6.5], [6, 3.5]]
    state.sends[:], state.hears[:] = True, True
    state.robot_timer = [0.0, 3.0, 9.0, np.nan, np.nan, np.nan]
    state.robot_told = [np.nan, 2.0, 1.0, np.nan, np.nan, np.nan]
    state.open_requests[:] = 0, 2
    give(state, 3, 2)
    give(state, 4, 4)
    state.failed = [False, True, False, True, False, False]
    state.failure_modes = ((), ("FM1",), (), ("FM4", "FM2"), (), ())
    state.progress.time[0] = 12.3
    state.delivery_times = [1.0, 2.0]
    return frame(state, scenario, 500)


def hall(size: int = 600) -> Frame:
    """A floor plan, wider than high, with requests that name docks."""
    plan = "A.::::::.B\nA.::==::.B\nA.::==::.B\n..::##::..\n++::##::.A\n++::::::.A"
    scenario = Scenario(floor=plan, n_robots=2, n_items=3, request_docks="random", cell_size=1.0)
    state: Any = WarehouseState(scenario)
    state.robot_position, state.item_position = [[0.6, 0.5], [7, 1]], [[3, 5], [2.5, 1.5], [7, 4]]
    state.open_requests[:], state.requested_docks[:] = 1, 1
    state.failed[1], state.failure_modes = True, ((), ("of_my_own",))
    return frame(state, scenario, size)


def small_hall() -> Frame:
    """The same with lines and marks as small as they are drawn."""
    return hall(130)


def yard(size: int = 500) -> Frame:
    """Batteries, a station that is broken, kinds of robots, orders with a due time, one late."""
    kinds = "lifter:2, scout:1 robot_radius=0.2, third:1, fourth:1"
    scenario = Scenario.preset("day").replace(
        floor=None, n_robots=5, n_items=6, robot_radius=0.3, robot_kinds=kinds, n_stations=2
    )
    world = Warehouse(scenario)
    world.reset(0)
    state: Any = world.state
    state.robot_position[:] = [[3, 2], [5, 8], [8, 4], [6, 6], [9, 9]]
    state.robot_heading[:] = [0.0, 0.8, 2.0, -1.2, 3.1]
    state.item_position[:] = [[4.2, 1.1], [2, 5.5], [5.5, 4], [1, 9], [7, 7], [3, 3.5]]
    state.batteries.energy[:] *= [1.0, 0.6, 0.25, 0.15, 0.02]
    state.batteries.n_dead[0] = 1
    state.open_requests[:2] = 0, 1
    state.orders.open[:2, DUE] = 5.0, 500.0
    state.progress.time[0] = 12.3
    return frame(state, scenario, size)


def small_yard() -> Frame:
    """The same with lines and marks as small as they are drawn."""
    return yard(130)


@pytest.mark.parametrize("scene", [room, hall, small_hall, yard, small_yard])
def test_pictures_are_as_recorded(scene: Callable[[], Frame], tmp_path: Path) -> None:
    """To every bit with the recorded version of pygame; other ones draw letters otherwise."""
    import pygame

    made = tmp_path / f"{scene.__name__}.png"
    pygame.image.save(pygame.surfarray.make_surface(scene().transpose(1, 0, 2)), made)
    recorded, shown = (
        pygame.surfarray.array3d(pygame.image.load(path)).astype(int)
        for path in (FROZEN / made.name, made)
    )
    message = f"if {made} is as it should be, put it into {FROZEN}"
    assert shown.shape == recorded.shape, message
    change = np.abs(shown - recorded).max(axis=2)
    if pygame.version.ver == RECORDED_WITH:
        assert not change.any(), message
    assert (change > 16).mean() <= 0.02, message


@pytest.mark.daily
def test_frames_are_the_same_in_two_processes() -> None:
    script = (
        "import sys; from swarm_logistics_env.world.rendering import Renderer\n"
        "assert 'pygame' not in sys.modules\n"  # it waits for the first renderer
        "from tests.world.rendering.test_renderer import digest\n"
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
    copied = before.copy()
    for twin in (pickle.loads(pickle.dumps(renderer)), copy.deepcopy(renderer)):
        assert np.array_equal(twin.frame(state, scenario), before)
    pygame.quit()  # by somebody else
    moved = copy.deepcopy(state)
    moved.robot_position[0] = [5.0, 1.0]
    assert not np.array_equal(renderer.frame(moved, scenario), before)
    assert np.array_equal(before, copied)  # an array of the caller's own
    assert np.array_equal(renderer.frame(state, scenario), before)
    renderer.close()
    state.progress.time[0] = 271.8  # words that were not written before
    assert not np.array_equal(renderer.frame(state, scenario), before)


def test_requested_item_is_plain_to_see() -> None:
    state, scenario = situation([[2, 2]], [[5, 5], [7, 7]])
    for share in (0.5, 0.7, 0.2):  # one item, the other, and that one on the robot
        if share == 0.7:
            state.open_requests[0] = 1
        if share == 0.2:
            give(state, 0, 1)
        rows, columns = np.nonzero((arena(state, scenario, 800) == palette.REQUESTED).all(axis=2))
        assert len(rows) > 250
        assert rows.mean() == pytest.approx((1.0 - share) * 780, abs=2)  # y points up
        assert columns.mean() == pytest.approx(share * 780, abs=2)
    state.open_requests[0], state.robot_item[0] = NOBODY, NOBODY
    state.item_status[:] = DELIVERED
    assert count(arena(state, scenario, 800), palette.REQUESTED) == 0


def test_every_request_and_every_robot_that_carries_one_is_plain_to_see() -> None:
    places = [[2, 2], [8, 2], [5, 8], [2, 8], [8, 8], [6, 5]]
    robots = [[4, 5], [1, 5]]
    state, _ = situation(robots, places)
    scenario = Scenario(n_robots=2, n_items=6, n_requests=5)
    state = WarehouseState(scenario)
    state.robot_position, state.item_position = np.array(robots), np.array(places)
    state.open_requests[:] = range(5)
    give(state, 0, 3)  # not the oldest request
    give(state, 1, 5)  # nothing that is asked for
    floor = arena(state, scenario, 800)

    def orange(x: float, y: float) -> int:
        around = floor[int(780 - 78 * y) - 20 :, int(78 * x) - 20 :][:40, :40]
        return count(around, palette.REQUESTED)

    assert all(orange(*places[item]) > 200 for item in (0, 1, 2, 4))
    assert orange(*robots[0]) > 100
    assert orange(*robots[1]) == 0
    assert [palette.activity(state, robot) for robot in (0, 1)] == ["delivering", "shuffling"]
    assert min(count(floor, palette.DELIVERING), count(floor, palette.SHUFFLING)) > 50


def test_each_robot_is_drawn_as_large_as_it_is() -> None:
    state, scenario = situation([(2.5, 5.0), (7.5, 5.0)])
    kinds = "large, small robot_radius=0.25"
    scenario = scenario.replace(robot_radius=0.5, robot_kinds=kinds, delivery_width=0.5)
    floor = frame(state, scenario, 800)[:700]  # without the legend
    searching = np.all(floor == palette.SEARCHING, axis=2)
    left, right = np.split(searching, [searching.shape[1] // 2], axis=1)
    assert np.ptp(np.flatnonzero(left.any(axis=0))) == pytest.approx(70, abs=5)
    assert np.ptp(np.flatnonzero(right.any(axis=0))) == pytest.approx(34, abs=5)


def test_the_legend_has_an_obstacle_only_where_there_are_some() -> None:
    for n_obstacles in (0, 3):
        world = Warehouse(Scenario(n_robots=2, n_items=2, n_obstacles=n_obstacles))
        world.reset(0)
        below = frame(world.state, world.scenario)[395:]
        assert (count(below, palette.OBSTACLE) > 20) == (n_obstacles > 0)


def test_what_a_robot_does_its_timer_and_its_heading_show() -> None:
    state, scenario = situation([[2, 2]], [[5, 5], [7, 7]])

    def colours() -> list[bool]:
        floor = arena(state, scenario, 800)
        return [
            count(floor, colour) > 20
            for colour in (palette.SEARCHING, palette.SHUFFLING, palette.DELIVERING)
        ]

    shown = []
    for age in (0.0, 3.0, 6.0, 9.0, np.nan):  # a halo that fades
        state.robot_timer[:] = age
        floor = arena(state, scenario).astype(int)
        shown.append(int((floor[..., 1] - floor[..., 0])[200:, :200].clip(0).sum()))  # greenness
    assert shown == sorted(set(shown), reverse=True)
    assert colours() == [True, False, False]
    give(state, 0, 1)
    assert colours() == [False, True, False]
    state.open_requests[0] = 1
    assert colours() == [False, False, True]
    looks_east = arena(state, scenario)
    state.robot_heading[:] = np.pi
    assert not np.array_equal(arena(state, scenario), looks_east)
    state.robot_present[:] = False
    assert colours() == [False, False, False]


def test_every_failure_mode_has_a_mark_of_its_own() -> None:
    assert set(palette.MARKS) == set(FAILURE_MODES) - {"removed", "away"}
    state, scenario = situation([[2, 2], [4, 4]])
    state.failure_modes = ((), ())
    grey = [0.299, 0.587, 0.114]  # they are told apart in print as well
    pictures = [arena(state, scenario) @ grey]
    state.failed[1] = True
    for mode in [*palette.MARKS, "of_my_own"]:
        state.failure_modes = ((), (mode,))
        pictures.append(arena(state, scenario) @ grey)
        changed = pictures[0] != pictures[-1]
        assert changed.sum() > 40
        assert not changed[260:, :140].any()  # the healthy one looks as before
    assert len({np.rint(picture).tobytes() for picture in pictures}) == len(palette.MARKS) + 2


def test_link_of_the_carrier() -> None:
    state, scenario = situation([[2, 2], [4, 4], [5, 2]], [[7, 7]])
    state.robot_told[:] = [np.nan, 3.0, 1.0]
    assert count(arena(state, scenario), palette.LINK) == 0
    give(state, 0, 0)
    assert count(arena(state, scenario), palette.LINK) > 100
    for gap, has_room in ((0.7, True), (0.5, False), (0.4, False)):
        state.robot_position[2] = [2.0 + gap, 2.0]
        assert (count(arena(state, scenario), palette.LINK) > 0) == has_room
    state.robot_position[2] = [5.0, 2.0]
    state.hears[0] = False
    assert count(arena(state, scenario), palette.LINK) == 0


ONE = situation([[2, 2]])


@pytest.fixture
def dummy_display(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    yield
    import pygame

    pygame.display.quit()


@pytest.mark.usefixtures("dummy_display")
def test_window_shows_the_frame_and_closes_twice() -> None:
    import pygame

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
    monkeypatch.setenv("SDL_VIDEODRIVER", "no such driver")
    with pytest.raises(SetupError, match=r"needs a display .* 'rgb_array'"):
        Renderer(ONE[1], "human", 300).show(*ONE)


@pytest.mark.usefixtures("dummy_display")
def test_a_display_that_shows_nothing_is_refused_unless_it_was_asked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    import pygame

    monkeypatch.setattr(pygame.display, "get_driver", lambda: "offscreen")
    Renderer(ONE[1], "human", 300).show(*ONE)  # SDL_VIDEODRIVER names a driver
    monkeypatch.delenv("SDL_VIDEODRIVER")
    with pytest.raises(SetupError, match=r"needs a display \(SDL found none\)"):
        Renderer(ONE[1], "human", 300).show(*ONE)
    assert not pygame.display.get_init()


def test_wrong_arguments_and_a_missing_pygame_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(SetupError, match="mode = 'ansi': should be one of"):
        Renderer(ONE[1], "ansi")  # type: ignore[arg-type]
    with pytest.raises(SetupError, match="size = 8001: should be 100 to 8000"):
        Renderer(ONE[1], "rgb_array", 8001)
    with pytest.raises(SetupError, match="should be 'human'"):
        Renderer(ONE[1], "rgb_array", 300).show(*ONE)
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises(SetupError, match=r"pip install .*\[render\]"):
        Renderer(Scenario(), "rgb_array")
