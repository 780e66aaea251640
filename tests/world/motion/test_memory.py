from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import Fault, Scenario, policies
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.policies.episode import Play
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.motion.memory import (
    MEMORY,
    N_COLUMNS,
    OPEN,
    kept_home,
    note_command,
    remember_observation,
    wall_angle,
    watch_walls,
)
from swarm_logistics_env.world.motion.steering import nearest_items

Memory = NDArray[np.float64]


def sensed(*columns: int, item_at: float | None = None, recently_held: bool = False) -> Any:
    """A row (1, D) with 1 in some columns, and one item ahead [m], or none."""
    rows = np.zeros((1, row.N_COLUMNS), np.float32)
    rows[0, row.RANGE_WALLS : row.RANGE_WALLS + row.N_BEAMS] = 2.0  # they meet nothing
    rows[0, list(columns)] = 1.0
    if item_at is not None:
        rows[0, row.ITEMS : row.ITEMS + row.ITEM_WIDTH] = [1, item_at, 0, 0, recently_held]
    return rows


LADEN = sensed(row.CARRYING, row.CARRYING_REQUESTED)
LADEN_INSIDE = sensed(row.CARRYING, row.CARRYING_REQUESTED, row.IN_DELIVERY_AREA)


@pytest.fixture
def memory() -> Memory:
    return np.zeros((1, N_COLUMNS))


def go_on(memory: Memory, rows: Any, seconds: float) -> None:
    """Command nothing new for a while."""
    for _ in range(round(seconds / 0.1)):
        remember_observation(rows, 0.1, memory)


def hold(memory: Memory, rows: Any, times: int, gripper: float = 1.0) -> None:
    """Hold on to what is in view, and learn what came of it."""
    for _ in range(times):
        note_command(rows[0], np.array([0.0, 0.0, 0.0, gripper]), memory[0])
        remember_observation(rows, 0.1, memory)


@pytest.mark.parametrize("handling_time", [0.0, 1.5])
def test_a_robot_that_holds_the_requested_item_inside_takes_its_delivery_for_broken_for_a_while(
    memory: Memory, handling_time: float
) -> None:
    memory[0, MEMORY.handling_time] = handling_time
    hold(memory, LADEN_INSIDE, round(10 * handling_time) + 8, gripper=0.0)
    assert memory[0, MEMORY.cannot_deliver] == 0.0, "a reading may come late"
    hold(memory, LADEN_INSIDE, 4, gripper=0.0)
    assert memory[0, MEMORY.cannot_deliver] > 0.99
    memory[0, MEMORY.held] = OPEN
    go_on(memory, sensed(), 60.0)
    assert memory[0, MEMORY.cannot_deliver] == pytest.approx(0.5, abs=0.01)
    assert memory[0, MEMORY.failed] == pytest.approx(math.exp(-1.0), abs=0.01)
    go_on(memory, sensed(), 61.0)
    assert memory[0, MEMORY.cannot_deliver] == 0.0, "it may have been repaired"


def test_a_robot_that_holds_on_in_vain_takes_its_gripper_for_broken_and_tries_again_later(
    memory: Memory,
) -> None:
    for _ in range(20):  # evidence fades
        hold(memory, sensed(item_at=0.1), 1)
        memory[0, MEMORY.held] = OPEN
        go_on(memory, sensed(), 30.0)
    hold(memory, sensed(item_at=0.1), 7)
    assert memory[0, MEMORY.cannot_lift] == 0.0
    hold(memory, sensed(item_at=0.1), 4)
    memory[0, MEMORY.held] = OPEN
    go_on(memory, sensed(), 118.0)
    assert memory[0, MEMORY.cannot_lift] > 0.0
    go_on(memory, sensed(), 3.0)
    assert memory[0, MEMORY.cannot_lift] == 0.0


