"""Inference on theta = mean(num) / mean(den) + offset over seeds, or over trainings and seeds.

At a theta, D = num - theta den has terms that count for it and terms that count against it. The
test is a t test of ln(mean of the ones / mean of the others), whose standard error s is that of the
difference of both in units of their means:

    t = (|ln ratio| - s^2 / 2) / (s (1 + 4 s^2))

A count that came out low by chance scatters less than its mean would: the t test of D itself then
calls FM4-like counts "refuted" wrongly in 12 % of studies of five. On the logarithm, spread and
mean of counts as skewed as geometric ones are independent; what is left of their skewness, of
order s^2, the two corrections take. For small s all of it is the t test of D.

The same rule holds for any number of seeds, paired or not, and over trainings. p also holds for
stalled runs and collapsed trainings that may be hidden (`hidden`); the interval is that of the runs
seen: all theta that the test keeps.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import Generic, NamedTuple, TypeVar

import numpy as np

from .hidden import Hidden, least_seen, p_with_hidden
from .inputs import Numbers
from .summaries import mean_over_trainings

# Differences this far below the numbers they are taken from are rounding, not spread between seeds.
ROUNDING = 1e-12
# Both means are raised by this share of their sum, which leaves their equality as it is: the
# logarithm of next to nothing then is a number. A larger share takes
# the tail from skewed counts, which then err more often.
RAISED = 0.02
# Factor of s^2 in the standard error: the least whole number at which geometric counts of mean 30
# are called refuted wrongly in less than 3 % of studies, of five seeds or more or until clear.
_SKEWNESS = 4.0
_LARGEST = float(np.finfo(np.float64).max)

Real = TypeVar("Real", float, Numbers)


class RatioTest(NamedTuple, Generic[Real]):
    """What the data say about one ratio, or about one ratio per study (arrays of one shape)."""

    value: Real
    low: Real
    high: Real
    mean_difference: Real  # above 0 where theta is estimated to lie above the threshold
    p_value: Real
    p_seen: Real  # p if no stalled run and no collapsed training is hidden
    log_sd: Real  # of the logarithm of the ratio, over seeds; 0: the differences show no spread
    base: Real  # mean of the terms that count against theta, at the threshold [items]
    degrees_of_freedom: Real


class Term(NamedTuple):
    """One sample of performances and its weights in numerator and denominator of the ratio.

    The last of several terms is the denominator: its weight there is 1, that of all others 0.
    """

    sample: Numbers
    in_num: float
    in_den: float

    def weight(self, theta: Numbers | float) -> Numbers:
        """Weight of the sample in D = num - theta den; what is but rounding counts as 0."""
        weight = self.in_num - np.asarray(theta) * self.in_den
        rounding = ROUNDING * (1.0 + abs(self.in_num))
        return np.asarray(np.where(np.abs(weight) <= rounding, 0.0, weight))


class Design(NamedTuple):
    """How samples hang together.

    Attributes:
        paired: whether they share their seeds.
        trainings: whether they are of shape (..., K trainings, S seeds), K >= 2, S >= 2, row k
            being one training in all of them; else (..., n), an entry for each seed. A value over
            trainings varies with both, and an interval over seeds alone would only hold for the
            networks at hand.
    """

    paired: bool = True
    trainings: bool = False

    def mean(self, sample: Numbers) -> Numbers:
        """Mean over seeds, and over trainings, shape (...)."""
        return np.asarray(sample.mean(axis=(-2, -1) if self.trainings else -1))

    def scaled(self, sample: Numbers, unit: Numbers) -> Numbers:
        """Sample times a unit of shape (...)."""
        return np.asarray(unit[..., None, None] if self.trainings else unit[..., None]) * sample

    def scatter(self, parts: Sequence[Numbers]) -> tuple[Numbers, Numbers]:
        """Squared standard error of the mean of the sum, and its degrees of freedom, (...)."""
        if self.trainings:
            _, variance, df = mean_over_trainings(parts, paired=self.paired)
            return variance, df
        if self.paired:
            together = sum(parts, np.zeros(()))
            n = parts[0].shape[-1]
            variance = np.asarray(together.var(axis=-1, ddof=1) / n)
            return variance, np.full(variance.shape, n - 1.0)
        sizes = [part.shape[-1] for part in parts]
        shares = [part.var(axis=-1, ddof=1) / n for part, n in zip(parts, sizes)]
        variance = np.asarray(sum(shares))
        freedom = np.asarray(sum(share**2 / (n - 1) for share, n in zip(shares, sizes)))
        with np.errstate(all="ignore"):  # no spread leaves no Welch formula
            df = np.where(freedom > 0.0, variance**2 / freedom, min(sizes) - 1.0)
        return variance, df


class Balance(NamedTuple):
    """What counts for a theta and what counts against it, arrays of shape (...).

    Attributes:
        above, below: Means of the terms of D with positive and with negative weight [items].
        s: Standard error of the logarithm of their ratio.
        df: Its degrees of freedom.
    """

    above: Numbers
    below: Numbers
    s: Numbers
    df: Numbers

    @classmethod
    def at(cls, theta: Numbers | float, terms: Sequence[Term], design: Design) -> Balance:
        """Weigh the terms at a theta, shape (...)."""
        weights = [term.weight(theta) for term in terms]
        means = [weight * design.mean(term.sample) for term, weight in zip(terms, weights)]
        above = np.asarray(sum(np.maximum(mean, 0.0) for mean in means))
        below = np.asarray(sum(np.maximum(-mean, 0.0) for mean in means))
        raised = RAISED * (above + below)
        with np.errstate(all="ignore"):  # where nothing is delivered at all
            sizes = [np.where(weight > 0.0, above, below) + raised for weight in weights]
            units = [np.where(size > 0.0, w / size, 0.0) for w, size in zip(weights, sizes)]
        parts = [design.scaled(term.sample, unit) for term, unit in zip(terms, units)]
        variance, df = design.scatter(parts)
        return cls(above, below, np.sqrt(variance), df)

    def t(self, side: int, remaining: Numbers | float = 1.0) -> Numbers:
        """Statistic of "above exceeds below" (side 1), or the opposite (side -1).

        Args:
            remaining: What is left of the larger mean if some runs stall, as a share.
        """
        more, less = (self.above, self.below)[::side]
        return statistic(log_ratio(more * remaining, less), self.s)

    def p(self, side: int, remaining: Numbers | float = 1.0) -> Numbers:
        """One-sided p of `t`."""
        from scipy.special import stdtr

        return np.asarray(stdtr(self.df, -self.t(side, remaining)))


def log_ratio(more: Numbers, less: Numbers) -> Numbers:
    """Logarithm of the ratio of two means, both raised so that neither is 0."""
    raised = RAISED * (more + less)
    with np.errstate(all="ignore"):
        return np.where(raised > 0.0, np.log((more + raised) / (less + raised)), 0.0)


def statistic(log_ratio: Numbers, s: Numbers) -> Numbers:
    """Student's statistic of a logarithm with standard error s."""
    with np.errstate(all="ignore"):
        t = (log_ratio - s**2 / 2.0) / (s * (1.0 + _SKEWNESS * s**2))
    # As `np.nan_to_num` does, in a third of its time.
    return np.where(np.isnan(t), 0.0, np.clip(t, -_LARGEST, _LARGEST))


