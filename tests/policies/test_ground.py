"""What a controller that sees everything knows of a room without a floor plan, and of one with."""

from __future__ import annotations

from typing import Any

import numpy as np

from swarm_logistics_env import Scenario
from swarm_logistics_env.policies.ground import OpenGround
from swarm_logistics_env.policies.planned_ground import PlannedGround
from swarm_logistics_env.policies.routes import BLOCKED, CROWDED, cost_to_go, discs_among
from swarm_logistics_env.world.warehouse.state import NOBODY

ROOM = Scenario(n_robots=4, n_items=4, warehouse_width=4.0, warehouse_height=2.0, delivery_width=1)
NO_DISCS = np.zeros((0, 4))


def open_ground(**changes: Any) -> OpenGround:
    """Return a room of 4 x 2 m, whose delivery area begins at 3 m."""
    return OpenGround(ROOM.replace(**changes))


def test_slots_stand_in_straight_rows_each_in_the_gaps_of_the_one_before() -> None:
    ground = open_ground()
    rows = ground.slots((0.5, 1.0, 1.5), 0.8).reshape(3, 2, 2)
    np.testing.assert_allclose(rows[..., 0], [[2.5, 2.5], [2.0, 2.0], [1.5, 1.5]])
    np.testing.assert_allclose(rows[..., 1], [[0.4, 1.2], [0.8, 1.6], [0.4, 1.2]])
    for pitch, along in ((0.65, [0.325, 0.975, 1.625]), (0.72, [0.36, 1.08])):  # up to 1.7 m
        np.testing.assert_allclose(ground.slots((0.5,), pitch)[:, 1], along)


def test_robots_rest_in_files_from_the_wall_and_beyond_the_last_file_at_the_other_wall() -> None:
    pitch = 0.35  # two radii and 0.1 m: five in 2 m
    places = open_ground().resting_places(200).reshape(40, 5, 2)
    np.testing.assert_allclose(places[:, :, 1], [pitch * (np.arange(5) + 0.5) + 0.05] * 40)
    np.testing.assert_allclose(places[:2, 0, 0], [0.5 * pitch, 1.5 * pitch])
    assert places[-1, 0, 0] == 4.0 - pitch / 2
    for height, per_file in ((0.4, 1), (2.16, 5), (2.25, 6)):
        ground = open_ground(warehouse_height=height, n_items=1)
        next_file = ground.resting_places(per_file + 1)[per_file]
        np.testing.assert_allclose(next_file, [1.5 * pitch, 0.5 * pitch + 0.05])


def test_the_delivery_area_is_what_lies_from_its_edge_on() -> None:
    ground = open_ground()
    cells = ground.dock_cells(0)
    np.testing.assert_array_equal(np.flatnonzero(cells.all(axis=0)), range(24, 32))
    np.testing.assert_array_equal(cells.any(axis=0), cells.all(axis=0))
    np.testing.assert_array_equal(ground.holding_cells(0.4), cells)
    assert ground.velocity_inside(2.99, 1.0, 0) is None
    np.testing.assert_array_equal(ground.velocity_inside(3.0, 1.0, 0), [1.0, 0.0])
    costs = ground.costs(NO_DISCS)
    assert costs[[0, 1, 1], [1, 0, 1]].tolist() == [BLOCKED, BLOCKED, 1.0]


def test_ways_into_the_delivery_area_lead_beyond_its_edge() -> None:
    ground = open_ground()
    costs = ground.costs(NO_DISCS)
    home = cost_to_go(costs, ground.dock_cells(NOBODY))
    np.testing.assert_allclose(ground.point_home(costs, home, 0.5, 1.0), [2.5625, 1.0625])
    np.testing.assert_allclose(ground.point_home(costs, home, 2.0, 1.0), [4.0625, 1.0625])
    places = np.array([[0.5, 1.0], [2.0, 1.0], [3.0, 0.6], [3.7, 1.3]])
    points = ground.points_to_hold(costs, home, places, 0.4)
    np.testing.assert_allclose(points, [[2.5625, 1.0625], [3.4625, 1.0625], [3.4, 0.6], [3.4, 1.3]])
    assert ground.points_to_hold(costs, home, places, 1.4)[2, 0] == 4.0  # no deeper than the room
    # The middle of the area's first cell lies before an edge at 3.1 m.
    ground = open_ground(delivery_width=0.9)
    np.testing.assert_allclose(ground.point_home(costs, home, 2.0, 1.0), [4.0625, 1.0625])


# 5 x 2 m; dock A is 1 m wide and high at the upper left, dock B 1 x 0.5 m at the lower right.
PLAN = "AA..=...::\nAA..=...::\n....=...::\n........BB"


def planned_ground() -> PlannedGround:
    return PlannedGround(Scenario(floor=PLAN, n_robots=4, n_items=4))


