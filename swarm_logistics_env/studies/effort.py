"""How much effort a study takes: its time, and the seeds that its claims need."""

from __future__ import annotations

import math
from typing import NamedTuple

from swarm_logistics_env import spi
from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.studies.engines import execute
from swarm_logistics_env.studies.performance_table import Row, rows_of
from swarm_logistics_env.studies.plan import Plan
from swarm_logistics_env.studies.results import StudyResults
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


class Demand(NamedTuple):
    """The number of seeds that one comparison needs.

    Attributes:
        test: the row of the pilot's table of indicators.
        effect: assumed true value of the indicator: the one named, or the published one.
        seeds: for a verdict at that effect with the wanted power on average; None: `problem` says
            why.
        least_power: power that so many seeds reach in nine pilots of ten; None as `seeds`.
        detectable: distance from the threshold that the pilot's own seeds would find.
        problem: why there is no number of seeds.
    """

    test: Row
    effect: float | None
    seeds: int | None = None
    least_power: float | None = None
    detectable: float | None = None
    problem: str | None = None


def demands(
    results: StudyResults, effect: float | None = None, power: float = 0.8
) -> tuple[Demand, ...]:
    """Return what every comparison of a study needs, from the spread that its runs show.

    Only the spread is taken from them. The effect is to come from elsewhere: the least that
    matters, or the published value; never the one that the pilot itself happened to show.

    Args:
        results: the results of the pilot, from at least two seeds.
        effect: assumed true value of every indicator, in its units; None: the published one.
        power: wanted probability of a verdict, in (0, 1).

    Raises:
        IndicatorError: effect not finite, power outside (0, 1).
    """
    return tuple(_demand(test, effect, power) for test in rows_of(results.indicators))


def _demand(test: Row, effect: float | None, power: float) -> Demand:
    estimate = test.estimate
    if effect is None and not math.isnan(test.published):
        effect = test.published
    if estimate is None:
        return Demand(test, effect, problem=test.problem)
    detectable = spi.minimum_detectable_effect(estimate, power)
    if effect is None:
        return Demand(test, None, detectable=detectable, problem="no effect is named")
    seeds = spi.seeds_for_power(estimate, effect, power)
    least = None if seeds is None else spi.lower_decile_of_power(estimate, effect, seeds)
    problem = spi.no_plan_because(estimate, effect)
    return Demand(test, effect, seeds, least, detectable, problem)
