"""Numbers and verdicts in words, the same in every table; every verdict as one sentence.

What is missing is None or, in a column of numbers, NaN.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeGuard

from swarm_logistics_env import spi
from swarm_logistics_env.spi.estimate import Estimate
from swarm_logistics_env.spi.summaries import Interval
from swarm_logistics_env.studies.indicator_table import POWER, Finding
from swarm_logistics_env.studies.performance_table import Cell
from swarm_logistics_env.studies.results import StudyResults
from swarm_logistics_env.studies.runs import seeds_in_words

SATURATED = "†"
UNAFFECTED = "unaffected by construction"
_NOT_COUNTED = "not counted: below ten paired seeds they assume normal differences"
NOTHING = "–"
DECIDED = ("supported", "refuted", "equivalent")


def is_known(value: float | None) -> TypeGuard[float]:
    """Return whether a number is there."""
    return value is not None and not math.isnan(value)


def digits_of(p: float) -> int:
    """Return how many digits after the point tell a performance: three in all where it is small."""
    return 1 if p >= 1 or p <= 0 else 2 - math.floor(math.log10(p))


def bracketed(interval: Interval | Estimate | Finding | None, digits: int) -> str:
    """Return a value with its limits to so many digits, e.g. "124.0 [101.2, ∞]"."""
    if interval is None or not is_known(interval.value):
        return NOTHING
    if not (is_known(interval.low) and is_known(interval.high)):
        return fixed(interval.value, digits)
    low, high = fixed(interval.low, digits), fixed(interval.high, digits)
    return f"{fixed(interval.value, digits)} [{low}, {high}]"


def fixed(value: float, digits: int) -> str:
    """Return a number to so many digits; infinity as its sign."""
    if math.isinf(value):
        return "∞" if value > 0 else "-∞"
    # "+ 0.0" after rounding: no minus sign before a zero.
    return f"{round(value, digits) + 0.0:.{digits}f}"


def number(value: float | None, digits: int = 3) -> str:
    """Return a number without interval."""
    return f"{value:.{digits}f}" if is_known(value) else NOTHING


def percent(confidence: float) -> str:
    """Return a confidence level, e.g. "95 %"; of an early look never rounded up to 100 %."""
    return "> 99.99 %" if confidence > 0.9999 else f"{100 * confidence:.4g} %"


def p_text(p: float) -> str:
    """Return a p-value, e.g. "0.013" or "< 0.001"."""
    return "< 0.001" if p < 0.001 else f"{p:.3f}"


def mean_p(cell: Cell) -> str:
    """Return the mean P of a row of performances with its limits, e.g. "28.7 [27.1, 30.3]†"."""
    if not cell.n_seeds:
        return "no run"
    return bracketed(Interval(cell.mean, cell.low, cell.high), digits_of(cell.mean)) + mark(cell)


def mark(row: Cell | Finding) -> str:
    """Return the sign of a P that is capped, or of what rests on it."""
    return SATURATED if row.saturated else ""


def ratio(test: Finding) -> str:
    """Return an indicator with its interval, e.g. "0.611 [0.520, 0.702]"."""
    return NOTHING if test.estimate is None else bracketed(test, 3) + mark(test)


def said(verdict: str | None) -> str:
    """Return a verdict in words."""
    return {None: "blocked", "unaffected": UNAFFECTED}.get(verdict, f"{verdict}")


def verdict(test: Finding) -> str:
    """Return the unadjusted verdict on the property, and Holm's in brackets where it differs."""
    plain, adjusted = said(test.answer), said(test.answer_holm)
    return plain if plain in (adjusted, "blocked") else f"{plain} ({adjusted})"


def counted_as(test: Finding, verdict: str | None) -> str:
    """Return what a verdict on this test counts as in `counted`.

    A count is a headline: a verdict that assumes normal differences does not stand in it.
    """
    if verdict in DECIDED and "assumes_normal" in test.flags:
        return _NOT_COUNTED
    return said(verdict)


def counted(verdicts: Counter[str]) -> str:
    """Return how many of each verdict, e.g. "7 supported, 1 refuted"."""
    order = (*DECIDED, "inconclusive", _NOT_COUNTED, UNAFFECTED, "blocked")
    return ", ".join(f"{verdicts[verdict]} {verdict}" for verdict in order if verdicts[verdict])


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


@dataclass(frozen=True)
class Sentence:
    """One verdict in words; `verdict`: the conclusion, "unaffected" or "blocked"."""

    head: str
    text: str
    verdict: str


