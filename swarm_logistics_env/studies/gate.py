"""Gates: conditions under which a comparison of two studies fails, for continuous integration.

    gate     := ["possibly"] subject ("<" | ">") number ["at" text]
    subject  := symbol of an indicator in `spi.definitions`, "change" among them

Indicators are those of the newer study. Only `change` is about both studies: (P_new - P_old) /
P_old of every condition under which both judge a policy, over the seeds that they share. "R < 0"
fails where R lies below 0 beyond chance, "possibly R < 0" wherever that is not ruled out, for want
of seeds as well.
`at` keeps the comparisons and conditions whose name holds the text, e.g. "R < 0 at FM4, m = 1".
Verdicts are Holm-adjusted over what is kept, and at one of the newer study's declared looks they
are as strict as those of its report. What cannot be judged fails: a policy without a match
in the other study, failed runs, studies that share no seed. If both studies have the same runs, the
change is exactly 0, and the gate fails if "0 < number" (or ">") is true.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Self

from swarm_logistics_env import spi
from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.spi.definitions import DEFINITIONS
from swarm_logistics_env.spi.estimate import Estimate, Verdict

from .indicator_table import findings_of
from .judged_comparisons import estimate_of, same_runs
from .matching import Match, match
from .performance_table import played
from .results import StudyResults
from .runs import seeds_in_words

SUBJECTS = "|".join(DEFINITIONS)
_GATE = re.compile(
    rf"(?P<possibly>possibly\s+)?(?P<subject>{SUBJECTS})\s*(?P<sign>[<>])\s*(?P<number>\S+)"
    r"(\s+at\s+(?P<at>.+))?"
)


@dataclass(frozen=True)
class Gate:
    """One condition to fail on; see the grammar above.

    Attributes:
        text: as it was written.
        possibly: whether it is enough that the condition is not refuted.
        below: "<" rather than ">".
        number: the threshold.
        at: part of the names that it is about; empty: all.
    """

    text: str
    possibly: bool
    subject: str
    below: bool
    number: float
    at: str

    @classmethod
    def parse(cls, text: str) -> Self:
        """Return the gate that `text` describes.

        Raises:
            StudyError: the text does not read so.
        """
        match = _GATE.fullmatch(text.strip())
        if match is None:
            raise StudyError(
                f"gate {text!r}: should be [possibly] {SUBJECTS} <|> NUMBER [at TEXT], "
                'e.g. "R < 0" or "possibly change < -0.1 at N = 25"'
            )
        try:
            number = float(match["number"])
        except ValueError:
            number = float("nan")
        if not abs(number) < float("inf"):
            raise StudyError(f"gate {text!r}: {match['number']} should be a number")
        return cls(
            text.strip(),
            match["possibly"] is not None,
            match["subject"],
            match["sign"] == "<",
            number,
            (match["at"] or "").strip(),
        )

    def holds_for(self, value: float) -> bool:
        """Return whether an exact value, which leaves nothing to chance, makes the gate fail."""
        return value < self.number if self.below else value > self.number

    def fails_on(self, verdict: Verdict) -> bool:
        """Return whether a verdict on "above the number" makes the gate fail."""
        holds, opposite = ("refuted", "supported") if self.below else ("supported", "refuted")
        return verdict != opposite if self.possibly else verdict == holds


# An estimate; a number that is exact, as the runs are the same runs; or why it cannot be judged.
_Found = Estimate | float | str


@dataclass(frozen=True)
class Answer:
    """The answer of one comparison or condition to a gate.

    Attributes:
        name: policy, subject and comparison.
        fails: whether it makes the gate fail; what cannot be judged does.
        estimate: the indicator tested against the gate's number; None: it is exact, or cannot be
            judged.
        verdict: on "above the number", Holm-adjusted over the gate's estimates.
        exact: the value where the runs compared are the same runs, so that nothing is estimated.
        problem: why it cannot be judged.
    """

    name: str
    fails: bool
    estimate: Estimate | None = None
    verdict: Verdict | None = None
    exact: float | None = None
    problem: str | None = None


def answers(gate: Gate, old: StudyResults, new: StudyResults) -> tuple[Answer, ...]:
    """Return what everything that a gate is about says to it.

    A change is asked of every judged policy: one that the other study gives nothing to compare
    with answers that it cannot be judged.

    Raises:
        StudyError: the gate is about nothing that the studies hold.
    """
    found = _changes(gate, old, new) if gate.subject == "change" else _indicators(gate, new)
    asked = list(found)
    if not asked:
        where = f" at {gate.at!r}" if gate.at else ""
        raise StudyError(
            f"gate {gate.text!r}: the studies hold no {gate.subject}{where}, so it tests nothing"
        )
    verdicts = iter(spi.adjust([value for _, value in asked if isinstance(value, Estimate)]))
    return tuple(_answer(gate, name, value, verdicts) for name, value in asked)


def _answer(gate: Gate, name: str, value: _Found, verdicts: Iterator[Verdict]) -> Answer:
    if isinstance(value, str):
        return Answer(name, fails=True, problem=value)
    if isinstance(value, float):
        return Answer(name, gate.holds_for(value), exact=value)
    verdict = next(verdicts)
    return Answer(name, gate.fails_on(verdict), estimate=value, verdict=verdict)


def _indicators(gate: Gate, new: StudyResults) -> Iterator[tuple[str, _Found]]:
    # A comparison tested against several thresholds answers once.
    comparisons = dict.fromkeys(
        replace(test.compared, threshold=gate.number)
        for test in findings_of(new.indicators)
        if test.indicator == gate.subject
    )
    labels = Counter((comparison.policy, comparison.label) for comparison in comparisons)
    for comparison in comparisons:
        name = f"{comparison.policy}: {comparison.indicator}, {comparison.label}"
        if labels[comparison.policy, comparison.label] > 1:
            name += f" ({comparison.table})"
        if gate.at not in name:
            continue
        found = estimate_of(
            comparison, new.by_arm, paired=new.plan.paired, confidence=new.confidence
        )
        yield name, found.value if isinstance(found, Estimate) and found.identical else found


def _changes(gate: Gate, old: StudyResults, new: StudyResults) -> Iterator[tuple[str, _Found]]:
    matching = match(old, new)
    for unmatched in matching.unmatched:
        if any(gate.at in name for name in unmatched.names):
            yield f"{unmatched.policy}: change", unmatched.problem
    for matched in matching.matches:
        if gate.at in matched.name:
            yield matched.name, _change(gate, old, new, matched, matching.seeds)


def _change(
    gate: Gate, old: StudyResults, new: StudyResults, matched: Match, seeds: Sequence[int] | None
) -> _Found:
    before, after = matched.before, matched.after
    problem: str | None = before.problem or after.problem
    if problem:
        return problem
    p_o, p_new = before.by_seed, after.by_seed
    if seeds is not None:
        if not seeds:
            return (
                f"the studies share no seed: the old one has {seeds_in_words(old.plan.seeds)}, "
                f"the new one {seeds_in_words(new.plan.seeds)}; play one of them on the other's "
                "seeds"
            )
        one, other = (
            played([results.outcome(cell.arm, seed) for seed in seeds])
            for results, cell in ((old, before), (new, after))
        )
        if same_runs(one.digests, other.digests):
            return 0.0
        p_o, p_new = one.by_seed, other.by_seed
    try:
        return spi.relative_change(
            p_o,
            p_new,
            threshold=gate.number,
            confidence=new.confidence,
            paired=seeds is not None,
            saturated=[
                name for name, cell in (("p_o", before), ("p_new", after)) if cell.saturated
            ],
        )
    except spi.IndicatorError as error:
        return str(error)
