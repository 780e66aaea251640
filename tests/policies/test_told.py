"""A script that is told where the requested item lies: who hears it, and what stands in its row."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_logistics_env import Scenario, Warehouse, policies
from swarm_logistics_env.core.errors import PolicyError
from swarm_logistics_env.policies.homing_stock import HomingStock
from swarm_logistics_env.policies.told import Told
from swarm_logistics_env.world import observations as row

SCENARIO = Scenario(n_robots=6, n_items=3, drive="holonomic", radio_range=2.0)
ITEM = 0


def world_of(xs: list[float]) -> Warehouse:
    """Return a world with robots on a line [m], whose requested item lies at its left end."""
    world = Warehouse(SCENARIO)
    world.reset(seed=0)
    state = world.state
    state.robot_position[:] = np.column_stack([xs, np.full(6, 5.0)])
    state.robot_heading[:] = np.pi / 2.0
    state.item_position[:] = [[0.5, 5.0], [9.0, 1.0], [9.0, 9.0]]
    state.open_requests[0] = ITEM
    return world


class Rows:
    """Notes the rows that a script gets."""

    def act(self, rows: np.ndarray) -> np.ndarray:
        self.rows = rows
        return np.zeros((len(rows), 4))


def sensed() -> np.ndarray:
    """Return rows of which the first has the requested item in view, and another one."""
    rows = np.zeros((6, row.N_COLUMNS), np.float32)
    rows[0, row.ITEMS : row.ITEMS + row.ITEM_WIDTH] = [1.0, 0.0, 0.5, 1.0, 0.0]
    rows[3, row.ITEMS : row.ITEMS + row.ITEM_WIDTH] = [1.0, 0.3, 0.3, 0.0, 0.0]
    return rows


def told_rows(world: Warehouse, **options: object) -> tuple[np.ndarray, list[int]]:
    """Return the rows of the script, and which robots have the requested item in them."""
    policy = Told(**options)
    policy.configure(world.scenario)
    policy._script = script = Rows()  # type: ignore[assignment]
    policy.act(sensed(), world.state)
    requested = row.ITEMS + np.arange(row.N_ITEMS_IN_VIEW) * row.ITEM_WIDTH + row.ITEM.requested
    return script.rows, np.flatnonzero((script.rows[:, requested] > 0.5).any(axis=1)).tolist()


@pytest.mark.parametrize(
    ("options", "robots"),
    [
        ({"hears": "hops", "count": 1}, [0, 1]),
        ({"hears": "hops", "count": 2}, [0, 1, 2]),
        ({"hears": "nearest", "count": 4}, [0, 1, 2, 3]),
        ({}, [0, 1, 2, 3, 4, 5]),
    ],
)
def test_those_are_told_who_are_near_enough_and_carry_nothing(
    options: dict[str, object], robots: list[int]
) -> None:
    world = world_of([1.0, 2.9, 4.8, 6.7, 8.6, 9.5])  # the first has it in view
    _, listeners = told_rows(world, **options)
    assert listeners == robots
    world.state.robot_item[1] = 2
    world.state.item_status[2] = 1
    _, listeners = told_rows(world, **options)
    assert 1 not in listeners
    assert 0 in listeners


def test_the_true_place_stands_in_the_robots_own_frame_behind_what_is_in_view() -> None:
    world = world_of([1.0, 2.9, 4.8, 6.7, 8.6, 9.5])
    rows, _ = told_rows(world)
    start = row.ITEMS + row.ITEM_WIDTH
    # It faces along y, so what lies 6.2 m to its left has y = 6.2.
    assert rows[3, start + row.ITEM.present] == 1.0
    np.testing.assert_allclose(
        rows[3, [start + row.ITEM.x, start + row.ITEM.y]], [0.0, 6.2], atol=1e-6
    )
    np.testing.assert_equal(rows[0], sensed()[0])  # who sees it is told nothing


def rows_of_script(world: Warehouse, rows: np.ndarray, **options: object) -> np.ndarray:
    """Return the rows of the script for rows of a swarm."""
    policy = Told(**options)
    policy.configure(world.scenario)
    policy._script = script = Rows()  # type: ignore[assignment]
    policy.act(rows, world.state)
    return script.rows


def test_rows_hold_the_item_behind_those_in_view_or_instead_of_the_last() -> None:
    world = world_of([1.0, 2.9, 4.8, 6.7, 8.6, 9.5])
    state = world.state
    state.robot_heading[:] = [0.7, -2.0, 3.0, 1.0, 0.0, 0.5]
    state.item_position[ITEM] = [3.0, 7.0]
    state.robot_present[5] = False
    rows = np.zeros((6, row.N_COLUMNS), np.float32)
    n_in_view = [0, 1, 2, row.N_ITEMS_IN_VIEW - 1, row.N_ITEMS_IN_VIEW, 0]
    for robot, count in enumerate(n_in_view):
        for rank in range(count):
            start = row.ITEMS + rank * row.ITEM_WIDTH
            rows[robot, start : start + row.ITEM_WIDTH] = [1.0, 0.1 * rank, 0.2, 0.0, 1.0]
    expected = rows.copy()
    for robot, count in enumerate(n_in_view[:5]):
        start = row.ITEMS + min(count, row.N_ITEMS_IN_VIEW - 1) * row.ITEM_WIDTH
        x, y = np.array([3.0, 7.0]) - state.robot_position[robot]
        away, angle = np.hypot(x, y), np.arctan2(y, x) - state.robot_heading[robot]
        item = [1.0, away * np.cos(angle), away * np.sin(angle), 1.0, 0.0]
        expected[robot, start : start + row.ITEM_WIDTH] = item
    np.testing.assert_allclose(rows_of_script(world, rows), expected, atol=1e-6)
    state.item_status[ITEM] = 1  # somebody carries it
    np.testing.assert_array_equal(rows_of_script(world, rows), rows)


@pytest.mark.parametrize(
    ("options", "absent", "carrying", "robots"),
    [
        ({"hears": "nearest", "count": 2}, [], [], [4, 5]),
        ({"hears": "nearest", "count": 2}, [5], [4], [2, 3]),
        ({"hears": "nearest", "count": 4}, [], [0, 1, 2, 3], [4, 5]),
        ({"hears": "hops", "count": 2}, [], [], [2, 3, 5]),
        ({"hears": "hops", "count": 2}, [3], [], [5]),
        ({"hears": "hops", "count": 2}, [4], [], []),
        ({"hears": "hops", "count": 9}, [], [3], [0, 1, 2, 5]),
    ],
)
def test_who_is_absent_or_carries_is_not_told_and_who_is_absent_passes_nothing_on(
    options: dict[str, object], absent: list[int], carrying: list[int], robots: list[int]
) -> None:
    world = world_of([1.0, 2.9, 4.8, 6.7, 8.6, 9.5])
    world.state.item_position[ITEM] = [9.5, 5.0]
    world.state.robot_present[absent] = False
    world.state.robot_item[carrying] = 2
    rows = np.zeros((6, row.N_COLUMNS), np.float32)
    if options["hears"] == "hops":  # robot 4 has it in view
        rows[4, row.ITEMS : row.ITEMS + row.ITEM_WIDTH] = [1.0, 0.9, 0.0, 1.0, 0.0]
    is_changed = (rows_of_script(world, rows, **options) != rows).any(axis=1)
    assert np.flatnonzero(is_changed).tolist() == robots


def test_where_nothing_is_asked_for_it_is_the_script_itself() -> None:
    scenario = SCENARIO.replace(drive="differential", handling_time=0.3)
    world = Warehouse(scenario)
    rows = world.reset(seed=0)
    told_script = policies.load("homing-told", near=2.0)
    script = HomingStock(near=2.0)
    for policy in (told_script, script):
        policy.configure(scenario)  # type: ignore[attr-defined]
        policy.reset(6, 3)
    assert repr(told_script._script) == repr(script) == "HomingStock(near=2.0)"  # type: ignore[attr-defined]
    for _ in range(60):
        world.state.open_requests[:] = -1
        commands = script.act(rows)
        np.testing.assert_equal(told_script.act(rows, world.state), commands)  # type: ignore[call-arg]
        rows = world.step(commands)
    with pytest.raises(PolicyError, match="state = None"):
        told_script.act(rows)
    with pytest.raises(PolicyError, match="hears"):
        policies.load("homing-told", hears="nobody")
