"""Verdicts in sentences, those on one indicator of one policy together."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from more_itertools import map_reduce

from swarm_logistics_env import spi
from swarm_logistics_env.spi.definitions import DEFINITIONS
from swarm_logistics_env.spi.estimate import Estimate
from swarm_logistics_env.study.questions.comparison import Family
from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.study.verdicts.verdict import Verdict

from .section import SATURATED, Section, Sentence, bracketed, fixed, limits, percent

# What limits a verdict, by the flag of its estimate.
_FLAGS = {
    "single_seed": "One seed gives a value, but no interval and no verdict.",
    "too_few_seeds": "Two seeds give no verdict, because whole numbers agree by chance.",
    "degenerate": "The seeds show no spread, so there is no interval and no verdict.",
    "cannot_fail": "As no P is below 0, it cannot lie below the threshold, so it is not tested and "
    "has no verdict.",
    "few_pairs_differ": "Nearly all pairs of runs have equal P, so that a handful of deliveries "
    "would decide: it is not tested and has no verdict.",
    "reference_near_0": "The interval of P_o reaches 0, so that a change relative to it says "
    "nothing: it is not tested and has no verdict.",
    "capped": "P is capped on the side that the verdict leans to, so the verdict is open.",
    "hidden_stalls": "These runs are too few to exclude stalled ones that would turn the verdict, "
    "so it is open.",
    "unbounded": "Mean P_o cannot be told from 0 at so few seeds, so the interval is infinite, and "
    "the verdict comes from the test.",
    "hidden_collapses": "These trainings are too few to exclude collapses that would turn the "
    "verdict, so it is open.",
    "assumes_normal": "The verdict is provisional, because fewer than ten seeds show too little of "
    "how they scatter.",
    "few_trainings": "Fewer than five trainings give no verdict.",
}
# What became of a question of a study that runs until it is clear, and why, by `stop_of`.
_STOPS = {
    "clear": ("Clear at", ""),
    "hardly": ("Open after", ": the others would hardly decide it"),
    "margin": ("Stopped after", ": P changes by less than the margin"),
    "most": ("Open after", ""),
}


def verdict_sections(
    verdicts: Sequence[Verdict], sentences: Sequence[Sentence]
) -> Iterator[Section]:
    """Yield the verdicts in words, those of one policy and indicator together."""
    families: dict[Family, list[Sentence]] = map_reduce(
        zip(verdicts, sentences), lambda pair: pair[0].compared.family, lambda pair: pair[1]
    )
    for (policy, indicator), of_family in families.items():
        yield Section(f"{policy}: {DEFINITIONS[indicator].heading}", sentences=tuple(of_family))


def sentence(results: StudyResults, verdict: Verdict) -> Sentence:
    """Return the verdict on one comparison in words."""
    comparison = verdict.compared
    swarm = f", N = {comparison.n_robots}"
    if comparison.original.setting.kind in ("size", "policy"):
        swarm = ""
    subject = results.subjects[comparison.original.case].name
    head = f"{subject}, {verdict.property_name}? {comparison.label}{swarm}."
    text = " ".join(_parts(results, verdict))
    return Sentence(head, text, verdict.conclusion, verdict.in_words)


def _parts(results: StudyResults, verdict: Verdict) -> Iterator[str]:
    """Yield what is known of a verdict, a sentence each."""
    estimate = verdict.estimate
    indicator = verdict.compared.indicator
    if estimate is None:
        yield f"Undefined: {verdict.problem}."
        return
    seeds = _seeds_of(results, estimate)
    if estimate.identical:
        yield (
            f"{indicator} = {estimate.value:.3f} exactly, over {seeds}: unaffected. Both "
            "conditions gave the same runs, so there is nothing to test."
        )
        return
    mark = SATURATED if verdict.saturated else ""
    value = f"{indicator}{mark} = {fixed(estimate.value, 3, [estimate.threshold])}"
    if interval := limits(estimate, 3):
        yield f"{value}, {percent(estimate.confidence)} interval {interval} over {seeds}."
    else:
        yield f"{value} (no interval) over {seeds}."
    if not estimate.untestable:
        plain, adjusted = verdict.on_property
        # One seed gives no p, and Holm's placeholder of 1 says nothing.
        p_adjusted = None if estimate.p_value is None else verdict.p_adjusted
        # Holm's method begins with the p that holds for stalled runs, too.
        alone = _p(estimate.p_seen)
        if _p(estimate.p_value) != alone:
            alone += f"{_p(estimate.p_value)} if some stall, which counts"
        yield f"Alone: {plain}{alone}; by Holm's method: {adjusted}{_p(p_adjusted)}."
    if verdict.on_claim is not None:
        plain, adjusted = verdict.on_claim
        words = plain if plain == adjusted else f"{plain}, {adjusted} under Holm"
        yield f'Claim "{verdict.claim}": {words}.'
    if verdict.equivalence is not None and verdict.on_equivalence is not None:
        plain, adjusted = verdict.on_equivalence
        words = plain if plain == adjusted else f"{plain} ({adjusted} under Holm)"
        change = _change(verdict.equivalence.change, verdict.margin)
        limits_of_change = verdict.equivalence.change.low, verdict.equivalence.change.high
        is_within = all(x is not None and abs(x) < verdict.margin for x in limits_of_change)
        why = ", as some runs may stall" if plain == "open" and is_within else ""
        yield f"{verdict.equivalence_name}? Change {change}: {words}{why}."
    yield from (_FLAGS[flag] for flag in verdict.flags)
    if estimate.collapsed is not None:
        yield f"Trainings: {estimate.collapsed}."
    if "hidden_stalls" in verdict.flags:
        runs = "seeds" if results.plan.paired else "trials a condition"
        yield (
            f"With stalls that may be hidden p is {estimate.p_value:.2g}: it needs at least "
            f"{spi.seeds_against_stalls(estimate)} {runs}."
        )
    if "hidden_collapses" in verdict.flags:
        yield (
            f"With collapses that may be hidden p is {estimate.p_value:.2g}: it needs at least "
            f"{spi.trainings_against_collapses(estimate)} trainings."
        )
    if results.plan.specification.until_clear and not estimate.untestable:
        stop, reason = _STOPS[stop_of(verdict)]
        yield f"{stop} {estimate.n_seeds} of at most {results.looks[-1]} seeds{reason}."
    if results.exploratory:
        yield "Exploratory."


def stop_of(verdict: Verdict) -> str:
    """Return why a question of a study that runs until it is clear was played no further.

    "clear", a name in `WHY_GIVEN_UP`, or "most": all seeds were played, or nothing decides yet.
    """
    return "clear" if verdict.stopped_at is not None else verdict.given_up or "most"


def _seeds_of(results: StudyResults, estimate: Estimate) -> str:
    """Return over which seeds an estimate is."""
    seeds = f"{estimate.n_seeds} runs a condition, unpaired"
    if results.plan.paired:
        seeds = results.seeds_text
    if results.plan.specification.until_clear:
        seeds = f"{estimate.n_seeds} paired seeds"
    if estimate.n_trainings is None:
        return seeds
    return f"{estimate.n_trainings} trainings x {seeds}"


def _change(change: Estimate, margin: float) -> str:
    """Return a change of P with its interval, and the level of that."""
    text = bracketed(change, 3, [-margin, margin])
    if change.low is None or change.identical:
        return text
    return f"{text} ({percent(change.confidence)})"


def _p(p: float | None) -> str:
    """Return a p-value behind a comma, e.g. ", p = 0.013"; empty: there is none."""
    if p is None:
        return ""
    return ", p < 0.001" if p < 0.001 else f", p = {p:.3f}"
