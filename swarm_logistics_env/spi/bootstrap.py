"""Studentised paired bootstrap: a check of the interval that assumes no distribution."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .errors import IndicatorError
from .inputs import between_0_and_1
from .ratio import ROUNDING, fieller_limits

if TYPE_CHECKING:
    from numpy.typing import NDArray

MIN_SEEDS = 10  # below, too few distinct resamples to studentise


def studentised_bootstrap(
    num: NDArray[np.float64],
    den: NDArray[np.float64],
    generator: np.random.Generator,
    *,
    offset: float = 0.0,
    level: float = 0.95,
    resamples: int = 9_999,
) -> tuple[float, float]:
    """Interval of mean(num)/mean(den) + offset from resampled pairs of seeds.

    Fieller's pivot mean(D)/se(D), D = num - theta den, with Student's quantiles replaced by those
    of the resampled pivot (at theta = the estimate). Dividing by se(D) of each resample is what
    keeps the coverage at ten seeds; percentile and BCa intervals lose it.

    Args:
        num: Numerators over seeds, shape (n,), n >= 10.
        den: Denominators over the same seeds, mean > 0.
        generator: The only source of randomness; equal states give equal limits.
        offset: Added to both limits.
        level: Confidence level, in (0, 1).
        resamples: Number of resamples.

    Returns:
        Lower and upper limit; -inf, inf where the mean denominator is not clear of 0.

    Raises:
        IndicatorError: Fewer than ten seeds, or level out of range.
    """
    between_0_and_1("level", level)
    n = num.size
    if n < MIN_SEEDS:
        raise IndicatorError(
            f"{n} seeds: the studentised bootstrap should have at least {MIN_SEEDS}"
        )
    value = float(num.mean() / den.mean())
    difference = num - value * den
    rounding = ROUNDING * float(np.abs(num).max() + abs(value) * den.max())
    if np.ptp(difference) <= rounding:
        return value + offset, value + offset
    drawn = difference[generator.integers(n, size=(resamples, n))]
    mean, sd = drawn.mean(axis=1), drawn.std(axis=1, ddof=1)
    # A resample without spread is as far out as its sign says: leaving it out would narrow.
    flat = sd <= rounding
    pivot = np.where(
        flat,
        np.where(np.abs(mean) <= rounding, 0.0, np.copysign(np.inf, mean)),
        np.sqrt(n) * mean / np.where(flat, 1.0, sd),
    )
    tail = (1.0 - level) / 2
    # method: an infinite pivot must not be averaged with a finite one
    t_high, t_low = np.quantile(pivot, [tail, 1.0 - tail], method="inverted_cdf")
    if not np.isfinite([t_low, t_high]).all():
        return -np.inf, np.inf
    low, high, _ = fieller_limits(num, den, float(t_low), -float(t_high))
    return float(low) + offset, float(high) + offset