def sentence(results: StudyResults, test: Finding) -> Sentence:
    """Return the verdict on one comparison in words."""
    head = f"{test.policy}, {test.property}? {_conditions(test)}."
    text = " ".join(_parts(results, test))
    return Sentence(head, text, "blocked" if test.problem else test.conclusion or "blocked")


def _parts(results: StudyResults, test: Finding) -> Iterator[str]:
    if test.problem:
        yield f"Blocked: {test.problem}."
        return
    unpaired = f"{test.n_seeds} runs a condition, unpaired"
    seeds = seeds_text(results) if results.plan.paired else unpaired
    if results.plan.specification.until_clear:
        seeds = f"{test.n_seeds} paired seeds"
    if test.verdict == "unaffected":
        yield f"{test.indicator} = {test.value:.3f} exactly, over {seeds}: {UNAFFECTED}."
        yield "Both conditions gave the same runs, so there is nothing to test."
        return
    interval = " (no interval)"
    if is_known(test.low) and is_known(test.high):
        limits = f"[{fixed(test.low, 3)}, {fixed(test.high, 3)}]"
        interval = f", {percent(test.confidence)} interval {limits}"
    yield f"{test.indicator}{mark(test)} = {fixed(test.value, 3)}{interval} over {seeds}."
    # One seed gives no p, and Holm's placeholder of 1 says nothing.
    adjusted_p = test.p_holm if is_known(test.p_value) else None
    yield f"Unadjusted: {test.answer}{_p(test.p_value)};"
    yield f"Holm-adjusted: {said(test.answer_holm)}{_p(adjusted_p)}."
    if test.claim:
        plain, adjusted = test.claim_verdict, said(test.claim_verdict_holm)
        both = plain if plain == adjusted else f"{plain}, {adjusted} under Holm"
        yield f'Claim "{test.claim}": {both}.'
    if test.equivalence is not None:
        yield _unchanged(test)
    if "inconclusive" in (test.answer, test.answer_holm):
        yield from _what_it_takes(test)
    if is_known(test.pairing_correlation):
        yield f"Pairing correlation {test.pairing_correlation:.2f}."
    if "assumes_normal" in test.flags:
        yield "The verdict assumes normal differences."
    if test.estimate is not None and "hidden_stalls" in test.flags:
        yield (
            "No verdict, as stalled runs that these seeds did not show could turn it: it needs at "
            f"least {spi.seeds_against_stalls(test.estimate)} seeds."
        )
    if "skewed" in test.flags:
        yield "Skewed: at so few seeds the verdict errs more often than its level."
    if results.plan.specification.until_clear:
        where = "Open after" if test.stopped_at is None else "Clear at"
        yield f"{where} {test.n_seeds} of at most {results.looks[-1]} seeds."
    if results.exploratory:
        yield "Exploratory."


def _unchanged(test: Finding) -> str:
    """Return the verdict on equivalence, e.g. "P_F within 10 % of P_o? Change -0.023 [..]: .."."""
    limits = ""
    if is_known(test.change_low) and is_known(test.change_high):
        limits = f" [{fixed(test.change_low, 3)}, {fixed(test.change_high, 3)}]"
    adjusted = ""
    if test.equivalence_holm != test.equivalence:
        adjusted = f" ({said(test.equivalence_holm)} under Holm)"
    change = f"{fixed(test.change, 3)}{limits}"
    return f"{test.unchanged}? Change {change}: {test.equivalence}{adjusted}."


def _conditions(test: Finding) -> str:
    if test.kind == "size":
        return f"N = {test.before:g} → {test.after:g} (m = {test.after - test.before:g} more)"
    if test.kind == "fault":
        start = f" from {test.onset:g} s" if test.onset else ""
        return f"Failure mode {test.factor}{start}, m = {test.after:g} of N = {test.n_robots}"
    before = test.policy if test.kind == "policy" else f"{test.factor} {test.before:g}"
    after = test.factor if test.kind == "policy" else f"{test.after:g}"
    return f"{before} → {after}, N = {test.n_robots}"


def _p(p: float | None) -> str:
    if not is_known(p):
        return ""
    text = p_text(p)
    return f" (p {text})" if text.startswith("<") else f" (p = {text})"


def _what_it_takes(test: Finding) -> Iterator[str]:
    if is_known(test.detectable):
        yield (
            f"{test.n_seeds} seeds find an effect {test.detectable:.3f} away from "
            f"{test.threshold:.3g} with {100 * POWER:.0f} % power, unadjusted."
        )
    if test.seeds_for_power_80 is not None:
        least = ""
        if is_known(test.least_power):
            least = f" ({test.least_power:.0%} power or more in nine pilots of ten)"
        yield (
            f"The published value {test.published:.3f} needs {test.seeds_for_power_80} seeds"
            f"{least}."
        )
