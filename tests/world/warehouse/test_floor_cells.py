"""Racks in a world: what they stop, what they hide, and which dock is where."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarm_logistics_env import Fault, Scenario, Warehouse
from swarm_logistics_env.compiler.addresses import unpacked_at
from swarm_logistics_env.compiler.kernels import kernel
from swarm_logistics_env.compiler.packing import packed
from swarm_logistics_env.core.errors import ScenarioError
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.warehouse.floor_cells import (
    floor_of,
    free_way,
    index_along,
    is_in_sight,
    is_near_solid,
)
from swarm_logistics_env.world.warehouse.pose import Pose
from swarm_logistics_env.world.warehouse.rangers import scan_boxes
from swarm_logistics_env.world.warehouse.state import NOBODY
from swarm_logistics_env.world.warehouse.structs import Floor, Sensed, World


def world_of(floor: str, n_robots: int = 1, n_items: int = 1, **fields: Any) -> Warehouse:
    world = Warehouse(Scenario(floor=floor, n_robots=n_robots, n_items=n_items, **fields))
    world.reset(0)
    return world


# As `test_layout.restock_at`: Python hands over no structure, which takes the compiler seconds.
@kernel
def free_way_at(address: int, x: float, y: float, dx: float, dy: float, reach: float) -> float:
    return free_way(unpacked_at(Floor, address), x, y, dx, dy, reach)


@kernel
def is_near_solid_at(address: int, x: float, y: float, distance: float) -> bool:
    return is_near_solid(unpacked_at(Floor, address), x, y, distance)


@kernel
def scan_boxes_at(
    address: int, x: float, y: float, heading: float, reach: float, scan: Sensed
) -> None:
    pose = Pose(x, y, math.cos(heading), math.sin(heading))
    scan_boxes(pose, reach, unpacked_at(World, address), scan)


@kernel
def is_in_sight_at(address: int, x: float, y: float, other_x: float, other_y: float) -> bool:
    return is_in_sight(unpacked_at(World, address), x, y, other_x, other_y)


@kernel
def column_of(x: float) -> int:
    return index_along(x, 0.5, 4)


def test_outside_of_the_floor_counts_as_its_edge() -> None:
    columns = [column_of(x) for x in (-0.6, 0.0, 0.49, 0.5, 1.9, 2.0, 9.0)]
    assert columns == [0, 0, 0, 1, 3, 3, 3]


def put(world: Warehouse, robots: list[list[float]], items: list[list[float]]) -> None:
    """Put robots and items there, all robots looking along x, and sense anew."""
    world.state.robot_position = np.array(robots)
    world.state.robot_heading = np.zeros(len(robots))
    world.state.item_position = np.array(items)
    world.change()  # makes the bodies anew
    world.step(np.zeros((len(robots), 4)))


WALLED = "A:::\n..=.\n....\n....\n"  # 2 x 2 m; the rack is at x 1 to 1.5, y 1 to 1.5


def test_a_robot_is_stopped_by_a_rack_and_feels_it() -> None:
    world = world_of(WALLED, heading_drift=0.0)
    put(world, [[0.4, 1.25]], [[0.75, 1.75]])
    for _ in range(20):
        world.step(np.array([[1.0, 0.0, 0.0, 0.0]]))
    assert world.state.robot_position[0, 0] == pytest.approx(1.0 - 0.125, abs=0.01)
    assert world.state.robot_contact[0]


def test_beams_stop_at_a_rack_and_hide_what_is_behind() -> None:
    world = world_of(WALLED, n_robots=2, heading_drift=0.0)
    put(world, [[0.4, 1.25], [1.75, 1.25]], [[0.75, 1.75]])
    observation = world.observe()[0]
    assert observation[row.RANGE_WALLS] == pytest.approx(0.6, abs=1e-3)
    assert observation[row.RANGE_ROBOTS] == world.scenario.ranger_range
    put(world, [[0.4, 0.25], [1.75, 0.25]], [[0.75, 1.75]])
    assert world.observe()[0][row.RANGE_ROBOTS] == pytest.approx(1.35 - 0.125, abs=1e-3)


def test_beams_see_a_rack_that_their_reach_just_meets() -> None:
    world = world_of(WALLED, ranger_range=1.0, heading_drift=0.0)
    put(world, [[0.45, 1.25]], [[0.75, 1.75]])
    assert world.observe()[0][row.RANGE_WALLS] == pytest.approx(0.55, abs=1e-3)


def test_cameras_and_grippers_do_not_reach_through_a_rack_but_the_radio_does() -> None:
    fields: dict[str, Any] = {"view_range": 2.0, "pickup_range": 1.0, "heading_drift": 0.0}
    world = world_of(WALLED, n_robots=2, **fields)
    put(world, [[0.8, 1.25], [1.75, 1.25]], [[1.65, 1.25]])
    world.step(np.array([[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 0.0]]))
    assert world.state.robot_item[0] == NOBODY
    observation = world.observe()[0]
    assert observation[row.ITEMS] == 0.0  # nothing in view
    assert observation[row.NEIGHBOURS] == 1.0  # but the neighbour is heard
    world.step(np.array([[0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]]))
    assert world.state.robot_item[1] == 0


def test_a_robot_delivers_in_any_dock() -> None:
    for x in (0.25, 2.25):
        world = world_of("A:::B\nA:::B", heading_drift=0.0)
        put(world, [[x, 0.25]], [[x, 0.25]])
        world.step(np.array([[0.0, 0.0, 0.0, 1.0]]))
        world.step(np.array([[0.0, 0.0, 0.0, 1.0]]))
        assert (world.state.delivered, world.state.robot_in_delivery[0]) == (1, True)


def test_items_robots_and_obstacles_start_in_their_cells_and_leave_ways() -> None:
    rows = ["A" * 4 + "." * 4 + ":" * 8] * 8 + ["A" * 4 + "." * 12] * 4 + ["+" * 16] * 4
    scenario = Scenario(
        floor="\n".join(rows), n_robots=10, n_items=20, n_obstacles=4, obstacle_radius=0.3
    )
    world = Warehouse(scenario)
    for seed in range(20):
        world.reset(seed)
        state = world.state
        assert (state.robot_position[:, 1] < 2.0).all()
        assert (state.item_position[:, 0] > 4.0).all()
        assert (state.item_position[:, 1] > 4.0).all()
        centres = state.obstacle_position
        apart = np.linalg.norm(centres[:, None] - centres, axis=2)[np.triu_indices(4, 1)]
        assert (apart > 2 * 0.3 + 2 * scenario.robot_radius).all()


def test_a_robot_finds_room_above_a_small_item_beside_a_rack() -> None:
    scenario = Scenario(floor="aisles", n_items=60, item_radius=0.05)
    world, words = Warehouse(scenario), packed(floor_of(scenario))
    for seed in range(5):
        world.reset(seed)
        for x, y in world.state.item_position.tolist():
            assert not is_near_solid_at(words.ctypes.data, x, y, scenario.robot_radius - 1e-9)


def test_what_comes_back_lies_in_storage_again() -> None:
    world = world_of("A:::::\nA:::::", restock=True, n_items=3, heading_drift=0.0)
    for _ in range(20):
        item = world.state.requested
        dock = [[0.25, 0.25]]
        items = world.state.item_position.copy()
        items[item] = dock[0]
        put(world, dock, items.tolist())
        world.step(np.array([[0.0, 0.0, 0.0, 1.0]]))
        assert (world.state.item_position[:, 0] > 0.5).all()
        assert world.floor.is_free(world.state.item_position).all()
    assert world.state.delivered == 20


PLANS = st.lists(st.text(alphabet=":.#=", min_size=6, max_size=6), min_size=5, max_size=5).map(
    lambda rows: "\n".join(["A:::::", *rows])
)


@given(plan=PLANS, x=st.floats(0.01, 2.99), y=st.floats(0.01, 2.99), angle=st.floats(0.0, 6.28))
@settings(max_examples=60)
def test_a_ray_goes_as_far_as_fine_steps_find_floor(
    plan: str, x: float, y: float, angle: float
) -> None:
    try:
        scenario = Scenario(floor=plan, n_items=1, n_robots=1)
    except ValueError:
        return
    cells, reach = floor_of(scenario), 2.0
    words = packed(cells)
    column, line = int(x / 0.5), int(y / 0.5)
    if cells.is_solid[line, column]:
        return
    step = np.array([np.cos(angle), np.sin(angle)])
    distance = free_way_at(words.ctypes.data, x, y, float(step[0]), float(step[1]), reach)
    along = np.arange(0.0, reach, 2e-4)
    points = np.array([x, y]) + along[:, None] * step
    inside = ((points > 0.0) & (points < 3.0)).all(axis=1)
    cell = np.clip((points / 0.5).astype(int), 0, 5)
    blocked = np.flatnonzero(cells.is_solid[cell[:, 1], cell[:, 0]] & inside)
    first = along[blocked[0]] if len(blocked) else reach
    # Steps may pass a corner that the ray touches.
    assert distance == pytest.approx(first, abs=3e-4) or distance < first
    end = points[min(np.searchsorted(along, distance + 2e-3), len(along) - 1)]
    if distance < reach - 1e-2 and distance < first - 1e-3:
        assert is_near_solid_at(words.ctypes.data, float(end[0]), float(end[1]), 5e-3)


@pytest.mark.parametrize("floor", ["aisles", "two_docks", "bottleneck", "large", "noise"])
@pytest.mark.parametrize("reach", [0.4, 3.0])
def test_beams_meet_what_rays_meet_cell_after_cell(floor: str, reach: float) -> None:
    rng = np.random.default_rng(5)
    if floor == "noise":
        signs = np.where(rng.random((30, 40)) < 0.05, "=", ":")
        signs[:, :4] = "A"
        floor = "\n".join("".join(line) for line in signs.tolist())
    world = world_of(floor, ranger_range=reach)
    words = packed(world._world.floor)
    sides = world.scenario.warehouse_width, world.scenario.warehouse_height
    points = rng.uniform((0.0, 0.0), sides, (400, 2))
    beams = 2.0 * np.pi * np.arange(row.N_BEAMS) / row.N_BEAMS
    for x, y in points[world.floor.is_free(points)].tolist():
        heading = rng.uniform(-np.pi, np.pi)
        scan = np.full(row.N_BEAMS, reach, np.float32)
        scan_boxes_at(world.address, x, y, heading, reach, scan)
        steps = np.column_stack([np.cos(beams + heading), np.sin(beams + heading)])
        rays = [free_way_at(words.ctypes.data, x, y, dx, dy, reach) for dx, dy in steps.tolist()]
        assert scan == pytest.approx(rays, abs=1e-6)


def test_sight_is_the_same_from_both_ends() -> None:
    world = world_of("aisles", n_robots=2)
    rng = np.random.default_rng(0)
    points = rng.uniform(0.0, 10.0, (400, 2))
    points = points[world.floor.is_free(points)]
    for start, end in zip(points[::2].tolist(), points[1::2].tolist(), strict=False):
        forth, back = (*start, *end), (*end, *start)
        assert is_in_sight_at(world.address, *forth) == is_in_sight_at(world.address, *back)


def test_a_pickle_goes_on_with_the_same_bits() -> None:
    import pickle

    world = Warehouse(Scenario(floor="aisles", n_robots=20, restock=True))
    world.reset(3, [Fault("FM4", 2)])
    rng = np.random.default_rng(1)
    for _ in range(30):
        world.step(rng.uniform(-1, 1, (20, 4)))
    copy = pickle.loads(pickle.dumps(world))
    for _ in range(30):
        commands = rng.uniform(-1, 1, (20, 4))
        assert (world.step(commands) == copy.step(commands)).all()


def test_a_request_that_names_a_dock_is_delivered_in_that_dock_alone() -> None:
    fields: dict[str, Any] = {"request_docks": "random", "restock": True, "heading_drift": 0.0}
    world = world_of("A:::B\nA:::B", n_items=3, **fields)
    named = []
    for _ in range(12):
        item, dock = world.state.requested, int(world.state.requested_docks[0])
        named.append(dock)
        assert world.state.item_docks[item] == dock
        for number, x in ((1 - dock, 0.25 + 2.0 * (1 - dock)), (dock, 0.25 + 2.0 * dock)):
            delivered = world.state.delivered
            items = world.state.item_position.copy()
            items[item] = (x, 0.25)
            world.state.robot_item[0] = NOBODY
            world.state.item_status[item], world.state.item_carrier[item] = 0, NOBODY
            put(world, [[x, 0.25]], items.tolist())
            for _ in range(2):
                world.step(np.array([[0.0, 0.0, 0.0, 1.0]]))
            assert world.state.delivered - delivered == int(number == dock)
            if number != dock:  # it carries the item, but this is no delivery area to it
                assert not world.state.robot_in_delivery[0]
    assert set(named) == {0, 1}


def test_requests_name_docks_only_where_there_are_two() -> None:
    for floor in (None, "aisles"):
        with pytest.raises(ScenarioError, match="should have a floor of two docks or more"):
            Scenario(floor=floor, request_docks="random")


@pytest.mark.parametrize(
    ("x", "y", "step_x", "step_y", "distance"),
    [
        (0.4, 1.25, 1, 0, 0.6),
        (1.9, 1.25, -1, 0, 0.4),
        (1.25, 0.4, 0, 1, 0.6),
        (1.25, 1.9, 0, -1, 0.4),
    ],
)
def test_a_ray_along_an_axis_meets_the_rack_in_its_way(
    x: float, y: float, step_x: float, step_y: float, distance: float
) -> None:
    words = packed(floor_of(Scenario(floor=WALLED, n_robots=1, n_items=1)))
    ray = free_way_at(words.ctypes.data, x, y, float(step_x), float(step_y), 5.0)
    assert ray == pytest.approx(distance)
