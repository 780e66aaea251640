"""Environments with floor plans: rewards along free floor, the state, and plans that change."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_logistics_env import swarm_logistics_v0
from swarm_logistics_env.environment.spaces import ROBOT_FEATURES
from swarm_logistics_env.wrappers import ParameterChange


def test_an_approach_counts_along_the_free_floor() -> None:
    # The dock is right behind a rack: straight towards it, nothing is earned for long.
    env = swarm_logistics_v0.parallel_env(
        floor=":::=A\n:::=A\n:::=A\n:::=A\n:::::", n_robots=1, n_items=1, heading_drift=0.0,
        rewards={"approach": 1.0}, pickup_range=0.5,
    )  # fmt: skip
    env.reset(seed=0)
    world = env.warehouse
    world.state.item_position = world.state.robot_position = np.array([[1.0, 2.0]])
    world.state.robot_heading = np.array([-0.5 * np.pi])  # away from the top, towards the gap
    world.change()
    hold, down = np.array([0.0, 0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0, 1.0])
    env.step_arrays(hold[None])
    position = world.state.robot_position.copy()
    _, rewards, _, _ = env.step_arrays(down[None])
    driven = float(np.linalg.norm(world.state.robot_position - position))
    assert driven > 0.05
    assert rewards[0] == pytest.approx(driven, rel=0.1)
    distance = world.floor.edge - world.floor.along(world.state.robot_position)
    assert distance[0] > 2.0
    robot = env.state()[: len(ROBOT_FEATURES)]
    assert robot[list(ROBOT_FEATURES).index("to_delivery")] == pytest.approx(distance[0])
    assert env.state_space.contains(env.state())


def test_plans_change_between_episodes() -> None:
    env = ParameterChange(
        swarm_logistics_v0.parallel_env(duration=10.0), "floor", ["aisles", "two_docks", None]
    )
    floors = set()
    for seed in range(12):
        env.reset(seed=seed)
        floors.add(env.warehouse.scenario.floor)
        assert env.state_space.contains(env.state())
        env.step_arrays(np.zeros((25, 4)))
    assert floors == {"aisles", "two_docks", None}
