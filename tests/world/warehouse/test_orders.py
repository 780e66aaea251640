"""Orders that come by themselves, and requests that end after a time or are told late or never."""

from __future__ import annotations

import pickle
import random
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Scenario, Warehouse
from swarm_logistics_env.core.errors import ScenarioError
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.scenario.order_file import ORDER_SHAPES
from swarm_logistics_env.world.warehouse.orders import OrderMeasures
from swarm_logistics_env.world.warehouse.state import CARRIED, DELIVERED, NOBODY
from swarm_logistics_env.world.warehouse.structs import CAME, DUE, ITEM_ORDERED
from tests.world.warehouse.conftest import (
    FAR,
    HOLD,
    INSIDE,
    OPEN,
    STAY,
    WEST,
    Build,
    steps,
)
from verification import soak
from verification.invariants import Watch

DOCKS = "#######/#:::.A#/#:::.B#/#######"


def waiting_items(world: Warehouse) -> list[int]:
    """Return the items that orders wait for, in the order in which these came."""
    orders = world.state.orders
    items: list[int] = orders.waiting[: orders.n_waiting[0], ITEM_ORDERED].astype(int).tolist()
    return items


def requested_items(world: Warehouse) -> list[int]:
    """Return the items that are asked for, the oldest request first."""
    return [item for item in world.state.open_requests.tolist() if item != NOBODY]


def file_of(*rows: str, header: str = "time,item,due,priority") -> str:
    """Return the value of `Scenario.orders` of a file with these rows."""
    return "/".join([header, *rows])


def test_a_request_that_waits_too_long_comes_again_after_all_others(build: Build) -> None:
    world = build([(1.0, 1.0)], [FAR, FAR, FAR], request_timeout=0.3, duration=10.0)
    seen = [world.state.requested]
    for _ in range(11):
        steps(world, STAY)
        seen.append(world.state.requested)
    assert seen[0:3] == [seen[0]] * 3
    cycles = [seen[0:9:3], seen[9:12:3]]
    assert sorted(cycles[0]) == [0, 1, 2]
    assert world.state.orders.n_put_back == 3
    assert world.state.order_measures == OrderMeasures(put_back=3)


def test_a_carrier_puts_down_what_is_asked_for_no_more_outside_the_area_alone(
    build: Build,
) -> None:
    world = build([(INSIDE, 5.0)], [(INSIDE, 5.1), FAR], ["FM4:1@0"], request_timeout=0.5)
    state = world.state
    steps(world, HOLD, times=4)
    assert (state.requested, state.item_status[0]) == (0, CARRIED)
    steps(world, STAY, times=2)
    rows = steps(world, OPEN)
    assert (state.requested, state.item_status[0], rows[0, row.CARRYING_REQUESTED]) == (
        1,
        CARRIED,
        0,
    )
    while state.robot_in_delivery[0]:
        steps(world, WEST)
    steps(world, OPEN)
    assert state.robot_item[0] == NOBODY


def test_a_delivery_that_began_in_time_is_in_vain_if_the_request_ends_before_it(
    build: Build,
) -> None:
    world = build([(INSIDE, 5.0)], [(INSIDE, 5.1), FAR], handling_time=0.3, request_timeout=0.6)
    steps(world, HOLD, times=8)
    assert (world.state.delivered, world.state.robot_item[0]) == (0, 0)
    world = build([(INSIDE, 5.0)], [(INSIDE, 5.1), FAR], handling_time=0.3, request_timeout=0.9)
    steps(world, HOLD, times=8)
    assert world.state.delivered_by == [0]


def test_word_of_a_request_is_late(build: Build) -> None:
    world = build([(2.0, 2.0)], [(2.2, 2.0), FAR], request_delay=0.3)
    column = row.ITEMS + row.ITEM.requested
    seen = [steps(world, STAY)[0, column] for _ in range(4)]
    assert seen == [0.0, 0.0, 1.0, 1.0]
    world.change(request_delay=0.0)
    steps(world, HOLD)
    assert world.observe()[0, row.CARRYING_REQUESTED] == 1.0


