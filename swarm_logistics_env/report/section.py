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
from swarm_logistics_env.questions.comparison import CONFIDENCE
from swarm_logistics_env.questions.specification import seeds_in_words
from swarm_logistics_env.spi.estimate import Estimate
from swarm_logistics_env.verdicts.cell import Cell
from swarm_logistics_env.verdicts.results import StudyResults
from swarm_logistics_env.verdicts.verdict import Verdict

if TYPE_CHECKING:
    import pandas as pd

    from .drawing import Draw

SATURATED = "†"
_SAME = 1e-9  # a value so near a threshold differs from it by rounding alone
NOTHING = "–"
DECIDED = ("supported", "refuted", "equivalent")
# The words of decisions, in the order in which they are counted.
WORDS = (*DECIDED, "open", "unaffected", "untestable", "undefined")
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
    """One verdict in words.

    Attributes:
        head: what is asked.
        text: all that is known.
        verdict: the conclusion, a name in `WORDS`.
        word: the answer to what is asked.
    """

    head: str
    text: str
    verdict: str
    word: str


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


def fixed(value: float, digits: int, thresholds: Iterable[float] = ()) -> str:
    """Return a number to so many digits; infinity as its sign.

    Args:
        thresholds: numbers on whose side the value is shown, by more digits where it takes them.
    """

    def sides(x: float) -> list[bool]:
        return [one for t in thresholds if abs(value - t) > _SAME for one in (x > t, x < t)]

    thresholds = tuple(thresholds)
    while sides(round(value, digits)) != sides(value):
        digits += 1
    # "+ 0.0" after rounding: no minus sign before a zero.
    return f"{round(value, digits) + 0.0:.{digits}f}".replace("inf", "∞")


def limits(interval: spi.Interval | Estimate, digits: int, thresholds: Iterable[float] = ()) -> str:
    """Return the limits of an interval to so many digits, e.g. "[101.2, ∞]"; empty: none.

    Args:
        thresholds: numbers on whose sides they are shown, besides that of an estimate.
    """
    if interval.low is None or interval.high is None:
        return ""
    told = _thresholds(interval, thresholds)
    return f"[{fixed(interval.low, digits, told)}, {fixed(interval.high, digits, told)}]"


def bracketed(
    interval: spi.Interval | Estimate | None, digits: int, thresholds: Iterable[float] = ()
) -> str:
    """Return a value with its limits, as `limits` does, e.g. "124.0 [101.2, ∞]"."""
    if interval is None:
        return NOTHING
    told = _thresholds(interval, thresholds)
    return f"{fixed(interval.value, digits, told)} {limits(interval, digits, told)}".rstrip()


def _thresholds(interval: spi.Interval | Estimate, others: Iterable[float]) -> tuple[float, ...]:
    own = (interval.threshold,) if isinstance(interval, Estimate) else ()
    return (*own, *others)


def number(value: float | None, digits: int = 3) -> str:
    """Return a number without interval."""
    return NOTHING if value is None else f"{value:.{digits}f}"


def percent(confidence: float) -> str:
    """Return a confidence level, e.g. "95 %"; of an early look never rounded up to 100 %."""
    return "> 99.99 %" if confidence > 0.9999 else f"{100 * confidence:.4g} %"


P_LEVEL = percent(CONFIDENCE)  # of intervals of P


def _with_interval(tests: Iterable[Verdict]) -> list[Estimate]:
    estimates = (test.estimate for test in tests)
    return [one for one in estimates if one and one.low is not None and not one.identical]


def level_of(tests: Iterable[Verdict]) -> float:
    """Return the level of most intervals of these tests, for a heading over all of them."""
    counts = Counter(one.confidence for one in _with_interval(tests))
    return max(counts, key=counts.__getitem__, default=CONFIDENCE)


def levels(tests: Iterable[Verdict]) -> str:
    """Return the levels of the intervals of these tests, e.g. "95 %" or "97.8 % to 99.2 %"."""
    found = {one.confidence for one in _with_interval(tests)} or {CONFIDENCE}
    return " to ".join(dict.fromkeys(map(percent, (min(found), max(found)))))


def other_levels(tests: Sequence[Verdict], level: float) -> str:
    """Return the levels of these tests' intervals behind one blank, if any is not `level`."""
    differ = any(one.confidence != level for one in _with_interval(tests))
    return f" {levels(tests)}" if differ else ""


