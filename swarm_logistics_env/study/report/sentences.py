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

from . import templates
from .section import SATURATED, Section, Sentence, bracketed, fixed, limits, percent
from .templates import Slots, fill


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
    head = f"{comparison.policy}, {verdict.property_name}? {comparison.label}{swarm}."
    slots_by_case = dict(_parts(results, verdict))
    text = " ".join(fill(templates.VERDICT, slots_by_case))
    return Sentence(head, text, verdict.conclusion, verdict.in_words)


def _parts(results: StudyResults, verdict: Verdict) -> Iterator[tuple[str, Slots]]:
    """Yield what is known of a verdict: the templates that apply, each with its slots."""
    estimate = verdict.estimate
    indicator = verdict.compared.indicator
    if estimate is None:
        yield "undefined", {"problem": verdict.problem}
        return
    seeds = _seeds_of(results, estimate)
    if estimate.identical:
        yield "unaffected", {"indicator": indicator, "value": estimate.value, "seeds": seeds}
        return
    interval = limits(estimate, 3)
    yield (
        "interval" if interval else "no_interval",
        {
            "indicator": indicator,
            "mark": SATURATED if verdict.saturated else "",
            "value": fixed(estimate.value, 3, [estimate.threshold]),
            "level": percent(estimate.confidence),
            "limits": interval,
            "seeds": seeds,
        },
    )
    if not estimate.untestable:
        plain, adjusted = verdict.on_property
        yield (
            "decision",
            {
                "plain": plain,
                "p": _p(estimate.p_seen),
                "adjusted": adjusted,
                # One seed gives no p, and Holm's placeholder of 1 says nothing.
                "adjusted_p": _p(None if estimate.p_value is None else verdict.p_adjusted),
            },
        )
    if verdict.on_claim is not None:
        plain, adjusted = verdict.on_claim
        words = plain if plain == adjusted else f"{plain}, {adjusted} under Holm"
        yield "claim", {"claim": verdict.claim, "words": words}
    if verdict.equivalence is not None and verdict.on_equivalence is not None:
        plain, adjusted = verdict.on_equivalence
        words = plain if plain == adjusted else f"{plain} ({adjusted} under Holm)"
        yield (
            "equivalence",
            {
                "question": verdict.equivalence_name,
                "change": _change(verdict.equivalence.change, verdict.margin),
                "words": words,
            },
        )
    if verdict.flags:
        yield "flags", {"flags": " ".join(templates.FLAGS[flag] for flag in verdict.flags)}
    if "hidden_stalls" in verdict.flags:
        runs = "seeds" if results.plan.paired else "trials a condition"
        n_runs = spi.seeds_against_stalls(estimate)
        yield "hidden_stalls", {"p": estimate.p_value, "n_runs": n_runs, "runs": runs}
    if estimate.collapsed is not None:
        yield "collapsed", {"collapsed": estimate.collapsed}
    if "hidden_collapses" in verdict.flags:
        n_trainings = spi.trainings_against_collapses(estimate)
        yield "hidden_collapses", {"p": estimate.p_value, "n_trainings": n_trainings}
    if results.plan.specification.until_clear and not estimate.untestable:
        case = stop_of(verdict)
        yield case, {"n_seeds": estimate.n_seeds, "most": results.looks[-1]}
    if results.exploratory:
        yield "exploratory", {}


def stop_of(verdict: Verdict) -> str:
    """Return why a question of a study that runs until it is clear was played no further.

    A key of `templates.STOPS`; "most": as all seeds were played, or nothing decides yet.
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
    """Return a p-value in brackets, e.g. " (p = 0.013)"; empty: there is none."""
    if p is None:
        return ""
    return " (p < 0.001)" if p < 0.001 else f" (p = {p:.3f})"
