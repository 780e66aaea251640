"""Numbers and verdicts in words, the same in every table; every verdict as one sentence."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from swarm_logistics_env import spi
from swarm_logistics_env.spi.estimate import Estimate, Verdict
from swarm_logistics_env.spi.summaries import Interval
from swarm_logistics_env.studies.results import POWER, IndicatorTest, StudyResults
from swarm_logistics_env.studies.runs import seeds_in_words

SATURATED = "†"
UNAFFECTED = "unaffected by construction"
_NOT_COUNTED = "not counted: below ten paired seeds they assume normal differences"
NOTHING = "–"


def items(interval: Interval | None) -> str:
    """Return a performance with its limits, e.g. "28.7 [27.1, 30.3]"."""
    if interval is None:
        return "no run"
    if interval.low is None or interval.high is None:
        return f"{interval.value:.1f}"
    return f"{interval.value:.1f} [{interval.low:.1f}, {interval.high:.1f}]"


def bracketed(interval: Interval | None, digits: int) -> str:
    """Return a value with its limits to so many digits, e.g. "124.0 [101.2, ∞]"."""
    if interval is None:
        return NOTHING
    value, low, high = (None if x is None else fixed(x, digits) for x in interval)
    return f"{value}" if low is None or high is None else f"{value} [{low}, {high}]"


def fixed(value: float, digits: int) -> str:
    """Return a number to so many digits; infinity as its sign."""
    if math.isinf(value):
        return "∞" if value > 0 else "-∞"
    # "+ 0.0" after rounding: no minus sign before a zero.
    return f"{round(value, digits) + 0.0:.{digits}f}"


def percent(confidence: float) -> str:
    """Return a confidence, e.g. "95 %"; of an early look never rounded up to 100 %."""
    return "> 99.99 %" if confidence > 0.9999 else f"{100 * confidence:.4g} %"


def limits(interval: Interval | None) -> str:
    """Return the limits alone."""
    if interval is None or interval.low is None or interval.high is None:
        return NOTHING
    return f"[{interval.low:.1f}, {interval.high:.1f}]"


def number(value: float | None) -> str:
    """Return an indicator's value without interval."""
    return NOTHING if value is None else f"{value:.3f}"


def ratio(test: IndicatorTest) -> str:
    """Return an indicator with its interval, e.g. "0.611 [0.520, 0.702]"."""
    estimate = test.estimate
    if estimate is None:
        return NOTHING
    mark = SATURATED if test.saturated else ""
    return bracketed(Interval(estimate.value, estimate.low, estimate.high), 3) + mark


def verdict(test: IndicatorTest) -> str:
    """Return the unadjusted verdict on the property, and Holm's in brackets where it differs."""
    if test.estimate is None:
        return "blocked"
    if test.unaffected:
        return UNAFFECTED
    plain = test.on_property(test.estimate.verdict)
    adjusted = test.on_property(test.adjusted_verdict)
    return f"{plain}" if adjusted == plain else f"{plain} ({adjusted or 'blocked'})"


def counted_as(test: IndicatorTest, verdict: Verdict | None) -> str:
    """Return what a verdict on this test counts as in `counted`.

    A count is a headline: a verdict that assumes normal differences does not stand in it.
    """
    if test.unaffected:
        return UNAFFECTED
    if test.estimate is None or verdict is None:
        return "blocked"
    if verdict != "inconclusive" and "assumes_normal" in test.estimate.flags:
        return _NOT_COUNTED
    return verdict


def p_text(p: float) -> str:
    """Return a p-value, e.g. "0.013" or "< 0.001"."""
    return "< 0.001" if p < 0.001 else f"{p:.3f}"


def power(test: IndicatorTest) -> str:
    """Return the seeds that 80 % power needs at the published value."""
    if test.published is None or test.estimate is None:
        return NOTHING
    if test.seeds_needed is None:
        return "undefined"
    return str(test.seeds_needed)


def listed(names: Sequence[str]) -> str:
    """Return names as a list, e.g. "swarm-dt, random-walk and central"."""
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last


def seeds_text(results: StudyResults) -> str:
    """Return over which seeds everything is, e.g. "20 paired seeds (0 to 19)"."""
    seeds = results.plan.seeds
    if not results.plan.paired:
        return f"{len(seeds)} unpaired {'run' if len(seeds) == 1 else 'runs'} a condition"
    count = "one seed" if len(seeds) == 1 else f"{len(seeds)} paired seeds"
    return f"{count} ({seeds_in_words(seeds)})"


def counted(verdicts: Counter[str]) -> str:
    """Return how many of each verdict, e.g. "7 supported, 1 refuted"."""
    order = ("supported", "refuted", "inconclusive", _NOT_COUNTED, UNAFFECTED, "blocked")
    return ", ".join(f"{verdicts[verdict]} {verdict}" for verdict in order if verdicts[verdict])


