"""Small worlds, what wraps them, and random play of all of them."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.wrappers import FaultInjection, ParameterChange, SwarmSize

if TYPE_CHECKING:
    from swarm_logistics_env.adapters.sb3 import SwarmVecEnv

# A world that is quickly played: 20 steps an episode.
SMALL: dict[str, Any] = {
    "warehouse_width": 6.0,
    "warehouse_height": 5.0,
    "n_items": 10,
    "duration": 2.0,
}


@pytest.fixture(autouse=True)
def one_thread() -> Iterator[None]:
    """Nets this small are slower on several threads, the more so beside other tests."""
    torch = sys.modules.get("torch")
    before = torch.get_num_threads() if torch else 0
    if torch:
        torch.set_num_threads(1)
    yield
    if torch:
        torch.set_num_threads(before)


def small(**fields: Any) -> SwarmLogisticsEnv:
    return SwarmLogisticsEnv(**{**SMALL, **fields})


def worlds(n_worlds: int, n_robots: Any = 3, **arguments: Any) -> SwarmVecEnv:
    from swarm_logistics_env.adapters.sb3 import SwarmVecEnv

    return SwarmVecEnv(n_worlds=n_worlds, n_robots=n_robots, **{"seed": 0, **SMALL, **arguments})


def wrapped(world: int) -> Any:
    """Return one of several worlds, each with faults and another swarm size."""
    env: Any = FaultInjection(small(n_robots=4), "FM1", onset=[0.0, 0.5])
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
