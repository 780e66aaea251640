"""The whole warehouse as one vector says what robots' rows and the world say."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_logistics_env import policies
from swarm_logistics_env.core.errors import SetupError
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
        timers = np.nan_to_num(world.robot_timer, nan=env.scenario.timer_limit)
        distance = np.maximum(env.scenario.storage_width - world.robot_position[:, 0], 0.0)
        for name, values in (
            ("cos_heading", np.cos(world.robot_heading)),
            ("sin_heading", np.sin(world.robot_heading)),
            ("velocity_x", np.clip(world.robot_velocity[:, 0], -2.0, 2.0)),
            ("velocity_y", np.clip(world.robot_velocity[:, 1], -2.0, 2.0)),
            ("timer", timers),
            ("to_delivery", distance),
        ):
            np.testing.assert_allclose(robots[name], np.where(present, values, 0.0), atol=1e-6)
        assert state[-1] == np.float32(world.time)
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


def test_what_may_differ_from_what_spaces_were_made_for_is_told_field_by_field() -> None:
    env = SwarmLogisticsEnv(n_robots=3, n_items=5, max_robots=4, duration=20.0)
    for fields in ({"n_robots": 4}, {"n_items": 5, "duration": 20.0}, {"restock": True}):
        env.conditions_of(0, {"scenario": fields})
    with pytest.raises(SetupError, match=r"^n_items = 4, duration = 20.5: observations or states"):
        env.conditions_of(0, {"scenario": {"duration": 20.5, "n_items": 4}})
    with pytest.raises(SetupError, match=r"^view_range = 3.5: observations or states could leave"):
        env.conditions_of(0, {"scenario": {"view_range": 3.5}})
    with pytest.raises(SetupError, match=r"^n_robots = 5: should be at most 4, .*max_robots=5 or"):
        env.conditions_of(0, {"scenario": {"n_robots": 5}})
    with pytest.raises(SetupError, match=r"^message_size = 2: should be the environment's own, 0,"):
        env.declare_spaces(env.scenario.replace(message_size=2))
    env.declare_spaces(env.scenario.replace(n_robots=6, duration=20.5))
    env.conditions_of(0, {"scenario": {"duration": 20.5, "n_items": 4, "n_robots": 6}})
    assert (len(env.possible_agents), env.state_space.high[-1]) == (6, 21.5)
    assert env.state_space.shape == (6 * len(ROBOT_FEATURES) + 5 * len(ITEM_COLUMNS) + 1,)
