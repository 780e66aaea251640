"""Small worlds, what wraps them, and what drives their robots."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.wrappers import FaultInjection, ParameterChange, SwarmSize

if TYPE_CHECKING:
    from swarm_logistics_env.adapters.sb3 import SwarmVecEnv

BRIEF: dict[str, Any] = {"warehouse_width": 6.0, "n_items": 10, "duration": 2.0}  # of 20 steps


def small(**fields: Any) -> SwarmLogisticsEnv:
    return SwarmLogisticsEnv(**{"n_robots": 6, "n_items": 8, "duration": 6.0, **fields})


def brief(**fields: Any) -> SwarmLogisticsEnv:
    return SwarmLogisticsEnv(**{**BRIEF, **fields})


def eastward(env: Any) -> NDArray[np.float64]:
    """Return commands (N, 4) that hold on and drive to the delivery area."""
    heading = env.unwrapped.warehouse.state.robot_heading
    return np.stack([np.cos(heading), -np.sin(heading), 0 * heading, 1 + 0 * heading], axis=1)


def worlds(n_worlds: int, n_robots: Any = 3, **arguments: Any) -> SwarmVecEnv:
    from swarm_logistics_env.adapters.sb3 import SwarmVecEnv

    return SwarmVecEnv(n_worlds=n_worlds, n_robots=n_robots, **{"seed": 0, **BRIEF, **arguments})


def wrapped(world: int) -> Any:
    """Return one of several worlds, each with faults and another swarm size."""
    env: Any = FaultInjection(brief(n_robots=4), "FM1", onset=[0.0, 0.5])
    env = SwarmSize(env, [3, 6], leave=[(1, 0.7)])
    return ParameterChange(env, "max_speed", [1.0, 2.0], at=0.3) if world % 2 else env


def played(env: SwarmVecEnv, steps: int) -> list[Any]:
    """Play random steps after a reset, and return all that they returned."""
    rng = np.random.default_rng(0)
    trace: list[Any] = [env.reset()]
    for _ in range(steps):
        *arrays, infos = env.step(rng.uniform(-1, 1, (env.num_envs, 4)))
        trace += [*arrays, [info.get("terminal_observation") for info in infos]]
    return trace
