"""Robots that are carried out of the arena, and those that come back."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Fault, Scenario, Warehouse
from swarm_logistics_env.core.errors import BodiesError
from swarm_logistics_env.world.warehouse.state import CARRIED, NOBODY, STORED
from tests.world.warehouse.conftest import EAST, FAR, HOLD, INSIDE, OPEN, STAY, WEST, Build, steps
from verification.invariants import Watch


def test_who_is_away_is_nowhere_and_comes_back_as_it_stood_with_nothing_in_mind(
    build: Build,
) -> None:
    away = [Fault("away", (0,), onset=0.5, duration=0.5)]
    world = build([(7.9, 5.0), (2.0, 2.0)], [(7.9, 5.1), FAR], away, max_speed=2.0)
    state = world.state
    turning = (0.0, 0.0, 1.0, 1.0)
    steps(world, EAST, STAY, times=2)
    steps(world, turning, STAY, times=2)
    assert state.robot_timer[0] == 0.0  # it was in the delivery area
    steps(world, OPEN, STAY)
    place = state.robot_position[1].copy()
    assert not state.robot_present[0]
    assert state.robot_away.tolist() == [True, False]
    left_at = state.robots.left_at[0].copy()
    for _ in range(4):
        rows = steps(world, EAST, EAST)
        assert not rows[0].any()
        assert rows[1].any()
    assert (world.n_removed, state.failure_modes[0]) == (0, ("away",))
    assert state.robot_position[1, 0] > place[0]
    rows = steps(world, EAST, STAY)
    assert state.robot_present.all()
    assert not state.robot_away.any()
    assert [*state.robot_position[0], state.robot_heading[0]] == left_at.tolist()
    assert not state.robot_velocity[0].any()
    assert np.isnan(state.robot_timer[0])
    assert (state.robot_memory[0] == NOBODY).all()
    assert rows[0].any()
    rows = steps(world, EAST, STAY, times=3)
    assert state.robot_position[0, 0] > left_at[0]  # it obeys, and its body is there


def test_what_it_carried_lies_where_it_stood_and_it_lifts_that_again(build: Build) -> None:
    away = [Fault("away", (0,), onset=0.2, duration=0.3)]
    world = build([(2.0, 5.0)], [(2.0, 5.1), FAR], away)
    state = world.state
    steps(world, HOLD)
    assert state.item_status[0] == CARRIED
    steps(world, HOLD)
    assert (state.item_status[0], state.robot_item[0]) == (STORED, NOBODY)
    steps(world, HOLD, times=3)
    assert state.robot_present[0]
    steps(world, HOLD)
    assert state.robot_item[0] == 0


def test_where_somebody_stands_now_it_comes_back_beside_and_pushes_nobody(build: Build) -> None:
    away = [Fault("away", (0,), onset=0.1, duration=2.0)]
    world = build([(3.0, 5.0), (2.2, 5.0)], [FAR], away, max_speed=1.0)
    state = world.state
    steps(world, STAY, EAST, times=8)
    steps(world, STAY, STAY, times=12)
    other = state.robot_position[1].copy()
    assert np.hypot(*(other - (3.0, 5.0))) < 0.1
    steps(world, STAY, STAY)
    apart = np.hypot(*(state.robot_position[0] - other))
    diameter = 2.0 * world.scenario.robot_radius
    assert diameter <= apart < 1.5 * diameter
    steps(world, STAY, STAY, times=5)
    np.testing.assert_allclose(state.robot_position[1], other, atol=1e-9)


def test_where_there_is_no_room_it_waits_and_a_copy_waits_alike(build: Build) -> None:
    # With one robot in the middle there is no room for another of this size.
    narrow: dict[str, Any] = {
        "warehouse_width": 2.9, "warehouse_height": 1.42, "delivery_width": 0.1,
        "robot_radius": 0.5, "max_speed": 1.0,
    }  # fmt: skip
    away = [Fault("away", (0,), onset=0.1, duration=2.0)]
    world = build([(0.6, 0.71), (2.35, 0.71)], [(0.2, 0.2)], away, **narrow)
    state = world.state
    steps(world, STAY, WEST, times=9)
    steps(world, STAY, STAY, times=16)
    assert abs(state.robot_position[1, 0] - 1.45) < 0.02
    assert state.failure_modes[0] == ()  # nothing keeps it out but the other one
    assert (state.robot_away[0], state.robot_present[0]) == (True, False)
    copied = copy.deepcopy(world)
    for _ in range(12):
        rows = steps(world, STAY, EAST)
        np.testing.assert_array_equal(steps(copied, STAY, EAST), rows)
    assert state.robot_present[0]
    assert np.hypot(*(state.robot_position[0] - (0.6, 0.71))) < 0.4


@pytest.mark.unmeasured
@pytest.mark.parametrize("floor", [None, "aisles"])
def test_crowds_that_come_and_go_stand_in_nobodys_way(floor: str | None) -> None:
    size: dict[str, Any] = {}
    if floor is None:
        size = {"warehouse_width": 4.0, "warehouse_height": 2.0}
    scenario = Scenario(
        n_robots=14, n_items=6, n_obstacles=2, obstacle_radius=0.2, restock=True, floor=floor,
        pickup_range=0.6, **size,
    )  # fmt: skip
    world = Warehouse(scenario)
    world.reset(3, [Fault("away", 10, intermittent=(1.0, 1.0)), "removed:2@6", "FM4:3@2+3"])
    watch, rng = Watch(world), np.random.default_rng(3)
    n_returns = 0
    copied = None
    for step in range(120):
        was_present = world.state.robot_present.copy()
        commands = rng.uniform(-1.0, 1.0, (14, 4))
        commands[:, 0] = 1.0
        rows = world.step(commands)
        watch.look()
        returned = np.flatnonzero(world.state.robot_present & ~was_present)
        n_returns += len(returned)
        # No nearer to robots than touching, and to walls not deeper than bodies rest.
        assert (watch.depth[returned, :14] <= 1e-9).all()
        assert (watch.depth[returned] <= 0.001 + 1e-9).all()
        if step == 60:
            copied = copy.deepcopy(world)
        elif copied is not None:
            assert copied.step(commands).tobytes() == rows.tobytes()
    assert n_returns > 20
    assert world.n_removed == 2


def test_a_repair_brings_back_and_who_is_removed_meanwhile_stays_away(build: Build) -> None:
    away = Fault("away", (0, 1), duration=60.0)
    world = build([(2.0, 2.0), (3.0, 3.0), (INSIDE, 5.0)], [FAR], [away])
    world.set_faults([away, Fault("removed", (1,))])
    steps(world, STAY, STAY, STAY)
    assert (world.n_removed, world.state.robot_away.tolist()) == (1, [True, False, False])
    world.set_faults([])
    assert world.state.robot_present.tolist() == [True, False, True]
    assert world.state.robot_position[0].tolist() == [2.0, 2.0]
    steps(world, STAY, STAY, STAY)
    world.set_faults([away])  # who is removed is not carried out any more
    assert world.state.robot_away.tolist() == [True, False, False]


def test_bodies_of_others_that_cannot_put_it_back_refuse_before_anything_is_played() -> None:
    world = Warehouse(Scenario(n_robots=3, n_items=2))
    world.reset(0)
    before = world.observe()
    other = Scenario(n_robots=3, n_items=2, bodies="mujoco")
    with pytest.raises(BodiesError, match=r'away: bodies = mujoco cannot .* should be "dead"'):
        world.reset(0, ["away:1@5+5"], other)
    assert world.observe() is before
    assert world.scenario.bodies == "chipmunk"
