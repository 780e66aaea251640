"""The rules of the warehouse, one by one, in worlds of a few robots and items."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Fault
from swarm_logistics_env import observations as row
from swarm_logistics_env.warehouse.state import CARRIED, DELIVERED, NOBODY, STORED
from tests.warehouse.conftest import (
    EAST,
    FAR,
    HOLD,
    INSIDE,
    OPEN,
    STAY,
    WEST,
    Build,
    Command,
    follow,
    steps,
)

Places = list[tuple[float, float]]
Script = list[list[Command]]

PAIR: Places = [(2.0, 2.0), (2.4, 2.0)]
ONE: Places = [(2.0, 2.0)]
BOTH: Script = [[HOLD, HOLD]]
LONG: Places = [(x, y) for x in (0.3, 3.0, 27.5) for y in (0.3, 2.0, 3.7)]
WIDE_ARENA = {"warehouse_width": 30.0, "warehouse_height": 4.0}
HIGH_ARENA = {"warehouse_width": 6.0, "warehouse_height": 30.0}
HIGH: Places = [(x, y) for x in (0.3, 3.0, 3.5) for y in (0.3, 2.0, 29.7)]


def beside(places: Places) -> Places:
    return [(x + 0.1, y) for x, y in places]


def grip(width: float) -> Command:
    return (0.0, 0.0, 0.0, width)


# What robots carry after a script: robots, items, script, their items; then faults and fields.
HANDS: dict[str, tuple[Any, ...]] = {
    "the nearest empty robot lifts first": (PAIR, [(2.17, 2.0)], BOTH, [0, -1]),
    "or the other, which is nearer": (PAIR, [(2.23, 2.0)], BOTH, [-1, 0]),
    "the lower number of two equally near": (
        [(2.0, 2.0), (2.5, 2.0)], [(2.25, 2.0)], BOTH, [0, -1]),
    "who loses an item takes its next best at once": (
        PAIR, [FAR, (2.21, 2.0), (1.78, 2.0)], BOTH, [2, 1]),
    "who loses twice takes the third best": (
        [*PAIR, (2.8, 2.0)], [FAR, (2.19, 2.0), (2.605, 2.0), (2.4, 2.24)], [[HOLD] * 3],
        [1, 3, 2]),
    "the requested item before a nearer one": (ONE, [(2.2, 2.0), (1.95, 2.0)], [[HOLD]], [0]),
    "of others the nearest, if it comes first": (
        ONE, [FAR, (1.95, 2.0), (2.2, 2.0)], [[HOLD]], [1]),
    "of others the nearest, if it comes last": (
        ONE, [FAR, (2.2, 2.0), (1.95, 2.0)], [[HOLD]], [2]),
    "an item behind one that is farther": (
        [(2.3, 3.3)], [FAR, (2.4, 3.3), (2.5, 3.3), (2.35, 3.3)], [[HOLD]], [3]),
    "the lower number above": (
        [(2.25, 2.5)], [FAR, (2.25, 2.625), (2.25, 2.375)], [[HOLD]], [1]),
    "the lower number below": (
        [(2.25, 2.5)], [FAR, (2.25, 2.375), (2.25, 2.625)], [[HOLD]], [1]),
    "anywhere in a long arena": (LONG, beside(LONG), [[HOLD] * 9], [*range(9)], (), WIDE_ARENA),
    "anywhere in a high arena": (HIGH, beside(HIGH), [[HOLD] * 9], [*range(9)], (), HIGH_ARENA),
    "nothing beyond the pick-up range, whose end belongs to it": (
        [(2.0, 2.0), (5.0, 5.0), (2.0, 8.0)], [(2.251, 2.0), (5.249, 5.0), (2.25, 8.0)],
        [[HOLD] * 3], [-1, 1, 2]),
    "who opens an empty hand changes nothing": (
        [(2.0, 2.0), (5.0, 5.0)], [FAR, (4.0, 9.0), (5.0, 5.1)], [[STAY, HOLD], [OPEN, STAY]],
        [-1, 2]),
    "an item goes where its carrier goes": (ONE, [FAR, (2.1, 2.1)], [[HOLD], *[[EAST]] * 3], [1]),
    "nothing more than one item": (ONE, [(2.1, 2.0), (1.8, 2.0)], [[HOLD]] * 3, [0]),
    "FM2 masks no item": (PAIR, [(2.18, 2.0)], BOTH, [-1, 0], [Fault("FM2", (0,))]),
    "who stays masks no item": (PAIR, [(2.18, 2.0)], [[STAY, HOLD]], [-1, 0]),
    "who opens masks no item": (PAIR, [(2.18, 2.0)], [[OPEN, HOLD]], [-1, 0]),
    "an item taken away hides none behind it": (
        [(2.0, 2.0), (2.1, 2.2)], [FAR, (2.1, 2.1), (2.15, 2.0)], [[STAY, HOLD], *BOTH], [2, 1],
        (), {"pickup_range": 0.2}),
    "without memory the same item again": (
        ONE, [FAR, (2.1, 2.0)], [[HOLD], [OPEN], [HOLD]], [1], (), {"memory_size": 0}),
    "with memory not the same item again": (ONE, [FAR, (2.1, 2.0)], [[HOLD], [OPEN], [HOLD]], [-1]),
    "the requested item again though remembered": (
        ONE, [(2.1, 2.0)], [[HOLD], [OPEN], [HOLD]], [0]),
    "letting go of another item inside is ignored": (
        [(INSIDE, 5.0)], [FAR, (INSIDE, 5.1)], [[HOLD], [OPEN]], [1]),
    "and is not once it is outside": (
        [(INSIDE, 5.0)], [FAR, (INSIDE, 5.1)], [[HOLD], *[[WEST]] * 6, [OPEN]], [-1]),
    "who cannot let go keeps nobody behind from it": (
        [(2.0, 2.0), (4.0, 2.0), (INSIDE, 5.0), (6.0, 2.0)],
        [FAR, (4.0, 2.1), (INSIDE, 5.1), (6.0, 2.1)],
        [[STAY, HOLD, HOLD, HOLD], [OPEN, HOLD, OPEN, OPEN]], [-1, 1, 2, -1]),
    "the requested item can be let go of outside": (ONE, [(2.1, 2.0)], [[HOLD], [OPEN]], [-1]),
    **{f"held {width}": (ONE, [(2.1, 2.0)], [[HOLD], [grip(width)]], [0 if width >= -0.5 else -1])
       for width in (-1.0, -0.51, -0.5, 0.0, 0.5, 1.0)},
    **{f"lifted at {width}": (ONE, [(2.1, 2.0)], [[grip(width)]], [0 if width > 0.5 else -1])
       for width in (0.5, 0.51, 9.0)},
}  # fmt: skip


@pytest.mark.parametrize("case", HANDS)
def test_what_is_in_whose_hand(build: Build, case: str) -> None:
    robots, items, script, carried, *others = HANDS[case]
    faults = others[0] if others else ()
    fields = others[1] if len(others) > 1 else {}
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
    robots = [(2.0, 2.0), (2.0, 4.0), (2.0, 6.0)]
    ahead = [(3.0, 2.0), (3.0, 4.0), (3.0, 6.0)]
    world = build(robots, [FAR, *ahead, (2.0, 4.1), (2.0, 6.1)], pickup_range=0.2)
    place = world.state.robot_position
    follow(world, [[STAY, HOLD, HOLD], *[[EAST] * 3] * 10])
    assert world.state.robot_item.tolist() == [NOBODY, 4, 5]
    assert place[0, 0] > 3.2
    assert place[1, 0] == place[2, 0] == pytest.approx(2.75, abs=0.02)
    follow(world, [[STAY, OPEN, STAY], *[[WEST, EAST, EAST]] * 10])
    assert place[0, 0] < 2.5
    assert place[1, 0] > 3.2
    assert place[2, 0] == pytest.approx(2.75, abs=0.02)
    follow(world, [[STAY, STAY, OPEN], *[[EAST, WEST, EAST]] * 10])
    assert place[0, 0] > 3.2
    assert place[1, 0] < 2.95
    assert place[2, 0] > 3.2


# -- the memory ---------------------------------------------------------------------------------


@pytest.mark.parametrize("memory_size", [1, 2, 3, 4])
def test_the_memory_holds_the_items_last_put_down_newest_first(
    build: Build, memory_size: int
) -> None:
    # Far enough away that a laden robot touches none of them.
    items = [FAR, (2.4, 2.0), (2.0, 2.5), (2.0, 1.4), (1.3, 2.0), (2.8, 2.0)]
    items = items[: memory_size + 2]
    world = build([(2.0, 2.0)], items, pickup_range=1.5, memory_size=memory_size)
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
    world = build(
        [(2.0, 2.0), (3.0, 5.0), (INSIDE, 5.0)], [(INSIDE, 5.1), (2.1, 2.0), (3.1, 5.0), FAR]
    )
    follow(world, [[HOLD, HOLD, STAY], [OPEN, OPEN, STAY]])
    assert world.state.robot_memory[:, 0].tolist() == [1, 2, NOBODY]
    steps(world, STAY, STAY, HOLD)
    assert world.state.delivered == 1
    assert (world.state.robot_memory == NOBODY).all()
    steps(world, STAY, HOLD, STAY)
    assert world.state.robot_item[1] == 2


# -- delivering ---------------------------------------------------------------------------------


def test_an_item_is_delivered_as_soon_as_its_carriers_centre_is_inside(build: Build) -> None:
    world = build([(7.0, 5.0), (7.0, 7.0)], [(7.0, 5.1), FAR, (7.0, 7.1)], max_speed=0.5)
    steps(world, HOLD, HOLD)
    state = world.state
    while state.robot_position[0, 0] < 8.0:
        assert state.delivered == 0
        steps(world, EAST, EAST)
    assert state.robot_position[0, 0] < 8.06
    assert state.delivery_times == [state.time]
    assert state.delivered_by == [0]
    assert state.item_status.tolist() == [DELIVERED, STORED, CARRIED]  # nobody asked for the last
    assert state.robot_item.tolist() == [NOBODY, 2]
    assert state.robot_in_delivery.all()
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


def test_who_is_removed_puts_its_item_down_for_others(build: Build) -> None:
    world = build([(2.0, 2.0), (2.3, 2.0)], [(1.9, 2.0)], [Fault("removed", (0,), onset=0.2)])
    state = world.state
    steps(world, HOLD, STAY)
    assert state.robot_item[0] == 0
    steps(world, STAY, STAY)
    assert state.item_status[0] == STORED
    np.testing.assert_allclose(state.item_position[0], [2.0, 2.0], atol=1e-3)
    steps(world, HOLD, (-1.0, 0.0, 0.0, 1.0), times=2)
    assert state.robot_item.tolist() == [NOBODY, 0]


# -- timers -------------------------------------------------------------------------------------


def test_a_timer_counts_seconds_since_the_area_and_falls_silent_at_its_limit(build: Build) -> None:
    world = build([(8.05, 5.0), (2.0, 2.0)], [FAR], timer_limit=3.0, radio_range=1.0)
    state = world.state
    for _ in range(5):
        steps(world, STAY, STAY)
        assert state.robot_timer[0] == 0.0
    steps(world, WEST, STAY)
    left = state.step - 1
    assert not state.robot_in_delivery[0]
    for step in range(1, 50):
        silent = [np.nan] if step >= 30 else [(state.step - left) * 0.1]
        for timer in (state.robot_timer, state.robot_told):
            assert timer[:1].tolist() == pytest.approx(silent, nan_ok=True)
            assert np.isnan(timer[1])  # until its first visit
        steps(world, STAY, STAY)
    steps(world, EAST, STAY, times=2)  # coming back starts it again
    assert state.robot_timer[0] == 0.0


LINE = [(INSIDE, 5.0), (5.0, 5.0), (1.5, 5.0)]  # each hears only the next


def test_gossip_carries_a_timer_on_and_ages_it_by_every_hop(build: Build) -> None:
    lowest = slice(row.LOWEST_TIMER, row.LOWEST_TIMER + 4)
    rows = steps(build(LINE, [FAR]), STAY, STAY, STAY, times=10)
    assert rows[:, row.LOWEST_TIMER].tolist() == [0.0, 1.0, 0.0]  # without it, in range alone
    rows = steps(build(LINE, [FAR], relay="gossip"), STAY, STAY, STAY, times=10)
    assert rows[1, lowest] == pytest.approx([1, 3.5, 0, 0.0])
    assert rows[2, lowest] == pytest.approx([1, 3.5, 0, 0.1])
