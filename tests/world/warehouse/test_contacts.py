"""Contacts: what counts as one, how fast it closed, how deep overlaps are, and accelerations."""

from __future__ import annotations

import pickle
from dataclasses import astuple

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import Fault, Scenario, Warehouse, policies, run_episode
from swarm_logistics_env.policies.homing import Homing
from swarm_logistics_env.world.warehouse.contacts import ContactMeasures
from tests.made_up import CAREFUL
from tests.world.warehouse.conftest import EAST, FAR, STAY, WEST, Build, steps

DIAMETER, PERIOD = 0.25, 0.1


def trajectory(world: Warehouse, n_steps: int) -> tuple[NDArray[np.float64], ...]:
    """Drive two robots at each other.

    Returns their positions and velocities, (steps + 1, 2, 2), and how fast they ran into each
    other in each step, (steps, 2).
    """
    state = world.state
    places, speeds, closing = [state.robot_position.copy()], [state.robot_velocity.copy()], []
    for _ in range(n_steps):
        steps(world, EAST, WEST)
        places.append(state.robot_position.copy())
        speeds.append(state.robot_velocity.copy())
        closing.append(state.contacts.closing.copy())
    return np.array(places), np.array(speeds), np.array(closing)


@pytest.mark.parametrize(("top", "is_fast"), [(2.0, True), (0.4, False)])
def test_two_robots_that_meet_head_on_have_one_contact_as_fast_as_they_close(
    build: Build, top: float, is_fast: bool
) -> None:
    world = build([(4.0, 5.0), (5.0, 5.0)], [FAR], max_speed=top)
    places, speeds, closing_speeds = trajectory(world, 20)
    gaps = np.linalg.norm(places[:, 0] - places[:, 1], axis=1) - DIAMETER
    (meeting,) = np.flatnonzero((gaps[1:] < 0.0) & (gaps[:-1] >= 0.0))
    closing = speeds[meeting, 0, 0] - speeds[meeting, 1, 0]
    assert closing == pytest.approx(2 * top)
    lengths = np.linalg.norm(np.diff(speeds, axis=0), axis=2) / PERIOD
    counted = world.state.contact_measures
    assert counted.contacts_per_robot_minute == pytest.approx(60.0 / (20 * PERIOD))
    assert counted.fast_contacts == is_fast
    assert closing_speeds[meeting].tolist() == pytest.approx([2 * top, 2 * top])
    assert closing_speeds.sum() == pytest.approx(4 * top)
    assert counted.overlap_share == pytest.approx(np.mean(gaps[1:] < -0.01))
    assert counted.mean_acceleration == pytest.approx(lengths.mean())
    assert counted.p95_acceleration == pytest.approx(np.quantile(lengths, 0.95), rel=0.1)


def test_a_contact_begins_anew_only_after_the_robots_parted(build: Build) -> None:
    world = build([(4.0, 5.0), (4.5, 5.0)], [FAR], [Fault("dead", (1,))], max_speed=1.0)
    for _ in range(3):
        steps(world, EAST, STAY, times=20)
        steps(world, WEST, STAY, times=4)
    assert world.state.contacts.n_contacts[0] == 3


def test_a_robot_alone_or_beside_others_has_no_contact_though_it_hits_walls(build: Build) -> None:
    alone = build([(0.5, 5.0)], [FAR])
    steps(alone, WEST, times=20)
    assert alone.state.robot_contact[0]
    assert astuple(alone.state.contact_measures)[:3] == (0.0, None, 0.0)
    abreast = build([(4.0, 5.0), (4.0, 5.3)], [FAR])
    steps(abreast, EAST, EAST, times=20)
    assert astuple(abreast.state.contact_measures)[:3] == (0.0, None, 0.0)


def test_a_percentile_of_many_accelerations_is_near_the_exact_one() -> None:
    world, policy = Warehouse(Scenario(n_robots=25)), policies.load("swarm-dt")
    rows, before, lengths = world.reset(0), world.state.robot_velocity.copy(), []
    policy.reset(25, 0)
    for _ in range(300):
        rows = world.step(policy.act(rows))
        lengths.append(np.linalg.norm(world.state.robot_velocity - before, axis=1) / PERIOD)
        before = world.state.robot_velocity.copy()
    counted = world.state.contact_measures
    assert counted.mean_acceleration == pytest.approx(np.mean(lengths))
    assert counted.p95_acceleration == pytest.approx(np.quantile(lengths, 0.95), abs=0.05)


def test_removed_robots_are_not_counted(build: Build) -> None:
    places = [(4.0, 5.0), (4.6, 5.0), (5.2, 5.0)]
    world = build(places, [FAR], [Fault("removed", (1, 2), onset=0.5)])
    steps(world, STAY, STAY, STAY, times=20)
    assert world.state.contacts.accelerations.sum() == 3 * 5 + 15
    nobody = build(places, [FAR], [Fault("removed", (0, 1, 2))])
    steps(nobody, STAY, STAY, STAY, times=5)
    assert nobody.state.contact_measures == ContactMeasures()


def test_a_copy_and_a_world_that_begins_again_count_the_same() -> None:
    scenario = Scenario(n_robots=25, warehouse_width=5, warehouse_height=5, duration=20.0)
    commands = np.random.default_rng(0).uniform(-1.0, 1.0, (200, 25, 4))
    world = Warehouse(scenario)
    measures = []
    for _ in range(2):
        world.reset(3)
        for number, command in enumerate(commands):
            if number == 100:
                world = pickle.loads(pickle.dumps(world))
            world.step(command)
        measures.append(world.state.contact_measures)
    assert measures[0] == measures[1]
    assert measures[0].contacts_per_robot_minute


def test_homing_meets_as_often_as_was_measured_apart_from_this_code() -> None:
    homing = Homing(**CAREFUL)
    # Another program counted .5 contacts a robot-minute on other seeds.
    counted = run_episode(Scenario(n_robots=25, duration=100.0), homing, 0).contacts
    assert counted.contacts_per_robot_minute == pytest.approx(0.5, abs=0.4)
