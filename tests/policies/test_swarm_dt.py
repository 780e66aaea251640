"""Swarm D-T, row by row: what it does for what it senses."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import Fault, Scenario, Warehouse, run_episode
from swarm_logistics_env import observations as row
from swarm_logistics_env.errors import PolicyError
from swarm_logistics_env.policies import SwarmDT, SwarmDTParameters, load
from swarm_logistics_env.scenario import SOURCES


def nothing_near(n_robots: int = 1) -> NDArray[np.float32]:
    """Return rows of robots that sense nothing within range, empty, timers silent."""
    rows = np.zeros((n_robots, row.N_COLUMNS), np.float32)
    for scan in (row.RANGE_ROBOTS, row.RANGE_WALLS, row.RANGE_ITEMS):
        rows[:, scan : scan + row.N_BEAMS] = 2.0
    rows[:, row.TIMER] = 10.0
    return rows


def fresh(n_robots: int = 1, seed: int = 0, **parameters: Any) -> SwarmDT:
    policy = SwarmDT(**parameters)
    policy.reset(n_robots, seed)
    return policy


def straight(n_robots: int = 1, **parameters: Any) -> SwarmDT:
    """Return a policy whose stored heading only turns for what is sensed."""
    return fresh(n_robots, diffusion=0.0, **parameters)


def heading_of(commands: NDArray[np.float64]) -> float:
    return math.atan2(commands[0, 1], commands[0, 0])


def with_neighbour(rows: NDArray[np.float32], x: float, y: float) -> NDArray[np.float32]:
    changed = rows.copy()
    changed[0, row.NEIGHBOURS : row.NEIGHBOURS + 3] = 1.0, x, y
    return changed


def with_item(rows: NDArray[np.float32], x: float, y: float) -> NDArray[np.float32]:
    changed = rows.copy()
    changed[0, row.ITEMS : row.ITEMS + 3] = 1.0, x, y
    return changed


def carrying(rows: NDArray[np.float32], requested: bool) -> NDArray[np.float32]:
    changed = rows.copy()
    changed[0, row.CARRYING] = 1.0
    changed[0, row.CARRYING_REQUESTED] = float(requested)
    return changed


def hearing(rows: NDArray[np.float32], x: float, y: float) -> NDArray[np.float32]:
    changed = rows.copy()
    changed[0, row.LOWEST_TIMER : row.LOWEST_TIMER + 4] = 1.0, x, y, 3.0
    return changed


def test_with_nothing_near_it_walks_at_full_speed_and_holds() -> None:
    commands = fresh(50).act(nothing_near(50))
    np.testing.assert_allclose(np.hypot(commands[:, 0], commands[:, 1]), 1.0)
    assert (commands[:, 2] == 0.0).all()
    assert (commands[:, 3] == 1.0).all()


def test_first_headings_are_spread_all_round() -> None:
    commands = fresh(4000).act(nothing_near(4000))
    assert np.abs(commands[:, :2].mean(axis=0)).max() < 0.06


@pytest.mark.parametrize("period", [0.02, 0.1, 0.2])
def test_the_heading_diffuses_at_its_rate_whatever_the_period(period: float) -> None:
    policy = SwarmDT()
    policy.configure(Scenario(control_period=period))
    policy.reset(4000, 0)
    rows = nothing_near(4000)
    first = policy.act(rows)
    for _ in range(round(0.4 / period)):
        last = policy.act(rows)
    turned = np.arctan2(
        first[:, 0] * last[:, 1] - first[:, 1] * last[:, 0],
        (first[:, :2] * last[:, :2]).sum(axis=1),
    )
    # Unwrapped it has variance D t = 0.556, so the mean cosine is exp(-D t / 2).
    assert np.cos(turned).mean() == pytest.approx(math.exp(-1.39 * 0.4 / 2), abs=0.02)
    assert abs(turned.mean()) < 0.06


@pytest.mark.parametrize("beam", range(row.N_BEAMS))
def test_a_wall_reflects_the_stored_heading_once(beam: int) -> None:
    rows = nothing_near()
    policy = straight()
    before = heading_of(policy.act(rows))
    wall = rows.copy()
    wall[0, row.RANGE_WALLS + beam] = 0.15
    towards = beam * math.tau / row.N_BEAMS
    approaches = math.cos(before - towards) > 0.0
    mirrored = 2 * towards + math.pi - before if approaches else before
    for _ in range(3):  # once turned away, it goes on straight
        after = heading_of(policy.act(wall))
        assert math.remainder(after - mirrored, math.tau) == pytest.approx(0.0, abs=1e-6)
    assert heading_of(policy.act(rows)) == pytest.approx(after)


def test_it_turns_away_from_a_near_robot_and_not_from_a_far_one() -> None:
    plain = straight().act(nothing_near())
    far = straight().act(with_neighbour(nothing_near(), 0.5, 0.1))
    np.testing.assert_array_equal(far, plain)
    near = straight().act(with_neighbour(nothing_near(), 0.3, 0.0))
    # Pushed back by 2 (1 - 0.3 / 0.5) = 0.8 top speeds.
    expected = plain[0, :2] + [-0.8, 0.0]
    expected /= max(np.hypot(*expected), 1.0)
    np.testing.assert_allclose(near[0, :2], expected, atol=1e-6)


def test_it_avoids_items_only_while_it_carries() -> None:
    plain = straight().act(nothing_near())
    empty = straight().act(with_item(nothing_near(), 0.3, 0.0))
    np.testing.assert_array_equal(empty, plain)
    laden = straight(drop_rate=0.0).act(carrying(with_item(nothing_near(), 0.3, 0.0), False))
    assert laden[0, 0] < plain[0, 0]


def test_only_who_carries_the_requested_item_follows_the_lowest_timer() -> None:
    rows = hearing(nothing_near(), 0.0, 2.0)
    plain = straight().act(nothing_near())
    for kind in (rows, carrying(rows, requested=False)):
        np.testing.assert_array_equal(straight(drop_rate=0.0).act(kind)[0, :2], plain[0, :2])
    delivering = straight().act(carrying(rows, requested=True))
    expected = plain[0, :2] + [0.0, 0.75]
    expected /= max(np.hypot(*expected), 1.0)
    np.testing.assert_allclose(delivering[0, :2], expected, atol=1e-6)


def test_without_taxis_it_follows_nobody() -> None:
    rows = carrying(hearing(nothing_near(), 0.0, 2.0), requested=True)
    walk = load("random-walk", diffusion=0.0)
    walk.reset(1, 0)
    # To a float32's rounding: the interpreter multiplies its zero gain in that precision.
    np.testing.assert_allclose(
        walk.act(rows)[0, :2],
        straight().act(carrying(nothing_near(), requested=True))[0, :2],
        rtol=1e-6,
    )


def test_without_taxis_fewer_items_are_delivered() -> None:
    scenario = Scenario(
        n_robots=20, n_items=15, warehouse_width=6, warehouse_height=4, duration=60.0, restock=True,
        delivery_width=1.0,
    )  # fmt: skip
    delivered = {
        name: sum(run_episode(scenario, load(name), seed).delivered for seed in range(4))
        for name in ("swarm-dt", "random-walk")
    }
    assert delivered["swarm-dt"] > 1.2 * delivered["random-walk"] > 0.0


@pytest.mark.parametrize("follows", [False, True])
def test_only_where_the_heading_follows_do_pushes_turn_it_for_good(follows: bool) -> None:
    policy = straight(heading_follows=follows)
    before = heading_of(policy.act(nothing_near()))
    pushed = heading_of(policy.act(with_neighbour(nothing_near(), 0.1, 0.05)))
    after = heading_of(policy.act(nothing_near()))
    assert after == pytest.approx(pushed if follows else before)
    assert pushed != pytest.approx(before)


@pytest.mark.parametrize("period", [0.02, 0.1])
def test_other_items_are_dropped_at_the_drop_rate_and_the_requested_one_never(
    period: float,
) -> None:
    n = 3000
    rows = nothing_near(n)
    rows[:, row.CARRYING] = 1.0
    policy = SwarmDT()
    policy.configure(Scenario(control_period=period))
    policy.reset(n, 0)
    kept = np.ones(n, np.bool_)
    for _ in range(round(0.5 / period)):
        kept &= policy.act(rows)[:, 3] > -0.5
    assert kept.mean() == pytest.approx(math.exp(-1.5 * 0.5), abs=0.04)
    rows[:, row.CARRYING_REQUESTED] = 1.0
    for _ in range(20):
        assert (policy.act(rows)[:, 3] == 1.0).all()


def test_a_command_follows_from_its_own_row_alone() -> None:
    rng = np.random.default_rng(0)
    world = Warehouse(Scenario(n_robots=10, warehouse_width=5, warehouse_height=4))
    rows = world.reset(0)
    whole, disturbed = fresh(10), fresh(10)
    for _ in range(30):
        scrambled = rng.permutation(rows)
        scrambled[4] = rows[4]
        commands = whole.act(rows)
        np.testing.assert_array_equal(disturbed.act(scrambled)[4], commands[4])
        rows = world.step(commands)


def test_a_robots_randomness_does_not_depend_on_who_else_is_there() -> None:
    few, many = fresh(5, seed=3), fresh(25, seed=3)
    for _ in range(10):
        commands = many.act(nothing_near(25))
        np.testing.assert_array_equal(few.act(nothing_near(5)), commands[:5])
    # And in a warehouse: who stands far from the one that is taken out does not notice.
    scenario = Scenario(n_robots=6, warehouse_width=30, warehouse_height=30)
    whole, less = Warehouse(scenario), Warehouse(scenario)
    rows, fewer = whole.reset(1), less.reset(1, [Fault("removed", (3,))])
    away = np.linalg.norm(whole.state.robot_position - whole.state.robot_position[3], axis=1)
    unconcerned = away > 6.0
    assert unconcerned.any()
    first, second = fresh(6), fresh(6)
    for _ in range(5):
        commands, others = first.act(rows), second.act(fewer)
        np.testing.assert_array_equal(commands[unconcerned], others[unconcerned])
        rows, fewer = whole.step(commands), less.step(others)


def test_reset_begins_anew_and_seeds_differ() -> None:
    policy, rows = fresh(3, seed=1), nothing_near(3)
    first = [policy.act(rows) for _ in range(4)]
    policy.reset(3, 1)
    np.testing.assert_array_equal(first, [policy.act(rows) for _ in range(4)])
    policy.reset(3, 2)
    assert not np.array_equal(first[0], policy.act(rows))


def test_commands_stay_within_bounds_in_a_crowd() -> None:
    world = Warehouse(Scenario(n_robots=40, n_items=40, warehouse_width=5, warehouse_height=4))
    rows, policy = world.reset(0), fresh(40)
    for _ in range(50):
        commands = policy.act(rows)
        assert np.isfinite(commands).all()
        assert (np.abs(commands) <= 1.0).all()
        assert (np.hypot(commands[:, 0], commands[:, 1]) <= 1.0 + 1e-12).all()
        rows = world.step(commands)


def test_rows_for_another_number_of_robots_are_refused() -> None:
    with pytest.raises(PolicyError, match="observations of 4 robots: reset was told 3"):
        fresh(3).act(nothing_near(4))


def test_every_constant_says_whether_it_has_a_source_or_was_fitted() -> None:
    for name, field in SwarmDTParameters.model_fields.items():
        origin = (field.description or "").rsplit("; ", 1)[-1]
        kind, _, source = origin.partition(": ")
        assert kind in ("source", "fitted"), name
        assert source in (SOURCES if kind == "source" else {""}), name