def mean_p(cell: Cell) -> str:
    """Return the mean P of a cell with its limits, e.g. "28.7 [27.1, 30.3]†"."""
    if not cell.n_seeds:
        return "no run"
    return bracketed(cell.mean, digits_of(cell.mean.value)) + SATURATED * cell.saturated


def ratio(test: Verdict, level: float = CONFIDENCE) -> str:
    """Return an indicator with its interval, e.g. "0.611 [0.520, 0.702]".

    Args:
        level: that the heading names; another one of the interval stands behind it.
    """
    capped = SATURATED * (test.saturated and test.estimate is not None)
    return bracketed(test.estimate, 3) + capped + other_levels([test], level)


def lies_above(test: Verdict) -> bool | None:
    """Return whether an interval lies above the threshold; None: it holds it, or there is none."""
    _, low, high = test.interval or (None, None, None)
    threshold = test.compared.threshold
    if low is None or high is None or low <= threshold <= high:
        return None
    return low > threshold


def concluded(*tests: Verdict) -> str:
    """Return the answers under Holm, then what else is known: "open; P changes by less than 10 %".

    Of several tests they are counted, unless all are the same.
    """
    words = [test.on_property.adjusted for test in tests]
    told = [words[0] if len(set(words)) == 1 else counted(words)]
    same = Counter(_unchanged(test) for test in tests if test.conclusion == "equivalent")
    for known, count in same.items():
        told.append(known if count == len(tests) else f"{known} in {count}")
    return "; ".join(told)


def _unchanged(test: Verdict) -> str:
    margin = f"{100 * test.margin:.3g} %"
    if test.compared.definition.needs_removed:
        return f"P_F and P_S differ by less than {margin} of P_o"
    return f"P changes by less than {margin}"


def answered(test: Verdict) -> str:
    """Return the unadjusted verdict on the property, and Holm's in brackets where it differs."""
    plain, adjusted = test.on_property
    return plain if plain == adjusted else f"{plain} ({adjusted})"


def counted_as(test: Verdict, verdict: str) -> str:
    """Return what a verdict on this test counts as in `counted`.

    A count is a headline: a verdict that assumes normal differences does not stand in it.
    """
    if verdict in DECIDED and "assumes_normal" in test.flags:
        return _NOT_COUNTED
    return verdict


def counted(verdicts: Iterable[str]) -> str:
    """Return how many of each word, e.g. "7 supported, 1 refuted"."""
    counts = Counter(verdicts)
    return ", ".join(f"{counts[word]} {word}" for word in (*WORDS, _NOT_COUNTED) if counts[word])


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
        return bracketed(spi.mean_interval(np.reshape(times, (several, -1)), CONFIDENCE), 0)
    found = bracketed(spi.median_interval(times, CONFIDENCE), 0)
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
    head = f"{compared.policy}, {test.property_name}? {compared.label}{swarm}."
    text = " ".join(_parts(results, test))
    return Sentence(head, text, test.conclusion, test.on_property.adjusted)


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
        yield f"{indicator} = {estimate.value:.3f} exactly, over {seeds}: unaffected."
        yield "Both conditions gave the same runs, so there is nothing to test."
        return
    found = limits(estimate, 3)
    level = f", {percent(estimate.confidence)} interval {found}" if found else " (no interval)"
    capped = SATURATED * test.saturated
    value = fixed(estimate.value, 3, [estimate.threshold])
    yield f"{indicator}{capped} = {value}{level} over {seeds}."
    if not estimate.untestable:
        # One seed gives no p, and Holm's placeholder of 1 says nothing.
        adjusted_p = None if estimate.p_value is None else test.p_adjusted
        yield f"Unadjusted: {test.on_property.plain}{_p(estimate.p_value)};"
        yield f"Holm-adjusted: {test.on_property.adjusted}{_p(adjusted_p)}."
    if test.on_claim is not None:
        plain, adjusted = test.on_claim
        both = plain if plain == adjusted else f"{plain}, {adjusted} under Holm"
        yield f'Claim "{test.claim}": {both}.'
    if test.equivalence is not None and test.on_equivalence is not None:
        unchanged, holm = test.on_equivalence
        under_holm = "" if unchanged == holm else f" ({holm} under Holm)"
        change = test.equivalence.change
        told = bracketed(change, 3, [-test.margin, test.margin])
        if change.low is not None and not change.identical:
            told += f" ({percent(change.confidence)})"
        yield f"{test.equivalence_name}? Change {told}: {unchanged}{under_holm}."
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
