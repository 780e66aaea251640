"""Numbers and verdicts in words, the same in every table."""

from __future__ import annotations

from swarm_logistics_env.spi.estimate import Verdict
from swarm_logistics_env.spi.summaries import Interval
from swarm_logistics_env.studies.judgement import Judgement

SATURATED = "†"
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
    if estimate.low is None or estimate.high is None:
        return f"{estimate.value:.3f}{mark}"
    return f"{estimate.value:.3f} [{estimate.low:.3f}, {estimate.high:.3f}]{mark}"


def verdict(judgement: Judgement) -> str:
    """Return the unadjusted verdict on the property, and Holm's in brackets where it differs."""
    if judgement.estimate is None:
        return "blocked"
    plain: Verdict | None = judgement.estimate.verdict
    adjusted = judgement.adjusted_verdict
    if _is_fall(judgement):
        plain, adjusted = judgement.on_claim(plain), judgement.on_claim(adjusted)
    return f"{plain}" if adjusted == plain else f"{plain} ({adjusted or 'blocked'})"


def power(judgement: Judgement) -> str:
    """Return the seeds that 80 % power needs at the published value."""
    if judgement.published is None or judgement.estimate is None:
        return NOTHING
    if judgement.seeds_needed is None:
        return f"undefined: {judgement.no_plan}"
    return str(judgement.seeds_needed)