def test_a_lift_or_a_delivery_shows_that_the_robot_can(memory: Memory) -> None:
    hold(memory, sensed(item_at=0.1), 12)
    assert memory[0, MEMORY.cannot_lift] > 0.0
    remember_observation(sensed(row.CARRYING), 0.1, memory)
    assert memory[0, MEMORY.cannot_lift] == 0.0
    hold(memory, sensed(item_at=0.1), 9)
    assert memory[0, MEMORY.cannot_lift] == 0.0, "what it held in vain before the lift is forgotten"
    hold(memory, LADEN_INSIDE, 15, gripper=0.0)
    remember_observation(sensed(row.IN_DELIVERY_AREA), 0.1, memory)
    assert memory[0, MEMORY.cannot_deliver] == memory[0, MEMORY.delivering] == 0.0


def test_its_memory_turns_as_its_gyro_tells_whatever_was_commanded(memory: Memory) -> None:
    memory[0, MEMORY.home_x], memory[0, MEMORY.heading_y] = 1.0, 1.0
    rows = sensed()
    rows[0, row.TURN_RATE] = 2.0  # rad/s to the left, for half a second
    for _ in range(5):
        remember_observation(rows, 0.1, memory)
    home = math.atan2(memory[0, MEMORY.home_y], memory[0, MEMORY.home_x])
    heading = math.atan2(memory[0, MEMORY.heading_y], memory[0, MEMORY.heading_x])
    assert home == pytest.approx(-1.0, abs=1e-6)
    assert heading == pytest.approx(0.5 * math.pi - 1.0, abs=1e-6)
    assert memory[0, MEMORY.wall] == pytest.approx(-1.0, abs=1e-6)


@pytest.mark.parametrize(
    "rows", [sensed(), sensed(item_at=0.3), sensed(item_at=0.1, recently_held=True)]
)
def test_nothing_is_held_in_vain_where_nothing_can_be_lifted(memory: Memory, rows: Any) -> None:
    hold(memory, rows, 20)
    assert memory[0, MEMORY.in_vain] == memory[0, MEMORY.cannot_lift] == 0.0
    hold(memory, LADEN, 1)
    remember_observation(sensed(item_at=0.1), 0.1, memory)  # it delivered, and holds on
    hold(memory, sensed(item_at=0.1), 9)
    assert memory[0, MEMORY.cannot_lift] == 0.0


def test_the_border_sets_right_how_far_it_is_home(memory: Memory) -> None:
    memory[0, MEMORY.away] = 5.0  # it has reckoned wrongly
    for speed in (1.0, -1.0, 1.0):  # in, out and in again, at 1 m/s
        rows = sensed()
        rows[0, row.VELOCITY], rows[0, row.IN_DELIVERY_AREA] = speed, speed > 0.0
        remember_observation(rows, 0.1, memory)
        assert memory[0, MEMORY.away] == pytest.approx(-0.1 * speed)


@pytest.mark.unmeasured
@pytest.mark.compiled
def test_in_a_run_robots_with_fm2_find_out_and_no_healthy_one_believes_it() -> None:
    policy: Any = policies.load("ppo-robust")
    play = Play(Scenario(restock=True, duration=90.0), policy, 60_001, [Fault("FM2", 3)])
    while not play.is_over:
        play.step()
        takes_for_broken = policy._frame.memory[:, MEMORY.cannot_lift] > 0.0
        assert not np.any(takes_for_broken & play.world.state.lifts)
    assert (takes_for_broken == ~play.world.state.lifts).all()


def scan(heading: float, front: float, left: float = 10.0) -> NDArray[np.float32]:
    """A row beside a wall `front` [m] in direction 0 and one to the `left`, at a heading [rad]."""
    observation = np.zeros(row.N_COLUMNS, np.float32)
    for beam in range(row.N_BEAMS):
        angle = heading + beam * 2 * math.pi / row.N_BEAMS
        x, y = math.cos(angle), math.sin(angle)
        away = min(front / x if x > 1e-9 else 2.0, left / y if y > 1e-9 else 2.0, 2.0)
        observation[row.RANGE_WALLS + beam] = away
    return observation


