"""The worlds of a training, as stable-baselines3 sees them: episodes of several kinds, rewards."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from swarm_logistics_env.adapters import SwarmVecEnv
from swarm_logistics_env.adapters.worlds import layers_of
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.environment.reset_options import faults_among, scenario_fields
from swarm_logistics_env.errors import StudyError, TrainingError
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.streams import generator
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.performance_table import rows_of
from swarm_logistics_env.train.settings import Conditions
from swarm_logistics_env.train.training import Training
from swarm_logistics_env.warehouse import Fault
from swarm_logistics_env.wrappers import Condition, IndicatorReward, RunningMeans, Wrapper
from swarm_logistics_env.wrappers.condition import changes_of

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
        SwarmLogisticsEnv(scenario, rewards=training.reward_weights),
        training.world_conditions[world],
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


class EpisodeMix(Wrapper):
    """Plays each episode under conditions drawn from several kinds, by the episode's seed.

    Args:
        env: the environment, or a wrapper of one.
        kinds: what is drawn from; none: every episode is as the environment has it.

    Raises:
        ScenarioError, SetupError: a scenario among them cannot be.
    """

    def __init__(self, env: SwarmLogisticsEnv | Wrapper, kinds: Sequence[Conditions]) -> None:
        super().__init__(env)
        self._kinds = tuple(kinds)
        self.follow(0.0)
        own = self.unwrapped.scenario
        for kind in kinds:
            for name, values in kind.scenario.items():
                for value in values:
                    self.env.declare_spaces(own.replace(**{name: value}))

    def follow(self, done: float) -> None:
        """Mix what begins from now on as it is due after a share `done` of the training."""
        weights = np.array([kind.weight_at(done) for kind in self._kinds])
        self._shares = weights / weights.sum()

    def plan(self, seed: int, options: dict[str, Any]) -> dict[str, Any]:
        """Return the options with this episode's conditions among them."""
        if not self._kinds:
            return options
        rng = generator(seed, "kind of episode")
        kind = self._kinds[int(rng.choice(len(self._kinds), p=self._shares))]
        drawn = {
            name: values[int(rng.integers(len(values)))] for name, values in kind.scenario.items()
        }
        faults = faults_among(options, self.unwrapped.faults)
        if kind.modes:
            mode = kind.modes[int(rng.integers(len(kind.modes)))]
            robots = kind.robots[int(rng.integers(len(kind.robots)))]
            faults = (*faults, Fault(mode, robots, onset=float(rng.uniform(*kind.onset))))
        return {**options, "scenario": {**drawn, **scenario_fields(options)}, "faults": faults}


def follow_progress(worlds: SwarmVecEnv, done: float) -> None:
    """Mix the episodes of all worlds as it is due after a share `done` of the training."""
    for world in worlds.worlds:
        for layer in layers_of(world):
            if isinstance(layer, EpisodeMix):
                layer.follow(done)


def performances_of_study(directory: str | Path, own: Scenario) -> dict[Condition, float]:
    """Return the mean P [items] of every condition that the study in `directory` ran.

    Args:
        directory: the directory of a study of one policy, the policy to improve on.
        own: the scenario of the training; conditions are relative to it.

    Raises:
        TrainingError: there is no such study, or it is of several policies.
    """
    try:
        results = Study.stored(directory).findings()
    except StudyError as error:
        raise TrainingError(f"indicators.references: {error}") from error
    labels = set(results.performance["policy"])
    if len(labels) != 1:
        raise TrainingError(
            f"indicators.references: the study in {directory} is of {', '.join(sorted(labels))}: "
            "should be of one policy"
        )
    performances: dict[Condition, float] = {}
    for cell in rows_of(results.performance):
        condition = cell.arm.condition
        if cell.n_seeds and not condition.behaviour:
            performances[_met(condition.scenario, condition.faults, own)] = cell.mean
    return performances


def _met(scenario: Scenario, faults: tuple[Fault, ...], own: Scenario) -> Condition:
    counts = {fault.mode: _count(fault) for fault in faults}
    removed = counts.pop("removed", 0)
    return Condition(
        scenario.n_robots,
        tuple(sorted(counts)),
        # The sets of one seed are nested, so the largest is all of them.
        n_failed=max(counts.values(), default=0),
        n_removed=removed,
        changes=changes_of(scenario, own),
    )


def _count(fault: Fault) -> int:
    return len(fault.robots) if isinstance(fault.robots, tuple) else fault.robots
