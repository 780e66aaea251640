"""Comparing two stored studies: what became of P, and whether a gate fails."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace

from swarm_logistics_env import spi
from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.spi.estimate import Estimate, Verdict
from swarm_logistics_env.studies.gate import Gate
from swarm_logistics_env.studies.judgement import Cell, Findings


@dataclass(frozen=True)
class Answer:
    """What one comparison or condition says to a gate.

    Attributes:
        name: policy, subject and comparison.
        estimate: against the gate's number; None: it cannot be judged.
        verdict: on "above the number", Holm-adjusted over the gate's answers.
        problem: why it cannot be judged.
        fails: whether it makes the gate fail; what cannot be judged does.
    """

    name: str
    estimate: Estimate | None
    verdict: Verdict | None
    problem: str | None
    fails: bool


def answers(gate: Gate, old: Findings, new: Findings) -> tuple[Answer, ...]:
    """Return what everything that a gate is about says to it.

    Raises:
        StudyError: it is about nothing that the studies hold.
    """
    found = _changes(gate, old, new) if gate.subject == "change" else _indicators(gate, new)
    asked = [(name, answer) for name, answer in found if gate.at in name]
    if not asked:
        where = f" at {gate.at!r}" if gate.at else ""
        raise StudyError(
            f"gate {gate.text!r}: the studies hold no {gate.subject}{where}, so it tests nothing"
        )
    judged = [estimate for _, estimate in asked if isinstance(estimate, Estimate)]
    verdicts = iter(spi.adjust(judged))
    return tuple(
        Answer(name, None, None, estimate, fails=True)
        if isinstance(estimate, str)
        else Answer(name, estimate, verdict := next(verdicts), None, gate.fails_on(verdict))
        for name, estimate in asked
    )


def _indicators(gate: Gate, new: Findings) -> Iterator[tuple[str, Estimate | str]]:
    performance = {(cell.policy, cell.table, cell.arm): cell for cell in new.cells}
    # Once each, however many thresholds it was asked against.
    comparisons = dict.fromkeys(
        replace(judgement.comparison, threshold=gate.number)
        for judgement in new.judgements
        if judgement.comparison.indicator == gate.subject
    )
    labels = Counter((comparison.policy, comparison.label) for comparison in comparisons)
    for comparison in comparisons:
        name = f"{comparison.policy}: {comparison.indicator}, {comparison.label}"
        if labels[comparison.policy, comparison.label] > 1:
            name += f" ({comparison.table})"
        used = {
            arm: performance[comparison.policy, comparison.table, arm] for arm in comparison.arms
        }
        problems = [f"{arm.level}: {cell.problem}" for arm, cell in used.items() if cell.problem]
        if problems:
            yield name, "; ".join(problems)
            continue
        try:
            estimate = comparison.estimate(
                # No type can be given to a lambda's default.
                lambda arm, used=used: used[arm].performance,  # type: ignore[misc]
                paired=new.plan.paired,
            )
        except spi.IndicatorError as error:
            yield name, str(error)
        else:
            yield name, estimate


def _changes(gate: Gate, old: Findings, new: Findings) -> Iterator[tuple[str, Estimate | str]]:
    before, after = _by_content(old), _by_content(new)
    # One policy in each: they are compared whatever they are called.
    (theirs, *more), ours = {policy for policy, _ in before}, {policy for policy, _ in after}
    renamed = not more and len(ours) == 1
    for (policy, content), cell in after.items():
        label = theirs if renamed else policy
        match = before.get((label, content))
        if match is None:
            continue
        named = policy if label == policy else f"{label} -> {policy}"
        name = f"{named}: change, {cell.arm.level} ({cell.table})"
        paired = old.plan.paired and new.plan.paired
        yield name, match.problem or cell.problem or _change(gate, match, cell, paired=paired)


def _change(gate: Gate, before: Cell, after: Cell, *, paired: bool) -> Estimate | str:
    # Seeds are 0, 1, ...: the shared ones come first in both.
    shared = min(len(before.performance), len(after.performance)) if paired else None
    try:
        return spi.relative_change(
            before.performance[:shared],
            after.performance[:shared],
            threshold=gate.number,
            paired=paired,
        )
    except spi.IndicatorError as error:
        return str(error)


def _by_content(findings: Findings) -> dict[tuple[str, tuple[object, ...]], Cell]:
    """Return each condition's cell, by the label of its policy and by all but the policy."""
    # Imported tables may differ in P at one condition.
    imported = findings.plan.imported_from is not None
    found: dict[tuple[str, tuple[object, ...]], Cell] = {}
    for cell in findings.cells:
        condition = cell.arm.condition
        content = (condition.scenario, condition.faults, condition.behaviour)
        table = cell.table if imported else ""
        found.setdefault((condition.policy.label, (*content, table)), cell)
    return found
