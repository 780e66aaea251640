from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.train.privileged import PRIVILEGED, fill_privileged, messages_of
from swarm_logistics_env.world.warehouse.state import CARRIED


def fill(env: SwarmLogisticsEnv, turned: Any, privileged: Any) -> None:
    floor = env.warehouse.floor
    to_delivery = floor.edge - floor.along(env.warehouse.state.robot_position)
    fill_privileged(env.warehouse.address, turned, to_delivery, privileged)


def test_the_critic_knows_where_the_requested_item_is() -> None:
    env = SwarmLogisticsEnv(n_robots=3, n_items=5)
    env.reset_arrays(seed=0)
    state = env.warehouse.state
    state.robot_position[0], state.robot_heading[0] = (4.0, 5.0), 0.5 * math.pi
    state.item_position[state.requested] = (4.0, 6.0)
    turned, privileged = np.zeros(3), np.zeros((4, len(PRIVILEGED)), np.float32)
    turned[0] = 0.5 * math.pi  # so that the frame looks along -x
    fill(env, turned, privileged)
    columns = dict(zip(PRIVILEGED._fields, privileged[0].tolist()))
    expected = {
        "to_delivery": 0.4, "frame_cos": -1.0, "frame_sin": 0.0, "requested_along": 0.0,
        "requested_aside": -1.0, "requested_distance": 0.1, "is_carried": 0.0,
    }  # fmt: skip
    assert {name: columns[name] for name in expected} == pytest.approx(expected, abs=1e-6)
    assert not privileged[3].any()

    state.item_status[state.requested], state.item_carrier[state.requested] = CARRIED, 1
    state.robot_position[1] = (7.0, 5.0)
    fill(env, turned, privileged)
    columns = dict(zip(PRIVILEGED._fields, privileged[0].tolist()))
    assert (columns["is_carried"], columns["carrier_delivers"]) == (1.0, 1.0)
    assert columns["carrier_to_delivery"] == pytest.approx(0.1)


def test_messages_should_say_how_near_a_free_requested_item_and_the_dock_are() -> None:
    env = SwarmLogisticsEnv(n_robots=2, n_items=5)
    env.reset_arrays(seed=0)
    state = env.warehouse.state
    state.robot_position[:] = [(4.0, 5.0), (9.5, 5.0)]
    state.item_position[state.requested] = (4.0, 7.0)
    privileged = np.zeros((2, len(PRIVILEGED)), np.float32)
    fill(env, np.zeros(2), privileged)
    floor = env.warehouse.floor
    to_dock = floor.along(state.robot_position) - floor.edge
    expected = np.clip(1.0 - to_dock / 8.0, 0.0, 1.0)
    messages = messages_of(privileged)
    assert messages[0].tolist() == pytest.approx([0.75, expected[0]], abs=1e-6)
    assert 0.0 < expected.min() < 1.0
    assert messages[:, 1] == pytest.approx(expected, abs=1e-6)

    state.item_status[state.requested], state.item_carrier[state.requested] = CARRIED, 1
    fill(env, np.zeros(2), privileged)
    assert messages_of(privileged)[:, 0].tolist() == [0.0, 0.0]


def test_of_several_requests_the_critic_knows_the_nearest() -> None:
    env = SwarmLogisticsEnv(n_robots=2, n_items=5, n_requests=3)
    env.reset_arrays(seed=0)
    state = env.warehouse.state
    state.robot_position[:], state.robot_heading[:] = [(4.0, 5.0), (1.0, 1.0)], 0.0
    state.item_position[state.open_requests] = [(7.0, 9.0), (4.0, 6.0), (1.0, 3.0)]
    privileged = np.zeros((2, len(PRIVILEGED)), np.float32)
    fill(env, np.zeros(2), privileged)
    assert privileged[:, PRIVILEGED.requested_distance] == pytest.approx([0.1, 0.2])
    state.item_carrier[state.open_requests[1]] = 0
    fill(env, np.zeros(2), privileged)
    assert privileged[:, PRIVILEGED.is_carried].tolist() == [1.0, 0.0]
