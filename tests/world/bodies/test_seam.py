"""A slow reference of what differs where others move the bodies: orders out, poses in."""

from __future__ import annotations

import math
import random
from copy import deepcopy
from typing import cast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarm_logistics_env import Scenario, Warehouse
from swarm_logistics_env.world.bodies import Poses
from swarm_logistics_env.world.warehouse.commands import IDLE
from swarm_logistics_env.world.warehouse.state import NOBODY, WarehouseState
from tests.verification.test_combined_faults import commands_of, planned_faults
from tests.world.bodies.test_bodies import Watched
from verification.reference import Able, Faults, Planned

STEPS = 30
Motion = list[float]  # forward and left [m/s], turn rate [rad/s]
Pose = tuple[float, float, float]  # x, y [m], heading [rad]


def wanted_motion(scenario: Scenario, command: list[float], able: Able, drift: float) -> Motion:
    """Return what a robot that may drive wants, as the pages on commands and bodies say."""
    forward, left, turn = (min(max(number, -1.0), 1.0) for number in command[:3])
    if scenario.drive == "differential":
        left = 0.0
    length = math.hypot(forward, left)
    if length > 1.0:
        forward, left = forward / length, left / length
    if able["max_turn_rate"] == 0.0:  # a dead motor does not even drift
        drift = 0.0
    top = able["max_speed"]
    return [top * forward, top * left, turn * able["max_turn_rate"] + drift]


def where_it_is(scenario: Scenario, start: list[float], heading: float, motion: Motion) -> Pose:
    """Return where a robot is that did what it wanted, kept within the walls."""
    forward, left, turn_rate = motion
    period = scenario.control_period
    x = start[0] + period * (math.cos(heading) * forward - math.sin(heading) * left)
    y = start[1] + period * (math.sin(heading) * forward + math.cos(heading) * left)
    x = min(max(x, 0.0), scenario.warehouse_width)
    y = min(max(y, 0.0), scenario.warehouse_height)
    return x, y, heading + period * turn_rate


@st.composite
def worlds(draw: st.DrawFn) -> tuple[Scenario, tuple[Planned, ...], int]:
    n_robots = draw(st.integers(2, 5))
    scenario = Scenario(
        bodies="tests.world.bodies.test_bodies:Watched", n_robots=n_robots,
        n_items=draw(st.integers(1, 4)),
        warehouse_width=2.5, warehouse_height=1.6, delivery_width=0.8, duration=STEPS * 0.1,
        restock=True, pickup_range=0.6, heading_drift=0.5, message_size=1,
        handling_time=draw(st.sampled_from([0.0, 0.3])),
        speed_mix=draw(st.sampled_from([(1.0,), (1.0, 0.5)])),
        drive=draw(st.sampled_from(["holonomic", "differential"])),
        robot_kinds=draw(st.sampled_from(["", "plain, wheels drive=differential"])),
    )  # fmt: skip
    planned = draw(st.lists(planned_faults(n_robots), max_size=2).map(tuple))
    return scenario, planned, draw(st.integers(0, 2**32))


@pytest.mark.daily
@given(case=worlds())
@settings(max_examples=60 if settings().max_examples < 2000 else 2000)
def test_orders_and_poses_are_as_the_reference_says(
    case: tuple[Scenario, tuple[Planned, ...], int],
) -> None:
    scenario, planned, seed = case
    world, rng = Warehouse(scenario), random.Random(seed)
    world.reset(seed, [fault.fault(scenario.control_period) for fault in planned])
    faults = Faults(scenario, seed, planned)
    bodies, before = watched_of(world), deepcopy(world.state)
    able = faults.expected(world, before)
    for _ in range(STEPS):
        commands = commands_of(world, rng)
        motions = expected_motions(before, commands, able, world)
        starts = [*zip(bodies.position.tolist(), bodies.heading.tolist())]
        world.step(commands)
        orders, now = bodies.orders[-1], world.state
        assert orders.motion.ravel().tolist() == pytest.approx(np.ravel(motions))
        assert orders.laden.tolist() == [item != NOBODY for item in before.robot_item]
        assert orders.present.tolist() == before.robot_present.tolist()
        expected = [where_it_is(scenario, *start, m) for start, m in zip(starts, motions)]
        check_poses(before, now, expected, bodies.poses)
        faults.gone = [gone or not present for gone, present in zip(faults.gone, now.robot_present)]
        able = faults.expected(world, before)  # whom a role struck, it tells from both moments
        before = deepcopy(now)


def watched_of(world: Warehouse) -> Watched:
    assert world._elsewhere is not None
    return cast("Watched", world._elsewhere._bodies)  # whose module the world imported for itself


def expected_motions(
    state: WarehouseState, commands: list[list[float]], able: list[Able], world: Warehouse
) -> list[Motion]:
    """Return what each robot wants; who is dead, gone or handles an item stands."""
    is_busy = world._world.robots.handling[:, 0] != IDLE
    motions = []
    for robot, command in enumerate(commands):
        motion = [0.0, 0.0, 0.0]
        if able[robot]["present"] and able[robot]["obeys"] and not is_busy[robot]:
            drift = float(state.robot_heading_drift[robot])
            motion = wanted_motion(world.scenario, command, able[robot], drift)
        motions.append(motion)
    return motions


def check_poses(
    before: WarehouseState, now: WarehouseState, expected: list[Pose], poses: Poses
) -> None:
    """Compare where robots and carried items are; a lost robot is gone, and its item stays."""
    for robot, (x, y, heading) in enumerate(expected):
        if poses.lost[robot]:
            assert not now.robot_present[robot]
            assert now.robot_item[robot] == NOBODY
        if not now.robot_present[robot]:
            continue
        assert now.robot_position[robot].tolist() == pytest.approx([x, y])
        error = math.remainder(heading - float(now.robot_heading[robot]), 2.0 * math.pi)
        assert error == pytest.approx(0.0, abs=1e-9)
        item = now.robot_item[robot]
        if item != NOBODY and item == before.robot_item[robot]:
            assert now.item_position[item].tolist() == pytest.approx([x, y])
    assert np.isfinite(now.item_position).all()
