"""Every verdict as one sentence that can be quoted: conditions, seeds, interval, both verdicts."""

from __future__ import annotations

from dataclasses import dataclass

from swarm_logistics_env import spi
from swarm_logistics_env.spi.estimate import Estimate
from swarm_logistics_env.studies.judgement import POWER, Findings, Judgement
from swarm_logistics_env.studies.reporting import wording


@dataclass(frozen=True)
class Sentence:
    """One verdict in words; `verdict`: Holm's on the property, "unaffected" or "blocked"."""

    head: str
    text: str
    verdict: str


def sentence(findings: Findings, judgement: Judgement) -> Sentence:
    """Return the verdict on one comparison in words."""
    comparison, estimate = judgement.comparison, judgement.estimate
    head = f"{comparison.policy}, {wording.property_name(judgement)}? {_conditions(judgement)}."
    if estimate is None:
        return Sentence(head, f"Blocked: {judgement.problem}.", "blocked")
    if judgement.unaffected:
        text = (
            f"{comparison.indicator} = {estimate.value:.3f} exactly, over "
            f"{_seeds(findings, estimate)}: {wording.UNAFFECTED}. Both conditions gave the same "
            "runs, so there is nothing to test."
        )
        return Sentence(head, text, "unaffected")
    plain = wording.on_property(judgement, estimate.verdict)
    adjusted = wording.on_property(judgement, judgement.adjusted_verdict) or "blocked"
    # One seed gives no p, and Holm's placeholder of 1 says nothing.
    adjusted_p = None if estimate.p_value is None else judgement.adjusted_p
    mark = wording.SATURATED if judgement.saturated else ""
    parts = [
        f"{comparison.indicator}{mark} = {_interval(estimate)} over {_seeds(findings, estimate)}.",
        (f"Unadjusted: {plain}{_p(estimate.p_value)}; Holm-adjusted: {adjusted}{_p(adjusted_p)}."),
        *_claim(judgement, estimate),
        *_what_it_takes(judgement, estimate, adjusted),
    ]
    if estimate.pairing_correlation is not None:
        parts.append(f"Pairing correlation {estimate.pairing_correlation:.2f}.")
    if "assumes_normal" in estimate.flags:
        parts.append("The verdict assumes normal differences.")
    if "skewed" in estimate.flags:
        parts.append("Skewed: at so few seeds the verdict errs more often than its level.")
    if findings.exploratory:
        parts.append("Exploratory.")
    return Sentence(head, " ".join(parts), adjusted)


def _conditions(judgement: Judgement) -> str:
    comparison = judgement.comparison
    before, after = comparison.original.level, comparison.changed.level
    swarm = comparison.original.condition.scenario.n_robots
    if after.kind == "size":
        return f"N = {before.value:g} → {after.value:g} (m = {after.value - before.value:g} more)"
    if after.kind == "fault":
        start = f" from {after.onset:g} s" if after.onset else ""
        return f"Failure mode {after.name}{start}, m = {after.value:g} of N = {swarm}"
    if after.kind == "parameter":
        return f"{after.name} {before.value:g} → {after.value:g}, N = {swarm}"
    return f"{before.name} → {after.name}, N = {swarm}"


def _interval(estimate: Estimate) -> str:
    level = wording.percent(estimate.level)
    if estimate.low is None or estimate.high is None:
        return f"{estimate.value:.3f} (no interval)"
    low, high = wording.fixed(estimate.low, 3), wording.fixed(estimate.high, 3)
    return f"{wording.fixed(estimate.value, 3)}, {level} interval [{low}, {high}]"


def _seeds(findings: Findings, estimate: Estimate) -> str:
    if estimate.paired:
        return wording.seeds_text(findings)
    return f"{estimate.n_seeds} runs a condition, unpaired"


def _p(p: float | None) -> str:
    if p is None:
        return ""
    text = wording.p_text(p)
    return f" (p {text})" if text.startswith("<") else f" (p = {text})"


def _claim(judgement: Judgement, estimate: Estimate) -> list[str]:
    if judgement.claim is None:
        return []
    plain, adjusted = (
        judgement.on_claim(verdict) or "blocked"
        for verdict in (estimate.verdict, judgement.adjusted_verdict)
    )
    both = plain if plain == adjusted else f"{plain}, {adjusted} under Holm"
    return [f'Claim "{wording.claimed(judgement)}": {both}.']


def _what_it_takes(judgement: Judgement, estimate: Estimate, adjusted: str) -> list[str]:
    if "inconclusive" not in (adjusted, estimate.verdict):
        return []
    parts = []
    smallest = spi.minimum_detectable_effect(estimate, POWER)
    if smallest is not None:
        parts.append(
            f"{estimate.n_seeds} seeds find an effect {smallest:.3f} away from "
            f"{estimate.threshold:.3g} with {100 * POWER:.0f} % power, unadjusted."
        )
    if judgement.published is not None and judgement.seeds_needed is not None:
        parts.append(
            f"The published value {judgement.published:.3f} needs {judgement.seeds_needed} seeds"
            f"{_least_power(judgement, estimate)}."
        )
    return parts


def _least_power(judgement: Judgement, estimate: Estimate) -> str:
    assert judgement.published is not None
    assert judgement.seeds_needed is not None
    least = spi.lower_decile_of_power(estimate, judgement.published, judgement.seeds_needed)
    return "" if least is None else f" ({least:.0%} power or more in nine pilots of ten)"
