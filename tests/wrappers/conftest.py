"""Small worlds, what wraps them, and what drives their robots."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import Fault, spi
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.wrappers import (
    Condition,
    FaultInjection,
    IndicatorReward,
    ParameterChange,
    SwarmSize,
)

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


# Of indicators as rewards: conditions, and what brings them about.
N = 4
OWN = Condition(N)
FAULTY = Condition(N, ("motor_slow",), n_failed=2)
REMOVED = Condition(N, n_removed=2)
LARGER = Condition(N + 3)
NARROW = Condition(N, changes=(("delivery_width", 1.5),))
OPTIONS: dict[Condition, Any] = {
    OWN: {},
    FAULTY: {"faults": [Fault("motor_slow", 2)]},
    REMOVED: {"faults": [Fault("removed", 2)]},
    LARGER: {"scenario": {"n_robots": N + 3}},
    NARROW: {"scenario": {"delivery_width": 1.5}},
}
CLOSE: Any = {"abs": 1e-9, "rel": 0}


def busy(**arguments: Any) -> SwarmLogisticsEnv:
    """A warehouse whose robots reach every item, so that even a blind policy delivers."""
    fields: dict[str, Any] = {
        "n_robots": N, "n_items": 12, "warehouse_width": 6.0, "warehouse_height": 5.0,
        "pickup_range": 9.0, "duration": 12.0, "restock": True,
    }  # fmt: skip
    return SwarmLogisticsEnv(**{**fields, **arguments})


def rewarded(weights: Any, references: Any, env: Any = None, **arguments: Any) -> IndicatorReward:
    return IndicatorReward(env or busy(), weights, references=references, **arguments)


def play(env: Any, seed: int | None, options: Any = None) -> tuple[np.ndarray, Any]:
    """Play an episode to its end; returns the rewards (steps, N) and the last infos."""
    env.reset(seed=seed, options=options)
    n_robots = env.unwrapped.warehouse.state.n_robots
    rng, rewards, infos = np.random.default_rng(seed), [], {}
    while env.agents:
        east = eastward(env)
        east[:, 3] = np.where(rng.uniform(size=n_robots) < 0.3, -1.0, 1.0)
        _, earned, _, _, infos = env.step({name: east[int(name[6:])] for name in env.agents})
        rewards.append([earned.get(f"robot_{row}", 0.0) for row in range(n_robots)])
    return np.array(rewards), infos


def delivered(env: Any) -> int:
    return int(env.unwrapped.warehouse.state.delivered)


Performances = dict[Condition, float]
# Of each indicator: the condition that it tests, and its value.
TESTED: dict[str, tuple[Condition, Callable[[Performances], spi.Estimate]]] = {
    "R": (FAULTY, lambda p: spi.robustness([p[OWN]], [p[FAULTY]], n=N, m=2)),
    "FT": (FAULTY, lambda p: spi.fault_tolerance([p[OWN]], [p[FAULTY]], [p[REMOVED]])),
    "S": (LARGER, lambda p: spi.scalability([p[OWN]], [p[LARGER]], n=N, m=3)),
    "A": (NARROW, lambda p: spi.adaptability([p[OWN]], [p[NARROW]], x_o=2.0, x_new=1.5)),
}
each_indicator = pytest.mark.parametrize("name", TESTED)
