from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import Scenario, run_episode
from swarm_logistics_env import observations as row
from swarm_logistics_env.policies import load
from swarm_logistics_env.warehouse import Warehouse

EAST, NORTH = (1.0, 0.0), (0.0, 1.0)


def fresh(n_robots: int, seed: int = 0) -> Any:
    policy = load("homing")
    policy.reset(n_robots, seed)
    return policy


def rows_of(n_robots: int, velocity: tuple[float, float] = (0.0, 0.0)) -> NDArray[np.float32]:
    """Rows of robots far from everything that move at this velocity [m/s]."""
    rows = np.zeros((n_robots, row.N_COLUMNS), np.float32)
    rows[:, row.RANGE_WALLS : row.RANGE_WALLS + row.N_BEAMS] = 2.0
    rows[:, row.VELOCITY : row.VELOCITY + 2] = velocity
    return rows


def loaded(rows: NDArray[np.float32]) -> NDArray[np.float32]:
    rows[:, [row.CARRYING, row.CARRYING_REQUESTED]] = 1.0
    return rows


def inside(rows: NDArray[np.float32]) -> NDArray[np.float32]:
    rows[:, row.IN_DELIVERY_AREA] = 1.0
    return rows


def test_it_is_shipped_and_delivers_more_than_swarm_dt() -> None:
    scenario = Scenario(duration=60.0, restock=True)
    delivered = {
        name: run_episode(scenario, load(name), seed=0).delivered for name in ("swarm-dt", "homing")
    }
    assert delivered["homing"] > 2 * delivered["swarm-dt"]


@pytest.mark.parametrize("entered", [EAST, NORTH])
def test_a_laden_robot_goes_where_it_entered_the_delivery_area(
    entered: tuple[float, float],
) -> None:
    policy = fresh(20)
    policy.act(rows_of(20, entered))
    policy.act(inside(rows_of(20, entered)))
    policy.act(rows_of(20))  # outside again, without a direction of leaving
    for _ in range(20):  # what it commands becomes its heading, so it swings home
        commands = policy.act(loaded(rows_of(20, entered)))
    assert (commands[:, :2] @ np.array(entered) > 0.95).all()
    assert (commands[:, 3] == 1.0).all()


def test_a_robot_that_never_entered_knows_no_direction() -> None:
    commands = fresh(200).act(loaded(rows_of(200)))
    angles = np.arctan2(commands[:, 1], commands[:, 0])
    assert all(
        ((angles > low) & (angles < low + np.pi / 2)).any() for low in (-3.0, -1.5, 0.0, 1.5)
    )


def test_it_follows_the_lowest_timer_heard_until_it_knows_the_way_for_sure() -> None:
    policy = fresh(30)
    rows = loaded(rows_of(30, EAST))
    rows[:, row.LOWEST_TIMER : row.LOWEST_TIMER + 3] = (1.0, *NORTH)
    for _ in range(20):
        commands = policy.act(rows)
    assert (commands[:, 1] > 0.9).all()
    for _ in range(4):  # enters in the east four times, without a way out at speed
        policy.act(rows_of(30, EAST))
        policy.act(inside(rows_of(30, EAST)))
        policy.act(inside(rows_of(30)))
        policy.act(rows_of(30))
    for _ in range(20):
        commands = policy.act(rows)
    assert (commands[:, 0] > 0.9).all()


def test_it_never_commands_a_turn() -> None:
    scenario = Scenario(n_robots=30, warehouse_width=6, warehouse_height=5, n_items=20)
    world = Warehouse(scenario.replace(heading_drift=0.0))
    rows, policy = world.reset(0), fresh(30)
    first = world.state.robot_heading.copy()
    for _ in range(100):
        commands = policy.act(rows)
        assert np.isfinite(commands).all()
        assert (np.hypot(commands[:, 0], commands[:, 1]) <= 1.0 + 1e-9).all()
        assert (commands[:, 2] == 0.0).all()
        rows = world.step(commands)
    np.testing.assert_allclose(world.state.robot_heading, first)
