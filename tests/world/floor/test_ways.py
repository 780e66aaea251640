"""Ways home: distances along free floor, in a dock and outside."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Scenario, Warehouse


def world_of(**fields: Any) -> Warehouse:
    world = Warehouse(Scenario(n_items=2, n_robots=2, **fields))
    world.reset(0)
    return world


def test_an_empty_room_has_its_strip_and_its_sides() -> None:
    floor = world_of().floor
    assert floor.edge == 8.0
    assert floor.along([[1.0, 5.0], [9.0, 5.0]]).tolist() == [1.0, 9.0]
    inside = floor.is_free([[0.0, 0.0], [10.0, 10.0], [10.1, 5.0], [5.0, -0.1]])
    assert inside.tolist() == [True, True, False, False]


def test_racks_and_the_outside_are_not_free() -> None:
    floor = world_of(floor="A::\n:=:\n:::").floor
    points = [[0.75, 0.75], [0.25, 0.25], [1.49, 1.49], [1.51, 0.2]]
    assert floor.is_free(points).tolist() == [False, True, True, False]


def test_a_way_goes_around_a_rack() -> None:
    # A rack of two cells between the item at the left and the dock at the right.
    floor = world_of(floor=":=A\n:=A\n:::").floor
    (straight, around) = -floor.along([[1.25, 0.25], [0.25, 1.25]])
    assert straight == pytest.approx(0.25, abs=0.13)  # half a cell below the dock
    # Down two cells and across two, half a cell of it in the dock.
    assert around == pytest.approx(2 * 0.5 + 2 * 0.5 + 0.25, rel=0.1)


def test_a_way_beside_a_rack_is_that_of_its_cell() -> None:
    floor = world_of(floor=":=A\n:=A\n:::").floor
    middle, at_the_rack = floor.along([[0.25, 0.75], [0.45, 0.75]])
    assert at_the_rack == middle


def test_each_point_has_the_way_to_its_own_dock() -> None:
    floor = world_of(floor="A::::B\n:::===\n::::::", request_docks="random").floor
    points = [[1.25, 0.25], [1.25, 0.25], [2.75, 1.25], [0.75, 1.25]]
    to_each = [floor.along(points, dock) for dock in (0, 1)]
    assert floor.along(points, [0, 1, 1, 0]).tolist() == [
        to_each[dock][number] for number, dock in enumerate((0, 1, 1, 0))
    ]
    assert to_each[0][0] > to_each[1][0]  # the way to B is the longer one


@pytest.mark.parametrize(
    ("floor", "axis"),
    [("::::AAAA\n" * 3, 0), ("AAAA::::\n" * 3, 0), (":::\n" * 4 + "AAA\n" * 4, 1),
     ("AAA\n" * 4 + ":::\n" * 4, 1)],
)  # fmt: skip
def test_the_way_grows_by_what_a_robot_drives_and_so_does_the_depth(floor: str, axis: int) -> None:
    points = np.full((40, 2), 0.75)
    points[:, axis] = np.linspace(0.3, 3.4, 40)
    ways = world_of(floor=floor.strip()).floor
    along = ways.along(points)
    if along[0] > 0.0:
        along = along[::-1]
    assert np.diff(along) == pytest.approx(np.diff(points[:, axis]), abs=1e-9)
    assert along[0] < 0.0 < along[-1]
    assert (along > 0.0).sum() == pytest.approx(20, abs=3)


def test_no_way_jumps_along_free_floor() -> None:
    floor = world_of(floor="::::::::A\n:==:==::A\n:==:::=:A\n::::=:::A").floor
    points = np.random.default_rng(0).uniform((0.0, 0.0), (4.5, 2.0), (3000, 2))
    for step in ((0.01, 0.0), (0.0, 0.01)):
        moved_points = points + step
        free = floor.is_free(points) & floor.is_free(moved_points)
        change = floor.along(moved_points[free]) - floor.along(points[free])
        # Beside a rack a way is that of the centre of a cell, half a cell away.
        assert np.abs(change).max() < 0.25 + 0.01


def test_a_hall_of_forty_metres_has_ways() -> None:
    rows = ["A" + ":" * 79] * 80
    assert -world_of(floor="\n".join(rows)).floor.along([[39.9, 20.0]])[0] == pytest.approx(
        39.4, abs=0.2
    )
