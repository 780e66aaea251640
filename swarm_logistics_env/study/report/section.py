"""Sections: what a report is made of; and numbers and verdicts in words, the same in every one."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from swarm_logistics_env import spi
from swarm_logistics_env.spi.estimate import SEEDS_OF_HEADLINE, Estimate
from swarm_logistics_env.study.questions.comparison import CONFIDENCE
from swarm_logistics_env.study.verdicts.cell import Cell
from swarm_logistics_env.study.verdicts.verdict import DECIDED, Verdict

if TYPE_CHECKING:
    import pandas as pd

    from .drawing import Draw
    from .points import Panel

SATURATED = "†"
_SAME = 1e-9  # a value so near a threshold differs from it by rounding alone
NOTHING = "–"
# The words of decisions, in the order in which they are counted.
WORDS = (*DECIDED, "open", "unaffected", "untestable", "undefined")
Texts = tuple[str, ...]


@dataclass
class Figure:
    """One figure.

    Attributes:
        name: of its files, without ending; letters, digits and hyphens.
        caption: what it shows and under which conditions.
        data: what it shows, one row a point.
        height: of the drawing without its note [inch]; the width is that of all figures.
        draw: draws it on an empty canvas.
        note: what values, bars and marks are, and over which seeds; stands in the drawing.
        title: what it shows in a few words.
        panels: the panels that it draws, of which each point can be clicked in the page.
    """

    name: str
    caption: str
    data: pd.DataFrame
    height: float
    draw: Draw
    note: str
    title: str = ""
    panels: tuple[Panel, ...] = ()


class Sentence(NamedTuple):
    """One verdict in words.

    Attributes:
        head: what is asked.
        text: all that is known.
        conclusion: a name in `WORDS`.
        word: the answer to what is asked.
    """

    head: str
    text: str
    conclusion: str
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


def digits_of(p: float, width: float = 0.0) -> int:
    """Return how many digits after the point tell a performance: three in all where it is small.

    Args:
        width: of its interval, whose first digit is told; 0: it has none.
    """
    least = 1 if not 0 < p < 1 else 2 - math.floor(math.log10(p))
    return least if not 0 < width < math.inf else max(least, -math.floor(math.log10(width)))


def width_of(interval: spi.Interval) -> float:
    """Return the width of an interval; 0: it has none."""
    if interval.low is None or interval.high is None:
        return 0.0
    return interval.high - interval.low


def fixed(value: float, digits: int, thresholds: Iterable[float] = ()) -> str:
    """Return a number to so many digits; infinity as its sign.

    Args:
        thresholds: numbers on whose side the value is shown, by more digits where it takes them.
    """
    distinct = [threshold for threshold in thresholds if abs(value - threshold) > _SAME]

    def sides(x: float) -> list[tuple[bool, bool]]:
        return [(x > threshold, x < threshold) for threshold in distinct]

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
    thresholds = _all_thresholds(interval, thresholds)
    low, high = (fixed(end, digits, thresholds) for end in (interval.low, interval.high))
    return f"[{low}, {high}]"


def bracketed(
    interval: spi.Interval | Estimate | None, digits: int, thresholds: Iterable[float] = ()
) -> str:
    """Return a value with its limits, as `limits` does, e.g. "124.0 [101.2, ∞]"."""
    if interval is None:
        return NOTHING
    thresholds = _all_thresholds(interval, thresholds)
    value = fixed(interval.value, digits, thresholds)
    return f"{value} {limits(interval, digits, thresholds)}".rstrip()


def _all_thresholds(
    interval: spi.Interval | Estimate, thresholds: Iterable[float]
) -> tuple[float, ...]:
    if isinstance(interval, Estimate):
        return (interval.threshold, *thresholds)
    return tuple(thresholds)


def number(value: float | None, digits: int = 3) -> str:
    """Return a number without interval."""
    return NOTHING if value is None else f"{value:.{digits}f}"


def percent(confidence: float) -> str:
    """Return a confidence level, e.g. "95 %"; of an early look never rounded up to 100 %."""
    return "> 99.99 %" if confidence > 0.9999 else f"{100 * confidence:.4g} %"


P_LEVEL = percent(CONFIDENCE)  # of intervals of P


def share_in_words(share: spi.Interval) -> str:
    """Return a share with its interval, e.g. "16 % [10, 23]"."""
    low, high = (0.0 if end is None else 100.0 * end for end in (share.low, share.high))
    return f"{100.0 * share.value:.0f} % [{low:.0f}, {high:.0f}]"


def levels(verdicts: Iterable[Verdict]) -> str:
    """Return the levels of the intervals of verdicts, e.g. "95 %" or "97.8 % to 99.2 %"."""
    confidences = {verdict.level for verdict in verdicts if verdict.level} or {CONFIDENCE}
    ends = min(confidences), max(confidences)
    return " to ".join(dict.fromkeys(map(percent, ends)))


def mean_p(cell: Cell) -> str:
    """Return the mean P of a cell with its limits, e.g. "28.7 [27.1, 30.3]†"."""
    if not cell.n_seeds:
        return "no run"
    interval = cell.mean
    mean = bracketed(interval, digits_of(interval.value, width_of(interval)))
    return mean + SATURATED if cell.saturated else mean


def ratio(verdict: Verdict, *, names_level: bool = True) -> str:
    """Return an indicator with its interval, e.g. "0.611 [0.520, 0.702]".

    Of several trainings it also says how many collapsed.

    Args:
        names_level: whether the level of the interval stands behind it if it is not that of P.
    """
    estimate = verdict.estimate
    text = bracketed(estimate, 3)
    if verdict.saturated and estimate is not None:
        text += SATURATED
    if names_level and verdict.level not in (None, CONFIDENCE):
        text += f" {percent(verdict.level or 0.0)}"
    if estimate is not None and estimate.collapsed is not None:
        text += f" ({estimate.collapsed})"
    return text


def word_to_count(verdict: Verdict, word: str) -> str:
    """Return what a decision counts as in `count_words`: a provisional one is told as such."""
    is_provisional = word in DECIDED and "assumes_normal" in verdict.flags
    return f"{word} (n < {SEEDS_OF_HEADLINE})" if is_provisional else word


def count_words(words: Iterable[str]) -> str:
    """Return how many of each word, e.g. "7 supported, 1 refuted"."""
    counts = Counter(words)
    return ", ".join(f"{counts[word]} {word}" for word in sorted(counts, key=rank_of_word))


def rank_of_word(word: str) -> int:
    """Return where a word of `word_to_count` stands among those that are counted."""
    return WORDS.index(word.partition(" ")[0])


def join_names(names: Sequence[str]) -> str:
    """Return names as a list, e.g. "swarm-dt, random-walk and central"."""
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last


def plural(count: int, noun: str) -> str:
    """Return a number of things, e.g. "1 claim" or "2 claims"."""
    return f"1 {noun}" if count == 1 else f"{count} {noun}s"


def interval_to_clear(cell: Cell) -> spi.Interval:
    """Return the median time until all items were delivered, with its interval [s].

    Of several trainings the mean over trainings and seeds; an interval needs all runs in time.
    """
    times = [outcome.time_to_clear for outcome in cell.outcomes]
    n_trainings = len(cell.arm.case.trainings)
    if n_trainings > 1 and all(map(math.isfinite, times)) and not cell.problem:
        by_training = np.reshape(times, (n_trainings, -1))
        return spi.mean_interval(by_training, CONFIDENCE)
    return spi.median_interval(times, CONFIDENCE)


def time_to_clear(cell: Cell) -> str:
    """Return `interval_to_clear` in words, and how many runs were late."""
    times = [outcome.time_to_clear for outcome in cell.outcomes]
    n_late = sum(map(math.isinf, times))
    text = bracketed(interval_to_clear(cell), 0)
    return f"{text} ({n_late} of {len(times)})" if n_late else text
