from __future__ import annotations

import copy
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import ArrayLike, NDArray

from swarm_logistics_env import Fault, Scenario, Warehouse
from swarm_logistics_env.warehouse.logistics import drive, refused_command
from swarm_logistics_env.warehouse.packing import blank
from swarm_logistics_env.warehouse.structs import (
    NOBODY,
    Capabilities,
    blank_robots,
    lengths_of,
    parameters_of,
)


def one_robot(heading: float = 0.0, obeys: bool = True, **fields: Any) -> tuple[Any, ...]:
    """Return robots, capabilities and parameters of one robot of 2 m/s and 6 rad/s."""
    scenario = Scenario(n_robots=1, **fields)
    lengths = lengths_of(scenario)
    robots, able = blank_robots(lengths), blank(Capabilities, lengths)
    robots.heading[:], able.obeys[:] = heading, obeys
    able.max_speed[:], able.max_turn_rate[:] = 2.0, 6.0
    return robots, able, parameters_of(scenario)


def driven(
    commands: ArrayLike, heading: float = 0.0, obeys: bool = True, period: float = 0.1
) -> tuple[NDArray[np.float64], float]:
    """Return the wanted velocity [m/s] and the new heading of one robot of 2 m/s and 6 rad/s."""
    robots, able, parameters = one_robot(heading, obeys)
    wanted = np.full((1, 2), 9.0)
    given_row = np.array([commands], dtype=np.float64)
    drive(given_row, robots, able, parameters._replace(control_period=period), wanted)
    return wanted[0], float(robots.heading[0])


@pytest.mark.parametrize(
    ("commands", "heading", "velocity"),
    [
        ((1.0, 0.0, 0.0, 0.0), 0.0, (2.0, 0.0)),
        ((0.5, 0.0, 0.0, 0.0), math.pi / 2, (0.0, 1.0)),
        ((0.0, 1.0, 0.0, 0.0), 0.0, (0.0, 2.0)),
        ((0.0, 1.0, 0.0, 0.0), math.pi / 2, (-2.0, 0.0)),
        ((-1.0, 0.0, 0.0, 0.0), 0.0, (-2.0, 0.0)),
        ((3.0, 0.0, 0.0, 0.0), 0.0, (2.0, 0.0)),  # cut
        ((1.0, 1.0, 0.0, 0.0), 0.0, (math.sqrt(2.0), math.sqrt(2.0))),  # no faster askew
        ((0.0, 0.0, 0.0, 1.0), 0.0, (0.0, 0.0)),
    ],
)
def test_forward_and_left_are_fractions_of_the_top_speed(
    commands: tuple[float, ...], heading: float, velocity: tuple[float, float]
) -> None:
    wanted, turned = driven(commands, heading)
    assert wanted == pytest.approx(velocity, abs=1e-12)
    assert turned == heading


def test_a_robot_that_turns_as_it_drives_goes_in_a_circle() -> None:
    # Speed 2 m/s at 6 rad/s: a circle of 1/3 m, closed after a turn of 2 pi.
    n_steps = 200
    place, heading = np.zeros(2), 0.0
    period = math.tau / 6.0 / n_steps
    lowest = highest = 0.0
    for _ in range(n_steps):
        wanted, heading = driven((1.0, 0.0, 1.0, 0.0), heading, period=period)
        place += wanted * period
        lowest, highest = min(lowest, place[1]), max(highest, place[1])
    assert place == pytest.approx([0.0, 0.0], abs=1e-9)
    assert highest - lowest == pytest.approx(2.0 / 3.0, rel=1e-3)
    assert heading == pytest.approx(0.0, abs=1e-9)


@given(
    st.lists(st.floats(-2.0, 2.0), min_size=4, max_size=4),
    st.floats(-math.pi, math.pi),
    st.floats(0.01, 3.0),
)
def test_speed_stays_within_the_top_and_heading_within_pi(
    commands: list[float], heading: float, period: float
) -> None:
    wanted, turned = driven(commands, heading, period=period)
    assert np.hypot(*wanted) <= 2.0 + 1e-12
    assert abs(turned) <= math.pi + 1e-12
    stood, kept = driven(commands, heading, obeys=False)
    assert (stood.tolist(), kept) == ([0.0, 0.0], heading)
    change = turned - heading - np.clip(commands[2], -1.0, 1.0) * 6.0 * period
    assert math.remainder(change, math.tau) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_the_first_command_that_is_not_finite_is_named(bad: float) -> None:
    lengths = lengths_of(Scenario(n_robots=2))
    robots, able = blank_robots(lengths), blank(Capabilities, lengths)
    able.obeys[:] = True
    commands = np.array([[1.0, 0.0, 1.0, 0.0], [0.0, 0.0, bad, bad]])
    assert refused_command(commands, robots, able) == 6
    able.obeys[1] = False
    assert refused_command(commands, robots, able) == NOBODY


# -- heading drift ------------------------------------------------------------------------------


def test_every_robot_turns_at_a_rate_of_its_own_that_depends_on_no_other() -> None:
    few, many = Warehouse(Scenario(n_robots=5)), Warehouse(Scenario(n_robots=200))
    few.reset(3)
    many.reset(3)
    rates = many.state.robot_heading_drift.copy()
    np.testing.assert_array_equal(few.state.robot_heading_drift, rates[:5])
    assert np.std(rates) == pytest.approx(0.02, rel=0.2)
    assert abs(np.mean(rates)) < 5 * 0.02 / math.sqrt(200)
    many.reset(4)
    assert not np.isclose(many.state.robot_heading_drift, rates).any()


@pytest.mark.parametrize("drive_kind", ["holonomic", "differential"])
@pytest.mark.parametrize("drift", [0.1, 0.0])
def test_headings_drift_at_constant_rates_of_robots_that_can_move(
    drive_kind: Any, drift: float
) -> None:
    world = Warehouse(Scenario(n_robots=6, heading_drift=drift, drive=drive_kind))
    world.reset(0, [Fault("dead", (0,)), Fault("motor_dead", (1,)), Fault("removed", (2,))])
    before = world.state.robot_heading.copy()
    commands = np.zeros((6, 4))
    commands[:4, 0] = 1.0
    for _ in range(50):
        world.step(commands)
    turned = np.remainder(world.state.robot_heading - before + np.pi, math.tau) - np.pi
    wanted = 5.0 * world.state.robot_heading_drift * [0, 0, 0, 1, 1, 1]
    np.testing.assert_allclose(turned, wanted, atol=1e-9)
    assert bool(turned.any()) == (drift > 0.0)
    copied = copy.deepcopy(world)
    for _ in range(10):
        np.testing.assert_array_equal(world.step(commands), copied.step(commands))
