"""Power: how many seeds the claims of a study need, from a pilot."""

from __future__ import annotations

from dataclasses import dataclass

from swarm_logistics_env import spi
from swarm_logistics_env.studies.results import IndicatorTest, StudyResults


@dataclass(frozen=True)
class Demand:
    """The number of seeds that one comparison needs.

    Attributes:
        test: of the pilot.
        effect: assumed true value of the indicator: the one named, or the published one.
        seeds: for a verdict at that effect with the wanted power on average; None: `problem` says
            why.
        least_power: that so many seeds have in nine pilots of ten; None as `seeds`.
        detectable: distance from the threshold that the pilot's own seeds would find.
        problem: why there is no number of seeds.
    """

    test: IndicatorTest
    effect: float | None
    seeds: int | None
    least_power: float | None
    detectable: float | None
    problem: str | None


def demands(
    results: StudyResults, effect: float | None = None, power: float = 0.8
) -> tuple[Demand, ...]:
    """Return what every comparison of a study needs, from the spread that its runs show.

    Only the spread is taken from them. The effect is to come from elsewhere: the least that
    matters, or the published value; never the one that the pilot itself happened to show.

    Args:
        results: of the pilot, from at least two seeds.
        effect: assumed true value of every indicator, in its units; None: the published one.
        power: wanted probability of a verdict, in (0, 1).

    Raises:
        IndicatorError: effect not finite, power outside (0, 1).
    """
    return tuple(_demand(test, effect, power) for test in results.tests)


def _demand(test: IndicatorTest, effect: float | None, power: float) -> Demand:
    assumed = test.published if effect is None else effect
    estimate = test.estimate
    if estimate is None:
        return Demand(test, assumed, None, None, None, test.problem)
    detectable = spi.minimum_detectable_effect(estimate, power)
    if assumed is None:
        return Demand(test, None, None, None, detectable, "no effect is named")
    seeds = spi.seeds_for_power(estimate, assumed, power)
    return Demand(
        test,
        assumed,
        seeds,
        None if seeds is None else spi.lower_decile_of_power(estimate, assumed, seeds),
        detectable,
        spi.no_plan_because(estimate, assumed),
    )
