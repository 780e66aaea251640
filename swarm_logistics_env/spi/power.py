"""What a study of n seeds can find, and how many seeds a named effect needs."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable

import numpy as np

from .equivalence import Equivalence
from .estimate import SEEDS_OF_HEADLINE, Estimate
from .hidden import Hidden, remainder_and_chance
from .inputs import IndicatorError, Numbers, between_0_and_1, count, finite
from .ratio import log_ratio, statistic

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
_FARTHEST = 1e6  # times the base: there the logarithm, of means that are raised, has its end
_SHARES = 11  # points at which a plan counts what stalls may hide


def minimum_detectable_effect(estimate: Estimate, power: float = 0.8) -> float | None:
    """Distance from the threshold that the estimate's own number of seeds finds with `power`.

    In units of the indicator; the same on both sides, by two one-sided tests of
    (1 - confidence)/2. With the spread's 60 % upper confidence limit, so that the power is `power`
    on average. None where `no_plan_because` says why, or where no effect is found at that spread.

    Raises:
        IndicatorError: power outside (0, 1) or not above the tests' own (1 - confidence)/2.
    """
    from scipy.optimize import brentq

    _check_power(estimate, power)
    if estimate.untestable:
        return None
    # Without a base, nothing was delivered on one side, and no distance is small or large.
    if not estimate.base or not _spread_limit(estimate, PLANNED_LIMIT):
        return None
    n = estimate.n_seeds
    lowest = estimate.base / estimate.mean_denominator

    def excess(distance: float) -> float:
        # No P is below 0: farther below the threshold than that the indicator cannot lie.
        sides = (-1, 1) if distance < lowest else (1,)
        return power - min(_power_at(estimate, side * distance, n, PLANNED_LIMIT) for side in sides)

    farthest = _FARTHEST * lowest
    if excess(farthest) > 0.0:
        return None
    return float(brentq(excess, 0.0, farthest, xtol=1e-12 * lowest))


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
    if equivalence.change.log_sd in (None, 0.0) or any(
        no_plan_because(test, 0.0) is not None for test in tests
    ):
        return None

    def enough(n: int) -> bool:
        powers = (_power_at(test, -test.threshold, n, PLANNED_LIMIT) for test in tests)
        return sum(powers) - 1.0 >= power

    return _least_seeds(enough)


def seeds_against_stalls(estimate: Estimate) -> int | None:
    """Seeds that would decide at the value and the spread found, if as few of them stall.

    None where the verdict is not withheld for hidden stalls.
    """
    if "hidden_stalls" not in estimate.flags:
        return None
    distance = estimate.value - estimate.threshold

    def enough(n: int) -> bool:
        needed, reached = _needed(estimate, distance, n, estimate.log_sd or 0.0)
        return reached > needed

    return _least(enough, estimate.n_seeds + 1)


def trainings_against_collapses(estimate: Estimate) -> int | None:
    """Trainings that would exclude, at the value found, so many collapses as turn the verdict.

    So many of which as large a share collapses as of those seen. None where the verdict is not
    withheld for hidden collapses.
    """
    if "hidden_collapses" not in estimate.flags:
        return None
    more, less, hidden = _sides(estimate, estimate.value - estimate.threshold)
    assert hidden is not None
    turning = 1.0 - float((1.0 - hidden.seen / hidden.of) * less / more)
    error = (1.0 - estimate.confidence) / 2

    def enough(n: int) -> bool:
        further = Hidden(np.floor(hidden.seen / hidden.of * n), n, hidden.most)
        return float(remainder_and_chance(turning, further)[1]) < error

    return _least(enough, hidden.of + 1)


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
    if "cannot_fail" in estimate.flags:
        return f"it cannot lie below {estimate.threshold:g}: there is nothing to find"
    if estimate.untestable:
        return "these runs deliver too little, or all the same, to plan others by"
    if estimate.n_trainings is not None:
        return "of several trainings no number of seeds is planned: more trainings tell more"
    if estimate.log_sd is None:
        return "one seed shows no spread between seeds"
    if estimate.log_sd == 0.0:
        return "the runs show no spread between seeds"
    if effect == estimate.threshold:
        return f"an effect of {effect:g} lies at the threshold: no number of seeds finds it"
    # Large samples need (z_confidence + z_power)^2 sd^2 / distance^2 seeds, about 8 at 80 %.
    more, less, _ = _sides(estimate, effect - estimate.threshold)
    distance = float(log_ratio(more, less))
    if 8.0 * (_spread_limit(estimate, PLANNED_LIMIT) / distance) ** 2 > MAX_SEEDS:
        return f"an effect of {effect:g} needs more than {MAX_SEEDS:,} seeds"
    return None


def _least_seeds(enough: Callable[[int], bool]) -> int:
    """Return the smallest n that is enough and can give a headline verdict, ten or more."""
    return _least(enough, SEEDS_OF_HEADLINE)


def _least(enough: Callable[[int], bool], least: int) -> int:
    """Return the smallest n that is enough, from `least` on."""
    high = least
    while not enough(high):
        high *= 2
    return least + bisect_left(range(least, high), x=True, key=enough)


def _check_power(estimate: Estimate, power: float) -> None:
    between_0_and_1("power", power)
    error = (1.0 - estimate.confidence) / 2
    if power <= error:
        raise IndicatorError(f"power = {power}: should exceed the one-sided error {error:g}")


def _spread_limit(estimate: Estimate, confidence: float) -> float:
    """Upper confidence limit of the standard deviation of the logarithm; 0 where there is none."""
    from scipy.special import chdtri

    sd = estimate.log_sd
    df = estimate.degrees_of_freedom
    if not sd or df is None:
        return 0.0
    return sd * math.sqrt(df / float(chdtri(df, confidence)))


def _power_at(estimate: Estimate, distance: float, n_seeds: int, confidence: float) -> float:
    """Power of so many seeds at a distance from the threshold, with that limit of the spread."""
    from scipy.special import chdtr, nctdtr

    df = _degrees_of_freedom(estimate, n_seeds)
    critical, reached = _needed(estimate, distance, n_seeds, _spread_limit(estimate, confidence))
    if critical > _FAR_OUT:
        return float(chdtr(df, df * (reached / critical) ** 2))
    # Where the statistic lies far above, SciPy has no number for the chance that it is lower.
    return 1.0 - float(np.nan_to_num(nctdtr(df, reached, critical)))


def _needed(estimate: Estimate, distance: float, n: int, sd: float) -> tuple[float, float]:
    """Statistic that a verdict of n seeds needs, and the one expected at that distance.

    Args:
        sd: Standard deviation of the logarithm.
    """
    from scipy.special import stdtrit

    df = _degrees_of_freedom(estimate, n)
    s = np.asarray(sd / math.sqrt(n))
    more, less, hidden = _sides(estimate, distance)
    error = (1.0 - estimate.confidence) / 2
    reached = float(statistic(log_ratio(more, less), s))
    needed = float(stdtrit(df, 1.0 - error))
    if hidden is not None:
        seen = Hidden(np.floor(hidden.seen / hidden.of * n), n, hidden.most)
        shares = np.linspace(0.0, hidden.most, _SHARES)[1:]
        remaining, chance = remainder_and_chance(shares, seen)
        counts = chance > error
        lost = reached - statistic(log_ratio(more * remaining[counts], less), s)
        needed_if_hidden = stdtrit(df, 1.0 - error / chance[counts]) + lost
        needed = float(np.max(needed_if_hidden, initial=needed))
    return needed, reached


def _sides(estimate: Estimate, distance: float) -> tuple[Numbers, Numbers, Hidden | None]:
    """Return the larger and the smaller mean at a distance, and what the larger one may hide."""
    assert estimate.base is not None
    base = np.asarray(estimate.base)
    moved = np.maximum(0.0, base + distance * estimate.mean_denominator)
    for_it, against = estimate.hidden
    return (moved, base, for_it) if distance > 0.0 else (base, moved, against)


def _degrees_of_freedom(estimate: Estimate, n_seeds: int) -> float:
    """Welch's degrees of freedom grow with n - 1, as the paired ones do."""
    assert estimate.degrees_of_freedom is not None
    return estimate.degrees_of_freedom * (n_seeds - 1) / (estimate.n_seeds - 1)