def test_each_request_is_lost_for_each_robot_for_itself_and_for_good() -> None:
    world = Warehouse(Scenario(n_robots=60, n_items=30, view_range=15.0, request_loss=0.3))
    rows = world.reset(0)
    requested = row.ITEMS + row.ITEM.requested + row.ITEM_WIDTH * np.arange(row.N_ITEMS_IN_VIEW)
    for _ in range(3):
        # Of those that see the item at all.
        is_told = np.any(rows[:, requested], axis=1)
        item = world.state.item_position[world.state.requested]
        squares = ((world.state.robot_position[:, None] - world.state.item_position) ** 2).sum(2)
        rank = (squares < ((world.state.robot_position - item) ** 2).sum(1)[:, None]).sum(1)
        sees = rank < row.N_ITEMS_IN_VIEW
        assert not is_told[~sees].any()
        rows = world.step(np.zeros((60, 4)))
    missed = [robot for robot in range(60) if sees[robot] and not is_told[robot]]
    assert 0 < len(missed) < sees.sum()
    world.change(request_loss=1.0)
    assert not world.step(np.zeros((60, 4)))[:, requested].any()
    world.change(request_loss=0.0)
    is_told = np.any(world.step(np.zeros((60, 4)))[:, requested], axis=1)
    assert is_told[sees].all()


@pytest.mark.parametrize("orders", ORDER_SHAPES)
def test_drawn_orders_come_at_the_rate_and_in_the_hours_that_are_set(orders: str) -> None:
    came: list[float] = []
    for seed in range(3):
        world = Warehouse(
            Scenario(
                n_robots=1, n_items=2, orders=orders, order_rate=2.0, order_cycle=24.0,
                restock=True, duration=240.0, announced="all",
            )
        )  # fmt: skip
        world.reset(seed)
        for _ in range(2400):
            world.step(np.zeros((1, 4)))
        orders_now = world.state.orders
        n_open = len(requested_items(world))
        came += orders_now.waiting[: orders_now.n_waiting[0], CAME].tolist()
        came += orders_now.open[:n_open, CAME].tolist()
    assert len(came) == pytest.approx(1440, abs=4 * 1440**0.5)
    shape = ORDER_SHAPES[orders]
    parts = (np.array(came) / 24.0 * len(shape)).astype(int) % len(shape)
    expected = len(came) * np.array(shape) / len(shape)
    assert np.bincount(parts, minlength=len(shape)) == pytest.approx(
        expected, abs=4.5 * expected.max() ** 0.5
    )


def test_another_rate_holds_from_the_next_step_on() -> None:
    world = Warehouse(
        Scenario(n_robots=1, n_items=2, orders="poisson", order_rate=1e-6, restock=True)
    )
    world.reset(0)
    for _ in range(10):
        world.step(np.zeros((1, 4)))
    assert requested_items(world) == []
    world.change(order_rate=100.0)
    for _ in range(10):
        world.step(np.zeros((1, 4)))
    assert len(waiting_items(world)) > 50


def test_orders_of_a_file_come_at_their_times_and_the_oldest_is_asked_for(build: Build) -> None:
    orders = file_of("0.25,2,,", "0,1,,", "0.25,0,,", "9,1,,")
    world = build([(1.0, 1.0)], [FAR] * 3, orders=orders, restock=True)
    state = world.state
    assert (requested_items(world), waiting_items(world)) == ([1], [])
    steps(world, STAY, times=2)
    assert waiting_items(world) == []
    steps(world, STAY)
    assert (requested_items(world), waiting_items(world)) == ([1], [2, 0])
    assert (state.order_measures.longest_queue, world.all_delivered) == (3, False)


