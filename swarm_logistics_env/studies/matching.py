"""Matching: which conditions of two studies are compared, and which have no counterpart.

Only judged policies are matched with each other: the second policy of an ablation is there to be
compared with, and how it has changed is not asked.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from .performance_table import Cell, cells_of
from .results import StudyResults
from .runs import seeds_in_words

_Content = tuple[object, ...]  # everything about a condition but its policy
_Judged = dict[str, dict[_Content, Cell]]  # keyed by the policy's label


@dataclass(frozen=True)
class Match:
    """One condition that both studies hold.

    Attributes:
        name: policy, "change" and condition.
        before, after: the rows of P in the old and of the new study.
    """

    name: str
    before: Cell
    after: Cell


@dataclass(frozen=True)
class Unmatched:
    """A judged policy of one study that the other gives nothing to compare with.

    Attributes:
        names: of its conditions, as `Match.name`.
        problem: one sentence that names the policy and says what is missing.
    """

    policy: str
    names: tuple[str, ...]
    problem: str


@dataclass(frozen=True)
class Matching:
    """The conditions that two studies share, and those that only one of them has.

    Attributes:
        seeds: the shared ones; None: one of the studies has no seeds to share.
        notes: sentences on conditions and seeds that only one of the studies has.
    """

    matches: tuple[Match, ...]
    unmatched: tuple[Unmatched, ...]
    seeds: tuple[int, ...] | None
    notes: tuple[str, ...]


def match(old: StudyResults, new: StudyResults) -> Matching:
    """Match the conditions of two studies' judged policies, by what is varied.

    A policy matches the one of its label; where each study judges a single policy these two match,
    whatever they are called.
    """
    before, after = _judged(old), _judged(new)
    partners = {label: label for label in after if label in before}
    if len(before) == len(after) == 1:
        partners = dict(zip(after, before))
    matches: list[Match] = []
    unmatched = [
        *_without_partner(before, partners.values(), "old", "new", tuple(after)),
        *_without_partner(after, partners, "new", "old", tuple(before)),
    ]
    notes: list[str] = []
    for label, old_label in partners.items():
        named = label if label == old_label else f"{old_label} -> {label}"
        theirs, ours = before[old_label], after[label]
        common = [content for content in ours if content in theirs]
        if not common:
            names = tuple(_name(named, cell) for cell in (*theirs.values(), *ours.values()))
            problem = f"policy {named!r} is judged in both studies, but under no common condition"
            unmatched.append(Unmatched(named, names, problem))
            continue
        matches += [Match(_name(named, ours[c]), theirs[c], ours[c]) for c in common]
        notes += _only_in("old", named, theirs, ours)
        notes += _only_in("new", named, ours, theirs)
    seeds = None
    if old.plan.paired and new.plan.paired:
        seeds = tuple(sorted({*old.plan.seeds} & {*new.plan.seeds}))
    if seeds:
        notes += _seed_notes(seeds, old, new)
    return Matching(tuple(matches), tuple(unmatched), seeds, tuple(notes))


def _judged(results: StudyResults) -> _Judged:
    """Return each condition of a judged policy once, by the policy's label and by all but it."""
    plan = results.plan
    # An ablation's second policy may bear the label of a judged one: its place tells them apart.
    second = {
        (comparison.policy, comparison.table, comparison.changed)
        for comparison in plan.comparisons
        if comparison.definition.compares == "policy"
    }
    found: _Judged = {}
    for cell in cells_of(results.performance):
        if (cell.policy, cell.table, cell.arm) in second:
            continue
        condition = cell.arm.condition
        content = (condition.scenario, condition.faults, condition.behaviour)
        # Imported tables may differ in P at one condition.
        table = "" if plan.imported_from is None else cell.table
        found.setdefault(cell.policy, {}).setdefault((*content, table), cell)
    return found


def _name(policy: str, cell: Cell) -> str:
    return f"{policy}: change, {cell.arm.setting} ({cell.table})"


def _without_partner(
    own: _Judged, matched: Iterable[str], study: str, other: str, theirs: Sequence[str]
) -> Iterator[Unmatched]:
    known = set(matched)
    for label in (label for label in own if label not in known):
        yield Unmatched(
            label,
            tuple(_name(label, cell) for cell in own[label].values()),
            f"policy {label!r} of the {study} study has no match: the {other} study judges "
            + (", ".join(map(repr, theirs)) or "no policy"),
        )


def _only_in(
    study: str, policy: str, own: Mapping[_Content, Cell], others: Mapping[_Content, Cell]
) -> Iterator[str]:
    lacking = [cell for content, cell in own.items() if content not in others]
    if lacking:
        settings = "; ".join(f"{cell.arm.setting} ({cell.table})" for cell in lacking)
        yield f"Only in the {study} study, and not compared: {policy}, {settings}."


def _seed_notes(seeds: Sequence[int], old: StudyResults, new: StudyResults) -> Iterator[str]:
    shared = set(seeds)
    for study, results in (("old", old), ("new", new)):
        extra = [seed for seed in results.plan.seeds if seed not in shared]
        if extra:
            yield (
                f"Only in the {study} study, and left out: seeds {seeds_in_words(extra)}. "
                f"Runs are paired over the shared seeds, {seeds_in_words(seeds)}."
            )
