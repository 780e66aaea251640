"""Power: how many seeds the claims of a study need, from a pilot."""

from __future__ import annotations

import math
from typing import NamedTuple

from swarm_logistics_env import spi
from swarm_logistics_env.studies.performance_table import Row, rows_of
from swarm_logistics_env.studies.results import StudyResults


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
        unchanged: seeds for the verdict "equivalent" with the wanted power, if the change truly is
            0; None: it is not asked, or the pilot shows no spread.
    """

    test: Row
    effect: float | None
    seeds: int | None = None
    least_power: float | None = None
    detectable: float | None = None
    problem: str | None = None
    unchanged: int | None = None


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
    equivalence = test.equivalence_test
    unchanged = spi.seeds_for_equivalence(equivalence, power) if equivalence else None
    if effect is None:
        no_effect = "no effect is named"
        return Demand(test, None, detectable=detectable, problem=no_effect, unchanged=unchanged)
    seeds = spi.seeds_for_power(estimate, effect, power)
    least = None if seeds is None else spi.lower_decile_of_power(estimate, effect, seeds)
    problem = spi.no_plan_because(estimate, effect)
    return Demand(test, effect, seeds, least, detectable, problem, unchanged)
