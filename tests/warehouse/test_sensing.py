"""What is sensed, against a slow and plain computation of the same, and by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import Fault, Scenario, Warehouse, policies
from swarm_logistics_env import observations as row
from swarm_logistics_env.observations import unflatten
from swarm_logistics_env.warehouse.state import NOBODY, STORED
from tests.warehouse.conftest import Build

TOLERANCE = 2e-5  # [m]: rows are of single precision

FAULTS = (
    Fault("FM1", 2),
    Fault("FM3", (3,)),
    Fault("FM3_send", (4,)),
    Fault("FM3_hear", (5,)),
    Fault("view_reduced", (6, 7), factor=0.3),
    Fault("rangers_blind", (8,)),
    Fault("dead", (9,)),
    Fault("removed", (10,)),
)
WORLDS = {
    "square": Scenario(n_robots=20, n_items=30, warehouse_width=5, warehouse_height=5),
    "tall": Scenario(
        n_robots=15, n_items=12, warehouse_width=2.2, warehouse_height=13.7, delivery_width=1.1,
        view_range=2.5, ranger_range=1.3,
    ),
    "wide": Scenario(
        n_robots=15, n_items=25, warehouse_width=17.3, warehouse_height=1.3, delivery_width=9.0,
        radio_range=2.1, n_obstacles=3, obstacle_radius=0.2,
    ),
    "nearly empty": Scenario(n_robots=11, n_items=2, warehouse_width=30, warehouse_height=25),
    "crowded": Scenario(
        n_robots=40, n_items=40, warehouse_width=4.6, warehouse_height=3.4, delivery_width=1.0,
        n_obstacles=2, relay="gossip", timer_limit=3.0, memory_size=3, view_range=0.6,
    ),
    "short-sighted": Scenario(
        n_robots=20, n_items=20, warehouse_width=4, warehouse_height=3, ranger_range=0.05,
        view_range=0.1, radio_range=0.1, delivery_width=1.0,
    ),
    "one robot": Scenario(n_robots=1, n_items=1),
}  # fmt: skip


@pytest.mark.parametrize("name", WORLDS)
def test_rows_agree_with_a_plain_computation(name: str) -> None:
    scenario = WORLDS[name]
    faults = FAULTS if scenario.n_robots > 10 else ()
    world, policy = Warehouse(scenario), policies.load("swarm-dt")
    policy.reset(scenario.n_robots, 1)
    rng = np.random.default_rng(3)
    rows = world.reset(4, faults)
    for step in range(48):
        commands = policy.act(rows)
        # All ways at once: turned, and crowding into the delivery area and its walls.
        commands[:, 2] = rng.uniform(-1.0, 1.0, scenario.n_robots)
        if step > 24:
            heading = world.state.robot_heading
            commands[:, 0], commands[:, 1] = np.cos(heading), -np.sin(heading)
        rows = world.step(commands)
        if step % 12 == 11:
            check_rows(world, rows)


def check_rows(world: Warehouse, rows: NDArray[np.float32]) -> None:
    state = world.state
    for me in range(state.n_robots):
        if not state.robot_present[me]:
            assert not rows[me].any()
            continue
        parts = unflatten(rows[me], world.scenario)
        check_scans(world, me, parts)
        check_items(world, me, parts)
        check_neighbours(world, me, parts)
        check_itself(world, me, parts)


def modes_of(world: Warehouse, robot: int) -> set[str]:
    return set(world.state.failure_modes[robot])


def view_of(world: Warehouse, robot: int) -> float:
    reduced = 0.3 if "view_reduced" in modes_of(world, robot) else 1.0
    return 0.0 if "dead" in modes_of(world, robot) else world.scenario.view_range * reduced


def seen_from(world: Warehouse, me: int, places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return `places` (n, 2) in the frame of robot `me`."""
    state = world.state
    heading = state.robot_heading[me]
    turn = np.array(
        [[math.cos(heading), math.sin(heading)], [-math.sin(heading), math.cos(heading)]]
    )
    return np.asarray((places - state.robot_position[me]) @ turn.T)


