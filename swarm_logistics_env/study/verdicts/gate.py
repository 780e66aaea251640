"""Gates: conditions under which a comparison of two studies fails, for continuous integration.

    gate     := ["possibly"] subject ("<" | ">") number ["at" text]
    subject  := symbol of an indicator in `spi.definitions`, "change" among them

Indicators are those of the newer study. Only `change` is about both studies: (P_new - P_old) /
P_old of every condition under which both judge a policy, over the seeds that they share. "R < 0"
fails where R lies below 0 beyond chance, "possibly R < 0" wherever that is not ruled out, for want
of seeds as well.
`at` keeps the comparisons and conditions whose name holds the text, e.g. "R < 0 at FM4, m = 1".
Verdicts are Holm-adjusted over what is kept. What cannot be judged fails: failed runs, and for
`change` a policy without a match in the other study, or studies that share no seed. If both studies
have the same runs, the change is exactly 0, and the gate fails if "0 < number" (or ">") is true.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple, Self

from swarm_logistics_env import spi
from swarm_logistics_env.core.errors import StudyError
from swarm_logistics_env.spi.definitions import DEFINITIONS
from swarm_logistics_env.spi.estimate import DecisionWord, Estimate
from swarm_logistics_env.study.questions.specification import seeds_in_words
from swarm_logistics_env.study.tasks.task import TaskFault, TaskScenario

from .cell import Cell, same_runs
from .results import StudyResults
from .verdict import judge_comparison

# All about a condition but its policy: scenario, faults, behaviour and table.
_Content = tuple[TaskScenario, tuple[TaskFault, ...], int, str]
_Unmatched = tuple[str, str, tuple[str, ...]]
_Judged = dict[str, dict[_Content, Cell]]  # keyed by the policy's label


class Matching(NamedTuple):
    """The conditions that two studies share, and the judged policies and conditions of one alone.

    A condition is named by policy, "change" and the condition in words.

    Attributes:
        matches: name, cell of the old study, and of the new one.
        unmatched: of each policy that the other study gives nothing to compare with: its label, a
            sentence that says what is missing, and the names of its conditions.
        seeds: the shared ones; None: one of the studies has no seeds to share, or they number
            blocks of other names.
        notes: sentences on conditions and seeds that only one of the studies has.
    """

    matches: tuple[tuple[str, Cell, Cell], ...]
    unmatched: tuple[_Unmatched, ...]
    seeds: tuple[int, ...] | None
    notes: tuple[str, ...]


def match(old: StudyResults, new: StudyResults) -> Matching:
    """Match the conditions of two studies' judged policies, by what is varied.

    A policy matches the one of its label; where each study judges a single policy these two match,
    whatever they are called.
    """
    before, after = _judged(old), _judged(new)
    partners = {label: label for label in (*after, *before)}
    if len(before) == len(after) == 1:
        partners = dict(zip(after, before))
    matches = list[tuple[str, Cell, Cell]]()
    unmatched = list[_Unmatched]()
    notes = list[str]()
    for label, old_label in partners.items():
        named = label if label == old_label else f"{old_label} -> {label}"
        old_cells, new_cells = before.get(old_label, {}), after.get(label, {})
        common = [content for content in new_cells if content in old_cells]
        if not common:
            names = tuple(_name(named, cell) for cell in (*old_cells.values(), *new_cells.values()))
            problem = (
                f"policy {named!r} is judged under no condition of both studies: the old one "
                f"judges {[*before]}, the new one {[*after]}"
            )
            unmatched.append((named, problem, names))
            continue
        matches += [(_name(named, new_cells[c]), old_cells[c], new_cells[c]) for c in common]
        for study, cells in (("old", old_cells), ("new", new_cells)):
            alone = [f"{c.words} ({c.table})" for at, c in cells.items() if at not in common]
            if alone:
                names_text = f"{named}, {'; '.join(alone)}"
                notes.append(f"Only in the {study} study, and not compared: {names_text}.")
    seeds = None
    if old.plan.paired and new.plan.paired and _blocks(old) != _blocks(new):
        notes.append("Their blocks have other names, so that runs are compared without pairs.")
    elif old.plan.paired and new.plan.paired:
        seeds = tuple(sorted({*old.plan.seeds} & {*new.plan.seeds}))
    for study, results in (("old", old), ("new", new)):
        if results.damage:
            notes.append(f"{results.damage}.")
        if seeds and (extra := sorted({*results.plan.seeds} - {*seeds})):
            notes.append(
                f"Only in the {study} study, and left out: seeds {seeds_in_words(extra)}. "
                f"Runs are paired over the shared seeds, {seeds_in_words(seeds)}."
            )
    return Matching(tuple(matches), tuple(unmatched), seeds, tuple(notes))


def _blocks(results: StudyResults) -> tuple[str, ...]:
    """Return the names of the blocks that a study's seeds number; none: seeds are numbers."""
    return results.plan.origin.blocks if results.plan.origin else ()


def _judged(results: StudyResults) -> _Judged:
    """Return each condition of a judged policy once, by the policy's label and by all but it."""
    cells_by_policy: _Judged = {}
    for cell in results.cells:
        case = cell.arm.case
        if case.policy.title != cell.policy:  # the second policy of an ablation
            continue
        # Imported tables may differ in P at one condition.
        table = "" if results.plan.origin is None else cell.table
        content = (case.scenario, case.faults, case.behaviour, table)
        cells_by_policy.setdefault(cell.policy, {}).setdefault(content, cell)
    return cells_by_policy


