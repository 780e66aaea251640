"""From validated samples to an Estimate: the one path that all indicators take."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from .bootstrap import MIN_SEEDS, studentised_bootstrap
from .errors import IndicatorError
from .estimate import Estimate, verdict_at
from .inputs import between_0_and_1, finite, performance, positive_mean, same_seeds
from .ratio import paired_ratio
from .summaries import pairing_correlation
from .unpaired import Term, unpaired_ratio

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import ArrayLike, NDArray

    from .estimate import Indicator


def judge(
    indicator: Indicator,
    terms: Mapping[str, tuple[ArrayLike, float, float]],
    *,
    offset: float,
    threshold: float,
    level: float,
    paired: bool,
    bootstrap: np.random.Generator | None,
) -> Estimate:
    """Estimate one ratio of means and judge it against `threshold`.

    Args:
        indicator: Its name.
        terms: Name to performances over seeds [items] and their weights in numerator and
            denominator; the first two are compared, the last is the reference that the ratio
            divides by.
        offset: Added to the ratio of means.
        threshold: What theta is tested against, finite.
        level: Confidence level, in (0, 1).
        paired: Whether row i of every sample is the same seed.
        bootstrap: Source of the studentised bootstrap, run from ten paired seeds on; None: not run.

    Raises:
        IndicatorError: Performances empty, negative or not finite, unequal seed sets, mean
            reference 0, threshold or level out of range.
    """
    weighted = {
        name: Term(performance(name, sample), in_num, in_den)
        for name, (sample, in_num, in_den) in terms.items()
    }
    finite("threshold", threshold)
    between_0_and_1("level", level)
    samples = {name: term.sample for name, term in weighted.items()}
    if paired:
        same_seeds(**samples)
    elif bootstrap is not None:
        raise IndicatorError("bootstrap with paired=False: only paired seeds can be resampled")
    *_, (reference_name, reference) = samples.items()
    positive_mean(reference_name, reference)
    n_seeds = min(sample.size for sample in samples.values())
    if n_seeds == 1:
        mean_den = float(reference.mean())
        mean_num = sum(term.in_num * float(term.sample.mean()) for term in weighted.values())
        return Estimate(
            indicator=indicator,
            value=mean_num / mean_den + offset,
            low=None,
            high=None,
            probability=None,
            verdict="inconclusive",
            threshold=threshold,
            level=level,
            n_seeds=n_seeds,
            p_value=None,
            paired=paired,
            pairing_correlation=None,
            difference_sd=None,
            mean_denominator=mean_den,
            degrees_of_freedom=None,
            flags=("single_seed",),
        )

    flags = []
    correlation, bootstrap_low, bootstrap_high = None, None, None
    if paired:
        num, den = _numerator(weighted), reference
        test = paired_ratio(num, den, offset=offset, threshold=threshold, level=level)
        correlation = pairing_correlation(*list(samples.values())[:2])
        # Where D has no spread there is nothing but rounding to be skewed.
        if not test.degenerate and _skewed(num - (threshold - offset) * den):
            flags.append("skewed")
        if bootstrap is not None and n_seeds >= MIN_SEEDS:
            bootstrap_low, bootstrap_high = studentised_bootstrap(
                num, den, bootstrap, offset=offset, level=level
            )
    else:
        test = unpaired_ratio(
            list(weighted.values()), offset=offset, threshold=threshold, level=level
        )
    if test.degenerate:
        flags.append("degenerate")
    if test.unbounded:
        flags.append("unbounded")
    p_value, probability = float(test.p_value), float(test.probability)
    return Estimate(
        indicator=indicator,
        value=float(test.value),
        low=float(test.low),
        high=float(test.high),
        probability=probability,
        verdict=verdict_at(1.0 - level, p_value, probability),
        threshold=threshold,
        level=level,
        n_seeds=n_seeds,
        p_value=p_value,
        paired=paired,
        pairing_correlation=correlation,
        difference_sd=float(test.difference_sd),
        mean_denominator=float(test.mean_denominator),
        degrees_of_freedom=test.degrees_of_freedom,
        bootstrap_low=bootstrap_low,
        bootstrap_high=bootstrap_high,
        flags=tuple(flags),
    )


def _numerator(terms: Mapping[str, Term]) -> NDArray[np.float64]:
    numerator = np.zeros_like(next(iter(terms.values())).sample)
    for term in terms.values():
        numerator += term.in_num * term.sample
    return numerator


def _skewed(difference: NDArray[np.float64]) -> bool:
    """Whether n is too small for the skewness of D: Cochran's n > 25 g^2 fails, beyond chance.

    Cochran (1977, Sampling Techniques, 2.15) gives the rule for the population's g. That of a few
    seeds scatters, so it must also exceed twice its standard error under a normal D.
    """
    n = difference.size
    deviation = difference - difference.mean()
    spread = math.sqrt(float(np.mean(deviation**2)))
    if n < 3 or spread == 0.0:
        return False
    g = float(np.mean((deviation / spread) ** 3)) * math.sqrt(n * (n - 1)) / (n - 2)
    standard_error = math.sqrt(6 * n * (n - 1) / ((n - 2) * (n + 1) * (n + 3)))
    return abs(g) > max(math.sqrt(n / 25), 2.0 * standard_error)