def others_of(world: Warehouse, me: int) -> NDArray[np.int64]:
    others = world.state.robot_present.copy()
    others[me] = False
    return np.flatnonzero(others)


def free_items(world: Warehouse) -> NDArray[np.int64]:
    return np.flatnonzero(world.state.item_status == STORED)


def check_scans(world: Warehouse, me: int, parts: dict[str, NDArray[np.float32]]) -> None:
    state, scenario = world.state, world.scenario
    items = state.item_position[free_items(world)]
    robots = state.robot_position[others_of(world, me)]
    blind = bool({"rangers_blind", "dead"} & modes_of(world, me))
    for beam in range(row.N_BEAMS):
        angle = beam * math.tau / row.N_BEAMS
        way = np.array([math.cos(angle), math.sin(angle)])
        wall = min(
            to_walls(world, me, beam),
            to_discs(seen_from(world, me, state.obstacle_position), scenario.obstacle_radius, way),
        )
        seen = {
            "range_robots": to_discs(seen_from(world, me, robots), scenario.robot_radius, way),
            "range_items": to_discs(seen_from(world, me, items), scenario.item_radius, way),
            "range_walls": wall,
        }
        for name, distance in seen.items():
            expected = scenario.ranger_range if blind else min(distance, scenario.ranger_range)
            assert parts[name][beam] == pytest.approx(expected, abs=TOLERANCE)


def to_discs(centres: NDArray[np.float64], radius: float, way: NDArray[np.float64]) -> float:
    """Return how far a beam from the origin goes until it meets a disc: the quadratic's root."""
    nearest = math.inf
    for centre in centres:
        if np.hypot(*centre) <= radius:
            return 0.0
        half, offset = -float(way @ centre), float(centre @ centre) - radius**2
        root = half * half - offset
        if root > 0.0 and -half > 0.0:
            nearest = min(nearest, -half - math.sqrt(root))
    return nearest


def to_walls(world: Warehouse, me: int, beam: int) -> float:
    """Return how far a beam goes until it leaves the arena."""
    x, y = world.state.robot_position[me]
    angle = world.state.robot_heading[me] + beam * math.tau / row.N_BEAMS
    width, height = world.scenario.warehouse_width, world.scenario.warehouse_height
    distances: list[float] = []
    for place, way, far in ((x, math.cos(angle), width), (y, math.sin(angle), height)):
        if abs(way) > 1e-12:
            distances.append(((far if way > 0.0 else 0.0) - place) / way)
    return max(min(distances), 0.0)


def check_items(world: Warehouse, me: int, parts: dict[str, NDArray[np.float32]]) -> None:
    state = world.state
    items, view = free_items(world), view_of(world, me)
    places = seen_from(world, me, state.item_position[items])
    distance = np.hypot(places[:, 0], places[:, 1])
    order = [at for at in np.argsort(distance) if distance[at] <= view][: row.N_ITEMS_IN_VIEW]
    expected = np.zeros((row.N_ITEMS_IN_VIEW, 5))
    for place, at in enumerate(order):
        item = items[at]
        is_requested = item == state.requested
        expected[place] = 1, *places[at], is_requested, item in state.robot_memory[me]
    names = ("item_present", "item_x", "item_y", "item_requested", "item_recently_held")
    sensed = np.column_stack([parts[name] for name in names])
    np.testing.assert_allclose(sensed, expected, atol=TOLERANCE)


