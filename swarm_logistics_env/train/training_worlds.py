"""The worlds of a training, as stable-baselines3 sees them."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from swarm_logistics_env.adapters import SwarmVecEnv
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.train.mix import EpisodeMix
from swarm_logistics_env.train.references import performances_of_study
from swarm_logistics_env.train.training import Training
from swarm_logistics_env.wrappers import Condition, IndicatorReward, RunningMeans, Wrapper

References = RunningMeans | dict[Condition, float] | float


def make_worlds(training: Training) -> SwarmVecEnv:
    """Return the worlds of a training, not yet begun.

    Raises:
        TrainingError, SetupError, ScenarioError, FaultError: they cannot be.
    """
    make_env: Callable[[int], Wrapper] = partial(_make_env, training, _references(training))
    return SwarmVecEnv(
        make_env=make_env, n_worlds=len(training.world_scenarios), threads=training.threads
    )


def _make_env(training: Training, references: References, world: int) -> Wrapper:
    scenario = training.world_scenarios[world]
    env = EpisodeMix(
        SwarmLogisticsEnv(scenario, rewards=training.rewards), training.world_conditions[world]
    )
    asked = training.indicators
    if asked is None:
        return env
    return IndicatorReward(
        env,
        asked.weights,
        references=references,
        credit=asked.credit,
        constant=asked.constant,
        own_reward=1.0,
    )


def _references(training: Training) -> References:
    asked = training.indicators
    if asked is None or asked.references == "running":
        window, initial = (asked.window, asked.initial) if asked else (1, 1.0)
        # All worlds share one, so that each reference episode serves them all.
        return RunningMeans(window=window, initial=initial)
    if isinstance(asked.references, str):
        return performances_of_study(asked.references, training.scenario)
    return asked.references