def _name(policy: str, cell: Cell) -> str:
    return f"{policy}: change, {cell.words} ({cell.table})"


SUBJECTS = "|".join(DEFINITIONS)
_GATE = re.compile(
    rf"(?P<possibly>possibly\s+)?(?P<subject>{SUBJECTS})\s*(?P<sign>[<>])\s*"
    r"(?P<number>[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?)(\s+at\s+(?P<at>.+))?"
)


class Gate(NamedTuple):
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
        possibly = match["possibly"] is not None
        below = match["sign"] == "<"
        number = float(match["number"])
        at = match["at"] or ""
        return cls(text.strip(), possibly, match["subject"], below, number, at)

    def holds_for(self, value: float) -> bool:
        """Return whether an exact value, which leaves nothing to chance, makes the gate fail."""
        return value < self.number if self.below else value > self.number

    def fails_on(self, verdict: DecisionWord) -> bool:
        """Return whether a verdict on "above the number" makes the gate fail."""
        holds, opposite = ("refuted", "supported") if self.below else ("supported", "refuted")
        return verdict != opposite if self.possibly else verdict == holds


# An estimate; a number that is exact, as the runs are the same runs; or why it cannot be judged.
_Found = Estimate | float | str


class GateAnswer(NamedTuple):
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
    verdict: DecisionWord | None = None
    exact: float | None = None
    problem: str | None = None


def answers(gate: Gate, old: StudyResults, new: StudyResults) -> tuple[GateAnswer, ...]:
    """Return what everything that a gate is about says to it.

    A change is asked of every judged policy: one that the other study gives nothing to compare
    with answers that it cannot be judged.

    Raises:
        StudyError: the gate is about nothing that the studies hold.
    """
    subjects = _changes(gate, old, new) if gate.subject == "change" else _indicators(gate, new)
    values = list(subjects)
    if not values:
        raise StudyError(
            f"gate {gate.text!r}: the studies hold nothing that it names, so it tests nothing"
        )
    verdicts = iter(spi.adjust([value for _, value in values if isinstance(value, Estimate)]))
    gate_answers = []
    for name, value in values:
        if isinstance(value, str):
            gate_answers.append(GateAnswer(name, fails=True, problem=value))
        elif isinstance(value, float):
            gate_answers.append(GateAnswer(name, gate.holds_for(value), exact=value))
        else:
            verdict = next(verdicts)
            is_impossible = gate.below and "cannot_fail" in value.flags
            gate_answers.append(
                GateAnswer(name, gate.fails_on(verdict) and not is_impossible, value, verdict)
            )
    return tuple(gate_answers)


def _indicators(gate: Gate, new: StudyResults) -> Iterator[tuple[str, _Found]]:
    # A comparison tested against several thresholds answers once.
    comparisons = dict.fromkeys(
        replace(judged.compared, threshold=gate.number)
        for judged in new.verdicts
        if judged.compared.indicator == gate.subject
    )
    for comparison in comparisons:
        label = f"{comparison.label} ({comparison.table})"
        name = f"{comparison.policy}: {comparison.indicator}, {label}"
        if gate.at not in name:
            continue
        policy, table = comparison.policy, comparison.table
        cells = {arm: new.cells_by_key[policy, table, arm] for arm in comparison.arms}
        margin = new.plan.specification.margin
        verdict = judge_comparison(comparison, cells, paired=new.plan.paired, margin=margin)
        estimate = verdict.estimate
        if estimate is None:
            yield name, str(verdict.problem)
        else:
            yield name, estimate.value if estimate.identical else estimate


def _changes(gate: Gate, old: StudyResults, new: StudyResults) -> Iterator[tuple[str, _Found]]:
    matching = match(old, new)
    for policy, problem, names in matching.unmatched:
        if any(gate.at in name for name in names):
            yield f"{policy}: change", problem
    for name, old_cell, new_cell in matching.matches:
        if gate.at in name:
            yield name, _change(gate, (old, old_cell), (new, new_cell), matching.seeds)


def _change(
    gate: Gate,
    before: tuple[StudyResults, Cell],
    after: tuple[StudyResults, Cell],
    seeds: Sequence[int] | None,
) -> _Found:
    old, old_cell = before
    new, new_cell = after
    if problem := old_cell.problem or new_cell.problem:
        return problem
    if seeds is not None:
        if not seeds:
            return (
                f"the studies share no seed: the old one has {seeds_in_words(old.plan.seeds)}, "
                f"the new one {seeds_in_words(new.plan.seeds)}; play one of them on the other's "
                "seeds"
            )
        # Over shared seeds the runs of these alone tell whether P is capped.
        old_cell, new_cell = (_over(seeds, results, of) for results, of in (before, after))
        if same_runs(old_cell.outcomes, new_cell.outcomes):
            return 0.0
    try:
        return spi.relative_change(
            old_cell.by_seed,
            new_cell.by_seed,
            threshold=gate.number,
            paired=seeds is not None,
            saturated=[
                name for name, of in (("p_o", old_cell), ("p_new", new_cell)) if of.saturated
            ],
        )
    except spi.IndicatorError as error:
        return str(error)


def _over(seeds: Sequence[int], results: StudyResults, cell: Cell) -> Cell:
    """Return a cell over some of its seeds, of each training if there are several."""
    cases = cell.arm.case.trainings
    outcomes = [results.outcomes.get((case.key, seed)) for case in cases for seed in seeds]
    return Cell.of(cell.policy, cell.table, cell.arm, outcomes)
