"""The score card of a policy: its answers to the study `scorecard` beside the shipped policies'."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from swarm_logistics_env.spi.summaries import Interval
from swarm_logistics_env.spi.verdict_signs import SIGNS
from swarm_logistics_env.studies.fault_measures import fault_budgets
from swarm_logistics_env.studies.indicator_table import Finding, findings_of
from swarm_logistics_env.studies.performance_table import cells_of
from swarm_logistics_env.studies.results import StudyResults

from . import wording
from .result_tables import Section

STUDY = "scorecard"
# `docs/play_tables.py` writes it.
RECORDED = Path(__file__).with_name("shipped_score_cards.json")
_FAILED = 2  # robots, of which R and FT are told


@dataclass(frozen=True)
class Line:
    """One number of a score card.

    Attributes:
        name: what it is, the same on every card: "P", "S, N 10 -> 25", "R", "fault budget", ...
        condition: where it was found, e.g. "FM4, the worst of four".
        value: NaN: no run, or undefined.
        low, high: limits of the 95 % interval; None: it has none.
        verdict: on the property, adjusted after Holm, a name in `SIGNS`; empty: nothing is asked.
    """

    name: str
    condition: str
    value: float
    low: float | None = None
    high: float | None = None
    verdict: str = ""

    @property
    def text(self) -> str:
        """The value with its interval."""
        if not wording.is_known(self.value):
            return wording.NOTHING
        if self.name == "fault budget":
            return f"{self.value:.0f}"
        digits = wording.digits_of(self.value) if self.name == "P" else 3
        return wording.bracketed(Interval(self.value, self.low, self.high), digits)

    @property
    def said(self) -> str:
        """The verdict with its sign."""
        return f"{SIGNS[self.verdict].mark} {SIGNS[self.verdict].word}" if self.verdict else ""

    @property
    def limits(self) -> tuple[float, float]:
        """The limits of the interval; the value itself where there is none."""
        if self.low is None or self.high is None:
            return self.value, self.value
        return self.low, self.high


@dataclass(frozen=True)
class ScoreCard:
    """What the study `scorecard` says of one policy.

    Attributes:
        policy: its label.
        lines: its numbers.
        seeds: over which seeds, in words.
    """

    policy: str
    lines: tuple[Line, ...]
    seeds: str


@dataclass(frozen=True)
class Rank:
    """The place of a policy among the shipped ones by one number, 1 the largest.

    Attributes:
        place: by the value; None: it has no value.
        best, worst: the places that the intervals leave open.
        of: how many policies there are, itself among them.
    """

    place: int | None
    best: int
    worst: int
    of: int

    def __str__(self) -> str:
        if self.place is None:
            return wording.NOTHING
        between = "" if self.best == self.worst else f" ({self.best} to {self.worst})"
        return f"{self.place} of {self.of}{between}"


def score_card(results: StudyResults) -> ScoreCard:
    """Return the score card of the one policy that a study `scorecard` judged."""
    return ScoreCard(
        results.indicators["policy"].iloc[0], tuple(_lines(results)), wording.seeds_text(results)
    )


def _lines(results: StudyResults) -> Iterator[Line]:
    unbroken = next(cell for cell in cells_of(results.performance) if cell.factor == "none")
    known = unbroken.n_seeds > 0
    yield Line(
        "P",
        f"N = {unbroken.n_robots}, no fault",
        unbroken.mean if known else math.nan,
        unbroken.low if known else None,
        unbroken.high if known else None,
    )
    tests = list(findings_of(results.indicators))
    for test in tests:
        if test.kind == "size":
            yield _line(f"S, {test.comparison}", "more robots", test)
    for symbol in ("R", "FT"):
        of_modes = [t for t in tests if t.indicator == symbol and t.after == _FAILED]
        # One that is blocked has no value, and is worse than any that has one.
        worst = min(of_modes, key=lambda t: t.value if wording.is_known(t.value) else -math.inf)
        where = f"{worst.factor}, the worst of {len(of_modes)} failure modes"
        yield _line(f"{symbol}, m = {_FAILED}", where, worst)
    for test in tests:
        if test.kind == "parameter":
            yield _line("A", f"{test.comparison} m", test)
    found = list(fault_budgets(results))
    budgets = [(one.budget, one.compared) for one in found if one.budget is not None]
    if len(budgets) < len(found):
        yield Line("fault budget", "runs are missing", math.nan)
        return
    (robots, limit), compared = min(budgets, key=lambda one: one[0].robots)
    mode = compared.changed.setting.name
    ended = "every m tested is withstood" if limit is None else f"{mode} ends it"
    yield Line("fault budget", f"robots of any mode; {ended}", float(robots))


def _line(name: str, condition: str, test: Finding) -> Line:
    low, high = (limit if wording.is_known(limit) else None for limit in (test.low, test.high))
    return Line(name, condition, test.value, low, high, test.answer_holm or "blocked")


@cache
def recorded() -> Mapping[str, Any]:
    """Return the recorded score cards: `command`, `seeds`, and `policies`.

    `policies` has for each shipped policy its `p` seed by seed at N = 25 without faults, and
    `lines`: for each name of a line its value and the limits of its interval, or None.
    """
    found: dict[str, Any] = json.loads(RECORDED.read_text(encoding="utf-8"))
    return found


def others(card: ScoreCard, line: Line) -> dict[str, tuple[float, float, float]]:
    """Return value, low and high of the shipped policies for a line, the largest first."""
    found = {
        policy: tuple(line_of[line.name])
        for policy, line_of in ((p, one["lines"]) for p, one in recorded()["policies"].items())
        if policy != card.policy and line_of.get(line.name) is not None
    }
    return dict(sorted(found.items(), key=lambda item: -item[1][0]))


def rank(card: ScoreCard, line: Line) -> Rank:
    """Return the place of a card's line among the shipped policies."""
    beside = others(card, line).values()
    if not wording.is_known(line.value):
        return Rank(None, 0, 0, len(beside) + 1)
    low, high = line.limits
    return Rank(
        1 + sum(value > line.value for value, _, _ in beside),
        1 + sum(least > high for _, least, _ in beside),
        1 + sum(most >= low for _, _, most in beside),
        len(beside) + 1,
    )


def card_section(card: ScoreCard) -> Section:
    """Return the card as a table for the terminal."""
    rows = tuple(
        (line.name, line.condition, line.text, line.said, str(rank(card, line)))
        for line in card.lines
    )
    columns = ("", "where", "value [95 %]", "verdict", "rank (within the intervals)")
    return Section(f"Score card of {card.policy}", columns, rows, explanation(card))


def explanation(card: ScoreCard) -> tuple[str, ...]:
    """Return how to read a card."""
    best = next(line for line in card.lines if line.name == "P")
    each = "; ".join(f"{name} {value:.0f}" for name, (value, *_) in others(card, best).items())
    conditions = (
        f"Over {card.seeds}, 500 s, delivered items come back; verdicts adjusted after Holm. The "
        "fault budget is the number of robots that may fail by any mode with R > 0 supported."
    )
    ranks = "Ranks are among the shipped policies on the same seeds, 1 the largest. Their P"
    return conditions, f"{ranks}: {each}."


def as_recorded(results: StudyResults) -> dict[str, Any]:
    """Return what `recorded` keeps of a shipped policy."""
    unbroken = next(cell for cell in cells_of(results.performance) if cell.factor == "none")
    return {
        "p": [float(p) for p in unbroken.by_seed],
        "lines": {
            line.name: [line.value, *line.limits] if wording.is_known(line.value) else None
            for line in score_card(results).lines
        },
    }
