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
    wanted_velocity: NDArray[np.float64]  # (T, N, 2) [m/s], world frame
    start: NDArray[np.float64]  # (N, 2) [m]
    items: NDArray[np.float64]  # (I, 2) [m]


def record(scenario: Scenario, n_steps: int) -> Recording:
    """Play Swarm D-T for `n_steps` control steps."""
    world, policy = Warehouse(scenario), policies.load("swarm-dt")
    observations = world.reset(seed=0)
    start(policy, scenario, seed=0)
    starts, items = world.state.robot_position.copy(), world.state.item_position.copy()
    commands = np.zeros((n_steps, scenario.n_robots, 4))
    wanted = np.zeros((n_steps, scenario.n_robots, 2))
    for step in range(n_steps):
        commands[step] = policy.act(observations)
        before = world.state.robot_heading.copy()
        observations = world.step(commands[step])
        wanted[step] = _wanted(commands[step], before, world)
    return Recording(scenario, commands, wanted, starts, items)


def _wanted(
    commands: NDArray[np.float64], before: NDArray[np.float64], world: Warehouse
) -> NDArray[np.float64]:
    """Return the wanted velocities (N, 2) [m/s]; who turns drives along its mean direction."""
    turned = np.remainder(world.state.robot_heading - before + np.pi, 2.0 * np.pi) - np.pi
    middle = before + 0.5 * turned
    forward, left = commands[:, 0], commands[:, 1]
    speed = world.scenario.max_speed / np.maximum(np.hypot(forward, left), 1.0)
    along = forward * np.cos(middle) - left * np.sin(middle)
    across = forward * np.sin(middle) + left * np.cos(middle)
    return np.asarray(speed[:, None] * np.stack([along, across], axis=1))
