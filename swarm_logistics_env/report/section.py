"""Sections: what a report is made of; and numbers and verdicts in words, the same in every one."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from swarm_logistics_env import spi
from swarm_logistics_env.spi.estimate import SIGNS, Estimate
from swarm_logistics_env.studies.results import StudyResults
from swarm_logistics_env.studies.specification import seeds_in_words
from swarm_logistics_env.studies.verdict import Cell, Verdict

if TYPE_CHECKING:
    import pandas as pd

    from .drawing import Draw

SATURATED = "†"
NOTHING = "–"
DECIDED = ("supported", "refuted", "equivalent")
UNAFFECTED = SIGNS["unaffected"].word
# The words for verdicts, in the order in which they are counted.
WORDS = {verdict: sign.word for verdict, sign in SIGNS.items()}
FLAGS = {
    "single_seed": "One seed gives a value, but no interval and no verdict",
    "too_few_seeds": "Two seeds give no verdict, because whole numbers agree by chance",
    "degenerate": "The seeds show no spread, so there is no interval and no verdict",
    "cannot_fail": "As no P is below 0, it cannot lie below the threshold, so it is not tested and "
    "has no verdict",
    "capped": "P is capped on the side that the verdict leans to, so the verdict is open",
    "hidden_stalls": "These seeds are too few to exclude stalled runs that would turn the verdict, "
    "so it is open",
    "unbounded": "Mean P_o cannot be told from 0 at so few seeds, so the interval is infinite, and "
    "the verdict comes from the test",
    "assumes_normal": "The verdict assumes normal differences, because the seeds are fewer than "
    "ten, or unpaired",
    "few_trainings": "Fewer than five trainings give no verdict",
    "skewed": "The differences are so skewed that at so few seeds the verdict errs more often than "
    "its level says",
}
_NOT_COUNTED = "not counted: below ten paired seeds they assume normal differences"
Texts = tuple[str, ...]


@dataclass
class Figure:
    """One figure.

    Attributes:
        name: of its files, without ending; letters, digits and hyphens.
        caption: what it shows and under which conditions, in full.
        data: what it shows, one row a point.
        height: of the drawing [inch]; the width is that of all figures.
        draw: draws it on an empty canvas.
    """

    name: str
    caption: str
    data: pd.DataFrame
    height: float
    draw: Draw


class Sentence(NamedTuple):
    """One verdict in words; `verdict`: the conclusion, a name in `WORDS`."""

    head: str
    text: str
    verdict: str


class Section(NamedTuple):
    """A heading with a figure, sentences, a table, lines of text, or several of them."""

    title: str
    columns: Texts = ()
    rows: tuple[Texts, ...] = ()
    lines: Texts = ()
    sentences: tuple[Sentence, ...] = ()
    figures: tuple[Figure, ...] = ()


def slug(*parts: object) -> str:
    """Return a name for files of letters, digits and hyphens, at most 80."""
    return re.sub(r"[^A-Za-z0-9]+", "-", " ".join(map(str, parts))).strip("-")[:80]


def digits_of(p: float) -> int:
    """Return how many digits after the point tell a performance: three in all where it is small."""
    return 1 if not 0 < p < 1 else 2 - math.floor(math.log10(p))


def fixed(value: float, digits: int) -> str:
    """Return a number to so many digits; infinity as its sign."""
    # "+ 0.0" after rounding: no minus sign before a zero.
    return f"{round(value, digits) + 0.0:.{digits}f}".replace("inf", "∞")


def limits(interval: spi.Interval | Estimate, digits: int) -> str:
    """Return the limits of an interval to so many digits, e.g. "[101.2, ∞]"; empty: none."""
    if interval.low is None or interval.high is None:
        return ""
    return f"[{fixed(interval.low, digits)}, {fixed(interval.high, digits)}]"


def bracketed(interval: spi.Interval | Estimate | None, digits: int) -> str:
    """Return a value with its limits to so many digits, e.g. "124.0 [101.2, ∞]"."""
    if interval is None:
        return NOTHING
    return f"{fixed(interval.value, digits)} {limits(interval, digits)}".rstrip()


def number(value: float | None, digits: int = 3) -> str:
    """Return a number without interval."""
    return NOTHING if value is None else f"{value:.{digits}f}"


def percent(confidence: float) -> str:
    """Return a confidence level, e.g. "95 %"; of an early look never rounded up to 100 %."""
    return "> 99.99 %" if confidence > 0.9999 else f"{100 * confidence:.4g} %"


def mean_p(cell: Cell) -> str:
    """Return the mean P of a cell with its limits, e.g. "28.7 [27.1, 30.3]†"."""
    if not cell.n_seeds:
        return "no run"
    return bracketed(cell.mean, digits_of(cell.mean.value)) + SATURATED * cell.saturated


def ratio(test: Verdict) -> str:
    """Return an indicator with its interval, e.g. "0.611 [0.520, 0.702]"."""
    return bracketed(test.interval, 3) + SATURATED * (test.saturated and test.interval is not None)


def lies_above(test: Verdict) -> bool | None:
    """Return whether an interval lies above the threshold; None: it holds it, or there is none."""
    _, low, high = test.interval or (None, None, None)
    threshold = test.compared.threshold
    if low is None or high is None or low <= threshold <= high:
        return None
    return low > threshold


def said(verdict: str | None) -> str:
    """Return a verdict in words."""
    return WORDS[verdict or "blocked"]


def answered(test: Verdict) -> str:
    """Return the unadjusted verdict on the property, and Holm's in brackets where it differs."""
    plain, adjusted = said(test.answer), said(test.answer_holm)
    return plain if plain == adjusted else f"{plain} ({adjusted})"


