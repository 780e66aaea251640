"""Policies beside each other and beside the published values: the same cells, seed by seed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import spi
from swarm_logistics_env.spi.summaries import Interval, t_interval

from .results import StudyResults
from .verdict import Cell, Verdict, grouped


class CellAgainstBaseline(NamedTuple):
    """P of one policy in one cell, beside that of the baseline, the study's first policy.

    Attributes:
        cell: of the policy.
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
        tests: the verdicts by policy, the baseline first.
        differences: each further policy's indicator less the baseline's with 95 % jackknife
            interval; None where it is undefined.
    """

    tests: dict[str, Verdict]
    differences: dict[str, Interval | None]

    @property
    def test(self) -> Verdict:
        """The first policy's verdict, for what is the same for all of them."""
        return next(iter(self.tests.values()))


def cells_against_baseline(results: StudyResults) -> dict[str, list[CellAgainstBaseline]]:
    """Return, table by table, every cell of every policy; the policies of a cell one by one."""
    known = [c for c in results.cells if c.arm.setting.kind != "policy" and c.n_seeds]
    return {
        table: [
            _against_baseline(results, cell, cells[0])
            for cells in grouped(here, lambda cell: cell.arm.setting).values()
            for cell in cells
        ]
        for table, here in grouped(known, lambda cell: cell.table).items()
    }


def _against_baseline(results: StudyResults, cell: Cell, baseline: Cell) -> CellAgainstBaseline:
    p, p_o = cell.by_seed, baseline.by_seed
    summaries = spi.interquartile_mean(p), spi.worst_decile(p)
    is_baseline = cell is baseline or baseline.policy != results.policies[0]
    if is_baseline or cell.problem or baseline.problem or not results.plan.paired:
        return CellAgainstBaseline(cell, *summaries)
    ratio = None
    if p_o.any():  # else there is nothing to divide by
        value, low, high = (
            None if x is None else 1.0 + x for x in _limits(spi.relative_change(p_o, p))
        )
        ratio = None if value is None else Interval(value, low, high)
    improvement = spi.probability_of_improvement(p_o, p)
    return CellAgainstBaseline(cell, *summaries, t_interval(p - p_o), ratio, improvement)


def _limits(estimate: spi.Estimate) -> tuple[float, float | None, float | None]:
    return estimate.value, estimate.low, estimate.high


def indicators_against_baseline(results: StudyResults) -> Iterator[IndicatorAgainstBaseline]:
    """Yield every question that more than one policy was asked, with the differences."""
    baseline = results.policies[0]
    compared = [one for one in results.verdicts if one.compared.changed.setting.kind != "policy"]
    for tests in grouped(compared, lambda v: (v.compared.table, v.compared.question)).values():
        if len(tests) > 1:
            by_policy = {test.compared.policy: test for test in tests}
            first = by_policy.get(baseline)
            differences = {
                policy: _difference(results, first, test) if first else None
                for policy, test in by_policy.items()
                if policy != baseline
            }
            yield IndicatorAgainstBaseline(by_policy, differences)


def _difference(results: StudyResults, baseline: Verdict, test: Verdict) -> Interval | None:
    if baseline.estimate is None or test.estimate is None or not results.plan.paired:
        return None

    def value(one: Verdict, seeds: NDArray[np.intp]) -> float:
        where = one.compared.policy, one.compared.table
        samples = {arm: results.by_place[*where, arm].by_seed[seeds] for arm in one.compared.arms}
        return one.compared.estimate(samples).value

    try:
        return jackknife_interval(
            len(results.plan.seeds), lambda seeds: value(test, seeds) - value(baseline, seeds)
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
    """How near one policy comes to the reference.

    Attributes:
        policy: its label.
        cells: those of the reference's tables.
        misses: those whose published value lies outside our 95 % prediction interval of one run: a
            weak test, which quite different policies pass as well. None at one seed.
        met: those whose published value lies inside the 95 % interval of our mean. None as above.
        mean_log_error: mean of |ln(our mean P / published P)|; None where a mean is 0.
        mean_interval_width: mean width of the prediction intervals [items], since wide intervals
            meet published values by their width alone. None at one seed.
    """

    policy: str
    cells: tuple[Cell, ...]
    misses: tuple[Cell, ...] | None
    met: tuple[Cell, ...] | None
    mean_log_error: float | None
    mean_interval_width: float | None


def agreements(results: StudyResults) -> tuple[Agreement, ...]:
    """Return the agreement of every policy all of whose cells have runs; none without reference."""
    counted = grouped([cell for cell in results.cells if cell.counted], lambda cell: cell.policy)
    return tuple(
        agreement(policy, cells)
        for policy, cells in counted.items()
        if not any(cell.problem for cell in cells)
    )


def agreement(policy: str, cells: Sequence[Cell]) -> Agreement:
    """Return the agreement of these cells, all of them with a published value and with runs."""
    known = [(cell, cell.published) for cell in cells if cell.published is not None]
    ratio = np.array([cell.mean.value / published for cell, published in known])
    width = [
        c.one_run.high - c.one_run.low
        for c in cells
        if c.one_run.low is not None and c.one_run.high is not None
    ]
    met = [
        cell
        for cell, p in known
        if cell.mean.low is not None and cell.mean.low <= p <= (cell.mean.high or 0.0)
    ]
    return Agreement(
        policy,
        tuple(cells),
        tuple(cell for cell in cells if not cell.published_inside) if width else None,
        tuple(met) if width else None,
        float(np.abs(np.log(ratio)).mean()) if ratio.all() else None,
        float(np.mean(width)) if width else None,
    )
