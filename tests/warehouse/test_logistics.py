"""The rules of the warehouse, one by one, in worlds of a few robots and items."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from swarm_logistics_env import Fault, Scenario, Warehouse
from swarm_logistics_env import observations as row
from swarm_logistics_env.warehouse.state import CARRIED, DELIVERED, NOBODY, STORED

Build = Callable[..., Warehouse]
Places = list[tuple[float, float]]

STAY = (0.0, 0.0, 0.0, 0.0)
HOLD = (0.0, 0.0, 0.0, 1.0)
OPEN = (0.0, 0.0, 0.0, -1.0)
EAST, WEST = (1.0, 0.0, 0.0, 0.0), (-1.0, 0.0, 0.0, 0.0)  # to and from the delivery area
FAR = (1.0, 9.0)  # out of everybody's reach
INSIDE = 8.5  # x in the delivery area, which begins at 8 m


# -- lifting ------------------------------------------------------------------------------------


@pytest.mark.parametrize("item_x", [2.17, 2.23])
def test_the_nearest_empty_robot_lifts_first(build: Build, item_x: float) -> None:
    world = build([(2.0, 2.0), (2.4, 2.0)], [(item_x, 2.0)])
    world.step([HOLD, HOLD])
    nearest = 0 if item_x < 2.2 else 1
    assert world.state.item_carrier[0] == nearest
    assert world.state.robot_item[1 - nearest] == NOBODY
    assert world.state.item_status[0] == CARRIED


def test_of_two_robots_equally_near_the_one_of_the_lower_number_lifts(build: Build) -> None:
    world = build([(2.0, 2.0), (2.5, 2.0)], [(2.25, 2.0)])
    world.step([HOLD, HOLD])
    assert world.state.robot_item.tolist() == [0, NOBODY]


def test_who_loses_an_item_takes_its_next_best_at_once(build: Build) -> None:
    # Both want item 1; robot 1 is nearer and robot 0 has item 2 in reach as well.
    world = build([(2.0, 2.0), (2.4, 2.0)], [FAR, (2.21, 2.0), (1.78, 2.0)])
    world.step([HOLD, HOLD])
    assert world.state.robot_item.tolist() == [2, 1]


def test_who_loses_twice_takes_the_third_best_in_the_same_step(build: Build) -> None:
    items = [FAR, (2.19, 2.0), (2.605, 2.0), (2.4, 2.24)]
    world = build([(2.0, 2.0), (2.4, 2.0), (2.8, 2.0)], items)
    world.step([HOLD, HOLD, HOLD])
    assert world.state.robot_item.tolist() == [1, 3, 2]


def test_the_requested_item_comes_before_a_nearer_one(build: Build) -> None:
    world = build([(2.0, 2.0)], [(2.2, 2.0), (1.95, 2.0)])
    world.step([HOLD])
    assert world.state.robot_item[0] == 0


@pytest.mark.parametrize("items", [[(2.2, 3.0), (1.95, 3.0)], [(1.95, 3.0), (2.2, 3.0)]])
def test_of_others_the_nearest_is_lifted_whatever_its_number(
    build: Build, items: list[tuple[float, float]]
) -> None:
    world = build([(2.0, 3.0)], [FAR, *items])
    world.step([HOLD])
    assert world.state.robot_item[0] == 1 + items.index((1.95, 3.0))
    np.testing.assert_array_equal(world.state.item_position, [FAR, *_with(items, (2.0, 3.0))])


def _with(items: Places, carried: tuple[float, float]) -> Places:
    return [carried if item == (1.95, 3.0) else item for item in items]


def test_an_item_behind_one_that_is_farther_is_found(build: Build) -> None:
    # In the order in which they are looked at: near, farther, nearest.
    world = build([(2.3, 3.3)], [FAR, (2.4, 3.3), (2.5, 3.3), (2.35, 3.3)])
    world.step([HOLD])
    assert world.state.robot_item[0] == 3


def test_of_two_equally_near_the_lower_number_is_lifted(build: Build) -> None:
    for items in ([(2.25, 2.625), (2.25, 2.375)], [(2.25, 2.375), (2.25, 2.625)]):
        world = build([(2.25, 2.5)], [FAR, *items])
        world.step([HOLD])
        assert world.state.robot_item[0] == 1


@pytest.mark.parametrize(("width", "height"), [(30.0, 4.0), (6.0, 30.0)])
def test_items_are_found_anywhere_in_a_long_or_a_high_arena(
    build: Build, width: float, height: float
) -> None:
    places = [(x, y) for x in (0.3, 3.0, width - 2.5) for y in (0.3, 2.0, height - 0.3)]
    items = [(x + 0.1, y) for x, y in places]
    world = build(places, items, warehouse_width=width, warehouse_height=height)
    world.step([HOLD] * len(places))
    assert world.state.robot_item.tolist() == list(range(len(places)))


def test_an_empty_robot_that_opens_its_gripper_changes_nothing(build: Build) -> None:
    world = build([(2.0, 2.0), (5.0, 5.0)], [FAR, (4.0, 9.0), (5.0, 5.1)])
    world.step([STAY, HOLD])
    world.step([OPEN, STAY])
    assert world.state.robot_item.tolist() == [NOBODY, 2]
    assert world.state.item_status.tolist() == [STORED, STORED, CARRIED]
    assert world.state.item_carrier.tolist() == [NOBODY, NOBODY, 1]
    assert (world.state.robot_memory == NOBODY).all()


def test_nothing_is_lifted_from_beyond_the_pickup_range(build: Build) -> None:
    # The last stands at the very end of it, which belongs to it.
    items = [(2.251, 2.0), (5.249, 5.0), (2.25, 8.0)]
    world = build([(2.0, 2.0), (5.0, 5.0), (2.0, 8.0)], items)
    world.step([HOLD, HOLD, HOLD])
    assert world.state.robot_item.tolist() == [NOBODY, 1, 2]


def test_a_laden_robot_lifts_nothing_more(build: Build) -> None:
    world = build([(2.0, 2.0)], [(2.1, 2.0), (1.8, 2.0)])
    for _ in range(3):
        world.step([HOLD])
    assert world.state.robot_item[0] == 0
    assert world.state.item_status[1] == STORED


def test_a_carried_item_goes_where_its_carrier_goes(build: Build) -> None:
    world = build([(2.0, 2.0)], [(2.1, 2.1)])
    world.step([HOLD])
    for _ in range(5):
        world.step([EAST])
        np.testing.assert_array_equal(world.state.item_position[0], world.state.robot_position[0])
    assert world.state.item_position[0, 0] > 2.5


def test_an_fm2_robot_does_not_mask_an_item_from_a_capable_one(build: Build) -> None:
    world = build([(2.0, 2.0), (2.4, 2.0)], [(2.18, 2.0)], [Fault("FM2", (0,))])
    world.step([HOLD, HOLD])
    assert world.state.robot_item.tolist() == [NOBODY, 0]


@pytest.mark.parametrize("first", [STAY, OPEN])
def test_a_nearer_robot_that_does_not_hold_does_not_mask_an_item(
    build: Build, first: tuple[float, ...]
) -> None:
    world = build([(2.0, 2.0), (2.4, 2.0)], [(2.18, 2.0)])
    world.step([first, HOLD])
    assert world.state.robot_item.tolist() == [NOBODY, 0]


@pytest.mark.parametrize(
    ("gripper", "is_laden_after"),
    [(-1.0, False), (-0.51, False), (-0.5, True), (0.0, True), (0.5, True), (1.0, True)],
)
def test_between_open_and_hold_a_gripper_keeps_its_item(
    build: Build, gripper: float, is_laden_after: bool
) -> None:
    world = build([(2.0, 2.0)], [(2.1, 2.0)])
    world.step([HOLD])
    world.step([(0.0, 0.0, 0.0, gripper)])
    assert bool(world.state.robot_item[0] != NOBODY) is is_laden_after


@pytest.mark.parametrize(("gripper", "lifts"), [(0.5, False), (0.51, True), (9.0, True)])
def test_only_holding_lifts(build: Build, gripper: float, lifts: bool) -> None:
    world = build([(2.0, 2.0)], [(2.1, 2.0)])
    world.step([(0.0, 0.0, 0.0, gripper)])
    assert bool(world.state.robot_item[0] == 0) is lifts


def test_an_item_that_is_taken_away_hides_none_behind_it(build: Build) -> None:
    # Robot 1 takes item 1 in the first step; then robot 0 looks past where it lay.
    world = build([(2.0, 2.0), (2.1, 2.2)], [FAR, (2.1, 2.1), (2.15, 2.0)], pickup_range=0.2)
    world.step([STAY, HOLD])
    world.step([HOLD, HOLD])
    assert world.state.robot_item.tolist() == [2, 1]


def test_only_who_lifts_collides_with_items_and_only_until_it_lets_go(build: Build) -> None:
    # An item lies ahead of each robot; 1 and 2 lift in the same step, 0 never does.
    robots = [(2.0, 2.0), (2.0, 4.0), (2.0, 6.0)]
    ahead = [(3.0, 2.0), (3.0, 4.0), (3.0, 6.0)]
    world = build(robots, [FAR, *ahead, (2.0, 4.1), (2.0, 6.1)], pickup_range=0.2)
    place = world.state.robot_position
    world.step([STAY, HOLD, HOLD])
    assert world.state.robot_item.tolist() == [NOBODY, 4, 5]
    for _ in range(10):
        world.step([EAST] * 3)
    assert place[0, 0] > 3.2
    assert place[1, 0] == place[2, 0] == pytest.approx(2.75, abs=0.02)
    world.step([STAY, OPEN, STAY])
    for _ in range(10):
        world.step([WEST, EAST, EAST])
    assert place[0, 0] < 2.5
    assert place[1, 0] > 3.2
    assert place[2, 0] == pytest.approx(2.75, abs=0.02)
    world.step([STAY, STAY, OPEN])
    for _ in range(10):
        world.step([EAST, WEST, EAST])
    assert place[0, 0] > 3.2
    assert place[1, 0] < 2.95
    assert place[2, 0] > 3.2


def test_who_lifts_after_another_put_something_down_collides_with_items(build: Build) -> None:
    world = build([(2.0, 2.0), (2.0, 4.0)], [FAR, (2.0, 2.1), (2.0, 4.1), (3.0, 4.0)])
    world.step([HOLD, STAY])
    world.step([OPEN, STAY])
    world.step([STAY, HOLD])
    for _ in range(10):
        world.step([STAY, EAST])
    assert world.state.robot_position[1, 0] == pytest.approx(2.75, abs=0.02)


# -- letting go, and the memory -----------------------------------------------------------------


def test_an_item_is_put_down_where_its_carrier_is(build: Build) -> None:
    world = build([(2.0, 2.0)], [FAR, (2.1, 2.1)])
    world.step([HOLD])
    for _ in range(3):
        world.step([EAST])
    world.step([OPEN])
    state = world.state
    assert state.item_status[1] == STORED
    assert state.item_carrier[1] == NOBODY
    np.testing.assert_array_equal(state.item_position[1], state.robot_position[0])


def test_the_items_last_put_down_are_not_lifted_again(build: Build) -> None:
    # Far enough away that a laden robot touches none of them.
    items = [FAR, (2.4, 2.0), (2.0, 2.5), (2.0, 1.4)]
    world = build([(2.0, 2.0)], items, pickup_range=1.5, memory_size=2)
    lifted = []
    for _ in range(5):
        world.step([HOLD])
        lifted.append(int(world.state.robot_item[0]))
        world.step([OPEN])
    assert set(lifted[:3]) == {1, 2, 3}
    assert lifted[3:] == lifted[:2]  # forgotten after two others
    assert world.state.robot_memory[0].tolist() == [lifted[4], lifted[3]]


@pytest.mark.parametrize("memory_size", [1, 3, 4])
def test_the_memory_holds_the_items_last_put_down_newest_first(
    build: Build, memory_size: int
) -> None:
    items = [FAR, (2.4, 2.0), (2.0, 2.5), (2.0, 1.4), (1.3, 2.0), (2.8, 2.0)]
    world = build([(2.0, 2.0)], items, pickup_range=1.5, memory_size=memory_size)
    lifted: list[int] = []
    for _ in range(7):
        world.step([HOLD])
        assert world.state.robot_item[0] not in lifted[:memory_size]
        lifted.insert(0, int(world.state.robot_item[0]))
        world.step([OPEN])
        put_down = lifted[:memory_size]
        assert world.state.robot_memory[0, : len(put_down)].tolist() == put_down


def test_a_robot_without_memory_lifts_the_same_item_again(build: Build) -> None:
    world = build([(2.0, 2.0)], [FAR, (2.1, 2.0)], memory_size=0)
    for command, item in ((HOLD, 1), (OPEN, NOBODY), (HOLD, 1)):
        world.step([command])
        assert world.state.robot_item[0] == item


def test_a_remembered_item_can_be_seen_to_be_so(build: Build) -> None:
    world = build([(2.0, 2.0), (2.6, 2.0)], [FAR, (2.1, 2.0)])
    world.step([HOLD, STAY])
    rows = world.step([OPEN, STAY])
    held = row.ITEMS + row.ITEM_FEATURES.index("recently_held")
    assert rows[:, row.ITEMS].tolist() == [1.0, 1.0]
    assert rows[:, held].tolist() == [1.0, 0.0]


def test_the_requested_item_is_lifted_again_though_remembered(build: Build) -> None:
    world = build([(2.0, 2.0)], [(2.1, 2.0)])
    for command, item in ((HOLD, 0), (OPEN, NOBODY), (HOLD, 0)):
        world.step([command])
        assert world.state.robot_item[0] == item
    assert world.state.robot_memory[0, 0] == 0


def test_a_delivery_clears_everybodys_memory(build: Build) -> None:
    world = build(
        [(2.0, 2.0), (3.0, 5.0), (INSIDE, 5.0)], [(INSIDE, 5.1), (2.1, 2.0), (3.1, 5.0), FAR]
    )
    world.step([HOLD, HOLD, STAY])
    world.step([OPEN, OPEN, STAY])
    assert world.state.robot_memory[:, 0].tolist() == [1, 2, NOBODY]
    world.step([STAY, STAY, HOLD])
    assert world.state.delivered == 1
    assert (world.state.robot_memory == NOBODY).all()
    world.step([STAY, HOLD, STAY])
    assert world.state.robot_item[1] == 2


def test_letting_go_of_another_item_in_the_delivery_area_is_ignored(build: Build) -> None:
    world = build([(INSIDE, 5.0)], [FAR, (INSIDE, 5.1)])
    world.step([HOLD])
    world.step([OPEN])
    assert world.state.robot_item[0] == 1
    assert world.state.delivered == 0
    while world.state.robot_in_delivery[0]:
        world.step([WEST])
    world.step([OPEN])
    assert world.state.robot_item[0] == NOBODY


def test_letting_go_of_an_item_asked_for_earlier_is_ignored_there_too(build: Build) -> None:
    world = build([(INSIDE, 5.0)], [(INSIDE, 5.1), FAR, FAR])
    world.state.requested = 1
    world.step([HOLD])
    world.step([OPEN])
    assert world.state.robot_item[0] == 0


def test_who_cannot_let_go_keeps_nobody_behind_from_it(build: Build) -> None:
    robots = [(2.0, 2.0), (4.0, 2.0), (INSIDE, 5.0), (6.0, 2.0)]
    world = build(robots, [FAR, (4.0, 2.1), (INSIDE, 5.1), (6.0, 2.1)])
    world.step([STAY, HOLD, HOLD, HOLD])
    # One has nothing, one holds on, one is in the delivery area, and the last lets go.
    world.step([OPEN, HOLD, OPEN, OPEN])
    assert world.state.robot_item.tolist() == [NOBODY, 1, 2, NOBODY]


# -- delivering ---------------------------------------------------------------------------------


def test_an_item_is_delivered_as_soon_as_its_carriers_centre_is_inside(build: Build) -> None:
    world = build([(7.0, 5.0)], [(7.0, 5.1), FAR], max_speed=0.5)
    world.step([HOLD])
    while world.state.robot_position[0, 0] < 8.0:
        assert world.state.delivered == 0
        world.step([EAST])
    state = world.state
    assert state.robot_position[0, 0] < 8.06
    assert state.delivery_times == [state.time]
    assert state.delivered_by == [0]
    assert state.item_status[0] == DELIVERED
    assert state.robot_item[0] == NOBODY
    assert state.requested == 1


def test_the_very_border_belongs_to_the_delivery_area(build: Build) -> None:
    world = build([(8.0, 5.0), (7.999, 7.0)], [FAR])
    world.step([STAY, STAY])
    assert world.state.robot_in_delivery.tolist() == [True, False]


def test_another_item_is_not_delivered(build: Build) -> None:
    world = build([(7.5, 5.0)], [FAR, (7.5, 5.1)])
    world.step([HOLD])
    for _ in range(10):
        world.step([EAST])
    assert world.state.robot_in_delivery[0]
    assert world.state.delivered == 0


def test_a_shuffled_item_that_becomes_requested_is_delivered_at_once(build: Build) -> None:
    world = build(
        [(INSIDE, 5.0), (INSIDE, 7.0), (INSIDE, 3.0)],
        [(INSIDE, 5.1), (INSIDE, 7.1), (INSIDE, 3.1), FAR],
    )
    world.step([STAY, HOLD, HOLD])
    assert world.state.delivered == 0
    world.step([HOLD, STAY, STAY])
    state = world.state
    assert state.delivered_by == [0, 1, 2]
    assert len(set(state.delivery_times)) == 1
    assert state.requested == 3


def test_after_the_last_item_nothing_is_requested(build: Build) -> None:
    world = build([(INSIDE, 5.0)], [(INSIDE, 5.1), (INSIDE, 4.9)])
    world.step([HOLD])
    assert not world.all_delivered
    rows = world.step([HOLD])
    assert world.all_delivered
    assert world.state.requested == NOBODY
    assert not rows[0, row.RANGE_ITEMS : row.RANGE_ITEMS + row.N_BEAMS].min() < 2.0
    world.step([HOLD])
    assert world.state.delivered == 2


def test_restock_brings_a_delivered_item_back_and_goes_on(build: Build) -> None:
    world = build([(INSIDE, 5.0)], [(INSIDE, 5.1)], restock=True, pickup_range=12.0)
    for delivered in range(1, 6):
        world.step([HOLD])
        state = world.state
        assert state.delivered == delivered
        assert state.item_status.tolist() == [STORED]
        assert state.requested == 0
        assert 0.125 <= state.item_position[0, 0] <= 8.0 - 0.125
    assert not world.all_delivered


@pytest.mark.parametrize("restock", [(False, True), (True, False)])
def test_when_restock_is_switched_what_is_there_is_asked_for(
    build: Build, restock: tuple[bool, bool]
) -> None:
    items = [(INSIDE, 5.1), (INSIDE, 4.9), (INSIDE, 5.05)]
    world = build([(INSIDE, 5.0)], items, restock=restock[0], pickup_range=12.0)
    state = world.state
    for _ in range(2):
        world.step([HOLD])
    world.change(restock=restock[1])
    for _ in range(10):
        assert state.requested == NOBODY or state.item_status[state.requested] != DELIVERED
        world.step([HOLD])
    # One came back and goes on coming back; or all three were there and left for good.
    assert state.delivered == (12 if restock[1] else 5)
    assert world.all_delivered is restock[0]


def test_with_restock_each_cycle_of_requests_has_an_order_of_its_own() -> None:
    world = Warehouse(Scenario(n_robots=1, n_items=5, pickup_range=20.0, restock=True))
    world.reset(0)
    world.change(delivery_width=9.5)
    state, asked = world.state, []
    while state.delivered < 25:
        asked.append(state.requested)
        heading = float(state.robot_heading[0])
        world.step([[np.cos(heading), -np.sin(heading), 0.0, 1.0]])
        asked = asked[: state.delivered]
        assert state.step < 200
    cycles = np.reshape(asked, (5, 5)).tolist()
    assert all(sorted(cycle) == list(range(5)) for cycle in cycles)
    assert len({tuple(cycle) for cycle in cycles}) > 2


def test_an_fm4_carrier_blocks_the_request_until_it_lets_go(build: Build) -> None:
    robots = [(INSIDE, 5.0), (INSIDE, 5.3)]
    world = build(robots, [(INSIDE, 5.05), FAR], [Fault("FM4", (0,))], pickup_range=0.4)
    for _ in range(3):
        world.step([HOLD, HOLD])
    state = world.state
    assert state.robot_item[0] == 0
    assert state.robot_in_delivery[0]
    assert state.delivered == 0
    world.step([OPEN, STAY])
    assert state.item_status[0] == STORED  # the requested item, even inside
    world.step([STAY, HOLD])
    assert state.delivered_by == [1]
    assert state.requested == 1


def test_the_requested_item_can_be_let_go_of_outside_too(build: Build) -> None:
    world = build([(2.0, 2.0)], [(2.1, 2.0)])
    world.step([HOLD])
    world.step([OPEN])
    assert world.state.item_status[0] == STORED


def test_who_is_removed_puts_its_item_down_for_others(build: Build) -> None:
    world = build([(2.0, 2.0), (2.3, 2.0)], [(1.9, 2.0)], [Fault("removed", (0,), onset=0.2)])
    world.step([HOLD, STAY])
    assert world.state.robot_item[0] == 0
    world.step([STAY, STAY])
    state = world.state
    assert state.item_status[0] == STORED
    np.testing.assert_allclose(state.item_position[0], [2.0, 2.0], atol=1e-3)
    for _ in range(2):
        world.step([HOLD, (-1.0, 0.0, 0.0, 1.0)])
    assert state.robot_item.tolist() == [NOBODY, 0]


# -- timers -------------------------------------------------------------------------------------


def test_a_timer_is_silent_until_the_first_visit(build: Build) -> None:
    world = build([(2.0, 2.0)], [FAR])
    for _ in range(150):
        world.step([STAY])
    assert np.isnan(world.state.robot_timer[0])
    assert np.isnan(world.state.robot_told[0])


def test_a_timer_counts_seconds_since_the_area_and_falls_silent_at_its_limit(build: Build) -> None:
    world = build([(8.05, 5.0)], [FAR])
    for _ in range(5):
        world.step([STAY])
        assert world.state.robot_timer[0] == 0.0
    world.step([WEST])
    left = world.state.step - 1
    assert not world.state.robot_in_delivery[0]
    for _ in range(120):
        seconds = (world.state.step - left) * 0.1
        if world.state.step - left < 100:
            assert world.state.robot_timer[0] == pytest.approx(seconds)
            assert world.state.robot_told[0] == pytest.approx(seconds)
        else:
            assert np.isnan(world.state.robot_timer[0])
            assert np.isnan(world.state.robot_told[0])
        world.step([STAY])


def test_coming_back_starts_the_timer_again(build: Build) -> None:
    world = build([(8.05, 5.0)], [FAR])
    world.step([STAY])
    while world.state.robot_in_delivery[0]:
        world.step([WEST])
    for _ in range(5):
        world.step([STAY])
    assert world.state.robot_timer[0] > 0.4
    while not world.state.robot_in_delivery[0]:
        world.step([EAST])
    assert world.state.robot_timer[0] == 0.0


def test_an_fm1_robot_tells_zero_always_whatever_its_timer(build: Build) -> None:
    world = build([(2.0, 2.0), (3.0, 2.0)], [FAR], [Fault("FM1", (0,))])
    heard = row.NEIGHBOURS + row.NEIGHBOUR_FEATURES.index("timer_heard")
    for _ in range(3):
        assert world.state.robot_told[0] == 0.0
        assert np.isnan(world.state.robot_timer[0])
        rows = world.observe()
        assert rows[1, heard] == 1.0
        assert rows[1, heard + 1] == 0.0
        assert rows[1, row.LOWEST_TIMER] == 1.0
        assert rows[0, row.TIMER_RUNS] == 0.0  # it is not told of its own lie
        world.step([STAY, STAY])


LINE = [(INSIDE, 5.0), (5.0, 5.0), (1.5, 5.0)]  # each hears only the next


def test_without_relay_only_those_in_range_of_a_visitor_hear(build: Build) -> None:
    world = build(LINE, [FAR])
    for _ in range(10):
        rows = world.step([STAY] * 3)
    assert rows[:, row.LOWEST_TIMER].tolist() == [0.0, 1.0, 0.0]


def test_gossip_carries_a_timer_on_and_ages_it_by_every_hop(build: Build) -> None:
    world = build(LINE, [FAR], relay="gossip")
    for _ in range(10):
        rows = world.step([STAY] * 3)
    assert rows[1, row.LOWEST_TIMER : row.LOWEST_TIMER + 4] == pytest.approx([1, 3.5, 0, 0.0])
    assert rows[2, row.LOWEST_TIMER : row.LOWEST_TIMER + 4] == pytest.approx([1, 3.5, 0, 0.1])


def test_with_gossip_the_lower_of_ones_own_timer_and_an_aged_one_is_told(build: Build) -> None:
    # Robot 1 leaves the area; robot 0 stays there until it is taken out, robot 2 is never heard.
    faults = [Fault("removed", (0,), onset=2.0)]
    world = build([(9.5, 5.0), (8.2, 5.0), (1.0, 1.0)], [FAR], faults, relay="gossip")
    for step in range(1, 31):
        world.step([STAY, WEST if step <= 5 else STAY, STAY])
        own, told = world.state.robot_timer[1], world.state.robot_told[1]
        if 6 <= step < 20:
            assert own > 0.3
            assert told == pytest.approx(0.1)
        if step > 21:
            assert told == own


def test_gossip_does_not_keep_a_timer_alive_for_ever(build: Build) -> None:
    # The visitor is taken out; the others go on telling each other, ever older, then nothing.
    faults = [Fault("removed", (0,), onset=1.0)]
    world = build(LINE, [FAR], faults, relay="gossip", timer_limit=2.0)
    told = []
    for _ in range(60):
        world.step([STAY] * 3)
        told.append(world.state.robot_told[1:].copy())
        assert (np.nan_to_num(told[-1]) < 2.0 - 1e-9).all()
    assert not np.isnan(told[9]).any()
    ages = np.nanmin(told[10:28], axis=1)
    assert (np.diff(ages) > 0.0).all()
    assert np.isnan(told[30:]).all()


def test_who_is_removed_falls_silent_at_once_even_with_gossip(build: Build) -> None:
    faults = [Fault("removed", (1,), onset=1.0)]
    world = build(LINE, [FAR], faults, relay="gossip")
    for _ in range(10):
        world.step([STAY] * 3)
    assert not world.state.robot_present[1]
    assert np.isnan(world.state.robot_told[1])
