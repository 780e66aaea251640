"""What a study of n seeds can find, and how many seeds a named effect needs."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable

from .equivalence import Equivalence
from .estimate import Estimate
from .inputs import IndicatorError, between_0_and_1, count, finite

MAX_SEEDS = 1_000_000
# A pilot's own spread is as often too small as too large, and power falls faster on the one side
# than it rises on the other: planned with it, a promised 0.80 is 0.56 to 0.74 on average for pilots
# of 3 to 10 seeds. With this upper confidence limit it is 0.76 for 3 and 0.80 to 0.82 for 5 to 20.
PLANNED_LIMIT = 0.6
UNLUCKY_LIMIT = 0.9  # confidence limit of the spread that one pilot in ten exceeds
# Beyond this critical t, as of two seeds at an early look, the statistic's normal part is lost
# beside its chi-squared one, and the noncentral t would be summed over so many terms.
_FAR_OUT = 1e3


def minimum_detectable_effect(estimate: Estimate, power: float = 0.8) -> float | None:
    """Distance from the threshold that the estimate's own number of seeds finds with `power`.

    In units of the indicator; the same on both sides, by two one-sided tests of
    (1 - confidence)/2. With the spread's 60 % upper confidence limit, so that the power is `power`
    on average. None where `no_plan_because` says why.

    Raises:
        IndicatorError: power outside (0, 1) or not above the tests' own (1 - confidence)/2.
    """
    _check_power(estimate, power)
    sd, df = _spread_limit(estimate, PLANNED_LIMIT), estimate.degrees_of_freedom
    if not sd or df is None:
        return None
    return (
        _noncentrality(df, estimate.confidence, power)
        * sd
        / math.sqrt(estimate.n_seeds)
        / estimate.mean_denominator
    )


def seeds_for_power(estimate: Estimate, effect: float, power: float = 0.8) -> int | None:
    """Seeds that a verdict needs if the indicator truly is `effect`.

    The spread is the 60 % upper confidence limit of the estimate's, so that the power is `power` on
    average over pilots; `lower_decile_of_power` is the power that nine pilots of ten keep. Take the
    effect from elsewhere (the paper's value, or the least one that matters), never the one just
    observed. If samples are not paired, the result is the number of seeds per sample.

    Args:
        estimate: The pilot, from at least two seeds.
        effect: Assumed true value of the indicator, in its units, not the distance to threshold.
        power: Wanted probability of the verdict, in (0, 1).

    Returns:
        The smallest n >= 2; None where `no_plan_because` says why.

    Raises:
        IndicatorError: effect not finite; power outside (0, 1) or not above (1 - confidence)/2.
    """
    _check_power(estimate, power)
    if no_plan_because(estimate, effect) is not None:
        return None

    return _least_seeds(lambda n: _power_at(estimate, effect, n, PLANNED_LIMIT) >= power)


def seeds_for_equivalence(equivalence: Equivalence, power: float = 0.8) -> int | None:
    """Seeds that the verdict "equivalent" needs if the change truly is 0.

    Both tests have to reject: the chance of that is at least the sum of their powers less 1. The
    spread is the one of `seeds_for_power`.

    Returns:
        The smallest n >= 2; None where the runs are the same, or show no spread.

    Raises:
        IndicatorError: power outside (0, 1) or not above alpha.
    """
    tests = equivalence.above, equivalence.below
    for test in tests:
        _check_power(test, power)
    if equivalence.change.difference_sd in (None, 0.0) or any(
        no_plan_because(test, 0.0) is not None for test in tests
    ):
        return None

    def enough(n: int) -> bool:
        return sum(_power_at(test, 0.0, n, PLANNED_LIMIT) for test in tests) - 1.0 >= power

    return _least_seeds(enough)


def lower_decile_of_power(estimate: Estimate, effect: float, n_seeds: int) -> float | None:
    """Power that `n_seeds` have or exceed in nine pilots of ten if the indicator is `effect`.

    With the 90 % upper confidence limit of the estimate's spread. None where `no_plan_because`
    says why.

    Raises:
        IndicatorError: effect not finite, n_seeds below 2.
    """
    if count("n_seeds", n_seeds) < 2:
        raise IndicatorError(f"n_seeds = {n_seeds}: should be at least 2")
    if no_plan_because(estimate, effect) is not None:
        return None
    return _power_at(estimate, effect, n_seeds, UNLUCKY_LIMIT)


def no_plan_because(estimate: Estimate, effect: float) -> str | None:
    """Why no number of seeds can be named for `effect`; None where one can."""
    finite("effect", effect)
    if estimate.identical:
        return "the runs compared are the same runs: the value is exact"
    if estimate.difference_sd is None:
        return "one seed shows no spread between seeds"
    if estimate.difference_sd == 0.0:
        return "the runs show no spread between seeds"
    if effect == estimate.threshold:
        return f"an effect of {effect:g} lies at the threshold: no number of seeds finds it"
    # Large samples need (z_confidence + z_power)^2 sd^2 / distance^2 seeds, about 8 at 80 %.
    distance = abs(effect - estimate.threshold) * estimate.mean_denominator
    if 8.0 * (_spread_limit(estimate, PLANNED_LIMIT) / distance) ** 2 > MAX_SEEDS:
        return f"an effect of {effect:g} needs more than {MAX_SEEDS:,} seeds"
    return None


def _least_seeds(enough: Callable[[int], bool]) -> int:
    """Return the smallest n >= 2 that is enough; more than enough is enough too."""
    high = 2
    while not enough(high):
        high *= 2
    return 2 + bisect_left(range(2, high), x=True, key=enough)


def _check_power(estimate: Estimate, power: float) -> None:
    between_0_and_1("power", power)
    error = (1.0 - estimate.confidence) / 2
    if power <= error:
        raise IndicatorError(f"power = {power}: should exceed the one-sided error {error:g}")


def _spread_limit(estimate: Estimate, confidence: float) -> float:
    """Upper confidence limit of the standard deviation of D; 0 where there is none."""
    from scipy.special import chdtri

    sd, df = estimate.difference_sd, estimate.degrees_of_freedom
    if not sd or df is None:
        return 0.0
    return sd * math.sqrt(df / float(chdtri(df, confidence)))


def _power_at(estimate: Estimate, effect: float, n_seeds: int, confidence: float) -> float:
    """Power of so many seeds with that upper confidence limit of the spread."""
    assert estimate.degrees_of_freedom is not None
    distance = abs(effect - estimate.threshold) * estimate.mean_denominator
    # Welch's degrees of freedom grow with n - 1, as the paired ones do.
    df = estimate.degrees_of_freedom * (n_seeds - 1) / (estimate.n_seeds - 1)
    noncentrality = distance / _spread_limit(estimate, confidence) * math.sqrt(n_seeds)
    return _power(df, noncentrality, estimate.confidence)


def _power(df: float, noncentrality: float, confidence: float) -> float:
    """Chance of a verdict on the right side by the one-sided t-test of (1 - confidence)/2."""
    from scipy.special import chdtr, nctdtr, stdtrit

    critical = float(stdtrit(df, 0.5 + confidence / 2))
    if critical > _FAR_OUT:
        return float(chdtr(df, df * (noncentrality / critical) ** 2))
    return 1.0 - float(nctdtr(df, noncentrality, critical))


def _noncentrality(df: float, confidence: float, power: float) -> float:
    """Noncentrality at which the one-sided test of (1 - confidence)/2 has the wanted power."""
    from scipy.special import chdtri, nctdtrinc, stdtrit

    critical = float(stdtrit(df, 0.5 + confidence / 2))
    if critical > _FAR_OUT:
        return critical * math.sqrt(float(chdtri(df, 1.0 - power)) / df)
    return float(nctdtrinc(df, 1.0 - power, critical))
