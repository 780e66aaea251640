"""The whole warehouse as one vector says what robots' rows and the world say."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_logistics_env import policies
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.environment.spaces import ITEM_COLUMNS, ROBOT_FEATURES
from swarm_logistics_env.policies.policy import decide, start
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.warehouse.state import CARRIED, NOBODY, STORED


@pytest.mark.parametrize("n_requests", [1, 4])
def test_the_state_tells_what_the_world_holds_and_zeros_of_what_is_gone(n_requests: int) -> None:
    env = SwarmLogisticsEnv(
        n_robots=12, n_items=14, n_requests=n_requests, warehouse_width=6.0, warehouse_height=5.0,
        duration=60.0,
    )  # fmt: skip
    faults = {"faults": ["removed:2@5", "removed:3@8"]}
    rows, policy = env.reset_arrays(3, faults), policies.load("homing")
    start(policy, env.scenario, 3)
    world, carried, n_shown = env.warehouse.state, 0, 12 * len(ROBOT_FEATURES)
    while env.agents:
        state = env.state()
        robots = dict(zip(ROBOT_FEATURES, state[:n_shown].reshape(12, -1).T))
        items = dict(zip(ITEM_COLUMNS, state[n_shown:-1].reshape(14, -1).T))
        present = world.robot_present
        assert robots["present"].tolist() == present.tolist()
        assert not state[:n_shown].reshape(12, -1)[~present].any()
        for name, column in (
            ("carrying", row.CARRYING),
            ("carrying_requested", row.CARRYING_REQUESTED),
        ):
            assert robots[name].tolist() == rows[:, column].tolist()
        carried += int(robots["carrying_requested"].sum())
        for axis, name in enumerate(("x", "y")):
            places = np.where(present, world.robot_position[:, axis], 0.0)
            np.testing.assert_allclose(robots[name], places, atol=1e-6)
            is_there = np.isin(world.item_status, (STORED, CARRIED))
            places = np.where(is_there, world.item_position[:, axis], 0.0)
            np.testing.assert_allclose(items[name], places, atol=1e-6)
        assert items["stored"].tolist() == (world.item_status == STORED).tolist()
        assert items["carried"].tolist() == (world.item_status == CARRIED).tolist()
        requested = set(np.flatnonzero(items["requested"]).tolist())
        assert requested == set(world.open_requests.tolist()) - {NOBODY}
        rows, *_ = env.step_arrays(decide(policy, rows, world))
    assert (world.delivered > 3, carried > 10, (~world.robot_present).sum()) == (True, True, 3)
