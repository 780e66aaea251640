"""P against swarm size: the laws that fit it, and what each robot of each size is worth."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from swarm_logistics_env import spi
from swarm_logistics_env.spi.scaling import ScalingFit, Weighting
from swarm_logistics_env.spi.summaries import Interval, t_interval

from .performance_table import Row, groups_of, rows_of
from .results import StudyResults

if TYPE_CHECKING:
    import pandas as pd

# The weighting that the laws are fitted with, then the one that shows how far N* hangs on it.
WEIGHTINGS: tuple[Weighting, ...] = ("1/P", "none")


@dataclass(frozen=True)
class SizeSeries:
    """P of one policy at every swarm size of one table, and the laws that fit it.

    Attributes:
        policy: label; None: the reference's published runs.
        table: heading of the table whose sizes they are.
        cells: rows of the table of performances, by ascending swarm size; of the published runs
            with P as `mean`, without limits.
        fits: both laws under both weightings, the better law of a weighting first.
        problem: why there are no fits; None: there are.
    """

    policy: str | None
    table: str
    cells: pd.DataFrame
    fits: tuple[ScalingFit, ...]
    problem: str | None


class Step(NamedTuple):
    """The gain of the step from one swarm size to the next.

    Attributes:
        before, after: swarm sizes N [robots].
        efficiency: P/N at the larger size with its interval [items per robot].
        marginal_gain: P(N2) - (N2/N1) P(N1) with its paired interval [items]; above 0 where S > 1.
        karp_flatt: serial fraction with the interval that S's gives; None where P(N1) is 0.
        saturated: whether it rests on a P that is capped.
    """

    before: int
    after: int
    efficiency: Interval
    marginal_gain: Interval
    karp_flatt: Interval | None
    saturated: bool


def size_series(results: StudyResults) -> tuple[SizeSeries, ...]:
    """Return every series of swarm sizes, the reference's published ones last."""
    found, published = [], {}
    p = results.performance
    for (policy, table), cells in groups_of(p[p["kind"] == "size"], "policy", "table"):
        ascending = cells.sort_values("value")
        problem = None
        for cell in rows_of(ascending[ascending["problem"].notna()][:1]):
            problem = f"{cell.cell}: {cell.problem}"
        found.append(_series(policy, table, ascending, problem))
        if ascending["published"].notna().all():
            runs = ascending.assign(
                mean=ascending["published"], low=math.nan, high=math.nan, saturated=False
            )
            published[table] = _series(None, table, runs, None)
    return (*found, *published.values())


def _series(policy: str | None, table: str, cells: pd.DataFrame, problem: str | None) -> SizeSeries:
    known = cells.dropna(subset="mean")
    sizes, means = known["value"].tolist(), known["mean"].tolist()
    fits: list[ScalingFit] = []
    if problem is None and len(set(means)) == 1 < len(means):
        problem = f"P is {means[0]:.1f} at every size"
    if problem is None:
        try:
            for weighting in WEIGHTINGS:
                fits += spi.compare_scaling(sizes, means, weighting=weighting)
        except spi.IndicatorError as error:
            problem = str(error)
    return SizeSeries(policy, table, cells, tuple(fits), problem)


def steps(results: StudyResults, series: SizeSeries) -> Iterator[Step]:
    """Yield the steps between neighbouring sizes whose runs are complete."""
    paired = results.plan.paired
    for small, large in itertools.pairwise(rows_of(series.cells)):
        if small.problem or large.problem:
            continue
        n_1, n_2 = int(small.value), int(large.value)
        yield Step(
            n_1,
            n_2,
            Interval(large.mean / n_2, large.low / n_2, large.high / n_2),
            _gain(small, large, paired=paired),
            _karp_flatt(small, large, n_1, n_2, paired=paired),
            small.saturated or large.saturated,
        )


def _gain(small: Row, large: Row, *, paired: bool) -> Interval:
    before, after = large.value / small.value * small.by_seed, large.by_seed
    if paired:
        return t_interval(after - before)
    return Interval(float(after.mean() - before.mean()), None, None)


def _karp_flatt(small: Row, large: Row, n_1: int, n_2: int, *, paired: bool) -> Interval | None:
    try:
        s = spi.scalability(small.by_seed, large.by_seed, n=n_1, m=n_2 - n_1, paired=paired)
    except spi.IndicatorError:
        return None
    # The speed-up X = 1 + S m/N is S's, so Fieller's limits carry over; e falls as X rises.
    low, value, high = (
        None if limit is None else _serial_fraction(1.0 + limit * (n_2 - n_1) / n_1, n_2 / n_1)
        for limit in (s.high, s.value, s.low)
    )
    assert value is not None
    return Interval(value, low, high)


def _serial_fraction(speed_up: float, growth: float) -> float:
    if speed_up <= 0.0:
        return math.inf
    if math.isinf(speed_up):
        return -1.0 / (growth - 1.0)
    return spi.karp_flatt(1.0, speed_up, n_1=1.0, n_2=growth)
