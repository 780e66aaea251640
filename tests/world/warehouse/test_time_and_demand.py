"""Handling that takes time, several requests at a time, ways to draw them, a dock's capacity."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarm_logistics_env import Fault, Scenario, Warehouse, policies
from swarm_logistics_env.compiler.kernels import uniform
from swarm_logistics_env.core.streams import key, row_keys
from swarm_logistics_env.policies.policy import decide, start
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.warehouse.state import CARRIED, DELIVERED, NOBODY, STORED
from tests.world.warehouse.conftest import EAST, FAR, HOLD, INSIDE, OPEN, STAY, WEST, Build, steps

TIMED = {"handling_time": 0.3}  # three steps


def test_lifting_and_putting_down_take_their_time_and_the_robot_stands_meanwhile(
    build: Build,
) -> None:
    world = build([(2.0, 2.0), (2.3, 2.0)], [FAR, (2.1, 2.0)], pickup_range=0.35, **TIMED)
    state = world.state
    steps(world, HOLD, STAY)
    for _ in range(2):  # whatever it commands, and whoever else wants the item
        rows = steps(world, (1.0, 0.0, 0.5, 0.0), HOLD)
        assert (state.item_status[1], state.robot_item.tolist()) == (STORED, [NOBODY] * 2)
        assert rows[:, [row.CARRYING, row.ITEMS]].tolist() == [[0.0, 1.0]] * 2
    steps(world, OPEN, STAY)
    assert (state.item_status[1], state.robot_item.tolist()) == (CARRIED, [1, NOBODY])
    steps(world, STAY, STAY, times=3)
    assert (state.robot_position[0, 0], state.robot_heading[0]) == (2.0, 0.0)
    steps(world, WEST, STAY, times=2)
    steps(world, OPEN, STAY)
    steps(world, EAST, STAY, times=2)
    assert state.robot_item[0] == 1
    steps(world, HOLD, STAY)
    assert (state.item_status[1], state.robot_memory[0, 0]) == (STORED, 1)
    assert state.item_position[1, 0] == pytest.approx(1.6, abs=0.1)  # where it came to rest
    steps(world, WEST, STAY)
    assert state.robot_velocity[0, 0] < -1.0


def test_a_delivery_takes_its_time_and_the_next_request_comes_after_it(build: Build) -> None:
    world = build([(7.5, 5.0)], [(7.5, 5.1), FAR], **TIMED)
    state = world.state
    steps(world, HOLD, times=4)
    while not state.robot_in_delivery[0]:
        steps(world, EAST)
    arrived = state.time
    rows = steps(world, WEST, times=2)
    assert (state.delivered, state.requested, state.item_status[0]) == (0, 0, CARRIED)
    assert rows[0, [row.CARRYING_REQUESTED, row.IN_DELIVERY_AREA]].tolist() == [1.0, 1.0]
    steps(world, WEST)
    assert state.delivery_times == pytest.approx([arrived + 0.3])
    assert (state.delivered_by, state.requested, state.item_status[0]) == ([0], 1, DELIVERED)


# What a robot holds in the end, by what befalls it after a step of handling; it begins with HOLD
# beside an item, or with item 0 in its hands to put it down outside or to deliver it inside.
BEFALLS: dict[str, tuple[str, Fault, int, int]] = {
    "FM2 while it lifts": ("lift", Fault("FM2", (0,), 0.2), NOBODY, STORED),
    "able again when it is over": ("lift", Fault("FM2", (0,), 0.2, 0.1), 0, CARRIED),
    "removed while it lifts": ("lift", Fault("removed", (0,), 0.2), NOBODY, STORED),
    "dead while it puts down": ("put", Fault("dead", (0,), 0.6), 0, CARRIED),
    "FM2 while it delivers": ("deliver", Fault("FM2", (0,), 0.6), NOBODY, DELIVERED),
    "FM4 while it delivers": ("deliver", Fault("FM4", (0,), 0.6), 0, CARRIED),
    "removed while it delivers": ("deliver", Fault("removed", (0,), 0.6), NOBODY, STORED),
}


@pytest.mark.parametrize("case", BEFALLS)
def test_a_fault_in_mid_handling_counts_if_it_holds_when_the_time_is_over(
    build: Build, case: str
) -> None:
    doing, fault, item, status = BEFALLS[case]
    x = INSIDE if doing == "deliver" else 2.0
    world = build([(x, 5.0), (x, 5.3)], [(x, 5.1), FAR], [fault], pickup_range=0.35, **TIMED)
    steps(world, HOLD, STAY)
    steps(world, STAY, STAY, times=3)
    steps(world, OPEN if doing == "put" else STAY, STAY)
    steps(world, STAY, STAY, times=4)
    state = world.state
    assert (state.robot_item[0], state.item_status[0]) == (item, status)
    if status == STORED:  # it is bound to nobody any more
        steps(world, STAY, HOLD, times=4)
        assert state.item_carrier[0] == 1


def test_any_open_request_can_be_delivered_and_the_next_one_joins_the_end(build: Build) -> None:
    robots = [(INSIDE, 5.0), (INSIDE, 7.0), (2.0, 2.0), (4.0, 4.0)]
    items = [FAR, (INSIDE, 7.1), (INSIDE, 5.1), (2.2, 2.0), (1.95, 2.0), (4.1, 4.0)]
    world = build(robots, items, n_requests=2)
    state = world.state
    assert state.open_requests.tolist() == [0, 1]
    steps(world, HOLD, HOLD, STAY, STAY)
    # Item 1 was asked for; then item 2, which was inside, and item 3.
    assert state.delivered_by == [1, 0]
    assert (state.open_requests.tolist(), state.requested) == ([0, 3], 0)
    rows = steps(world, STAY, STAY, HOLD, HOLD)
    assert state.robot_item.tolist() == [NOBODY, NOBODY, 3, 5]  # 3 before the nearer item 4
    assert rows[:, row.CARRYING_REQUESTED].tolist() == [0.0, 0.0, 1.0, 0.0]


def test_an_item_that_is_asked_for_twice_is_delivered_twice_unless_it_leaves_for_good(
    build: Build,
) -> None:
    items = [(INSIDE, 5.1), FAR]
    world = build([(INSIDE, 5.0)], items, n_requests=2, restock=True, pickup_range=0.3)
    state = world.state
    state.open_requests[:] = 0
    steps(world, HOLD)
    assert (state.delivered, state.open_requests.tolist()[0]) == (1, 0)
    state.open_requests[:] = 0
    world.change(restock=False, pickup_range=14.0)
    steps(world, HOLD)
    assert (state.delivered, state.open_requests.tolist()) == (2, [1, NOBODY])


@pytest.mark.parametrize("handling_time", [0.0, 0.4])
def test_the_dock_counts_the_oldest_request_first_and_the_others_wait(
    build: Build, handling_time: float
) -> None:
    robots, items = [(INSIDE, y) for y in (3, 5, 7)], [(INSIDE, y + 0.1) for y in (7, 5, 3)]
    world = build(robots, items, n_requests=3, dock_capacity=2.0, handling_time=handling_time)
    steps(world, HOLD, HOLD, HOLD, times=30)
    state = world.state
    assert state.delivered_by == [2, 1, 0]
    assert np.diff(state.delivery_times) == pytest.approx([0.5, 0.5])
    assert (state.robot_item == NOBODY).all()


def requests_of(demand: str, seed: int, n_items: int, count: int) -> list[int]:
    """Return the first requests of a world whose items come back, by a plain computation."""
    if demand == "closed":
        keys = row_keys(seed, "requests 0", n_items)
        cycles = range(count // n_items + 1)
        drawn = [np.argsort([uniform(item, c) for item in keys], kind="stable") for c in cycles]
        return [int(item) for cycle in drawn for item in cycle][:count]
    ranks = np.arange(1.0, n_items + 1.0)
    shares = np.cumsum(1.0 / ranks if demand == "zipf" else np.ones(n_items))
    stream_key = np.array([key(seed, "demand")], np.uint64)
    draws = np.array([uniform(stream_key[0], number) for number in range(count)])
    return [int(item) for item in np.searchsorted(shares / shares[-1], draws, side="right")]


@pytest.mark.daily
@settings(max_examples=12, deadline=None)
@given(data=st.data(), seed=st.integers(0, 2**32))
def test_random_worlds_keep_their_order_and_their_bits(data: st.DataObject, seed: int) -> None:
    draw = data.draw
    n_items = draw(st.integers(2, 12))
    demand: Any = draw(st.sampled_from(["closed", "independent", "zipf"]))
    capacity = draw(st.sampled_from([None, 0.5, 1.0, 3.0, 10.0]))
    scenario = Scenario(
        n_robots=6, n_items=n_items, n_requests=draw(st.integers(1, n_items)), demand=demand,
        dock_capacity=capacity, handling_time=draw(st.sampled_from([0.0, 0.05, 0.5, 1.0])),
        warehouse_width=3.0, warehouse_height=2.0, delivery_width=1.2, restock=True,
    )  # fmt: skip
    modes = draw(st.lists(st.sampled_from(["dead", "FM2", "FM4", "removed"]), max_size=2))
    faults = [Fault(mode, 1, 5.0 * (n + 1)) for n, mode in enumerate(modes)]
    world, twin = Warehouse(scenario), Warehouse(scenario)
    rows, state = world.reset(seed, faults), world.state
    twin.reset(seed, faults)
    drawn = requests_of(demand, seed, n_items, 1000)
    policy = policies.load("central")
    start(policy, scenario, seed)
    for step in range(150):
        commands = decide(policy, rows, state)
        rows = world.step(commands)
        np.testing.assert_array_equal(rows, twin.step(commands))
        if step == 70:
            twin = pickle.loads(pickle.dumps(twin))
        expected = drawn[: scenario.n_requests + state.delivered]
        assert state.open_requests[-1] == expected[-1]
        left = iter(expected)
        assert all(item in left for item in state.open_requests)  # in the order of the draws
    assert capacity is None or (np.diff(state.delivery_times) >= 1.0 / capacity - 1e-6).all()


@pytest.mark.parametrize("demand", ["closed", "independent", "zipf"])
def test_first_requests_are_those_of_the_demand(demand: Any) -> None:
    scenario = Scenario(n_robots=1, n_items=4, n_requests=4, restock=True, demand=demand)
    twice = set()
    for seed in range(20):
        world = Warehouse(scenario)
        world.reset(seed)
        requested = world.state.open_requests.tolist()
        assert requested == requests_of(demand, seed, 4, 4)
        twice.add(len(set(requested)) < 4)
    assert (True in twice) == (demand != "closed")


def test_the_item_of_any_open_request_is_told_and_can_be_let_go_of_inside(build: Build) -> None:
    robots, items = [(INSIDE, 5.0), (INSIDE, 5.6)], [FAR, (INSIDE, 5.1), (INSIDE, 5.5)]
    world = build(robots, items, [Fault("FM4", (0, 1))], n_requests=2, pickup_range=0.3)
    rows = steps(world, STAY, STAY)
    assert world.state.open_requests.tolist() == [0, 1]
    at = [row.ITEMS + row.ITEM_WIDTH * index + row.ITEM.requested for index in range(2)]
    assert rows[0, at].tolist() == [1.0, 0.0]  # items 1 and 2, the nearer first
    steps(world, HOLD, HOLD)
    assert world.state.robot_item.tolist() == [1, 2]
    steps(world, OPEN, OPEN)
    assert world.state.robot_item.tolist() == [NOBODY, 2]


def test_nothing_is_lifted_that_is_out_of_reach_when_the_time_is_over(build: Build) -> None:
    world = build([(2.0, 2.0)], [FAR, (2.1, 2.0)], pickup_range=0.35, **TIMED)
    steps(world, HOLD)
    world.state.item_position[1] = (3.0, 2.0)
    steps(world, STAY, times=5)
    assert (world.state.robot_item[0], world.state.item_status[1]) == (NOBODY, STORED)


def test_what_a_robot_was_lifting_as_it_was_removed_can_be_lifted_at_once(build: Build) -> None:
    robots, gone = [(2.0, 2.0), (2.3, 2.0)], [Fault("removed", (0,), onset=0.2)]
    world = build(robots, [FAR, (2.1, 2.0)], gone, pickup_range=0.35, handling_time=1.0)
    steps(world, HOLD, STAY, times=2)
    steps(world, STAY, HOLD, times=11)
    assert world.state.robot_item.tolist() == [NOBODY, 1]


def test_a_delivery_closes_one_request_for_an_item_that_comes_back(build: Build) -> None:
    items = [(INSIDE, 5.1), FAR, (1.0, 1.0)]
    world = build([(INSIDE, 5.0)], items, n_requests=2, restock=True, pickup_range=0.3)
    world.state.open_requests[:] = 0
    steps(world, HOLD)
    assert world.state.delivered == 1
    assert world.state.open_requests.tolist() == [0, 2]
