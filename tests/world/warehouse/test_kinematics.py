from __future__ import annotations

import cmath
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from swarm_logistics_env import Fault, Scenario, Warehouse
from swarm_logistics_env.compiler.addresses import unpacked_at
from swarm_logistics_env.compiler.kernels import kernel
from swarm_logistics_env.compiler.packing import packed
from swarm_logistics_env.world.observations import TURN_RATE
from swarm_logistics_env.world.warehouse.commands import drive
from swarm_logistics_env.world.warehouse.structs import NOBODY, World
from tests.world.warehouse.conftest import HOLD, Build, steps


@kernel
def drive_at(address: int) -> None:
    """Drive the robots of the world at an address: as `test_layout.restock_at`."""
    drive(unpacked_at(World, address))


@given(
    commands=st.lists(st.floats(-2.0, 2.0), min_size=4, max_size=4),
    heading=st.floats(-math.pi, math.pi),
    period=st.floats(0.01, 3.0),
    is_holonomic=st.booleans(),
)
@example([1.0, 1.0, 0.0, 0.0], 0.0, 0.1, True)  # no faster askew
def test_a_robot_drives_along_its_mean_direction_at_most_at_its_top_speed(
    commands: list[float], heading: float, period: float, is_holonomic: bool
) -> None:
    still = Warehouse(Scenario(n_robots=2, heading_drift=0.0))
    still.reset(0)
    parameters = still._world.parameters._replace(control_period=period)
    world = still._world._replace(parameters=parameters)
    robots, able, wanted = world.robots, world.able, world.engine.wanted_velocity
    robots.heading[:], able.obeys[:], wanted[:] = heading, [True, False], 9.0
    able.max_speed[:], able.max_turn_rate[:], able.is_holonomic[:] = 2.0, 6.0, is_holonomic
    world.commands.now[:] = commands
    words = packed(world)
    drive_at(words.ctypes.data)
    forward, left, turn = np.clip(commands[:3], -1.0, 1.0)
    velocity = complex(forward, left if is_holonomic else 0.0)
    velocity *= (
        2.0 / max(abs(velocity), 1.0) * cmath.exp(1j * (heading + 0.5 * turn * 6.0 * period))
    )
    assert wanted[0] == pytest.approx([velocity.real, velocity.imag], abs=1e-9)
    turned = float(robots.heading[0])
    assert abs(turned) <= math.pi + 1e-12
    assert math.remainder(turned - heading - turn * 6.0 * period, math.tau) == pytest.approx(0.0)
    assert (wanted[1].tolist(), robots.heading[1]) == ([0.0, 0.0], heading)


def test_kinds_drive_gather_speed_and_lift_as_they_can(build: Build) -> None:
    robots = [(2.0, y) for y in (2.0, 4.0, 6.0, 8.0)]
    kinds = "plain, wheels drive=differential, slow max_acceleration=1.0, scout lifts=false"
    world = build(robots, robots, robot_kinds=kinds)
    steps(world, *[HOLD] * 4)
    assert (world.state.robot_item != NOBODY).tolist() == [True, True, True, False]
    steps(world, *[(1.0, 1.0, 0.0, 1.0)] * 4)
    plain, wheels, slow, _ = world.state.robot_velocity.tolist()
    assert plain == pytest.approx([math.sqrt(2.0), math.sqrt(2.0)])
    assert wheels == pytest.approx([2.0, 0.0])
    assert math.hypot(*slow) == pytest.approx(0.1)  # after 0.1 s


def test_every_robot_drifts_at_a_rate_of_its_own_that_depends_on_no_other() -> None:
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
def test_headings_drift_at_constant_rates_of_robots_that_can_move(drive_kind: Any) -> None:
    world = Warehouse(Scenario(n_robots=6, heading_drift=0.1, drive=drive_kind))
    world.reset(0, [Fault("dead", (0,)), Fault("motor_dead", (1,)), Fault("removed", (2,))])
    before = world.state.robot_heading.copy()
    for _ in range(50):
        world.step(np.tile([1.0, 0.0, 0.0, 0.0], (6, 1)))
    turned = np.remainder(world.state.robot_heading - before + np.pi, math.tau) - np.pi
    wanted = 5.0 * world.state.robot_heading_drift * [0, 0, 0, 1, 1, 1]
    np.testing.assert_allclose(turned, wanted, atol=1e-9)
    assert turned.any()


@pytest.mark.parametrize("bodies", ["chipmunk", "tests.world.bodies.test_bodies:Exact"])
def test_a_gyro_tells_turns_without_the_drift_so_robots_that_stand_feel_their_drift(
    bodies: str,
) -> None:
    world = Warehouse(Scenario(n_robots=4, heading_drift=0.2, bodies=bodies))
    world.reset(0, [Fault("dead", (0,)), Fault("motor_slow", (1,)), Fault("removed", (2,))])
    drift = world.state.robot_heading_drift.copy()
    slow = 0.5 * world.state.max_turn_rate[1]
    for _ in range(30):  # more than half a turn
        rows = world.step(np.tile([0.0, 0.0, 0.5, 0.0], (4, 1)))
        expected = [-drift[0], slow, 0.0, 3.0]
        np.testing.assert_allclose(rows[:, TURN_RATE], expected, atol=1e-5)


def test_the_gyro_of_a_robot_that_drifts_alone_tells_exactly_nothing() -> None:
    world = Warehouse(Scenario(heading_drift=0.3))
    world.reset(0)
    for _ in range(20):
        rows = world.step(np.tile([1.0, 0.5, 0.0, 0.0], (25, 1)))
        assert not rows[:, TURN_RATE].any()