def ratio_test(
    terms: Sequence[Term],
    design: Design,
    hidden: Sequence[Hidden | None],
    *,
    offset: float,
    threshold: float,
    confidence: float,
    limits: tuple[Numbers, Numbers] | None = None,
) -> RatioTest[Numbers]:
    """Interval and test of theta = mean(num) / mean(den) + offset.

    Args:
        terms: Samples, each of at least two seeds; mean of the last one > 0.
        design: How they hang together.
        hidden: What each of them shows of stalls, or of collapses; None: it hides none.
        offset: Added to the ratio of means.
        threshold: The theta that the test compares with.
        confidence: Of the interval, in (0, 1).
        limits: Those of the interval, where another threshold gave them: they depend on none.

    Returns:
        Arrays of shape (...). The interval excludes `threshold` exactly where
        p_seen < 1 - confidence, but where it is unbounded (limits -inf, inf). Differences without
        spread have p = 1 and no limits.
    """
    null = threshold - offset
    balance = Balance.at(null, terms, design)
    scale = sum(
        (abs(term.in_num) + abs(null * term.in_den)) * np.abs(design.mean(term.sample))
        for term in terms
    )
    # The spread of D itself, of which that of the logarithm is a share.
    variance, _ = design.scatter([design.scaled(t.sample, t.weight(null)) for t in terms])
    degenerate = np.sqrt(variance) <= ROUNDING * scale
    p = np.ones(balance.s.shape)
    p_seen = p.copy()
    for side in (1, -1):
        may_hide = hidden_of_side(terms, hidden, null, side)
        p = np.minimum(p, 2.0 * p_with_hidden(functools.partial(balance.p, side), may_hide))
        p_seen = np.minimum(p_seen, 2.0 * balance.p(side))
    value = sum(term.in_num * design.mean(term.sample) for term in terms) / design.mean(
        terms[-1].sample
    )
    if limits is None:
        low, high = _limits(terms, design, np.asarray(value), 0.5 + confidence / 2)
        limits = low + offset, high + offset
    low, high = limits
    n = min(term.sample.shape[-1] for term in terms)
    return RatioTest(
        value=np.asarray(value + offset),
        low=np.where(degenerate, -np.inf, low),
        high=np.where(degenerate, np.inf, high),
        mean_difference=balance.above - balance.below,
        # Seeds without spread between them are no evidence: equal counts come about by chance.
        p_value=np.where(degenerate, 1.0, p),
        p_seen=np.where(degenerate, 1.0, p_seen),
        log_sd=np.where(degenerate, 0.0, balance.s * np.sqrt(n)),
        base=balance.below,
        degrees_of_freedom=balance.df,
    )