def test_cells_in_racks_and_close_to_them_cost_more_than_those_along_walls() -> None:
    ground = planned_ground()
    costs = ground.costs(NO_DISCS)
    expected = np.ones((16, 40))
    expected[[0, -1]], expected[:, [0, -1]] = BLOCKED, BLOCKED
    expected[3:, 15:21], expected[4:, 16:20] = 400.0, 1e6
    np.testing.assert_array_equal(costs, expected)
    with_disc = ground.costs(np.array([[1.0, 1.0, 0.15, CROWDED]]))
    assert np.argwhere(with_disc != costs).tolist() == [[7, 7], [7, 8], [8, 7], [8, 8]]
    assert with_disc[7, 7] == CROWDED


def test_a_dock_of_a_plan_is_held_in_as_deep_as_asked_or_as_it_goes() -> None:
    ground = planned_ground()
    first, second = np.zeros((2, 16, 40), np.bool_)
    first[8:, :8], second[:4, 32:] = True, True
    for dock, cells in ((0, first), (1, second), (NOBODY, first | second)):
        np.testing.assert_array_equal(ground.dock_cells(dock), cells)
    np.testing.assert_array_equal(ground.holding_cells(0.0), first | second)
    deep_cells = ground.holding_cells(0.3)
    assert [deep_cells[row].nonzero()[0].tolist() for row in (0, 2, 9, 10, 15)] == [
        [34, 35, 36, 37, 38, 39], [], [], [0, 1, 2], [0, 1, 2, 3, 4, 5]
    ]  # fmt: skip
    assert np.argwhere(ground.holding_cells(0.9)).tolist() == [
        *([row, column] for row in (0, 1) for column in range(34, 40)), [14, 0], [14, 1],
        [15, 0], [15, 1],
    ]  # fmt: skip
    for dock in (0, NOBODY):
        np.testing.assert_array_equal(ground.velocity_inside(0.5, 1.5, dock), [0.0, 0.0])
    assert ground.velocity_inside(0.5, 1.5, 1) is None


def test_ways_into_a_dock_of_a_plan_end_beyond_its_border_and_there_robots_stay() -> None:
    ground = planned_ground()
    costs = ground.costs(NO_DISCS)
    far = cost_to_go(costs, ground.dock_cells(1))
    np.testing.assert_allclose(ground.point_home(costs, far, 0.5, 0.3), [2.5625, 0.3125])
    x, y = ground.point_home(costs, far, 3.5, 0.3)  # 0.25 m farther than the cell at 4.0625 m
    np.testing.assert_allclose([x, y], [4.312438, 0.318054], atol=1e-6)
    assert ground.point_home(costs, far, 4.0625, 0.3125) == (4.0625, 0.3125)  # it is there
    far = cost_to_go(costs, ground.holding_cells(0.3))
    places = np.array([[1.5, 1.0], [0.2, 1.5], [3.0, 0.6], [4.7, 0.2]])
    points = ground.points_to_hold(costs, far, places, 0.3)
    np.testing.assert_allclose(points, [[0.6875, 1.6875], [0.2, 1.5], [4.3125, 0.1875], [4.7, 0.2]])


def test_places_to_rest_and_slots_of_a_plan_are_the_first_that_fit() -> None:
    ground = planned_ground()
    np.testing.assert_allclose(
        ground.resting_places(8),
        [[2.6875, 1.8125], [2.6875, 1.1875], [3.3125, 1.8125], [2.3125, 0.1875],
         [3.9375, 1.8125], [2.8125, 0.5625], [4.5625, 1.8125], [1.6875, 0.1875]],
    )  # fmt: skip
    np.testing.assert_allclose(
        ground.slots((0.35, 0.85), 0.6),
        [[3.6875, 0.4375], [0.4375, 0.6875], [1.0625, 0.8125], [4.1875, 0.8125],
         [1.3125, 1.4375], [1.5625, 0.5625], [3.4375, 0.9375], [4.4375, 1.3125]],
    )  # fmt: skip
    small = PlannedGround(ground._scenario.replace(robot_radius=0.1, item_radius=0.1))
    slots = small.slots((0.35, 0.85), 0.6)  # 0.33 m from sides, for a laden robot to get past
    assert slots[:, 1].min() >= 0.33
    assert slots[:, 1].max() <= 2.0 - 0.33
    assert [len(ground.resting_places(many)) for many in (14, 100)] == [14, 100]
    places = ground.resting_places(25)  # more than have 0.6 m: two radii apart
    distances = np.linalg.norm(places[:, None] - places, axis=2)[~np.eye(25, dtype=bool)]
    assert 0.25 <= distances.min() < 0.3


def test_discs_are_of_what_counts_and_as_wide_as_a_robot_must_stay_away() -> None:
    robots, obstacles, items = np.array([[1.0, 1], [2, 1]]), np.array([[3.0, 1]]), np.eye(2)
    stands, lies = np.array([True, False]), np.array([False, True])
    discs = discs_among(robots, stands, 0.125, obstacles, 0.3, items, lies, 0.1)
    np.testing.assert_allclose(
        discs, [[1, 1, 0.28, CROWDED], [3, 1, 0.455, BLOCKED], [0, 1, 0.255, BLOCKED]]
    )