def check_neighbours(world: Warehouse, me: int, parts: dict[str, NDArray[np.float32]]) -> None:
    state, scenario = world.state, world.scenario
    view = view_of(world, me)
    deaf, mute = {"FM3", "FM3_hear", "dead"}, {"FM3", "FM3_send", "dead"}
    near: list[tuple[float, int, float, float, bool]] = []
    for other in others_of(world, me):
        x, y = seen_from(world, me, state.robot_position[[other]])[0]
        distance = math.hypot(x, y)
        heard = distance <= scenario.radio_range and not (
            deaf & modes_of(world, me) or mute & modes_of(world, int(other))
        )
        if heard or distance <= view:
            near.append((distance, int(other), x, y, heard))
    near.sort()

    expected = np.zeros((row.N_NEIGHBOURS, 5))
    tellers = []
    for place, (distance, other, x, y, heard) in enumerate(near):
        told = state.robot_told[other]
        tells = heard and not math.isnan(told)
        if tells:
            tellers.append((told, distance, x, y))
        if place < row.N_NEIGHBOURS:
            expected[place] = 1, x, y, tells, told if tells else scenario.timer_limit
    names = ("present", "x", "y", "timer_heard", "timer")
    sensed = np.column_stack([parts[f"neighbour_{name}"] for name in names])
    np.testing.assert_allclose(sensed, expected, atol=TOLERANCE)

    lowest = [parts[f"lowest_timer{end}"][0] for end in ("_present", "_x", "_y", "")]
    told, _, x, y = min(tellers, default=(0.0, 0.0, 0.0, 0.0))
    np.testing.assert_allclose(lowest, [float(bool(tellers)), x, y, told], atol=TOLERANCE)


def check_itself(world: Warehouse, me: int, parts: dict[str, NDArray[np.float32]]) -> None:
    state, scenario = world.state, world.scenario
    item, timer = state.robot_item[me], state.robot_timer[me]
    velocity = seen_from(world, me, state.robot_position[me] + state.robot_velocity[[me]])[0]
    expected = {
        "carrying": item != NOBODY,
        "carrying_requested": item != NOBODY and item == state.requested,
        "in_delivery_area": state.robot_position[me, 0] >= scenario.storage_width,
        "timer_runs": not math.isnan(timer),
        "timer": scenario.timer_limit if math.isnan(timer) else timer,
        "velocity": np.clip(velocity, -scenario.max_speed, scenario.max_speed),
    }
    for name, value in expected.items():
        np.testing.assert_allclose(parts[name], value, atol=TOLERANCE)

    gap = narrowest_gap(world, me)
    if gap < 0.001:
        assert parts["contact"][0] == 1.0
    if gap > 0.02:
        assert parts["contact"][0] == 0.0
    assert parts["contact"][0] == state.robot_contact[me]


def narrowest_gap(world: Warehouse, me: int) -> float:
    """Return the gap [m] to what is nearest of all that is solid to robot `me`."""
    state, scenario = world.state, world.scenario
    x, y = state.robot_position[me]
    walls = (x, y, scenario.warehouse_width - x, scenario.warehouse_height - y)
    gaps = [min(walls) - scenario.robot_radius]
    things = [
        (state.robot_position[others_of(world, me)], scenario.robot_radius),
        (state.obstacle_position, scenario.obstacle_radius),
    ]
    if state.robot_item[me] != NOBODY:
        solid = free_items(world)
        solid = solid[state.item_covered[solid] == 0]
        things.append((state.item_position[solid], scenario.item_radius))
    for places, radius in things:
        distances = np.linalg.norm(places - state.robot_position[me], axis=1)
        gaps.extend((distances - radius - scenario.robot_radius).tolist())
    return float(min(gaps))


# -- by hand ------------------------------------------------------------------------------------


@pytest.mark.parametrize("x", np.linspace(1.0, 3.0, 21))
def test_a_robot_that_sees_nothing_still_feels_what_touches_it(build: Build, x: float) -> None:
    # Wherever the two stand: whether a robot looks around for what touches it must not depend on
    # how far it sees.
    robots = [(x, 2.0), (x + 0.255, 2.0)]
    world = build(robots, [(8.0, 8.0)], ranger_range=0.05, view_range=0.05, radio_range=0.05)
    assert world.state.robot_contact.tolist() == [True, True]


def test_a_dead_robot_does_not_see_the_item_at_its_very_centre(build: Build) -> None:
    world = build([(2.0, 2.0)], [(1.0, 9.0), (2.1, 2.0)], [Fault("dead", (0,), onset=0.15)])
    world.step([(0.0, 0.0, 0.0, 1.0)])
    rows = world.step([(0.0, 0.0, 0.0, -1.0)])  # put down, and dead from here on
    np.testing.assert_array_equal(world.state.item_position[1], world.state.robot_position[0])
    assert world.state.failure_modes == (("dead",),)
    assert rows[0, row.ITEMS] == 0.0
