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


def told_rows(world: Warehouse, **who: object) -> tuple[np.ndarray, list[int]]:
    """Return the rows of the script, and which robots have the requested item in them."""
    policy = Told(**who)
    policy.configure(world.scenario)
    policy._script = script = Rows()  # type: ignore[assignment]
    policy.act(sensed(), world.state)
    requested = row.ITEMS + np.arange(row.N_ITEMS_IN_VIEW) * row.ITEM_WIDTH + row.ITEM.requested
    return script.rows, np.flatnonzero((script.rows[:, requested] > 0.5).any(axis=1)).tolist()


@pytest.mark.parametrize(
    ("who", "robots"),
    [
        ({"hears": "hops", "count": 1}, [0, 1]),
        ({"hears": "hops", "count": 2}, [0, 1, 2]),
        ({"hears": "nearest", "count": 4}, [0, 1, 2, 3]),
        ({}, [0, 1, 2, 3, 4, 5]),
    ],
)
def test_those_are_told_who_are_near_enough_and_carry_nothing(
    who: dict[str, object], robots: list[int]
) -> None:
    world = world_of([1.0, 2.9, 4.8, 6.7, 8.6, 9.5])  # the first has it in view
    _, listeners = told_rows(world, **who)
    assert listeners == robots
    world.state.robot_item[1] = 2
    world.state.item_status[2] = 1
    _, listeners = told_rows(world, **who)
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


def test_where_nothing_is_asked_for_it_is_the_script_itself() -> None:
    world = Warehouse(SCENARIO)
    rows = world.reset(seed=0)
    world.state.open_requests[:] = -1
    told_script = policies.load("homing-told", near=2.0)
    script = HomingStock(near=2.0)
    for policy in (told_script, script):
        policy.configure(SCENARIO)  # type: ignore[attr-defined]
        policy.reset(6, 3)
    np.testing.assert_equal(told_script.act(rows, world.state), script.act(rows))  # type: ignore[call-arg]
    with pytest.raises(PolicyError, match="state = None"):
        told_script.act(rows)
    with pytest.raises(PolicyError, match="hears"):
        policies.load("homing-told", hears="nobody")