def hidden_of_side(
    terms: Sequence[Term], hidden: Sequence[Hidden | None], theta: float, side: int
) -> Hidden | None:
    """Return what the terms that count for a theta (side 1), or against it (-1), may hide."""
    counts = [side * float(term.weight(theta)) > 0.0 for term in terms]
    return least_seen(
        [
            sample_hides
            for sample_hides, does_count in zip(hidden, counts)
            if sample_hides and does_count
        ]
    )


_GROWTHS = 20
_STEPS = 60


def _limits(
    terms: Sequence[Term], design: Design, value: Numbers, quantile: float
) -> tuple[Numbers, Numbers]:
    """Return the ends of the interval of all theta that the test keeps; infinite: it has none.

    Args:
        value: the estimate, where both sides are equal, shape (...).
        quantile: of Student's distribution, in (0.5, 1).
    """
    from scipy.special import stdtrit

    def outside(theta: Numbers, side: int) -> Numbers:
        """Positive where the test at theta rejects."""
        balance = Balance.at(theta, terms, design)
        return np.asarray(balance.t(side) - stdtrit(balance.df, quantile))

    at_value = Balance.at(value, terms, design)
    width = at_value.s * at_value.above / design.mean(terms[-1].sample)
    width = np.where(width > 0.0, width, ROUNDING)
    *changed_terms, reference = terms
    # No P is below 0, so nor is a ratio of two, whose weights differ in sign.
    least = reference.in_num if all(term.in_num >= 0.0 for term in changed_terms) else -np.inf

    low = _root(lambda theta: outside(theta, 1), value, -width, least)
    high = _root(lambda theta: outside(theta, -1), value, width, np.inf)
    unbounded = np.isinf(low) | np.isinf(high)
    return np.where(unbounded, -np.inf, low), np.where(unbounded, np.inf, high)


def _root(
    outside: Callable[[Numbers], Numbers], inner: Numbers, step: Numbers, end: float
) -> Numbers:
    """Return where `outside` turns positive on the way from `inner` by steps; `end` if nowhere."""
    within = np.minimum if end == np.inf else np.maximum
    outer = within(inner + step, end)
    rejected = outside(outer) > 0.0
    for _ in range(_GROWTHS):
        if (rejected | (outer == end)).all():
            break
        inner = np.where(rejected, inner, outer)
        step = np.where(rejected, step, 4.0 * step)
        outer = np.where(rejected, outer, within(outer + step, end))
        rejected = rejected | (outside(outer) > 0.0)
    middle = outer
    at_inner = outside(inner)
    at_outer = outside(outer)
    was_outer = np.full(rejected.shape, -1)
    for _ in range(_STEPS):  # regula falsi, Illinois
        with np.errstate(all="ignore"):
            share = np.clip(np.nan_to_num(at_inner / (at_inner - at_outer), nan=0.5), 0.0, 1.0)
        middle = inner + share * (outer - inner)
        at_middle = outside(middle)
        is_outer = at_middle > 0.0
        again = is_outer == was_outer
        at_inner = np.where(is_outer, np.where(again, at_inner / 2.0, at_inner), at_middle)
        at_outer = np.where(is_outer, at_middle, np.where(again, at_outer / 2.0, at_outer))
        was_outer = np.where(is_outer, 1, 0)
        inner = np.where(is_outer, inner, middle)
        outer = np.where(is_outer, middle, outer)
        close = np.abs(outer - inner) <= 1e-12 * np.abs(step)
        if (close | (at_middle == 0.0) | ~rejected).all():
            break
    return np.where(rejected, middle, end)