@pytest.mark.parametrize("heading", [0.0, 0.7, 1.5, -2.0])
def test_three_beams_tell_how_the_robot_stands_to_a_wall(heading: float) -> None:
    seen = wall_angle(scan(heading, 1.0))
    assert (seen + heading + 0.1) % (math.pi / 2) == pytest.approx(0.1, abs=1e-4)


def test_an_open_field_and_an_obstacle_tell_nothing() -> None:
    assert wall_angle(scan(0.2, 10.0)) == -1.0
    bulge = scan(0.0, 1.0)
    bulge[row.RANGE_WALLS] -= 0.3
    assert wall_angle(bulge) == -1.0


@pytest.mark.compiled
def test_the_way_home_is_kept_though_the_body_turns_unnoticed() -> None:
    scenario = Scenario(
        restock=True, n_robots=10, duration=100.0, heading_drift=0.1, ranger_noise=0.03
    )
    env = SwarmLogisticsEnv(scenario)
    observations = env.reset_arrays(seed=3)
    policy: Any = policies.load("ppo-delivery")
    policy.reset(10, 3)
    while env.agents:
        observations, *_ = env.step_arrays(policy.act(observations))
    state, memory = env.warehouse.state, policy._frame.memory
    ways = np.array([kept_home(memory_row) for memory_row in memory])
    has = ways[:, 2] > 0
    assert has.sum() >= 8
    # The area lies along x, so the body's heading tells how far the direction kept is off.
    off = np.arctan2(ways[has, 1], ways[has, 0]) + state.robot_heading[has]
    assert np.median(np.abs(np.angle(np.exp(1j * off)))) < math.radians(8)
    away = scenario.storage_width - state.robot_position[has, 0]
    assert np.median(np.abs(memory[has, MEMORY.away] - away)) < 0.6
    drifts = memory[has, MEMORY.drift] + state.robot_heading_drift[has]
    assert np.median(np.abs(drifts)) < 0.01


def test_a_gyro_that_drifts_is_found_out_beside_a_wall(memory: Memory) -> None:
    """Its heading seems to stand, and the wall turns by .02 rad/s."""
    for step in range(600):
        watch_walls(scan(0.002 * step, 1.0), 0.1, memory[0])
    assert memory[0, MEMORY.drift] == pytest.approx(-0.02, rel=0.1)
    # The wall is that of the first sighting all the time.
    assert memory[0, MEMORY.wall] == pytest.approx(-0.002 * 599, abs=0.01)


@pytest.mark.parametrize(("sightings", "angle"), [(0.0, 0.2), (1.0, 0.0)])
def test_the_way_home_is_at_a_right_angle_to_a_wall_that_was_seen(
    memory: Memory, sightings: float, angle: float
) -> None:
    memory[0, [MEMORY.kept_x, MEMORY.kept_y]] = 3.0 * math.cos(0.2), 3.0 * math.sin(0.2)
    memory[0, [MEMORY.sightings, MEMORY.wall]] = sightings, 0.3
    expected = (math.cos(angle + 0.3), math.sin(angle + 0.3), 3.0)
    assert kept_home(memory[0]) == pytest.approx(expected)
    assert kept_home(np.zeros(N_COLUMNS)) == (0.0, 0.0, 0.0)


def test_of_several_requested_items_in_view_the_nearest_counts() -> None:
    rows, distances = sensed(), [0.3, 0.5, 0.6, 0.8]
    for index, (away, is_requested) in enumerate(zip(distances, [0, 1, 1, 0])):
        first_column = row.ITEMS + row.ITEM_WIDTH * index
        rows[0, first_column : first_column + row.ITEM_WIDTH] = [1, away, 0, is_requested, 0]
    requested, other = nearest_items(rows[0])
    assert (requested, other) == (row.ITEMS + row.ITEM_WIDTH, row.ITEMS)
