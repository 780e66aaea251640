from __future__ import annotations

import numpy as np
import pytest

from swarm_logistics_env import Fault, Scenario, Warehouse
from swarm_logistics_env.world import observations
from swarm_logistics_env.world.rendering.palette import leader_of
from swarm_logistics_env.world.warehouse.state import NOBODY


def test_follows_whom_the_robot_itself_hears() -> None:
    scenario = Scenario(n_robots=30, radio_range=2.0, relay="gossip")
    world = Warehouse(scenario)
    faults = [Fault("FM1", [0, 1]), Fault("FM3_send", [2, 3]), Fault("FM3_hear", [4, 5])]
    world.reset(1, [*faults, Fault("removed", [6], onset=1.0)])
    compared = 0
    for _ in range(60):
        rows = observations.unflatten(world.step(np.tile([1.0, 0.2, 0.1, 0.0], (30, 1))), scenario)
        state = world.state
        for robot in range(30):
            leader = leader_of(state, scenario, robot)
            assert (leader != NOBODY) == bool(rows["lowest_timer_present"][robot, 0])
            if leader == NOBODY:
                continue
            compared += 1
            assert state.robot_told[leader] == state.robot_heard[robot]
            offset = state.robot_position[leader] - state.robot_position[robot]
            seen = [rows["lowest_timer_x"][robot, 0], rows["lowest_timer_y"][robot, 0]]
            assert np.hypot(*offset) == pytest.approx(np.hypot(*seen), abs=1e-5)
    assert compared > 100
