"""Small worlds, what drives their robots, and stacks of wrappers around them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.wrappers import (
    DiscreteActions,
    FaultInjection,
    FixedAgents,
    IndicatorReward,
    MotionFrame,
    ParameterChange,
    RunningMeans,
    SwarmSize,
    Wrapper,
)

Env = SwarmLogisticsEnv | Wrapper


def small(**fields: Any) -> SwarmLogisticsEnv:
    return SwarmLogisticsEnv(**{"n_robots": 6, "n_items": 8, "duration": 6.0, **fields})


def eastward(env: Any) -> NDArray[np.float64]:
    """Return commands (N, 4) that hold on and drive to the delivery area."""
    heading = env.unwrapped.warehouse.state.robot_heading
    return np.stack([np.cos(heading), -np.sin(heading), 0 * heading, 1 + 0 * heading], axis=1)


def onsets(rng: np.random.Generator) -> Any:
    return rng.uniform(0.5, 3.0, size=rng.integers(3))


def with_faults(env: Env) -> Env:
    return FaultInjection(FaultInjection(env, "FM3", onset=onsets), "motor_slow", onset=[0.0, 1.0])


def with_sizes(env: Env) -> Env:
    n = env.unwrapped.scenario.n_robots
    return SwarmSize(env, [n, 2 * n], leave=[(1, 1.5)] if n > 1 else ())


def with_changes(env: Env) -> Env:
    env = ParameterChange(env, "n_items", [10, 20])
    env = ParameterChange(env, "radio_range", [1.0, 6.0], at=1.0)
    return ParameterChange(env, "max_speed", [1.0, 3.0], at=[0.5, 2.0])


def with_all(env: Env) -> Env:
    return with_faults(with_sizes(with_changes(env)))


WRAPPED: dict[str, Callable[[Env], Env]] = {
    "plain": lambda env: env,
    "changes(sizes(faults))": lambda env: with_changes(with_sizes(with_faults(env))),
    "faults(sizes(changes))": with_all,
    "fixed(faults(sizes(changes)))": lambda env: FixedAgents(with_all(env)),
    "indicators(faults(sizes(changes)))": lambda env: IndicatorReward(
        with_all(env), {"R": 1.0, "P": 0.1}, references=RunningMeans()
    ),
    "numbers(sizes(faults))": lambda env: DiscreteActions(with_sizes(with_faults(env))),
    "motion(sizes(faults))": lambda env: MotionFrame(with_sizes(with_faults(env))),
}


def stacked(stack: str, n_robots: int = 4, **arguments: Any) -> Any:
    """Return a small, short environment in one of the stacks of `WRAPPED`."""
    fields = {"warehouse_width": 6.0, "warehouse_height": 5.0, "n_items": 10, "duration": 4.0}
    return WRAPPED[stack](SwarmLogisticsEnv(n_robots=n_robots, **{**fields, **arguments}))
