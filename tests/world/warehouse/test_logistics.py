"""The rules of the warehouse, one by one, in worlds of a few robots and items."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Fault
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.warehouse.state import CARRIED, DELIVERED, NOBODY, STORED
from tests.world.warehouse.conftest import (
    EAST,
    FAR,
    HOLD,
    INSIDE,
    OPEN,
    STAY,
    WEST,
    Build,
    follow,
    steps,
)

PAIR = [(2.0, 2.0), (2.4, 2.0)]
ONE = [(2.0, 2.0)]
BOTH = [[HOLD, HOLD]]
AGAIN = [[HOLD], [OPEN], [HOLD]]
IN, ENTER = [(7.5, 5.0)], [[HOLD], *[[EAST]] * 10]
LONG = [(x, y) for x in (0.3, 3.0, 27.5) for y in (0.3, 2.0, 3.7)]
LONG_ARENA = {"warehouse_width": 30.0, "warehouse_height": 4.0}

# What robots carry after a script: robots, items, script, their items; then faults and fields.
HANDS: dict[str, tuple[Any, ...]] = {
    "the nearest empty robot lifts first": (PAIR, [(2.17, 2.0)], BOTH, [0, -1]),
    "the lower number of two equally near": (
        [(2.0, 2.0), (2.5, 2.0)], [(2.25, 2.0)], BOTH, [0, -1]),
    "who loses twice takes the third best": (
        [*PAIR, (2.8, 2.0)], [FAR, (2.19, 2.0), (2.605, 2.0), (2.4, 2.24)], [[HOLD] * 3],
        [1, 3, 2]),
    "the requested item before a nearer one": (ONE, [(2.2, 2.0), (1.95, 2.0)], [[HOLD]], [0]),
    "who is told of no request takes the nearest item": (
        ONE, [(2.2, 2.0), (1.95, 2.0)], [[HOLD]], [1], [Fault("FM3_isolated", (0,))]),
    "and not the requested one again": (
        ONE, [(2.1, 2.0)], AGAIN, [-1], [Fault("FM3_isolated", (0,))]),
    "which a robot in FM3 does": (ONE, [(2.1, 2.0)], AGAIN, [0], [Fault("FM3", (0,))]),
    "of others the nearest": (ONE, [FAR, (2.2, 2.0), (1.95, 2.0)], [[HOLD]], [2]),
    "of items equally near the lower number": (
        [(2.25, 2.5)], [FAR, (2.25, 2.625), (2.25, 2.375)], [[HOLD]], [1]),
    "anywhere in a long arena": (
        LONG, [(x + 0.1, y) for x, y in LONG], [[HOLD] * 9], [*range(9)], (), LONG_ARENA),
    "nothing beyond the pick-up range, whose end belongs to it": (
        [(2.0, 2.0), (5.0, 5.0), (2.0, 8.0)], [(2.251, 2.0), (5.249, 5.0), (2.25, 8.0)],
        [[HOLD] * 3], [-1, 1, 2]),
    "an item goes where its carrier goes": (ONE, [FAR, (2.1, 2.1)], [[HOLD], *[[EAST]] * 3], [1]),
    "nothing more than one item": (ONE, [(2.1, 2.0), (1.8, 2.0)], [[HOLD]] * 3, [0]),
    "FM2 masks no item": (PAIR, [(2.18, 2.0)], BOTH, [-1, 0], [Fault("FM2", (0,))]),
    "who is removed puts its item down for others": (
        [(2.0, 2.0), (2.3, 2.0)], [(1.9, 2.0)],
        [[HOLD, STAY], [STAY, STAY], *[[HOLD, (-1.0, 0.0, 0.0, 1.0)]] * 2], [-1, 0],
        [Fault("removed", (0,), onset=0.2)]),
    "without memory the same item again": (ONE, [FAR, (2.1, 2.0)], AGAIN, [1], (),
                                           {"memory_size": 0}),
    "with memory not the same item again": (ONE, [FAR, (2.1, 2.0)], AGAIN, [-1]),
    "the requested item again though remembered": (ONE, [(2.1, 2.0)], AGAIN, [0]),
    "letting go of another item inside is ignored": (
        [(INSIDE, 5.0)], [FAR, (INSIDE, 5.1)], [[HOLD], [OPEN]], [1]),
    "and is not once it is outside": (
        [(INSIDE, 5.0)], [FAR, (INSIDE, 5.1)], [[HOLD], *[[WEST]] * 6, [OPEN]], [-1]),
    "FM4 delivers nothing": (IN, [(7.5, 5.1), FAR], ENTER, [0], [Fault("FM4", (0,))]),
    "and lets go inside": (IN, [(7.5, 5.1), FAR], [*ENTER, [OPEN]], [-1], [Fault("FM4", (0,))]),
    "unless it is jammed": (
        IN, [(7.5, 5.1), FAR], [*ENTER, [OPEN]], [0], [Fault("FM4_jam", (0,))]),
    "then it lets go outside": (
        IN, [(7.5, 5.1), FAR], [*ENTER, *[[WEST]] * 10, [OPEN]], [-1], [Fault("FM4_jam", (0,))]),
    "the requested item can be let go of outside": (ONE, [(2.1, 2.0)], [[HOLD], [OPEN]], [-1]),
    **{f"held at {width}": (ONE, [(2.1, 2.0)], [[HOLD], [(0.0, 0.0, 0.0, width)]], [item])
       for width, item in ((-0.51, -1), (-0.5, 0), (0.0, 0))},
    **{f"lifted at {width}": (ONE, [(2.1, 2.0)], [[(0.0, 0.0, 0.0, width)]], [item])
       for width, item in ((0.5, -1), (0.51, 0), (9.0, 0))},
}  # fmt: skip


@pytest.mark.parametrize("case", HANDS)
def test_what_is_in_whose_hand(build: Build, case: str) -> None:
    robots, items, script, carried, *options = HANDS[case]
    faults = options[0] if options else ()
    fields = options[1] if len(options) > 1 else {}
    state = follow(build(robots, items, faults, **fields), script).state
    assert state.robot_item.tolist() == carried
    for item in range(len(items)):
        carrier = carried.index(item) if item in carried else NOBODY
        assert state.item_carrier[item] == carrier
        assert state.item_status[item] == (STORED if carrier == NOBODY else CARRIED)
        if carrier != NOBODY:
            np.testing.assert_array_equal(state.item_position[item], state.robot_position[carrier])


def test_only_who_lifts_collides_with_items_and_only_until_it_lets_go(build: Build) -> None:
    # An item lies ahead of each robot; 1 and 2 lift in the same step, 0 never does.
    items = [FAR, (3.0, 2.0), (3.0, 4.0), (3.0, 6.0), (2.0, 4.1), (2.0, 6.1)]
    world = build([(2.0, 2.0), (2.0, 4.0), (2.0, 6.0)], items, pickup_range=0.2)
    x = world.state.robot_position[:, 0]
    follow(world, [[STAY, HOLD, HOLD], *[[EAST] * 3] * 10])
    assert world.state.robot_item.tolist() == [NOBODY, 4, 5]
    assert x[0] > 3.2
    assert x[1] == x[2] == pytest.approx(2.75, abs=0.02)
    follow(world, [[STAY, OPEN, STAY], *[[WEST, EAST, EAST]] * 10])
    assert x[0] < 2.5
    assert x[1] > 3.2
    assert x[2] == pytest.approx(2.75, abs=0.02)


@pytest.mark.parametrize("memory_size", [1, 4])
def test_the_memory_holds_the_items_last_put_down_newest_first(
    build: Build, memory_size: int
) -> None:
    # Far enough away that a laden robot touches none of them.
    items = [FAR, (2.4, 2.0), (2.0, 2.5), (2.0, 1.4), (1.3, 2.0), (2.8, 2.0)][: memory_size + 2]
    world = build(ONE, items, pickup_range=1.5, memory_size=memory_size)
    lifted: list[int] = []
    for _ in range(7):
        steps(world, HOLD)
        assert world.state.robot_item[0] not in lifted[:memory_size]
        lifted.insert(0, int(world.state.robot_item[0]))
        steps(world, OPEN)
        put_down = lifted[:memory_size]
        assert world.state.robot_memory[0, : len(put_down)].tolist() == put_down
    assert set(lifted) == {*range(1, len(items))}  # each is forgotten after so many others


def test_a_delivery_clears_everybodys_memory(build: Build) -> None:
    robots = [(2.0, 2.0), (3.0, 5.0), (INSIDE, 5.0)]
    world = build(robots, [(INSIDE, 5.1), (2.1, 2.0), (3.1, 5.0), FAR])
    follow(world, [[HOLD, HOLD, STAY], [OPEN, OPEN, STAY]])
    assert world.state.robot_memory[:, 0].tolist() == [1, 2, NOBODY]
    steps(world, STAY, STAY, HOLD)
    assert world.state.delivered == 1
    assert (world.state.robot_memory == NOBODY).all()


def test_who_is_told_of_nothing_keeps_its_memory_and_sees_no_request_but_can_deliver(
    build: Build,
) -> None:
    # It puts 1 down, then carries 0, which is requested, into the delivery area.
    isolated, item = [Fault("FM3_isolated", (0,))], row.ITEMS + row.ITEM_FEATURES.index("requested")
    for faults, knows, memory in (([], 1.0, NOBODY), (isolated, 0.0, 1)):
        world = build([(7.0, 5.0)], [(7.3, 5.0), (7.1, 5.0), FAR], faults, pickup_range=0.15)
        rows = steps(world, HOLD)
        assert rows[0, item] == knows
        steps(world, OPEN)
        rows = steps(world, EAST, times=2)
        rows = steps(world, HOLD)
        assert world.state.robot_item[0] == 0
        assert rows[0, row.CARRYING_REQUESTED] == knows
        steps(world, EAST, times=6)
        assert world.state.delivered == 1
        assert world.state.robot_memory[0, 0] == memory


def test_an_item_is_delivered_as_soon_as_its_carriers_centre_is_inside(build: Build) -> None:
    world = build([(7.0, 5.0), (7.0, 7.0)], [(7.0, 5.1), FAR, (7.0, 7.1)], max_speed=0.5)
    steps(world, HOLD, HOLD)
    state = world.state
    while state.robot_position[0, 0] < 8.0:
        assert state.delivered == 0
        steps(world, EAST, EAST)
    assert state.robot_position[0, 0] < 8.06
    assert (state.delivery_times, state.delivered_by) == ([state.time], [0])
    assert state.item_status.tolist() == [DELIVERED, STORED, CARRIED]  # nobody asked for the last
    assert state.robot_item.tolist() == [NOBODY, 2]
    assert state.requested == 1
    border = follow(build([(8.0, 5.0), (7.999, 7.0)], [FAR]), [[STAY, STAY]])  # belongs to it
    assert border.state.robot_in_delivery.tolist() == [True, False]


@pytest.mark.parametrize("restock", [(False, True), (True, False)])
def test_when_restock_is_switched_what_is_there_is_asked_for(
    build: Build, restock: tuple[bool, bool]
) -> None:
    items = [(INSIDE, 5.1), (INSIDE, 4.9), (INSIDE, 5.05)]
    world = build([(INSIDE, 5.0)], items, restock=restock[0], pickup_range=12.0)
    state = world.state
    steps(world, HOLD, times=2)
    world.change(restock=restock[1])
    for _ in range(10):
        assert state.requested == NOBODY or state.item_status[state.requested] != DELIVERED
        steps(world, HOLD)
    # One came back and goes on coming back; or all three were there and left for good.
    assert state.delivered == (12 if restock[1] else 5)
    assert world.all_delivered is restock[0]


def test_a_timer_counts_seconds_since_the_area_and_falls_silent_at_its_limit(build: Build) -> None:
    world = build([(8.05, 5.0), (2.0, 2.0)], [FAR], timer_limit=3.0, radio_range=1.0)
    state = world.state
    steps(world, STAY, STAY, times=5)
    assert state.robot_timer[0] == 0.0
    steps(world, WEST, STAY)
    left = state.step - 1
    for step in range(1, 50):
        silent = [np.nan] if step >= 30 else [(state.step - left) * 0.1]
        for timer in (state.robot_timer, state.robot_told):
            assert timer[:1].tolist() == pytest.approx(silent, nan_ok=True)
            assert np.isnan(timer[1])  # until its first visit
        steps(world, STAY, STAY)
    steps(world, EAST, STAY, times=2)  # coming back starts it again
    assert state.robot_timer[0] == 0.0


def test_gossip_carries_a_timer_on_and_ages_it_by_every_hop(build: Build) -> None:
    line = [(INSIDE, 5.0), (5.0, 5.0), (1.5, 5.0)]  # each hears only the next
    lowest = slice(row.LOWEST_TIMER, row.LOWEST_TIMER + 4)
    rows = steps(build(line, [FAR]), STAY, STAY, STAY, times=10)
    assert rows[:, row.LOWEST_TIMER].tolist() == [0.0, 1.0, 0.0]  # without it, in range alone
    rows = steps(build(line, [FAR], relay="gossip"), STAY, STAY, STAY, times=10)
    assert rows[1, lowest] == pytest.approx([1, 3.5, 0, 0.0])
    assert rows[2, lowest] == pytest.approx([1, 3.5, 0, 0.1])


def test_the_carrier_is_who_carries_the_item_of_the_oldest_request(build: Build) -> None:
    world = build([(1.0, 1.0), (7.5, 5.0)], [(7.5, 5.0)])
    assert world.state.carrier == NOBODY
    steps(world, STAY, HOLD)
    assert world.state.carrier == 1
    for _ in range(10):
        steps(world, STAY, EAST)
    assert world.all_delivered
    assert world.state.carrier == NOBODY  # nothing is asked for
