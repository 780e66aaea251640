"""Policies beside each other and beside the published values: the same cells, seed by seed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import spi
from swarm_logistics_env.spi.summaries import Interval, t_interval

from .comparisons import Comparison, Setting
from .indicator_table import Finding, findings_of
from .performance_table import Cell, cells_of, groups_of
from .results import StudyResults

if TYPE_CHECKING:
    import pandas as pd


class CellAgainstBaseline(NamedTuple):
    """P of one policy in one cell, beside that of the baseline, the study's first policy.

    Attributes:
        cell: the policy's row in the table of performances.
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
    difference: Interval | None = None
    ratio: Interval | None = None
    improvement: Interval | None = None


class IndicatorAgainstBaseline(NamedTuple):
    """One question asked of every policy.

    Attributes:
        tests: rows of the table of indicators by policy, the baseline first.
        differences: each further policy's indicator less the baseline's with 95 % jackknife
            interval; None where it is undefined.
    """

    tests: dict[str, Finding]
    differences: dict[str, Interval | None]

    @property
    def test(self) -> Finding:
        """The first policy's row, for what is the same for all of them."""
        return next(iter(self.tests.values()))


def judged_policies(results: StudyResults) -> tuple[str, ...]:
    """Return the labels of the study's policies, the baseline first."""
    return tuple(dict.fromkeys(results.indicators["policy"]))


def cells_against_baseline(results: StudyResults) -> dict[str, list[CellAgainstBaseline]]:
    """Return, table by table, every cell of every policy; the policies of a cell one by one."""
    found: dict[str, dict[Setting, list[Cell]]] = {}
    for cell in cells_of(results.performance):
        if cell.kind != "policy" and cell.n_seeds:
            found.setdefault(cell.table, {}).setdefault(cell.arm.setting, []).append(cell)
    return {
        table: [
            _cell_against_baseline(results, cell, cells[0])
            for cells in by_setting.values()
            for cell in cells
        ]
        for table, by_setting in found.items()
    }


def _cell_against_baseline(
    results: StudyResults, cell: Cell, baseline: Cell
) -> CellAgainstBaseline:
    p = cell.by_seed
    summaries = spi.interquartile_mean(p), spi.worst_decile(p)
    is_baseline = cell is baseline or baseline.policy != judged_policies(results)[0]
    if is_baseline or cell.problem or baseline.problem or not results.plan.paired:
        return CellAgainstBaseline(cell, *summaries)
    return CellAgainstBaseline(
        cell,
        *summaries,
        t_interval(p - baseline.by_seed),
        _ratio(baseline.by_seed, p),
        spi.probability_of_improvement(baseline.by_seed, p),
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
    baseline = judged_policies(results)[0]
    asked: dict[object, dict[str, Finding]] = {}
    for test in findings_of(results.indicators):
        if test.kind != "policy":
            asked.setdefault((test.table, test.compared.question), {})[test.policy] = test
    for tests in asked.values():
        if len(tests) > 1:
            differences = {
                policy: _difference(results, tests[baseline], test) if baseline in tests else None
                for policy, test in tests.items()
                if policy != baseline
            }
            yield IndicatorAgainstBaseline(tests, differences)


def _difference(results: StudyResults, baseline: Finding, test: Finding) -> Interval | None:
    if baseline.estimate is None or test.estimate is None or not results.plan.paired:
        return None

    def value(compared: Comparison, seeds: NDArray[np.intp]) -> float:
        key = compared.policy, compared.table
        return compared.estimate(lambda arm: results.by_arm[*key, arm].by_seed[seeds]).value

    try:
        return jackknife_interval(
            len(results.plan.seeds),
            lambda seeds: value(test.compared, seeds) - value(baseline.compared, seeds),
        )
    except spi.IndicatorError:  # without one of the seeds nothing is delivered in the reference
        return None


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


@dataclass(frozen=True)
class Agreement:
    """The figures of one policy.

    Attributes:
        policy: its label.
        cells: rows of the table of performances, those of the reference's cells.
        misses: those whose published value lies outside our 95 % prediction interval of one run: a
            weak test, which quite different policies pass as well. None at one seed.
        met: those whose published value lies inside the 95 % interval of our mean. None as above.
        mean_relative_error: mean of |our mean P - published P| / published P.
        mean_log_error: mean of |ln(our mean P / published P)|; None where a mean is 0.
        mean_interval_width: mean width of the prediction intervals [items], since wide intervals
            meet published values by their width alone. None at one seed.
        disorder: pairs of swarm sizes that stand opposite to the published order, with our 95 %
            intervals of the means apart.
        largest_ordered: the order is judged up to this swarm size, where the published P peaks.
    """

    policy: str
    cells: pd.DataFrame
    misses: pd.DataFrame | None
    met: pd.DataFrame | None
    mean_relative_error: float
    mean_log_error: float | None
    mean_interval_width: float | None
    disorder: tuple[tuple[Cell, Cell], ...]
    largest_ordered: int


def agreements(results: StudyResults) -> tuple[Agreement, ...]:
    """Return the figures of every policy all of whose cells have runs; none without reference."""
    counted = results.performance[results.performance["counted"]]
    return tuple(
        agreement(policy, cells)
        for policy, cells in groups_of(counted, "policy")
        if cells["problem"].isna().all()
    )


def agreement(policy: str, cells: pd.DataFrame) -> Agreement:
    """Return the figures of these cells, all of them with a published value and with runs."""
    published = cells["published"]
    ratio = cells["mean"] / published
    width = cells["prediction_high"] - cells["prediction_low"]
    has_intervals = bool(width.notna().any())
    # Beyond the peak the published fall is within one run's noise.
    sizes = cells[cells["kind"] == "size"]
    largest = 0 if sizes.empty else int(sizes["value"].iloc[sizes["published"].argmax()])
    ordered = cells_of(sizes[sizes["value"] <= largest].sort_values("published", kind="stable"))
    return Agreement(
        policy,
        cells,
        cells[~cells["published_inside"].eq(True)] if has_intervals else None,
        cells[published.between(cells["low"], cells["high"])] if has_intervals else None,
        float((ratio - 1.0).abs().mean()),
        float(np.abs(np.log(ratio)).mean()) if ratio.all() else None,
        float(width.mean()) if has_intervals else None,
        tuple(
            (a, b)
            for a, b in combinations(ordered, 2)
            if a.published < b.published and a.low > b.high
        ),
        largest,
    )
