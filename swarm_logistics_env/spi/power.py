"""What a study of n seeds can find, and how many seeds a named effect needs."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable

import numpy as np

from .equivalence import Equivalence
from .estimate import Estimate
from .inputs import IndicatorError, Numbers, between_0_and_1, count, finite
from .ratio import MIN_SEEDS
from .summaries import STALL_MARGIN, critical_with_hidden

MAX_SEEDS = 1_000_000
# A pilot's own spread is as often too small as too large, and power falls faster on the one side
# than it rises on the other: planned with it, a promised 0.80 is 0.56 to 0.74 on average for pilots
# of 3 to 10 seeds. With this upper confidence limit it is 0.76 for 3 and 0.80 to 0.82 for 5 to 20.
# Of counts like those under FM4 a small pilot shows too little of the tail as well: 0.61 to 0.72
# for 10 seeds, 0.66 to 0.74 for 20, 0.78 for 100, 0.79 to 0.80 for thousands.
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
    from scipy.optimize import brentq

    _check_power(estimate, power)
    if estimate.untestable:
        return None
    spread = _spread_limit(estimate, PLANNED_LIMIT) / estimate.mean_denominator
    if not spread:
        return None

    def excess(distance: float) -> float:
        return power - min(
            _power_at(estimate, side * distance, n, PLANNED_LIMIT) for side in (-1, 1)
        )

    n, enough = estimate.n_seeds, spread
    while excess(enough) > 0.0:
        enough *= 2.0
    return float(brentq(excess, 0.0, enough, xtol=1e-9 * spread))


def seeds_for_power(estimate: Estimate, effect: float, power: float = 0.8) -> int | None:
    """Seeds that a verdict needs if the indicator truly is `effect`.

    The spread is the 60 % upper confidence limit of the estimate's, so that the power is `power` on
    average over pilots of normal differences (0.6 to 0.75 after 10 or 20 seeds of counts as skewed
    as those under FM4); `lower_decile_of_power` is the power that nine pilots of ten keep. The plan
    counts the skewness that the pilot shows and the stalls that a verdict has to exclude. Take the
    effect from elsewhere (the paper's value, or the least one that matters), never the one just
    observed. If samples are not paired, the result is the number of seeds per sample.

    Args:
        estimate: The pilot, from at least two seeds.
        effect: Assumed true value of the indicator, in its units, not the distance to threshold.
        power: Wanted probability of the verdict, in (0, 1).

    Returns:
        The smallest n >= 10, as fewer seeds give no verdict for a headline; None where
        `no_plan_because` says why.

    Raises:
        IndicatorError: effect not finite; power outside (0, 1) or not above (1 - confidence)/2.
    """
    _check_power(estimate, power)
    if no_plan_because(estimate, effect) is not None:
        return None

    distance = effect - estimate.threshold
    return _least_seeds(lambda n: _power_at(estimate, distance, n, PLANNED_LIMIT) >= power)


def seeds_for_equivalence(equivalence: Equivalence, power: float = 0.8) -> int | None:
    """Seeds that the verdict "equivalent" needs if the change truly is 0.

    Both tests have to reject: the chance of that is at least the sum of their powers less 1. The
    spread is the one of `seeds_for_power`.

    Returns:
        The smallest n >= 10; None where the runs are the same, or show no spread.

    Raises:
        IndicatorError: power outside (0, 1) or not above alpha.
    """
    tests = equivalence.above, equivalence.below
    _check_power(equivalence.change, power)
    if equivalence.change.difference_sd in (None, 0.0) or any(
        no_plan_because(test, 0.0) is not None for test in tests
    ):
        return None

    def enough(n: int) -> bool:
        powers = (_power_at(test, -test.threshold, n, PLANNED_LIMIT) for test in tests)
        return sum(powers) - 1.0 >= power

    return _least_seeds(enough)


def seeds_against_stalls(estimate: Estimate) -> int | None:
    """Seeds below which no verdict can be had at the value found: too many stalls may be hidden.

    So many seeds of which none stalls leave too little chance for a share that would move the value
    to the threshold. None where the verdict is not withheld for hidden stalls.
    """
    if "hidden_stalls" not in estimate.flags:
        return None
    distance = (estimate.value - estimate.threshold) * estimate.mean_denominator
    share = min(abs(distance) / estimate.at_stake[distance < 0.0], 0.5)
    error = (1.0 - estimate.confidence) / 2
    fewest = math.log(error / STALL_MARGIN) / math.log1p(-share)
    return max(math.floor(fewest), estimate.n_seeds) + 1


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
    return _power_at(estimate, effect - estimate.threshold, n_seeds, UNLUCKY_LIMIT)


def no_plan_because(estimate: Estimate, effect: float) -> str | None:
    """Why no number of seeds can be named for `effect`; None where one can."""
    finite("effect", effect)
    if estimate.identical:
        return "the runs compared are the same runs: the value is exact"
    if estimate.untestable:
        return f"it cannot lie below {estimate.threshold:g}: there is nothing to find"
    if estimate.n_trainings is not None:
        return "of several trainings no number of seeds is planned: more trainings tell more"
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
    """Return the smallest n that is enough and can give a headline verdict, ten or more."""
    high = MIN_SEEDS
    while not enough(high):
        high *= 2
    return MIN_SEEDS + bisect_left(range(MIN_SEEDS, high), x=True, key=enough)


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


def _power_at(estimate: Estimate, distance: float, n_seeds: int, confidence: float) -> float:
    """Power of so many seeds at a distance from the threshold, with that limit of the spread."""
    from scipy.special import chdtr, nctdtr

    assert estimate.degrees_of_freedom is not None
    # Welch's degrees of freedom grow with n - 1, as the paired ones do.
    df = estimate.degrees_of_freedom * (n_seeds - 1) / (estimate.n_seeds - 1)
    standard_error = _spread_limit(estimate, confidence) / math.sqrt(n_seeds)
    noncentrality = abs(distance) * estimate.mean_denominator / standard_error
    # Skewness g, of a long tail of D on the far side of the threshold, spreads the statistic: mean
    # and spread of the seeds then move together (as those of gamma variables, whose excess kurtosis
    # is 1.5 g^2).
    side = 1 if distance > 0.0 else -1
    g = max(0.0, -side * (estimate.difference_skewness or 0.0))
    critical = _critical(estimate, side, g, n_seeds, df, standard_error)
    drift = noncentrality / math.sqrt(n_seeds)
    usual = 1.0 + drift**2 / 2.0
    noncentrality = critical + (noncentrality - critical) * math.sqrt(
        usual / (usual + g * drift + 0.375 * (g * drift) ** 2)
    )
    if critical > _FAR_OUT:
        return float(chdtr(df, df * (noncentrality / critical) ** 2))
    # Where the statistic lies far above, SciPy has no number for the chance that it is lower.
    return 1.0 - float(np.nan_to_num(nctdtr(df, noncentrality, critical)))


def _critical(
    estimate: Estimate, side: int, g: float, n_seeds: int, df: float, standard_error: float
) -> float:
    """Statistic that the verdict on a side (-1: refuted, 1: supported) needs at so many seeds.

    Args:
        g: skewness of D away from that side.
    """
    from scipy.special import ndtri, stdtrit

    # What the bootstrap asks for beyond the t test (Hall 1992, The Bootstrap and Edgeworth
    # Expansion, 2.6).
    tail = g / (6.0 * math.sqrt(n_seeds))

    def quantile(p: Numbers) -> Numbers:
        return np.asarray(stdtrit(df, 1.0 - p) + tail * (2.0 * ndtri(p) ** 2 + 1.0))

    lost = estimate.at_stake[side < 0] if n_seeds >= MIN_SEEDS else 0.0
    error = (1.0 - estimate.confidence) / 2
    return critical_with_hidden(quantile, error, lost / standard_error, n_seeds)
