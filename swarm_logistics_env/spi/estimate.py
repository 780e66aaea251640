"""The record that every indicator returns, and the rule that turns a test into a verdict."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Indicator = Literal["S", "FT", "R", "A", "change", "resilience"]
Verdict = Literal["supported", "refuted", "inconclusive"]


@dataclass(frozen=True, slots=True)
class Estimate:
    """One indicator over n seeds: theta = mean(num) / mean(den) + offset, with its judgement.

    Everything but `value`, `verdict` and the description of the input is None at n = 1, and where
    the runs compared are the same runs.

    Attributes:
        indicator: Which indicator this is.
        value: The ratio of means plus offset, dimensionless.
        low: Lower limit of the interval at `level`; -inf where the interval is unbounded. None at
            n = 1 and where the differences show no spread; `value` where the value is exact.
        high: Upper limit of the interval; inf where the interval is unbounded; None as `low`.
        probability: Confidence that theta > threshold, in [0, 1], not a posterior frequency:
            1 - p/2 where mean(D) > 0, else p/2, D = num - (threshold - offset) den.
        verdict: On theta > threshold, one-sided (1 - level)/2 on each side, unadjusted.
        threshold: The value that theta is tested against.
        level: Confidence level of the interval, in (0, 1).
        n_seeds: Number of seeds; of the smallest sample where unpaired.
        p_value: Two-sided p of mean(D) = 0, in [0, 1]: what Holm acts on. From ten paired seeds on
            the larger of the t test's and the studentised bootstrap's.
        paired: Whether the samples share their seeds, row by row.
        pairing_correlation: Pearson correlation of the two performances compared (P_F and P_S for
            FT); None where unpaired, below three seeds, or where one of them is constant.
        difference_sd: Standard deviation of D over seeds, in items; where unpaired se(D) sqrt(n).
        mean_denominator: mean(den), in items.
        degrees_of_freedom: Of the t-test: n - 1, or Welch's where unpaired.
        flags: Of "single_seed", "too_few_seeds" (two: counts agree by chance, so p = 1),
            "degenerate" (se(D) = 0: no limits, p = 1), "identical" (the runs compared are the same
            runs: the value is exact, and no evidence), "capped" (a capped P blocks the verdict on
            the side that it leans to: p = 1), "unbounded" (the mean denominator is not
            distinguishable from 0), "assumes_normal" (below ten paired seeds, or unpaired: the
            verdict rests on normal differences), "skewed" (D is so skewed that the verdict errs
            more often than its level at this n).
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
    flags: tuple[str, ...] = ()

    @property
    def identical(self) -> bool:
        """Whether the runs compared are the same runs, so that `value` is exact."""
        return "identical" in self.flags

    @property
    def answer(self) -> Verdict:
        """The verdict; of identical runs what their exact value says, which is no evidence.

        Gates and fault budgets ask for it: "is it above the threshold?" has an answer there.
        """
        if not self.identical:
            return self.verdict
        return "supported" if self.value > self.threshold else "refuted"


def verdict_at(alpha: float, p_value: float | None, probability: float | None) -> Verdict:
    """Judge theta > threshold by a two-sided p at level `alpha`; `probability` gives the side.

    No p (one seed) is inconclusive.
    """
    if p_value is None or probability is None or not p_value < alpha:
        return "inconclusive"
    return "supported" if probability > 0.5 else "refuted"