@dataclass(frozen=True)
class Sentence:
    """One verdict in words; `verdict`: Holm's on the property, "unaffected" or "blocked"."""

    head: str
    text: str
    verdict: str


def sentence(results: StudyResults, test: IndicatorTest) -> Sentence:
    """Return the verdict on one comparison in words."""
    comparison, estimate = test.comparison, test.estimate
    head = f"{comparison.policy}, {test.property_name}? {_conditions(test)}."
    if estimate is None:
        return Sentence(head, f"Blocked: {test.problem}.", "blocked")
    if test.unaffected:
        text = (
            f"{comparison.indicator} = {estimate.value:.3f} exactly, over "
            f"{_seeds(results, estimate)}: {UNAFFECTED}. Both conditions gave the same "
            "runs, so there is nothing to test."
        )
        return Sentence(head, text, "unaffected")
    plain = test.on_property(estimate.verdict)
    adjusted = test.on_property(test.adjusted_verdict) or "blocked"
    # One seed gives no p, and Holm's placeholder of 1 says nothing.
    adjusted_p = None if estimate.p_value is None else test.adjusted_p
    mark = SATURATED if test.saturated else ""
    parts = [
        f"{comparison.indicator}{mark} = {_interval(estimate)} over {_seeds(results, estimate)}.",
        (f"Unadjusted: {plain}{_p(estimate.p_value)}; Holm-adjusted: {adjusted}{_p(adjusted_p)}."),
        *_claim(test, estimate),
        *_what_it_takes(test, estimate, adjusted),
    ]
    if estimate.pairing_correlation is not None:
        parts.append(f"Pairing correlation {estimate.pairing_correlation:.2f}.")
    if "assumes_normal" in estimate.flags:
        parts.append("The verdict assumes normal differences.")
    if "skewed" in estimate.flags:
        parts.append("Skewed: at so few seeds the verdict errs more often than its level.")
    if results.exploratory:
        parts.append("Exploratory.")
    return Sentence(head, " ".join(parts), adjusted)


def _conditions(test: IndicatorTest) -> str:
    comparison = test.comparison
    before, after = comparison.original.setting, comparison.changed.setting
    swarm = comparison.original.condition.size
    if after.kind == "size":
        return f"N = {before.value:g} → {after.value:g} (m = {after.value - before.value:g} more)"
    if after.kind == "fault":
        start = f" from {after.onset:g} s" if after.onset else ""
        return f"Failure mode {after.name}{start}, m = {after.value:g} of N = {swarm}"
    if after.kind == "parameter":
        return f"{after.name} {before.value:g} → {after.value:g}, N = {swarm}"
    return f"{before.name} → {after.name}, N = {swarm}"


def _interval(estimate: Estimate) -> str:
    confidence = percent(estimate.confidence)
    if estimate.low is None or estimate.high is None:
        return f"{estimate.value:.3f} (no interval)"
    low, high = fixed(estimate.low, 3), fixed(estimate.high, 3)
    return f"{fixed(estimate.value, 3)}, {confidence} interval [{low}, {high}]"


def _seeds(results: StudyResults, estimate: Estimate) -> str:
    if estimate.paired:
        return seeds_text(results)
    return f"{estimate.n_seeds} runs a condition, unpaired"


def _p(p: float | None) -> str:
    if p is None:
        return ""
    text = p_text(p)
    return f" (p {text})" if text.startswith("<") else f" (p = {text})"


def _claim(test: IndicatorTest, estimate: Estimate) -> list[str]:
    if test.claim is None:
        return []
    plain, adjusted = (
        test.on_claim(verdict) or "blocked" for verdict in (estimate.verdict, test.adjusted_verdict)
    )
    both = plain if plain == adjusted else f"{plain}, {adjusted} under Holm"
    return [f'Claim "{test.claim_text}": {both}.']


def _what_it_takes(test: IndicatorTest, estimate: Estimate, adjusted: str) -> list[str]:
    if "inconclusive" not in (adjusted, estimate.verdict):
        return []
    parts = []
    smallest = spi.minimum_detectable_effect(estimate, POWER)
    if smallest is not None:
        parts.append(
            f"{estimate.n_seeds} seeds find an effect {smallest:.3f} away from "
            f"{estimate.threshold:.3g} with {100 * POWER:.0f} % power, unadjusted."
        )
    if test.published is not None and test.seeds_needed is not None:
        parts.append(
            f"The published value {test.published:.3f} needs {test.seeds_needed} seeds"
            f"{_least_power(test, estimate)}."
        )
    return parts


def _least_power(test: IndicatorTest, estimate: Estimate) -> str:
    assert test.published is not None
    assert test.seeds_needed is not None
    least = spi.lower_decile_of_power(estimate, test.published, test.seeds_needed)
    return "" if least is None else f" ({least:.0%} power or more in nine pilots of ten)"
