"""Several policies in one study: the same cells and the same questions, seed by seed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import spi
from swarm_logistics_env.spi.summaries import Interval
from swarm_logistics_env.studies.analysis.paired import difference_interval, jackknife_interval
from swarm_logistics_env.studies.comparisons import Arm, Comparison, Level
from swarm_logistics_env.studies.judgement import Cell, Findings, Judgement


@dataclass(frozen=True)
class CellContest:
    """P of one policy in one cell, beside that of the baseline, the study's first policy.

    Attributes:
        cell: of the policy.
        interquartile_mean, worst_decile: of its P [items].
        difference: its P less the baseline's, paired by seed, with 95 % interval [items]; None
            for the baseline itself, or where runs are missing or share no seeds.
        ratio: its mean P as a multiple of the baseline's, with Fieller's 95 % interval; None as
            above, and where the baseline delivers nothing.
        improvement: share of seeds on which it delivers more, ties counting half; None as above.
    """

    cell: Cell
    interquartile_mean: float
    worst_decile: float
    difference: Interval | None
    ratio: Interval | None
    improvement: Interval | None


@dataclass(frozen=True)
class IndicatorContest:
    """One question asked of every policy.

    Attributes:
        judgements: policy by policy; None: the policy was not asked.
        differences: each policy's indicator less the baseline's with 95 % jackknife interval; None
            for the baseline, or where it is undefined.
    """

    table: str
    judgements: tuple[Judgement | None, ...]
    differences: tuple[Interval | None, ...]


def judged_policies(findings: Findings) -> tuple[str, ...]:
    """Return the labels of the study's policies, the baseline first."""
    return tuple(dict.fromkeys(c.policy for c in findings.plan.comparisons))


def cell_contests(findings: Findings) -> dict[str, list[CellContest]]:
    """Return, table by table, every cell of every policy; cells side by side."""
    policies = judged_policies(findings)
    found: dict[str, dict[Level, dict[str, Cell]]] = {}
    for cell in findings.cells:
        if cell.arm.level.kind != "policy" and cell.performance.size:
            cells = found.setdefault(cell.table, {}).setdefault(cell.arm.level, {})
            cells[cell.policy] = cell
    return {
        table: [
            _cell_contest(findings, cells[policy], cells.get(policies[0]))
            for cells in levels.values()
            for policy in policies
            if policy in cells
        ]
        for table, levels in found.items()
    }


def _cell_contest(findings: Findings, cell: Cell, baseline: Cell | None) -> CellContest:
    difference = ratio = improvement = None
    comparable = baseline is not None and not (cell.problem or baseline.problem)
    if baseline is not None and baseline is not cell and comparable and findings.plan.paired:
        difference = difference_interval(baseline.performance, cell.performance)
        ratio = _ratio(baseline.performance, cell.performance)
        improvement = spi.probability_of_improvement(baseline.performance, cell.performance)
    return CellContest(
        cell,
        spi.interquartile_mean(cell.performance),
        spi.worst_decile(cell.performance),
        difference,
        ratio,
        improvement,
    )


def _ratio(baseline: NDArray[np.float64], performance: NDArray[np.float64]) -> Interval | None:
    try:
        change = spi.relative_change(baseline, performance)
    except spi.IndicatorError:  # nothing to divide by
        return None
    low, high = (None if limit is None else 1.0 + limit for limit in (change.low, change.high))
    return Interval(1.0 + change.value, low, high)


def indicator_contests(findings: Findings) -> Iterator[IndicatorContest]:
    """Yield every question that more than one policy was asked, with the differences."""
    policies = judged_policies(findings)
    performance = {(cell.policy, cell.table, cell.arm): cell.performance for cell in findings.cells}
    asked: dict[object, dict[str, Judgement]] = {}
    for judgement in findings.judgements:
        comparison = judgement.comparison
        if comparison.indicator != "change":
            asked.setdefault((comparison.table, comparison.question), {})[comparison.policy] = (
                judgement
            )
    for by_policy in asked.values():
        if len(by_policy) < 2:
            continue
        judgements = tuple(by_policy.get(policy) for policy in policies)
        baseline = judgements[0]
        yield IndicatorContest(
            next(iter(by_policy.values())).comparison.table,
            judgements,
            tuple(
                None
                if baseline is None or judgement is None or judgement is baseline
                else _difference(findings, baseline, judgement, performance)
                for judgement in judgements
            ),
        )


def _difference(
    findings: Findings,
    baseline: Judgement,
    judgement: Judgement,
    performance: dict[tuple[str, str, Arm], NDArray[np.float64]],
) -> Interval | None:
    if baseline.estimate is None or judgement.estimate is None or not findings.plan.paired:
        return None

    def value(comparison: Comparison, seeds: NDArray[np.intp]) -> float:
        key = comparison.policy, comparison.table
        return comparison.estimate(lambda arm: performance[*key, arm][seeds]).value

    try:
        return jackknife_interval(
            len(findings.plan.seeds),
            lambda seeds: value(judgement.comparison, seeds) - value(baseline.comparison, seeds),
        )
    except spi.IndicatorError:  # without one of the seeds nothing is delivered in the reference
        return None
