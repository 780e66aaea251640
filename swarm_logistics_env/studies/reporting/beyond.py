"""Sections on what the paper does not define, kept apart from its indicators."""

from __future__ import annotations

from collections.abc import Iterator

from swarm_logistics_env.spi.scaling import ScalingFit
from swarm_logistics_env.spi.summaries import Interval
from swarm_logistics_env.studies.analysis.scaling import SizeSeries, steps
from swarm_logistics_env.studies.judgement import Findings
from swarm_logistics_env.studies.reporting import wording
from swarm_logistics_env.studies.reporting.sections import Section

_WORTH = (
    "Marginal gain: P(N2) - (N2/N1) P(N1), in items; above 0 where S > 1. Karp-Flatt e: the share "
    "of the work that is not shared; 0 where P grows as N does, 1 where it does not grow, below 0 "
    "where it grows faster."
)


def beyond(findings: Findings, series: tuple[SizeSeries, ...]) -> Iterator[Section]:
    """Yield the second table of a report, topic by topic."""
    if series:
        yield _laws(series)
        yield from _sizes(findings, series)


def _laws(series: tuple[SizeSeries, ...]) -> Section:
    rows, lines = [], []
    for one in series:
        who = f"{one.policy or 'published runs'}: {one.table}"
        rows += [(who, *_law(fit)) for fit in one.fits]
        if one.problem:
            lines.append(f"{who}: no law is fitted: {one.problem}.")
    return Section(
        "Scaling laws",
        ("P(N) of", "weights", "law", "parameters", "N* [95 %]", "AICc"),
        tuple(rows),
        (
            (
                "USL: P = gN / (1 + a(N-1) + bN(N-1)), N* = sqrt((1-a)/b). The other: "
                "P = kN^p exp(-qN), N* = p/q. Fitted to mean P by least squares with the weights "
                "given; the better law by AICc stands first. N* is the size of the largest P; it "
                "moves with the weights, so it is quoted with its interval and its weights."
            ),
            *lines,
        ),
    )


def _law(fit: ScalingFit) -> tuple[str, ...]:
    law = {"usl": "USL", "power_exponential": "kN^p exp(-qN)"}[fit.law]
    parameters = ", ".join(f"{name} = {value:.3g}" for name, value in fit.parameters.items())
    if fit.peak is None:
        peak = "none: the fitted law has no peak"
    else:
        peak = wording.bracketed(Interval(fit.peak, fit.peak_low, fit.peak_high), 1)
    aicc = wording.NOTHING if fit.aicc is None else f"{fit.aicc:.1f}"
    return fit.weighting, law, parameters, peak, aicc


def _sizes(findings: Findings, series: tuple[SizeSeries, ...]) -> Iterator[Section]:
    for one in series:
        if one.policy is None:
            continue
        rows = [
            (
                f"{step.before} → {step.after}" + (wording.SATURATED if step.saturated else ""),
                wording.bracketed(step.efficiency, 3),
                wording.bracketed(step.marginal_gain, 1),
                wording.bracketed(step.karp_flatt, 3),
            )
            for step in steps(findings, one.policy, one.table)
        ]
        if rows:
            yield Section(
                f"{one.policy}: {one.table}, what robots are worth",
                (
                    "N",
                    "P/N at the larger N [95 %]",
                    "marginal gain [95 %]",
                    "Karp-Flatt e [95 %]",
                ),
                tuple(rows),
                (_WORTH,),
            )