def counted_as(test: Verdict, verdict: str | None) -> str:
    """Return what a verdict on this test counts as in `counted`.

    A count is a headline: a verdict that assumes normal differences does not stand in it.
    """
    if verdict in DECIDED and "assumes_normal" in test.flags:
        return _NOT_COUNTED
    return said(verdict)


def counted(verdicts: Iterable[str]) -> str:
    """Return how many of each word, e.g. "7 supported, 1 refuted"."""
    counts = Counter(verdicts)
    return ", ".join(
        f"{counts[word]} {word}" for word in (*WORDS.values(), _NOT_COUNTED) if counts[word]
    )


def listed(names: Sequence[str]) -> str:
    """Return names as a list, e.g. "swarm-dt, random-walk and central"."""
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last


def plural(count: int, noun: str) -> str:
    """Return a number of things, e.g. "1 claim" or "2 claims"."""
    return f"{count} {noun}{'' if count == 1 else 's'}"


def time_to_clear(cell: Cell) -> str:
    """Return the median time until all items were delivered [s], and how many runs were late.

    Of several trainings the mean over trainings and seeds; an interval needs all runs in time.
    """
    times = [outcome.time_to_clear for outcome in cell.outcomes]
    late = sum(map(math.isinf, times))
    several = len(cell.arm.case.trainings)
    if several > 1 and not (late or cell.problem):
        return bracketed(spi.mean_interval(np.reshape(times, (several, -1))), 0)
    found = bracketed(spi.median_interval(times), 0)
    return f"{found} ({late} of {len(times)})" if late else found


def seeds_text(results: StudyResults) -> str:
    """Return over which seeds everything is, e.g. "20 paired seeds (0 to 19)"."""
    seeds = results.plan.seeds
    if not results.plan.paired:
        fewest = min(cell.n_seeds for cell in results.cells)
        count = f"{fewest} to {len(seeds)}" if fewest < len(seeds) else f"{fewest}"
        return f"{count} unpaired {'run' if count == '1' else 'runs'} a condition"
    count = "one seed" if len(seeds) == 1 else f"{len(seeds)} paired seeds"
    return f"{count} ({seeds_in_words(seeds)})"


def sentence(results: StudyResults, test: Verdict) -> Sentence:
    """Return the verdict on one comparison in words."""
    compared = test.compared
    swarm = (
        "" if compared.original.setting.kind in ("size", "policy") else f", N = {compared.n_robots}"
    )
    head = f"{compared.policy}, {test.asked}? {compared.label}{swarm}."
    return Sentence(head, " ".join(_parts(results, test)), test.conclusion or "blocked")


def _parts(results: StudyResults, test: Verdict) -> Iterator[str]:
    estimate, indicator = test.estimate, test.compared.indicator
    if estimate is None:
        yield f"Undefined: {test.problem}."
        return
    seeds = f"{estimate.n_seeds} runs a condition, unpaired"
    if results.plan.paired:
        seeds = seeds_text(results)
    if results.plan.specification.until_clear:
        seeds = f"{estimate.n_seeds} paired seeds"
    if estimate.n_trainings is not None:
        seeds = f"{estimate.n_trainings} trainings x {seeds}"
    if estimate.identical:
        yield f"{indicator} = {estimate.value:.3f} exactly, over {seeds}: {UNAFFECTED}."
        yield "Both conditions gave the same runs, so there is nothing to test."
        return
    found = limits(estimate, 3)
    level = f", {percent(estimate.confidence)} interval {found}" if found else " (no interval)"
    capped = SATURATED * test.saturated
    yield f"{indicator}{capped} = {fixed(estimate.value, 3)}{level} over {seeds}."
    if not estimate.untestable:
        # One seed gives no p, and Holm's placeholder of 1 says nothing.
        adjusted_p = None if estimate.p_value is None else test.p_holm
        yield f"Unadjusted: {said(test.answer)}{_p(estimate.p_value)};"
        yield f"Holm-adjusted: {said(test.answer_holm)}{_p(adjusted_p)}."
    if test.claim:
        plain, adjusted = map(said, (test.claim_verdict, test.claim_verdict_holm))
        both = plain if plain == adjusted else f"{plain}, {adjusted} under Holm"
        yield f'Claim "{test.claim}": {both}.'
    if test.equivalence is not None:
        same, holm = said(test.equivalence.verdict), said(test.equivalence_holm)
        adjusted = "" if same == holm else f" ({holm} under Holm)"
        change = bracketed(test.equivalence.change, 3)
        yield f"{test.unchanged}? Change {change}: {same}{adjusted}."
    yield from (f"{FLAGS[flag]}." for flag in test.flags)
    if "hidden_stalls" in test.flags:
        yield f"It needs at least {spi.seeds_against_stalls(estimate)} seeds."
    if results.plan.specification.until_clear:
        where = "Open after" if test.stopped_at is None else "Clear at"
        yield f"{where} {estimate.n_seeds} of at most {results.looks[-1]} seeds."
    if results.exploratory:
        yield "Exploratory."


def _p(p: float | None) -> str:
    """Return a p-value in brackets, e.g. " (p = 0.013)"; empty: there is none."""
    if p is None:
        return ""
    return " (p < 0.001)" if p < 0.001 else f" (p = {p:.3f})"
