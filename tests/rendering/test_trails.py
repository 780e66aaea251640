from __future__ import annotations

from collections.abc import Callable

import numpy as np

from swarm_logistics_env import Scenario
from swarm_logistics_env.rendering.readings import TRAIL_SECONDS, Trails
from swarm_logistics_env.warehouse import WarehouseState

Situation = Callable[..., tuple[WarehouseState, Scenario]]


def test_remembers_so_long_and_no_longer(situation: Situation) -> None:
    state, _ = situation([[2, 2]], [[5, 5]])
    trails = Trails()
    for step in range(100):
        state.time = 0.1 * step
        state.robot_position[0, 0] = step
        trails.note(state)
        trails.note(state)  # the same moment twice counts once
    expected = np.arange(99 - round(10 * TRAIL_SECONDS), 100)
    assert trails.positions()[:, 0, 0].tolist() == expected.tolist()


def test_starts_afresh_with_an_episode(situation: Situation) -> None:
    state, _ = situation([[2, 2]], [[5, 5]])
    trails = Trails()
    state.time = 3.0
    trails.note(state)
    state.time = 0.0
    trails.note(state)
    assert trails.positions().shape == (1, 1, 2)
    larger, _ = situation([[2, 2], [3, 3]], [[5, 5]])
    larger.time = 0.1
    trails.note(larger)
    assert trails.positions().shape == (1, 2, 2)


def test_absent_robot_leaves_no_trail(situation: Situation) -> None:
    state, _ = situation([[2, 2], [3, 3]], [[5, 5]])
    state.robot_present[1] = False
    trails = Trails()
    trails.note(state)
    assert np.isnan(trails.positions()[0, 1]).all()
    assert trails.positions()[0, 0].tolist() == [2.0, 2.0]
