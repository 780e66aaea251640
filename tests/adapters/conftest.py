"""Small worlds, what wraps them, and random play of all of them."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.wrappers import FaultInjection, ParameterChange, SwarmSize

if TYPE_CHECKING:
    from swarm_logistics_env.adapters.sb3 import SwarmVecEnv

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


@pytest.fixture
def small() -> dict[str, Any]:
    """Fields of a world that is quickly played: 20 steps an episode."""
    return dict(SMALL)


@pytest.fixture
def wrapped() -> Callable[[int], Any]:
    """Makes one of several worlds, each with faults and another swarm size."""

    def make_env(world: int) -> Any:
        env: Any = SwarmLogisticsEnv(**SMALL, n_robots=4)
        env = FaultInjection(env, "FM1", onset=[0.0, 0.5])
        env = SwarmSize(env, [3, 6], leave=[(1, 0.7)])
        return ParameterChange(env, "max_speed", [1.0, 2.0], at=0.3) if world % 2 else env

    return make_env


@pytest.fixture
def played() -> Callable[[SwarmVecEnv, int], list[Any]]:
    """Plays random steps after a reset, and returns all that they returned."""

    def play(env: SwarmVecEnv, steps: int) -> list[Any]:
        rng = np.random.default_rng(0)
        trace: list[Any] = [env.reset()]
        for _ in range(steps):
            observations, rewards, dones, infos = env.step(rng.uniform(-1, 1, (env.num_envs, 4)))
            trace += [observations, rewards, dones]
            trace += [
                info.get("terminal_observation", np.zeros(0))
                for info, done in zip(infos, dones)
                if done
            ]
        return trace

    return play
