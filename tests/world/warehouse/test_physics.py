"""Bodies in motion: speeds, collisions, jams, and what lies in whose way."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from pymunk._chipmunk_cffi import ffi, lib

from swarm_logistics_env import Fault, Warehouse
from swarm_logistics_env.compiler.packing import blank, packed
from swarm_logistics_env.core.errors import SetupError
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.warehouse import physics
from swarm_logistics_env.world.warehouse.structs import Items
from tests.world.warehouse.conftest import EAST, FAR, HOLD, OPEN, STAY, WEST, Build, steps

DIAMETER = 0.25
SUSTAINED = 0.02  # [m], how far bodies may sink into each other under steady pressure
CLOSING = 2 * 2.0 * 0.02  # [m], what two robots at top speed close in one physics step


def deepest_overlap(world: Warehouse) -> float:
    position = world.state.robot_position[world.state.robot_present]
    gaps = np.linalg.norm(position[:, None] - position[None], axis=2)
    return float(DIAMETER - gaps[~np.eye(len(position), dtype=bool)].min())


@pytest.mark.parametrize("gap", [0.3, 0.35, 0.425])
def test_two_robots_that_meet_head_on_never_pass_through_each_other(
    build: Build, gap: float
) -> None:
    # One physics step per control step, so that each is looked at.
    world = build([(4.0, 5.0), (4.0 + gap + 1.0, 5.0)], [FAR], control_period=0.02)
    pushed = build([(2.0, 5.0), (3.0, 5.0)], [FAR], [Fault("dead", (1,))], control_period=0.02)
    for _ in range(100):
        steps(world, EAST, WEST)
        assert deepest_overlap(world) <= CLOSING
        assert world.state.robot_position[0, 0] < world.state.robot_position[1, 0]
        steps(pushed, EAST, EAST)
        assert deepest_overlap(pushed) <= CLOSING
    assert abs(deepest_overlap(world)) <= SUSTAINED
    assert pushed.state.robot_position[1, 0] > max(pushed.state.robot_position[0, 0], 3.1)
    assert world.state.robot_heading.tolist() == [0.0, 0.0]  # no collision turns a robot


@pytest.mark.parametrize(("top", "acceleration"), [(2.0, 20.0), (1.0, 2.0)])
def test_a_robot_speeds_up_to_its_top_speed_and_stops_again(
    build: Build, top: float, acceleration: float
) -> None:
    world = build([(1.0, 5.0)], [FAR], max_speed=top, max_acceleration=acceleration)
    needed = math.ceil(top / acceleration / 0.1 + 1e-9)
    speeds = [0.0]
    for _ in range(needed):
        steps(world, EAST)
        speeds.append(world.state.robot_velocity[0, 0])
    assert max(np.diff(speeds)) <= acceleration * 0.1 * 1.01
    assert speeds[-1] == pytest.approx(top, rel=0.01)
    start = world.state.robot_position[0, 0]
    steps(world, EAST)
    assert world.state.robot_position[0, 0] - start == pytest.approx(top * 0.1, rel=0.01)
    steps(world, STAY, times=needed)
    assert world.state.robot_velocity[0, 0] == pytest.approx(0.0, abs=1e-3)


def test_robots_of_unlike_sizes_touch_at_their_edges_and_the_heavier_one_gets_its_way(
    build: Build,
) -> None:
    kinds = "heavy robot_mass=6.0, small robot_radius=0.06 robot_mass=2.0"
    robots = [(4.0, 5.0), (5.0, 5.0)]
    world = build(robots, [FAR], max_acceleration=1.0, robot_radius=0.25, robot_kinds=kinds)
    state = world.state
    while not state.robot_contact.any():
        assert state.robot_position[1, 0] - state.robot_position[0, 0] > 0.25 + 0.06
        steps(world, EAST, WEST)
    assert state.robot_contact.all()
    before = state.robot_position[:, 0].copy()
    rows = steps(world, EAST, WEST, times=10)
    moved = state.robot_position[:, 0] - before
    assert (moved > 0.2).all()
    assert state.robot_position[1, 0] - state.robot_position[0, 0] == pytest.approx(0.31, abs=0.01)
    ahead = rows[[0, 1], [row.RANGE_ROBOTS, row.RANGE_ROBOTS + row.N_BEAMS // 2]]
    assert ahead.tolist() == pytest.approx([0.25, 0.06], abs=0.01)
    assert state.contacts.n_contacts[0] == 1


def test_a_laden_robot_does_not_drive_through_an_item(build: Build) -> None:
    world = build([(2.0, 5.0)], [FAR, (2.0, 5.1), (3.0, 5.0)], pickup_range=0.15)
    steps(world, HOLD)
    for _ in range(20):
        steps(world, EAST)
        away = np.linalg.norm(world.state.robot_position[0] - [3.0, 5.0])
        assert away >= DIAMETER - CLOSING / 2
    assert world.state.robot_item[0] == 1
    assert world.state.robot_position[0, 0] == pytest.approx(2.75, abs=SUSTAINED)
    assert world.state.item_position[2].tolist() == [3.0, 5.0]  # it stays put


def test_a_robot_that_lifts_above_other_items_is_not_pushed_off_them(build: Build) -> None:
    above = [(2.0, 5.1), (2.1, 5.15), (1.9, 5.15), (2.0, 4.8)]
    world = build([(2.0, 5.0)], [FAR, *above], pickup_range=0.15)
    alone = build([(2.0, 5.0)], [FAR, above[0]], pickup_range=0.15)
    for command in [HOLD, *[STAY] * 5, *[EAST] * 10]:
        steps(world, command)
        alone.step([command])
        np.testing.assert_array_equal(world.state.robot_position, alone.state.robot_position)
        assert not world.state.robot_contact[0]
    assert world.state.robot_item[0] == 1
    assert world.state.robot_velocity[0, 0] == pytest.approx(2.0)


def test_an_item_put_down_beneath_a_laden_robot_does_not_push_it(build: Build) -> None:
    # Items are wider than robots here: what robot 0 puts down reaches below robot 1.
    items = [FAR, (2.0, 5.0), (2.3, 5.0)]
    world = build([(2.0, 5.0), (2.26, 5.0)], items, item_radius=0.2, pickup_range=0.1)
    steps(world, HOLD, HOLD)
    steps(world, OPEN, STAY)
    steps(world, STAY, STAY, times=5)
    np.testing.assert_allclose(world.state.robot_position, [[2.0, 5.0], [2.26, 5.0]], atol=1e-3)
    assert world.state.item_covered[1] == 1
    steps(world, STAY, EAST, times=10)
    assert world.state.item_covered[1] == 0


def test_an_item_is_in_the_way_where_it_was_put_down_and_nowhere_else(build: Build) -> None:
    # Robot 0 carries item 1 from x = 2 to 4 and leaves it; robot 1, laden, then comes along.
    items = [FAR, (2.0, 5.1), (1.0, 5.1)]
    world = build([(2.0, 5.0), (1.0, 5.0)], items, pickup_range=0.15)
    steps(world, HOLD, HOLD)
    while world.state.robot_position[0, 0] < 4.0:
        steps(world, EAST, STAY)
    steps(world, OPEN, STAY)
    left_at = world.state.item_position[1, 0]
    steps(world, (0.0, 1.0, 0.0, 0.0), STAY, times=5)
    steps(world, STAY, EAST, times=30)
    assert world.state.robot_position[1, 0] == pytest.approx(left_at - DIAMETER, abs=SUSTAINED)


def test_an_array_that_is_not_as_declared_is_refused_before_a_kernel_reads_it() -> None:
    items = blank(Items, {"I": 4})
    wrong: list[Any] = [items.position.astype("f4"), items.position[0], items.position[::2].T]
    for position in wrong:
        with pytest.raises(TypeError, match=r"Items\.position: should be"):
            packed(items._replace(position=position))


def test_bodies_are_read_and_pushed_where_the_engine_has_them(build: Build) -> None:
    world = build([(2.0, 5.0), (3.0, 6.0)], [FAR])
    engine = world._world.engine
    steps(world, EAST, (0.3, 0.4, 0.0, 0.0))
    for address, (x, y, velocity_x, velocity_y) in zip(engine.robot_bodies, engine.bodies):
        body = ffi.cast("cpBody *", int(address))
        position, velocity = lib.cpBodyGetPosition(body), lib.cpBodyGetVelocity(body)
        assert (position.x, position.y) == (x, y)
        assert (velocity.x, velocity.y) == (velocity_x, velocity_y) != (0.0, 0.0)


def test_an_engine_whose_bodies_are_otherwise_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(physics, "N_WORDS", 8)
    with pytest.raises(SetupError, match="should be pymunk 7"):
        physics._body_words()
