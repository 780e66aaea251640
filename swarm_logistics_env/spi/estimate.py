"""The record that every indicator returns, and the rule that turns a test into a verdict."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Indicator = Literal["S", "FT", "R", "A", "change", "resilience"]
Verdict = Literal["supported", "refuted", "inconclusive"]


@dataclass(frozen=True, slots=True)
class Estimate:
    """One indicator over n seeds: theta = mean(num) / mean(den) + offset, with its judgement.

    Everything but `value`, `verdict` and the description of the input is None at n = 1.

    Attributes:
        indicator: Which indicator this is.
        value: The ratio of means plus offset, dimensionless.
        low: Lower limit of the interval at `level`; -inf where the interval is unbounded.
        high: Upper limit of the interval; inf where the interval is unbounded.
        probability: t-CDF of mean(D)/se(D), D = num - (threshold - offset) den, in [0, 1]: the
            confidence that theta > threshold, not a posterior frequency.
        verdict: On theta > threshold, one-sided (1 - level)/2 on each side, unadjusted.
        threshold: The value that theta is tested against.
        level: Confidence level of the interval, in (0, 1).
        n_seeds: Number of seeds; of the smallest sample where unpaired.
        p_value: Two-sided p of mean(D) = 0, in [0, 1]: what Holm acts on.
        paired: Whether the samples share their seeds, row by row.
        pairing_correlation: Pearson correlation of the two performances compared (P_F and P_S for
            FT); None where unpaired, below three seeds, or where one of them is constant.
        difference_sd: Standard deviation of D over seeds, in items; where unpaired se(D) sqrt(n).
        mean_denominator: mean(den), in items.
        degrees_of_freedom: Of the t-test: n - 1, or Welch's where unpaired.
        bootstrap_low: Lower limit of the studentised bootstrap; None below ten seeds or unasked.
        bootstrap_high: Its upper limit.
        flags: Of "single_seed", "degenerate" (se(D) = 0: the interval is the point), "unbounded"
            (the mean denominator is not distinguishable from 0), "skewed" (D is so skewed that the
            interval covers less than its level at this n).
    """

    indicator: Indicator
    value: float
    low: float | None
    high: float | None
    probability: float | None
    verdict: Verdict
    threshold: float
    level: float
    n_seeds: int
    p_value: float | None
    paired: bool
    pairing_correlation: float | None
    difference_sd: float | None
    mean_denominator: float
    degrees_of_freedom: float | None
    bootstrap_low: float | None = None
    bootstrap_high: float | None = None
    flags: tuple[str, ...] = ()


def verdict_at(alpha: float, p_value: float | None, probability: float | None) -> Verdict:
    """Judge theta > threshold by a two-sided p at level `alpha`; `probability` gives the side.

    No p (one seed) is inconclusive.
    """
    if p_value is None or probability is None or not p_value < alpha:
        return "inconclusive"
    return "supported" if probability > 0.5 else "refuted"
