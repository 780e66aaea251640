"""Pilot: how long a study will take, from a few seconds of each of its conditions."""

from __future__ import annotations

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.studies.engines import execute
from swarm_logistics_env.studies.plan import Plan
from swarm_logistics_env.studies.runs import Condition

PILOT = 3.0  # simulated seconds


def expected_seconds(plan: Plan) -> float:
    """Return how long a study takes at most on one process of this machine [s].

    The start of one condition is played for each policy and swarm size. Runs that deliver all items
    end earlier than their duration, so this is an upper bound.

    Raises:
        StudyError: a policy fails in its first seconds.
    """
    shortened = {_kind(condition): condition for condition in plan.conditions}
    pace = {kind: _pace(plan, condition) for kind, condition in shortened.items()}
    return len(plan.seeds) * sum(pace[_kind(c)] * c.duration for c in plan.conditions)


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