def test_the_urgent_order_comes_first_and_one_that_is_open_stays(build: Build) -> None:
    orders = file_of("0,0,,0", "0,1,9,0", "0,2,5,0", "0,3,,1", "0.1,4,0.2,9")
    fields: dict[str, Any] = {"orders": orders, "request_timeout": 0.2}
    world = build([(1.0, 1.0)], [FAR] * 5, announced="urgent", **fields)
    assert (requested_items(world), waiting_items(world)) == ([3], [0, 1, 2])
    steps(world, STAY)
    assert (requested_items(world), waiting_items(world)) == ([3], [0, 1, 2, 4])
    steps(world, STAY)
    assert (requested_items(world), waiting_items(world)) == ([4], [0, 1, 2, 3])
    world = build([(1.0, 1.0)], [FAR] * 5, announced="all", **fields)
    assert requested_items(world) == [0, 1, 2, 3]


def test_what_a_class_took_and_comes_back_no_more_is_not_ordered_by_its_number() -> None:
    orders = file_of("0,A,", "0.3,0,", "0.3,1,", header="time,item,dock")
    scenario = Scenario(n_robots=1, n_items=3, orders=orders, restock=True)
    drawn_items = set()
    for seed in range(8):
        world = Warehouse(scenario)
        world.reset(seed)
        first_items = requested_items(world)
        world.change(restock=False)
        steps(world, STAY, times=4)
        assert requested_items(world) == first_items
        assert waiting_items(world) == [item for item in (0, 1) if item not in first_items]
        assert world.state.order_measures.turned_away == int(first_items != [2])
        drawn_items.update(first_items)
    assert drawn_items == {0, 1, 2}


def test_of_fewer_orders_than_requests_at_a_time_each_is_put_back_once_a_time_out(
    build: Build,
) -> None:
    fields: dict[str, Any] = {"orders": file_of("0,0,,", "9,1,,"), "request_timeout": 0.2}
    world = build([(1.0, 1.0)], [FAR] * 3, n_requests=3, **fields)
    steps(world, STAY, times=7)
    assert world.state.order_measures.put_back == 3


def test_classes_and_docks_of_a_file_are_kept() -> None:
    orders = file_of("0,A,B", "0,B,", "0,C,A", header="time,item,dock")
    scenario = Scenario(
        n_robots=2, n_items=6, floor=DOCKS, orders=orders, announced="all", item_radius=0.05,
        robot_radius=0.05,
    )  # fmt: skip
    for seed in range(5):
        world = Warehouse(scenario)
        world.reset(seed)
        assert [item % 3 for item in requested_items(world)] == [0, 1, 2]
        assert world.state.requested_docks.tolist()[:3] == [1, NOBODY, 0]


def test_an_order_for_a_class_leaves_the_items_that_later_rows_name() -> None:
    orders = file_of("0,A,,", "0,A,,", "0.3,0,,")
    for seed in range(4):
        world = Warehouse(Scenario(n_robots=1, n_items=3, orders=orders, announced="all"))
        world.reset(seed)
        assert sorted(requested_items(world)) == [1, 2]
        world.step(np.zeros((1, 4)))
        for _ in range(3):
            world.step(np.zeros((1, 4)))
        assert requested_items(world)[2] == 0
        assert world.state.order_measures.turned_away == 0


def test_an_order_counts_as_late_from_its_due_time_until_it_is_served(build: Build) -> None:
    orders = file_of("0,0,5,", "0,1,0.25,", "0,2,0.3,", "0,3,,")
    robots = [(INSIDE, 5.0), (INSIDE, 7.0)]
    items = [(INSIDE, 5.1), FAR, (INSIDE, 7.1), FAR]
    world = build(robots, items, orders=orders, announced="all")
    steps(world, HOLD, STAY)
    steps(world, STAY, STAY, times=3)
    steps(world, STAY, HOLD)
    measures = world.state.order_measures
    # Item 0 on time; item 1 is late by .25 s and counting; item 2 was served .2 s late.
    assert world.state.delivered_due == [5.0, 0.3]
    assert measures.share_on_time == pytest.approx(1 / 3)
    assert measures.mean_tardiness == pytest.approx(0.15)
    assert measures.p95_tardiness == pytest.approx(0.245)
    assert world.state.item_status.tolist()[::2] == [DELIVERED] * 2


