"""Numbers and verdicts in words, the same in every table."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

from swarm_logistics_env.spi.estimate import Verdict
from swarm_logistics_env.spi.summaries import Interval
from swarm_logistics_env.studies.judgement import Findings, Judgement
from swarm_logistics_env.studies.seeds import seeds_in_words

SATURATED = "†"
UNAFFECTED = "unaffected by construction"
_NOT_COUNTED = "not counted: below ten paired seeds they assume normal differences"
NOTHING = "–"

_PROPERTIES = {
    ("S", 0.0): "scalable",
    ("S", 1.0): "superlinear",
    ("FT", 0.0): "tolerant",
    ("R", 0.0): "robust",
    ("A", 0.0): "adaptable",
}


def property_name(judgement: Judgement) -> str:
    """Return what is asked: whether the swarm is scalable, tolerant, ...; whether P falls."""
    comparison = judgement.comparison
    if _is_fall(judgement):
        fall = -comparison.threshold
        return f"P falls by more than {100 * fall:.0f} %" if fall else "P falls"
    named = _PROPERTIES.get((comparison.indicator, comparison.threshold))
    return named or f"{comparison.indicator} > {comparison.threshold:.3g}"


def claimed(judgement: Judgement) -> str:
    """Return the claim in words."""
    name = property_name(judgement)
    return f"not {name}" if judgement.claim is False and not _is_fall(judgement) else name


def _is_fall(judgement: Judgement) -> bool:
    return judgement.comparison.indicator == "change" and judgement.claim is False


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


def percent(level: float) -> str:
    """Return a confidence level, e.g. "95 %"; of an early look never rounded up to 100 %."""
    return "> 99.99 %" if level > 0.9999 else f"{100 * level:.4g} %"


def limits(interval: Interval | None) -> str:
    """Return the limits alone."""
    if interval is None or interval.low is None or interval.high is None:
        return NOTHING
    return f"[{interval.low:.1f}, {interval.high:.1f}]"


def number(value: float | None) -> str:
    """Return an indicator's value without interval."""
    return NOTHING if value is None else f"{value:.3f}"


def ratio(judgement: Judgement) -> str:
    """Return an indicator with its interval, e.g. "0.611 [0.520, 0.702]"."""
    estimate = judgement.estimate
    if estimate is None:
        return NOTHING
    mark = SATURATED if judgement.saturated else ""
    return bracketed(Interval(estimate.value, estimate.low, estimate.high), 3) + mark


def verdict(judgement: Judgement) -> str:
    """Return the unadjusted verdict on the property, and Holm's in brackets where it differs."""
    if judgement.estimate is None:
        return "blocked"
    if judgement.unaffected:
        return UNAFFECTED
    plain = on_property(judgement, judgement.estimate.verdict)
    adjusted = on_property(judgement, judgement.adjusted_verdict)
    return f"{plain}" if adjusted == plain else f"{plain} ({adjusted or 'blocked'})"


def on_property(judgement: Judgement, verdict: Verdict | None) -> Verdict | None:
    """Turn a verdict on "above the threshold" into one on the property that is named."""
    return judgement.on_claim(verdict) if _is_fall(judgement) else verdict


def counted_as(judgement: Judgement, verdict: Verdict | None) -> str:
    """Return what a verdict on this judgement counts as in `counted`.

    A count is a headline: a verdict that assumes normal differences does not stand in it.
    """
    if judgement.unaffected:
        return UNAFFECTED
    if judgement.estimate is None or verdict is None:
        return "blocked"
    if verdict != "inconclusive" and "assumes_normal" in judgement.estimate.flags:
        return _NOT_COUNTED
    return verdict


def p_text(p: float) -> str:
    """Return a p-value, e.g. "0.013" or "< 0.001"."""
    return "< 0.001" if p < 0.001 else f"{p:.3f}"


def power(judgement: Judgement) -> str:
    """Return the seeds that 80 % power needs at the published value."""
    if judgement.published is None or judgement.estimate is None:
        return NOTHING
    if judgement.seeds_needed is None:
        return "undefined"
    return str(judgement.seeds_needed)


def decided(judgement: Judgement) -> bool:
    """Return whether the Holm-adjusted verdict is either way."""
    return judgement.adjusted_verdict in ("supported", "refuted")


def listed(names: Sequence[str]) -> str:
    """Return names as a list, e.g. "swarm-dt, random-walk and central"."""
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last


def seeds_text(findings: Findings) -> str:
    """Return over which seeds everything is, e.g. "20 paired seeds (0 to 19)"."""
    seeds = findings.plan.seeds
    if not findings.plan.paired:
        return f"{len(seeds)} unpaired {'run' if len(seeds) == 1 else 'runs'} a condition"
    count = "one seed" if len(seeds) == 1 else f"{len(seeds)} paired seeds"
    return f"{count} ({seeds_in_words(seeds)})"


def counted(verdicts: Counter[str]) -> str:
    """Return how many of each verdict, e.g. "7 supported, 1 refuted"."""
    order = ("supported", "refuted", "inconclusive", _NOT_COUNTED, UNAFFECTED, "blocked")
    return ", ".join(f"{verdicts[verdict]} {verdict}" for verdict in order if verdicts[verdict])
