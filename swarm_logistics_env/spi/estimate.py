"""The record that every indicator returns, and the one path from samples to it."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias, TypedDict

import numpy as np
from numpy.typing import ArrayLike

from .hidden import Collapsed, Hidden, collapsed, hidden_of
from .inputs import (
    IndicatorError,
    between_0_and_1,
    finite,
    performance,
    positive_mean,
    same_seeds,
)
from .ratio import Design, RatioTest, Term, hidden_of_side, ratio_test
from .summaries import mean_interval, pairing_correlation

# Performances by name, with their weights in the numerator; the last is the denominator.
Weighted: TypeAlias = Mapping[str, tuple[ArrayLike, float]]
DecisionWord = Literal["supported", "refuted", "equivalent", "open"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """One indicator over n seeds: theta = mean(num) / mean(den) + offset, with its judgement.

    Everything but `value` and the description of the input is None at n = 1; where the runs
    compared are the same runs, `low` and `high` are `value`, and there is no p. Nor is there one
    where the indicator is `untestable`.

    Attributes:
        indicator: Which indicator this is.
        value: The ratio of means plus offset, dimensionless.
        low: Lower limit of the interval; -inf where the interval is unbounded. None at n = 1,
            where the differences show no spread and where no pair differs; `value` where the
            value is exact.
        high: Upper limit of the interval; inf where the interval is unbounded; None as `low`.
        probability: Confidence that theta > threshold, in [0, 1], not a posterior frequency:
            1 - p/2 where mean(D) > 0, else p/2, D = num - (threshold - offset) den.
        threshold: The value that theta is tested against.
        confidence: Of the interval, in (0, 1).
        n_seeds: Number of seeds; of the smallest sample where unpaired.
        n_trainings: Number of trainings, each played over all seeds; None: one policy was judged,
            and nothing is said of another training of it.
        p_value: Two-sided p of mean(D) = 0, in [0, 1]: what Holm acts on. It holds for stalls and
            collapses that may be hidden.
        p_seen: The same of the runs seen alone, by the rule of the interval, which excludes the
            threshold exactly where p_seen < 1 - confidence; None as `p_value`.
        paired: Whether the samples share their seeds, row by row.
        pairing_correlation: Pearson correlation of the two performances compared (P_F and P_S for
            FT); None where unpaired, below three seeds, or where one of them is constant.
        log_sd: Standard deviation over seeds of the logarithm that is tested: sqrt(n) times its
            standard error; 0 where D shows no spread; None over trainings, which have two spreads.
        base: Mean of what counts against theta at the threshold, in items: of R, what the swarm
            delivers without faults, less the share that it may lose.
        hidden: Stalls, or collapses, that those terms show which count for theta, and those which
            count against it: that more are hidden is part of p.
        collapsed: Trainings that collapsed under the change (P_F, P_N+m or P_new), with the exact
            limit of their share; None: no trainings were judged.
        mean_denominator: mean(den), in items.
        degrees_of_freedom: Of the t-test: n - 1, Welch's if unpaired, or Satterthwaite's.
        flags: Some of "single_seed", "too_few_seeds" (two: counts agree by chance, so p = 1),
            "degenerate" (se(D) = 0: no limits, p = 1), "identical" (the runs compared are the same
            runs: the value is exact, and no evidence), "cannot_fail" (as no P is below 0, theta
            cannot lie below the threshold: there is no p, and no verdict), "few_pairs_differ" (the
            performances compared are equal at most seeds, and the threshold is a few items from
            that, so that a handful of deliveries would decide: there is no p),
            "reference_near_0" (the interval of the mean reference reaches 0, so that a change
            relative to it says nothing: there is no p), "capped" (a capped P blocks the verdict on
            the side that it leans to: p = 1), "hidden_stalls" (stalled runs that these seeds did
            not show could turn the verdict: it needs `seeds_against_stalls`), "hidden_collapses"
            (so could trainings that collapse: `trainings_against_collapses`),
            "unbounded" (the mean denominator is not distinguishable from 0), "assumes_normal"
            (below ten seeds: provisional, as few show how they scatter), "few_trainings" (fewer
            than five: p = 1).
    """

    indicator: str
    value: float
    low: float | None = None
    high: float | None = None
    probability: float | None = None
    threshold: float
    confidence: float
    n_seeds: int
    n_trainings: int | None = None
    p_value: float | None = None
    p_seen: float | None = None
    paired: bool
    pairing_correlation: float | None = None
    log_sd: float | None = None
    base: float | None = None
    hidden: tuple[Hidden | None, Hidden | None] = (None, None)
    collapsed: Collapsed | None = None
    mean_denominator: float
    degrees_of_freedom: float | None = None
    flags: tuple[str, ...] = ()

    @property
    def identical(self) -> bool:
        """Whether the runs compared are the same runs, so that `value` is exact."""
        return "identical" in self.flags

    @property
    def untestable(self) -> bool:
        """Whether there is nothing to test: a flag, one of `UNTESTABLE`, says why."""
        return any(flag in self.flags for flag in UNTESTABLE)

    @property
    def withheld(self) -> bool:
        """Whether stalls or collapses that may be hidden keep a verdict from what was seen."""
        return "hidden_stalls" in self.flags or "hidden_collapses" in self.flags

    @property
    def verdict(self) -> DecisionWord:
        """On theta > threshold, one-sided (1 - confidence)/2 on each side, unadjusted."""
        return self.verdict_for(self.p_value)

    @property
    def answer(self) -> DecisionWord:
        """The verdict; of identical runs what their exact value says, which is no evidence.

        Gates ask for it: "is it above the threshold?" has an answer there.
        """
        if not self.identical:
            return self.verdict
        return "supported" if self.value > self.threshold else "refuted"

    def verdict_for(self, p_value: float | None) -> DecisionWord:
        """Return the verdict at a two-sided p, e.g. one that Holm adjusted; None: open."""
        if p_value is None or self.probability is None or not p_value < 1.0 - self.confidence:
            return "open"
        return "supported" if self.probability > 0.5 else "refuted"

    def __str__(self) -> str:
        """Return value, interval and verdict in one line."""
        word: str = "untestable" if self.untestable else self.verdict
        if self.identical:
            word = "unaffected"
        limits = ""
        if self.low is not None and self.high is not None and not self.identical:
            limits = f" [{self.low:.3f}, {self.high:.3f}]"
        unit = "paired seed" if self.paired else "run"
        n = f"1 {unit}" if self.n_seeds == 1 else f"{self.n_seeds} {unit}s"
        n += "" if self.paired else " a condition"
        n = n if self.n_trainings is None else f"{self.n_trainings} trainings x {n}"
        p = "" if self.p_seen is None else f", p = {self.p_seen:.3g}"
        if self.withheld and self.p_value is not None:
            p += f", {self.p_value:.3g} with what these runs may hide"
        p += "" if self.collapsed is None else f"; {self.collapsed}"
        return (
            f"{self.indicator} = {self.value:.3f}{limits}; above {self.threshold:g}: "
            f"{word} ({n}{p})"
        )


# The two differences of two seeds are close to each other by chance so often, counts being whole
# numbers, that their spread says nothing.
LEAST_SEEDS = 3
# With three trainings an interval is 4.3 standard errors wide on each side, and one of three that
# is lucky turns it: such few are shown, and decide nothing.
LEAST_TRAININGS = 5
# Fewer show too little of how they scatter for a headline.
SEEDS_OF_HEADLINE = 10
# The flags that concern the interval; all others are about a test.
_OF_INTERVAL = ("single_seed", "degenerate", "unbounded")
# Flags of what is not tested. The first follows from the question, the others from the runs.
UNTESTABLE = ("cannot_fail", "few_pairs_differ", "reference_near_0")
# Where fewer pairs differ, and most are equal, the threshold has to lie as many items from equal
# sums: it is the least number of events of which a sign test can tell anything at 5 %.
LEAST_EVENTS = 6
# Of the interval by which the reference is told from 0: that which reports print beside P.
_CONFIDENCE_OF_P = 0.95


class Options(TypedDict, total=False):
    """What every indicator takes besides its performances.

    Attributes:
        threshold: What theta is tested against, finite; 0 if not given.
        confidence: Of the interval, in (0, 1); 0.95 if not given.
        paired: Whether row i of every sample is the same seed; False for results that come without
            seeds; True if not given.
        saturated: Names of the performances that are capped (every item delivered in a run). The
            true P is then larger: that blocks the verdict which a larger P could turn, in most
            cases "supported" for the reference and "refuted" for a changed condition.
        identical: Whether the runs compared are the same runs, seed by seed: the value is then
            exact.
    """

    threshold: float
    confidence: float
    paired: bool
    saturated: Collection[str]
    identical: bool


def estimate_ratio(
    indicator: str,
    terms: Weighted,
    *,
    offset: float = 0.0,
    threshold: float = 0.0,
    confidence: float = 0.95,
    paired: bool = True,
    saturated: Collection[str] = (),
    identical: bool = False,
    two_recipes: bool = False,
    limits: tuple[float, float] | None = None,
) -> Estimate:
    """Estimate one ratio of means and judge it against `threshold`; see `Options`.

    Args:
        indicator: Its name.
        terms: Name to performances over seeds [items] and their weight in the numerator; the first
            two are compared, the last is the reference that the ratio divides by. Of several
            trainings of a policy each has a row, shape (K, n); a performance of shape (n,) beside
            it is of a policy that is not trained.
        offset: Added to the ratio of means.
        two_recipes: Whether row k of the first and of the last performance are two trainings, not
            one: the last may then collapse by itself.
        limits: Of the interval, where the estimate against another threshold had them.

    Raises:
        IndicatorError: Performances empty, negative or not finite, unequal seed sets, mean
            reference 0, threshold or confidence out of range, an unknown name in `saturated`, or
            `identical` with performances that differ.
    """
    finite("threshold", threshold)
    between_0_and_1("confidence", confidence)
    weighted = _checked(terms, saturated, paired=paired, identical=identical)
    *_, reference = (term.sample for term in weighted.values())
    mean_den = float(reference.mean())
    mean_num = sum(term.in_num * float(term.sample.mean()) for term in weighted.values())
    n_seeds = min(term.sample.shape[-1] for term in weighted.values())
    untested = Estimate(
        indicator=indicator,
        value=mean_num / mean_den + offset,
        threshold=threshold,
        confidence=confidence,
        n_seeds=n_seeds,
        n_trainings=len(reference) if reference.ndim == 2 else None,
        paired=paired,
        mean_denominator=mean_den,
    )
    if identical:  # the same runs leave nothing to test
        value = untested.value
        return replace(untested, low=value, high=value, flags=("identical",))
    if n_seeds == 1:
        estimate = replace(untested, flags=("single_seed",))
    else:
        estimate = _tested(
            untested, weighted, offset, saturated, two_recipes=two_recipes, limits=limits
        )
    terms_in_order = list(weighted.values())
    reason = _why_untestable(terms_in_order, threshold - offset, paired=paired)
    if reason is None:
        return estimate
    if paired and np.array_equal(terms_in_order[0].sample, terms_in_order[1].sample):
        estimate = replace(estimate, low=None, high=None)  # they show no spread
    of_interval = [flag for flag in estimate.flags if flag in _OF_INTERVAL]
    return replace(
        estimate, p_value=None, p_seen=None, probability=None, flags=(reason, *of_interval)
    )


def _why_untestable(terms: Sequence[Term], null: float, *, paired: bool) -> str | None:
    """Return the flag that says why there is nothing to test at a ratio `null`; None: there is."""
    reference = terms[-1].sample
    # D is a sum of weighted P, and no P is below 0.
    if min(term.weight(null) for term in terms) >= 0.0:
        return "cannot_fail"
    if reference.shape[-1] < LEAST_SEEDS:
        return None
    if paired and _few_pairs_differ(terms[0], terms[1], null):
        return "few_pairs_differ"
    if mean_interval(reference, _CONFIDENCE_OF_P).low == 0.0:
        return "reference_near_0"
    return None


def _few_pairs_differ(changed: Term, original: Term, null: float) -> bool:
    """Return whether most pairs are equal, and the threshold lies only a few items from that."""
    differs = changed.sample != original.sample
    values = np.unique([changed.sample, original.sample])
    item = np.diff(values).min(initial=values[-1])  # the smallest step between two values
    lost = abs(1.0 + original.weight(null) / changed.weight(null)) * original.sample.sum()
    few = LEAST_EVENTS
    return bool(differs.sum() < few and differs.mean() < 0.5 and lost < few * item)


def _tested(
    untested: Estimate,
    weighted: Mapping[str, Term],
    offset: float,
    saturated: Collection[str],
    *,
    two_recipes: bool,
    limits: tuple[float, float] | None,
) -> Estimate:
    """Return the estimate with the test that its seeds allow, and what is to be said of it."""
    n_seeds, paired, threshold = untested.n_seeds, untested.paired, untested.threshold
    terms, null = list(weighted.values()), threshold - offset
    over_trainings = untested.n_trainings is not None
    # Of a policy without trainings all rows are equal, and two recipes share no training.
    is_of_one_recipe = over_trainings and not two_recipes and np.ptp(terms[0].sample, axis=0).any()
    correlation = None
    if paired and not over_trainings:
        correlation = pairing_correlation(terms[0].sample, terms[1].sample)
    hidden = hidden_of(
        [term.sample for term in terms], trainings=over_trainings, reference_too=two_recipes
    )
    tests = ratio_test(
        terms,
        Design(paired=paired, trainings=over_trainings),
        hidden,
        offset=offset,
        threshold=threshold,
        confidence=untested.confidence,
        limits=limits and (np.array(limits[0]), np.array(limits[1])),
    )
    test = RatioTest(*map(float, tests))
    degenerate = test.log_sd == 0.0
    # The true P of one that is capped is larger, and moves D by the sign of its weight.
    leaning = test.value - threshold
    capped = any(weighted[name].weight(null) * leaning < 0.0 for name in saturated)
    few = untested.n_trainings is not None and untested.n_trainings < LEAST_TRAININGS
    blocked = capped or degenerate or n_seeds < LEAST_SEEDS or few
    withheld = test.p_seen < 1.0 - untested.confidence <= test.p_value and not blocked
    p_value = 1.0 if blocked else test.p_value
    flags = {
        "too_few_seeds": n_seeds < LEAST_SEEDS,
        "degenerate": degenerate,
        "capped": capped,
        "assumes_normal": n_seeds < SEEDS_OF_HEADLINE and not blocked,
        "hidden_stalls": withheld and not over_trainings,
        "hidden_collapses": withheld and over_trainings,
        "unbounded": math.isinf(test.low) and not degenerate,
        "few_trainings": few,
    }
    return replace(
        untested,
        value=test.value,
        low=None if degenerate else test.low,
        high=None if degenerate else test.high,
        probability=1.0 - p_value / 2 if test.mean_difference > 0.0 else p_value / 2,
        p_value=p_value,
        p_seen=1.0 if blocked else test.p_seen,
        pairing_correlation=correlation,
        log_sd=None if over_trainings else test.log_sd,
        base=test.base,
        hidden=(
            hidden_of_side(terms, hidden, null, 1),
            hidden_of_side(terms, hidden, null, -1),
        ),
        collapsed=collapsed(terms[0].sample, terms[-1].sample) if is_of_one_recipe else None,
        degrees_of_freedom=test.degrees_of_freedom,
        flags=tuple(flag for flag, holds in flags.items() if holds),
    )


def _checked(
    terms: Weighted,
    saturated: Collection[str],
    *,
    paired: bool,
    identical: bool,
) -> dict[str, Term]:
    samples = {name: performance(name, p, or_trainings=True) for name, (p, _) in terms.items()}
    trainings = {len(p) for p in samples.values() if p.ndim == 2}
    if trainings:  # a policy that is not trained is the same beside every one
        every = (max(trainings), 1)
        samples = {n: p if p.ndim == 2 else np.tile(p, every) for n, p in samples.items()}
    if paired:
        same_seeds(**samples)
    if len(trainings) > 1:
        raise IndicatorError(f"{', '.join(samples)}: should be of the same trainings")
    for name in saturated:
        if name not in samples:
            raise IndicatorError(f"saturated = {name!r}: should be among {', '.join(samples)}")
    if identical:
        first, *further = samples
        for name in further:
            if not paired or not np.array_equal(samples[first], samples[name]):
                raise IndicatorError(
                    f"identical = True, but {first} and {name} differ: should be paired and equal"
                )
    reference = list(samples)[-1]
    positive_mean(reference, samples[reference])
    return {
        name: Term(samples[name], weight, float(name == reference))
        for name, (_, weight) in terms.items()
    }
