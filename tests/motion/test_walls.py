from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import Scenario, policies
from swarm_logistics_env import observations as row
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.motion import memory as known
from swarm_logistics_env.motion.memory import wall_angle

REACH = 2.0


def scan(heading: float, ahead: float, left: float = 10.0) -> NDArray[np.float32]:
    """A row beside a wall `ahead` [m] in direction 0 and one to the `left`, at a heading [rad]."""
    sensed = np.zeros(row.N_COLUMNS, np.float32)
    for beam in range(row.N_BEAMS):
        angle = heading + beam * 2 * math.pi / row.N_BEAMS
        x, y = math.cos(angle), math.sin(angle)
        away = min(ahead / x if x > 1e-9 else REACH, left / y if y > 1e-9 else REACH, REACH)
        sensed[row.RANGE_WALLS + beam] = away
    return sensed


@pytest.mark.parametrize("heading", [0.0, 0.1, 0.7, 1.5, -2.0])
def test_three_beams_tell_how_the_robot_stands_to_a_wall(heading: float) -> None:
    seen = wall_angle(scan(heading, 1.0))
    quarter = math.pi / 2
    assert (seen + heading + 0.1) % quarter == pytest.approx(0.1, abs=1e-4)


def test_an_open_field_and_an_obstacle_tell_nothing() -> None:
    assert wall_angle(scan(0.2, 10.0)) == -1.0
    bulge = scan(0.0, 1.0)
    bulge[row.RANGE_WALLS] -= 0.3
    assert wall_angle(bulge) == -1.0


@pytest.mark.parametrize("noise", [0.0, 0.03])
def test_the_way_home_is_kept_though_the_body_turns_unnoticed(noise: float) -> None:
    scenario = Scenario(
        restock=True, n_robots=10, duration=100.0, heading_drift=0.1, ranger_noise=noise
    )
    env = SwarmLogisticsEnv(scenario)
    observations = env.reset_arrays(seed=3)
    policy: Any = policies.load("ppo-delivery")
    policy.reset(10, 3)
    while env.agents:
        observations, *_ = env.step_arrays(policy.act(observations))
    state, memory = env.warehouse.state, policy._frame.memory
    ways = np.array([known.kept_home(own) for own in memory])
    has = ways[:, 2] > 0
    assert has.sum() >= 8
    # The area lies along x, so the body's heading tells how far the direction kept is off.
    off = np.arctan2(ways[has, 1], ways[has, 0]) + state.robot_heading[has]
    assert np.median(np.abs(np.angle(np.exp(1j * off)))) < math.radians(8)
    away = scenario.storage_width - state.robot_position[has, 0]
    assert np.median(np.abs(memory[has, known.AWAY] - away)) < 0.6
    drifts = memory[has, known.DRIFT] + state.robot_heading_drift[has]
    assert np.median(np.abs(drifts)) < 0.01
