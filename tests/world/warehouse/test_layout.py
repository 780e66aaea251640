from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from swarm_logistics_env import Scenario, Warehouse
from swarm_logistics_env.compiler.addresses import unpacked_at
from swarm_logistics_env.compiler.kernels import kernel
from swarm_logistics_env.core.errors import ScenarioError
from swarm_logistics_env.world.warehouse import layout
from swarm_logistics_env.world.warehouse.state import DELIVERED
from swarm_logistics_env.world.warehouse.structs import World
from tests.world.warehouse.conftest import Build

NOTHING = np.zeros((0, 2))
SEEDS = st.integers(-(2**70), 2**70)


@kernel
def restock_at(address: int, item: int) -> bool:
    """Put an item back into the world at an address: Python hands over no structure, which takes
    the compiler ten seconds."""
    return layout.place_restocked(unpacked_at(World, address), item)


def narrowest(first: NDArray[np.float64], second: NDArray[np.float64]) -> float:
    """Return the least distance between two points, not counting a point's to itself."""
    gaps = np.linalg.norm(first[:, None] - second[None], axis=2)
    return float(gaps[gaps > 0.0].min(initial=np.inf))


@settings(max_examples=30)
@given(seed=SEEDS, n_obstacles=st.integers(0, 5))
def test_everything_stands_clear_within_the_storage(seed: int, n_obstacles: int) -> None:
    scenario = Scenario(
        n_robots=15, n_items=20, warehouse_width=5, warehouse_height=3, n_obstacles=n_obstacles,
        robot_radius=0.15, item_radius=0.1, obstacle_radius=0.25,
    )  # fmt: skip
    obstacles = layout.place_obstacles(scenario, seed)
    items = layout.place_items(scenario, seed, obstacles)
    robots, headings = layout.place_robots(scenario, seed, obstacles)
    assert [len(rows) for rows in (obstacles, items, robots)] == [n_obstacles, 20, 15]
    for centres, radius in ((obstacles, 0.25), (items, 0.1), (robots, 0.15)):
        assert (centres >= radius).all()
        assert (centres <= 3.0 - radius).all()
        assert narrowest(centres, centres) >= 2 * radius
        if centres is not obstacles:
            assert narrowest(centres, obstacles) >= radius + 0.25
    assert (np.abs(headings) <= np.pi).all()


@given(seed=SEEDS)
@settings(max_examples=30)
def test_a_place_depends_on_its_own_number_not_on_how_many_follow(seed: int) -> None:
    few, many = Scenario(n_robots=5, n_items=10), Scenario(n_robots=25, n_items=60)
    starts = []
    for scenario in (few, many):
        items, robots = (
            place_things(scenario, seed, NOTHING)
            for place_things in (layout.place_items, layout.place_robots)
        )
        starts.append((items[:10], robots[0][:5], robots[1][:5]))
        assert not np.array_equal(items[0], robots[0][0])  # each kind has a stream of its own
    for of_few, of_many in zip(*starts):
        np.testing.assert_array_equal(of_few, of_many)


@pytest.mark.compiled
@given(seed=SEEDS)
@settings(max_examples=30, deadline=None)
def test_every_item_is_requested_once_and_in_an_order_keyed_by_item(seed: int) -> None:
    def order(n_items: int, seed: int) -> NDArray[np.int64]:
        world = Warehouse(Scenario(n_robots=1, n_items=n_items, n_requests=n_items))
        world.reset(seed)
        return world.state.open_requests

    drawn = order(60, seed)
    assert sorted(drawn) == list(range(60))
    np.testing.assert_array_equal(drawn[drawn < 10], order(10, seed))
    assert not np.array_equal(drawn, order(60, seed + 1))


def test_places_are_spread_evenly() -> None:
    scenario = Scenario(n_robots=1)
    starts = [layout.place_robots(scenario, seed, NOTHING) for seed in range(800)]
    drawn = np.array([[*centres[0], heading[0]] for centres, heading in starts])
    spans = np.array([8.0 - 0.25, 10.0 - 0.25, 2.0 * np.pi])
    # Means of uniform numbers, within five standard errors.
    shares = (drawn - [0.125, 0.125, -np.pi]) / spans
    assert shares.mean(axis=0) == pytest.approx([0.5] * 3, abs=5.0 / np.sqrt(12 * 800))
    assert shares.std(axis=0) == pytest.approx([1.0 / np.sqrt(12)] * 3, abs=0.02)


def test_a_restocked_item_stands_clear_and_each_elsewhere() -> None:
    size: Any = {"warehouse_width": 5, "warehouse_height": 3}
    world = Warehouse(Scenario(n_robots=20, n_items=20, restock=True, **size))
    world.reset(0)
    items, robots = world.state.items, world.state.robots
    items.status[0] = DELIVERED
    taken, places = np.vstack([items.position[1:], robots.position]), []
    for count in range(1, 30):
        world.state.progress.n_delivered[0] = count
        assert restock_at(world.address, 0)
        places.append(items.position[0].copy())
    assert narrowest(np.array(places), taken) >= 0.25
    assert 0.125 <= np.min(places) <= np.max(places) <= 3.0 - 0.125
    assert len(np.unique(places, axis=0)) == 29


def test_an_obstacle_that_would_close_the_only_way_finds_no_room() -> None:
    size: Any = {"n_robots": 1, "n_items": 1, "n_obstacles": 1, "obstacle_radius": 0.1}
    world = Warehouse(Scenario(floor="A::", **size))
    with pytest.raises(ScenarioError, match="be fewer obstacles, or a larger"):
        world.reset(0)


def test_where_nothing_fits_any_more_it_says_what_would_help(build: Build) -> None:
    world = build(
        [(0.6, 0.6)], [(0.65, 0.6)], warehouse_width=1.2, warehouse_height=1.2, delivery_width=0.6,
        item_radius=0.25, robot_radius=0.05, pickup_range=0.3, restock=True,
    )  # fmt: skip
    with pytest.raises(ScenarioError, match=r"no room .* items .* should be fewer .* or a larger"):
        world.step([(0.0, 0.0, 0.0, 1.0)])
    assert (world.state.delivered, world.state.step) == (1, 1)
    assert world.all_delivered
    copied = pickle.loads(pickle.dumps(world))
    stay = [(0.0, 0.0, 0.0, 0.0)]
    assert copied.step(stay).tobytes() == world.step(stay).tobytes()


def test_no_item_comes_back_into_an_obstacle() -> None:
    size: Any = {"warehouse_width": 4, "warehouse_height": 2, "n_obstacles": 5}
    world = Warehouse(Scenario(n_robots=1, n_items=2, restock=True, **size))
    world.reset(0)
    state, places = world.state, []
    state.item_status[0] = DELIVERED
    for count in range(1, 60):
        state.progress.n_delivered[0] = count
        assert restock_at(world.address, 0)
        places.append(state.item_position[0].copy())
    clear = world.scenario.obstacle_radius + world.scenario.item_radius
    assert narrowest(np.array(places), state.obstacle_position) >= clear
