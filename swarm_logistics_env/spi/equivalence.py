"""Equivalence: whether a change leaves P within a margin, by two one-sided tests (Schuirmann 1987).

An open verdict is no evidence that a fault does no harm. This test gives such evidence: it
rejects "P falls by the margin or more", and "P rises by it or more".
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from numpy.typing import ArrayLike

from .estimate import DecisionWord, Estimate, estimate_ratio
from .inputs import IndicatorError, between_0_and_1

MARGIN = 0.1
ALPHA = 0.05  # of each of the two tests


@dataclass(frozen=True, slots=True, kw_only=True)
class Equivalence:
    """Whether the relative change of P lies within a margin.

    Attributes:
        margin: Largest change that counts as none, as a share of P_o, in (0, 1).
        alpha: Error of each of the two tests, in (0, 1).
        change: The relative change; its interval of level 1 - 2 alpha is the one that has to lie
            within the margin.
        above: The change against -margin: "supported" where P falls by less.
        below: The change against +margin: "refuted" where P rises by less.
    """

    margin: float
    alpha: float
    change: Estimate
    above: Estimate
    below: Estimate

    @property
    def identical(self) -> bool:
        """Whether the runs compared are the same runs, so that the change is exactly 0."""
        return self.change.identical

    @property
    def confidence(self) -> float:
        """Level of the interval, 1 - 2 alpha."""
        return self.change.confidence

    @property
    def flags(self) -> tuple[str, ...]:
        """Those of the two tests; "degenerate" as well where all seeds change by the same count."""
        flags = [*self.above.flags, *self.below.flags]
        if "degenerate" in self.change.flags:
            flags.append("degenerate")
        return tuple(dict.fromkeys(flags))

    @property
    def p_value(self) -> float | None:
        """P of the verdict that the change leans to; None at one seed and for identical runs.

        Of a change within the margin the larger p of the two tests. Of one beyond it the two-sided
        p against the nearer end, so that "refuted" errs in at most alpha on both sides together.
        """
        above = self.above
        below = self.below
        if above.p_value is None or above.probability is None or below.probability is None:
            return None
        if "degenerate" in self.flags:
            return 1.0
        if self._within:
            return max(1.0 - above.probability, below.probability)
        return below.p_value if self.change.value > 0.0 else above.p_value

    @property
    def verdict(self) -> DecisionWord:
        """Equivalent, refuted (the change exceeds the margin) or open."""
        return self.verdict_for(self.p_value)

    def verdict_for(self, p_value: float | None) -> DecisionWord:
        """Return the verdict at a p, e.g. one that Holm adjusted."""
        if self.identical:
            return "equivalent"
        if p_value is None or not p_value < self.alpha:
            return "open"
        return "equivalent" if self._within else "refuted"

    @property
    def _within(self) -> bool:
        return abs(self.change.value) <= self.margin


def equivalence(
    p_o: ArrayLike,
    p_new: ArrayLike,
    p_s: ArrayLike | None = None,
    *,
    margin: float = MARGIN,
    alpha: float = ALPHA,
    paired: bool = True,
    saturated: Collection[str] = (),
    identical: bool = False,
) -> Equivalence:
    """Test whether P_new is P_o, or P_s, but for a margin: |P_new - P_o| < margin P_o.

    The two tests are those of the indicators. Declare the margin before the study.

    Args:
        p_o: Performance P_o over seeds [items], shape (n_seeds,), which the change is relative to.
        p_new: Performance after the change, P_F or P_new, over the same seeds [items].
        p_s: What P_new is compared with, if not with P_o: with the faulty robots removed [items].
        margin: Largest change that counts as none, as a share of P_o, in (0, 1).
        alpha: Error of each of the two tests, in (0, 0.5).
        paired, saturated, identical: As in `Options`.

    Raises:
        IndicatorError: margin or alpha out of range, performance empty, negative or not finite,
            mean P_o = 0, unequal seed sets where paired.
    """
    between_0_and_1("margin", margin)
    if not 0.0 < alpha < 0.5:
        raise IndicatorError(f"alpha = {alpha}: should lie between 0 and 0.5, both excluded")
    terms = {"p_new": (p_new, 1.0), "p_o": (p_o, -1.0)}
    if p_s is not None:
        terms = {"p_new": (p_new, 1.0), "p_s": (p_s, -1.0), "p_o": (p_o, 0.0)}

    def against(threshold: float, limits: tuple[float, float] | None = None) -> Estimate:
        return estimate_ratio(
            "change",
            terms,
            threshold=threshold,
            confidence=1.0 - 2.0 * alpha,
            paired=paired,
            saturated=saturated,
            identical=identical,
            limits=limits,
        )

    change = against(0.0)
    limits = None if change.low is None or change.high is None else (change.low, change.high)
    above = against(-margin, limits)
    below = against(margin, limits)
    return Equivalence(margin=margin, alpha=alpha, change=change, above=above, below=below)