def test_requests_one_after_another_are_due_from_when_they_are_asked_for(build: Build) -> None:
    world = build([(INSIDE, 5.0)], [(INSIDE, 5.1), FAR], order_due=0.5)
    steps(world, HOLD, times=9)
    assert world.state.orders.open[0, DUE] == pytest.approx(0.6)
    measures = world.state.order_measures
    assert measures.share_on_time == 0.5
    assert measures.mean_tardiness == pytest.approx(0.15)


def test_nothing_is_left_once_the_file_is_served(build: Build) -> None:
    world = build(
        [(INSIDE, 5.0), (INSIDE, 3.0)], [(INSIDE, 5.1), (INSIDE, 3.1)],
        orders=file_of("0.2,0,,", "0.4,1,,"), restock=True,
    )  # fmt: skip
    left = []
    for _ in range(4):
        steps(world, HOLD, HOLD)
        left.append((world.state.delivered, world.all_delivered))
    assert left == [(0, False), (1, False), (1, False), (2, True)]
    assert (requested_items(world), waiting_items(world)) == ([], [])


@pytest.mark.unmeasured
@pytest.mark.parametrize("number", range(6))
def test_every_promise_holds_in_random_worlds_with_all_fields(number: int) -> None:
    source = random.Random(number)
    tally = soak.Tally()
    while tally.worlds < 2:
        soak.play(source, 60, tally, plans=number % 2 == 1)


def test_a_copy_goes_on_alike() -> None:
    scenario = Scenario(
        n_robots=4, n_items=6, restock=True, orders="bursts", order_rate=1.0, request_timeout=1.0,
        request_loss=0.5, request_delay=0.2, order_due=2.0, announced="urgent", n_requests=2,
    )  # fmt: skip
    world = Warehouse(scenario)
    world.reset(0)
    rng = np.random.default_rng(0)
    for _ in range(15):
        world.step(rng.uniform(-1, 1, (4, 4)))
    copy = pickle.loads(pickle.dumps(world))
    watch = Watch(copy)
    for _ in range(40):
        commands = rng.uniform(-1, 1, (4, 4))
        assert world.step(commands).tobytes() == copy.step(commands).tobytes()
        watch.look()
    assert world.state.order_measures == copy.state.order_measures
    assert world.state.orders.n_put_back > 0


BAD_ORDERS: dict[str, str] = {
    "poison": "'poison': should be next, poisson, bursts, day or a CSV file .* did you mean",
    file_of("0,1", header="time,itme"): "line 1: column 'itme': should be one of time, item",
    file_of("0", header="time"): "line 1: no column 'item'",
    file_of("0,1,2"): "line 2: 3 cells: should be 4",
    file_of("0,,,"): "line 2: item is empty",
    file_of("0,A,,", "1,-1,,"): "line 3: item = '-1': should be an item's number, 0 or more, or a",
    file_of("0,4.5,,"): "line 2: item = '4.5': should be an item's number, 0 or more, or a class",
    file_of("soon,1,,"): "line 2: time = 'soon': should be a number",
    file_of("-1,1,,"): "line 2: time = -1: should be at least 0",
    file_of("0,1,,", "8,2,7,"): "line 3: due = 7: should be at least the order's time, 8 s",
    file_of("0,60,,"): "line 2: item = 60: should be at most 59",
    file_of("0,7,,", "1,7,,"): "line 3: item = 7 is ordered in line 2 already",
    file_of("0,1,A", header="time,item,dock"): "line 2: dock = 'A': should be empty",
    file_of(*["0,A,,"] * 60, "9,7,,"): "item = 'A' is ordered 60 times: there are 59 items",
    "time,item\n0,A/B": r"a row has the sign '/': should have none",
    file_of("0,1,2", header="time,item,time"): "line 1: column 'time' stands there twice",
    "time,item/": "0 orders: should be 1 to 100000",
}


@pytest.mark.parametrize("orders", BAD_ORDERS)
def test_orders_that_cannot_be_are_refused_with_line_and_value(orders: str) -> None:
    with pytest.raises(ScenarioError, match=f"Scenario.orders.*{BAD_ORDERS[orders]}"):
        Scenario(orders=orders)
