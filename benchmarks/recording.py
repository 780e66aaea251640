"""One episode written down, so that everything measured replays the same motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import Scenario, Warehouse, policies
from swarm_logistics_env.policies.policy import start


@dataclass(frozen=True)
class Recording:
    """Swarm D-T from seed 0: what it commanded and how fast that made the robots want to go."""

    scenario: Scenario
    commands: NDArray[np.float64]  # (T, N, 4)
    wanted_velocity: NDArray[np.float64]  # (T, N, 2) [m/s], world frame; nobody turns
    start: NDArray[np.float64]  # (N, 2) [m]
    items: NDArray[np.float64]  # (I, 2) [m]


def record(scenario: Scenario, n_steps: int) -> Recording:
    """Play Swarm D-T for `n_steps` control steps."""
    world, policy = Warehouse(scenario), policies.load("swarm-dt")
    observations = world.reset(seed=0)
    start(policy, scenario, seed=0)
    starts, items = world.state.robot_position.copy(), world.state.item_position.copy()
    heading = world.state.robot_heading
    rotation = np.stack([np.cos(heading), -np.sin(heading), np.sin(heading), np.cos(heading)])
    turned = rotation.T.reshape(-1, 2, 2) * scenario.max_speed
    commands = np.zeros((n_steps, scenario.n_robots, 4))
    for step in range(n_steps):
        commands[step] = policy.act(observations)
        observations = world.step(commands[step])
    wanted = np.einsum("nij,tnj->tni", turned, commands[:, :, :2])
    return Recording(scenario, commands, wanted, starts, items)
