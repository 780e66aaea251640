"""Environments with wrappers around them: alone, and stacked in both orders."""

from __future__ import annotations

import importlib
import warnings
from collections.abc import Callable, Iterator
from types import ModuleType
from typing import Any

import numpy as np
import pytest

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


WRAPPED: dict[str, Callable[[Env], Env]] = {
    "plain": lambda env: env,
    "faults": with_faults,
    "sizes": with_sizes,
    "changes": with_changes,
    "changes(sizes(faults))": lambda env: with_changes(with_sizes(with_faults(env))),
    "faults(sizes(changes))": lambda env: with_faults(with_sizes(with_changes(env))),
    "fixed(changes(sizes(faults)))": lambda env: FixedAgents(
        with_changes(with_sizes(with_faults(env)))
    ),
    "indicators(faults(sizes(changes)))": lambda env: IndicatorReward(
        with_faults(with_sizes(with_changes(env))), {"R": 1.0, "P": 0.1}, references=RunningMeans()
    ),
    "numbers(sizes(faults))": lambda env: DiscreteActions(with_sizes(with_faults(env))),
    "motion(sizes(faults))": lambda env: MotionFrame(with_sizes(with_faults(env))),
}


@pytest.fixture
def make() -> Callable[..., Env]:
    """Return a maker of small, short environments in a stack of wrappers."""

    def made(stack: str, n_robots: int = 4, **arguments: Any) -> Env:
        fields: dict[str, Any] = {
            "warehouse_width": 6.0,
            "warehouse_height": 5.0,
            "n_items": 10,
            "duration": 4.0,
            **arguments,
        }
        return WRAPPED[stack](SwarmLogisticsEnv(n_robots=n_robots, **fields))

    return made


@pytest.fixture
def conformance(monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    """PettingZoo's own tests."""
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    with warnings.catch_warnings():
        # They load environments of PettingZoo's in a way that it deprecates, and pass an option of
        # their own, which we ignore and say so.
        warnings.simplefilter("ignore", DeprecationWarning)
        warnings.filterwarnings("ignore", "reset option 'options' is ignored")
        # In a swarm smaller than the largest, not all possible agents end.
        warnings.filterwarnings("ignore", "No agents present but not all possible_agents")
        # Inputs of the frame of motion have no bounds.
        warnings.filterwarnings("ignore", "Agent's m.* observation space value is")
        # A robot that left observes zeros.
        warnings.filterwarnings("ignore", "Observation numpy array is all zeros")
        yield importlib.import_module("pettingzoo.test")
