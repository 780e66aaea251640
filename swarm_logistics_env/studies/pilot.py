"""Pilot: what a study will take, from a few seconds of each of its conditions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.studies.engines import execute
from swarm_logistics_env.studies.plan import Plan
from swarm_logistics_env.studies.runs import Condition
from swarm_logistics_env.studies.store import Store
from swarm_logistics_env.tasks.task import Outcome

PILOT = 3.0  # simulated seconds


@dataclass(frozen=True)
class Expectation:
    """Upper bounds of time and space for a study; runs that deliver all items end earlier.

    Attributes:
        seconds: on one process of this machine [s].
        size: of the store [bytes].
    """

    seconds: float
    size: int


def expect(plan: Plan) -> Expectation:
    """Play the start of one condition per policy and swarm size, and reckon from there.

    Raises:
        StudyError: a policy fails in its first seconds.
    """
    shortened = {_kind(condition): condition for condition in plan.conditions}
    pace = {kind: _pace(plan, condition) for kind, condition in shortened.items()}
    per_seed = sum(pace[_kind(c)] * c.duration for c in plan.conditions)
    n_seeds = len(plan.seeds)
    return Expectation(per_seed * n_seeds, _size(plan, n_seeds))


def _kind(condition: Condition) -> tuple[str, int]:
    return condition.policy.identity, condition.size


def _pace(plan: Plan, condition: Condition) -> float:
    """Return the wall time of a simulated second [s]."""
    duration = min(PILOT, condition.duration)
    scenario = condition.task.vary(condition.scenario, {"duration": duration})
    run = Condition(condition.policy, scenario, task=condition.task).run(plan.code, 0)
    outcomes = [execute(run) for _ in range(2)]  # the first may compile
    for outcome in outcomes:
        if outcome.error is not None:
            reason = outcome.error.strip().splitlines()[-1]
            raise StudyError(
                f"policy {condition.policy.label!r} fails in its first seconds: {reason}"
            )
    return min(outcome.wall_seconds for outcome in outcomes) / duration


def _size(plan: Plan, n_seeds: int) -> int:
    """Return the size of a store with a full delivery of every run [bytes]."""
    sizes = []
    with Store(None) as store:
        # Ten more seeds: a file grows by whole pages.
        for seeds in (range(1), range(1, 11)):
            for run in (c.run(plan.code, seed) for c in plan.conditions for seed in seeds):
                times = np.zeros(getattr(run.condition.scenario, "n_items", 0))
                store.add(run, Outcome(run.key, delivery_times=times))
            sizes.append(store.size)
    return sizes[0] + (n_seeds - 1) * (sizes[1] - sizes[0]) // 10
