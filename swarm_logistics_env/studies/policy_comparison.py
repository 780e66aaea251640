"""Several policies in one study: the same cells and the same questions, seed by seed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import spi
from swarm_logistics_env.spi.summaries import Interval, t_interval
from swarm_logistics_env.studies.comparisons import Comparison, Setting
from swarm_logistics_env.studies.results import Cell, IndicatorTest, StudyResults


@dataclass(frozen=True)
class CellAgainstBaseline:
    """P of one policy in one cell, beside that of the baseline, the study's first policy.

    Attributes:
        cell: the policy's cell.
        interquartile_mean, worst_decile: these statistics of its P [items].
        difference: its P minus the baseline's, paired by seed, with 95 % interval [items]; None
            for the baseline itself, or if runs are missing or share no seeds.
        ratio: its mean P as a multiple of the baseline's, with Fieller's 95 % interval; None in
            the same cases, or if the baseline delivers nothing.
        improvement: the share of seeds on which it delivers more, ties counting half; None in the
            same cases as `difference`.
    """

    cell: Cell
    interquartile_mean: float
    worst_decile: float
    difference: Interval | None
    ratio: Interval | None
    improvement: Interval | None


@dataclass(frozen=True)
class IndicatorAgainstBaseline:
    """One question asked of every policy.

    Attributes:
        tests: policy by policy; None: the policy was not asked.
        differences: each policy's indicator less the baseline's with 95 % jackknife interval; None
            for the baseline, or where it is undefined.
    """

    table: str
    tests: tuple[IndicatorTest | None, ...]
    differences: tuple[Interval | None, ...]


def judged_policies(results: StudyResults) -> tuple[str, ...]:
    """Return the labels of the study's policies, the baseline first."""
    return tuple(dict.fromkeys(c.policy for c in results.plan.comparisons))


def cells_against_baseline(results: StudyResults) -> dict[str, list[CellAgainstBaseline]]:
    """Return, table by table, every cell of every policy; cells side by side."""
    policies = judged_policies(results)
    found: dict[str, dict[Setting, dict[str, Cell]]] = {}
    for cell in results.cells:
        if cell.arm.setting.kind != "policy" and cell.performance.size:
            cells = found.setdefault(cell.table, {}).setdefault(cell.arm.setting, {})
            cells[cell.policy] = cell
    return {
        table: [
            _cell_against_baseline(results, cells[policy], cells.get(policies[0]))
            for cells in by_setting.values()
            for policy in policies
            if policy in cells
        ]
        for table, by_setting in found.items()
    }


def _cell_against_baseline(
    results: StudyResults, cell: Cell, baseline: Cell | None
) -> CellAgainstBaseline:
    difference = ratio = improvement = None
    comparable = baseline is not None and not (cell.problem or baseline.problem)
    if baseline is not None and baseline is not cell and comparable and results.plan.paired:
        difference = difference_interval(baseline.performance, cell.performance)
        ratio = _ratio(baseline.performance, cell.performance)
        improvement = spi.probability_of_improvement(baseline.performance, cell.performance)
    return CellAgainstBaseline(
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


def indicators_against_baseline(results: StudyResults) -> Iterator[IndicatorAgainstBaseline]:
    """Yield every question that more than one policy was asked, with the differences."""
    policies = judged_policies(results)
    asked: dict[object, dict[str, IndicatorTest]] = {}
    for test in results.tests:
        comparison = test.comparison
        if comparison.definition.compares != "policy":
            asked.setdefault((comparison.table, comparison.question), {})[comparison.policy] = test
    for by_policy in asked.values():
        if len(by_policy) < 2:
            continue
        tests = tuple(by_policy.get(policy) for policy in policies)
        baseline = tests[0]
        yield IndicatorAgainstBaseline(
            next(iter(by_policy.values())).comparison.table,
            tests,
            tuple(
                None
                if baseline is None or test is None or test is baseline
                else _difference(results, baseline, test)
                for test in tests
            ),
        )


def _difference(
    results: StudyResults,
    baseline: IndicatorTest,
    test: IndicatorTest,
) -> Interval | None:
    if baseline.estimate is None or test.estimate is None or not results.plan.paired:
        return None

    def value(comparison: Comparison, seeds: NDArray[np.intp]) -> float:
        key = comparison.policy, comparison.table
        return comparison.estimate(lambda arm: results.by_arm[*key, arm].performance[seeds]).value

    try:
        return jackknife_interval(
            len(results.plan.seeds),
            lambda seeds: value(test.comparison, seeds) - value(baseline.comparison, seeds),
        )
    except spi.IndicatorError:  # without one of the seeds nothing is delivered in the reference
        return None


def difference_interval(before: NDArray[np.float64], after: NDArray[np.float64]) -> Interval:
    """Return mean(after - before) with its 95 % t-interval, paired by seed; shapes (n,)."""
    return t_interval(after - before)


def jackknife_interval(n_seeds: int, statistic: Callable[[NDArray[np.intp]], float]) -> Interval:
    """Return a statistic of seeds with the 95 % t-interval of its jackknife pseudo-values.

    For differences of two ratios over the same seeds, which have no Fieller interval (Tukey 1958).

    Args:
        n_seeds: number of seeds.
        statistic: its value from the seeds of these indices, shape (k,).
    """
    seeds = np.arange(n_seeds)
    value = statistic(seeds)
    if n_seeds == 1:
        return Interval(value, None, None)
    left_out = np.array([statistic(np.delete(seeds, seed)) for seed in seeds])
    pseudo = t_interval(n_seeds * value - (n_seeds - 1) * left_out)
    if pseudo.low is None or pseudo.high is None:
        return Interval(value, None, None)
    return Interval(value, pseudo.low - pseudo.value + value, pseudo.high - pseudo.value + value)
