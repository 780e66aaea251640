"""P against swarm size: the laws that fit it, and what each robot of each size is worth."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from swarm_logistics_env import spi
from swarm_logistics_env.spi.scaling import ScalingFit, Weighting
from swarm_logistics_env.spi.summaries import Interval
from swarm_logistics_env.studies.policy_comparison import difference_interval
from swarm_logistics_env.studies.results import Cell, StudyResults

# The weighting that the laws are fitted with, then the one that shows how far N* hangs on it.
WEIGHTINGS: tuple[Weighting, ...] = ("1/P", "none")


@dataclass(frozen=True)
class SizeSeries:
    """P of one policy at every swarm size of one table, and the laws that fit it.

    Attributes:
        policy: label; None: the reference's published runs.
        table: heading of the table whose sizes they are.
        sizes: swarm sizes N [robots], ascending.
        performance: mean P at each size with its interval [items]; published runs have none.
        saturated: whether P is capped, at each size.
        fits: both laws under both weightings, the better law of a weighting first.
        problem: why there are no fits; None: there are.
    """

    policy: str | None
    table: str
    sizes: tuple[int, ...]
    performance: tuple[Interval, ...]
    saturated: tuple[bool, ...]
    fits: tuple[ScalingFit, ...]
    problem: str | None


@dataclass(frozen=True)
class Step:
    """The gain of the step from one swarm size to the next.

    Attributes:
        before, after: swarm sizes N [robots].
        efficiency: P/N at the larger size with its interval [items per robot].
        marginal_gain: P(N2) - (N2/N1) P(N1) with its paired interval [items]; above 0 where S > 1.
        karp_flatt: serial fraction with the interval that S's gives; None where P(N1) is 0.
        saturated: it rests on a P that is capped.
    """

    before: int
    after: int
    efficiency: Interval
    marginal_gain: Interval
    karp_flatt: Interval | None
    saturated: bool


def size_series(results: StudyResults) -> tuple[SizeSeries, ...]:
    """Return every series of swarm sizes, the reference's published ones last."""
    found = [
        _series(policy, table, [(cell, cell.mean) for cell in cells])
        for (policy, table), cells in _by_table(results).items()
    ]
    published = {
        table: cells
        for (_, table), cells in _by_table(results).items()
        if all(cell.published is not None for cell in cells)
    }
    for table, cells in published.items():
        runs = [(c, Interval(float(c.published or 0.0), None, None)) for c in cells]
        found.append(_series(None, table, runs))
    return tuple(found)


def steps(results: StudyResults, policy: str, table: str) -> Iterator[Step]:
    """Yield the steps between neighbouring sizes whose runs are complete."""
    cells = _by_table(results)[policy, table]
    for small, large in itertools.pairwise(cells):
        if small.problem or large.problem:
            continue
        n_1, n_2 = int(small.arm.setting.value), int(large.arm.setting.value)
        yield Step(
            n_1,
            n_2,
            _scaled(spi.mean_interval(large.performance), 1 / n_2),
            _gain(small, large, n_1, n_2, paired=results.plan.paired),
            _karp_flatt(small, large, n_1, n_2, paired=results.plan.paired),
            small.saturated or large.saturated,
        )


def _by_table(results: StudyResults) -> dict[tuple[str, str], list[Cell]]:
    tables: dict[tuple[str, str], list[Cell]] = {}
    for cell in results.cells:
        if cell.arm.setting.kind == "size":
            tables.setdefault((cell.policy, cell.table), []).append(cell)
    return {
        name: sorted(cells, key=lambda cell: cell.arm.setting.value)
        for name, cells in tables.items()
    }


def _series(
    policy: str | None, table: str, cells: Sequence[tuple[Cell, Interval | None]]
) -> SizeSeries:
    known = [(cell, mean) for cell, mean in cells if mean is not None]
    sizes = tuple(int(cell.arm.setting.value) for cell, _ in known)
    means = tuple(mean for _, mean in known)
    problem: str | None = None
    fits: list[ScalingFit] = []
    incomplete = [cell for cell, _ in cells if policy is not None and cell.problem]
    if incomplete:
        problem = f"{incomplete[0].arm.setting}: {incomplete[0].problem}"
    elif len({mean.value for mean in means}) == 1 < len(means):
        problem = f"P is {means[0].value:.1f} at every size"
    else:
        try:
            for weighting in WEIGHTINGS:
                fits += spi.compare_scaling(
                    sizes, [mean.value for mean in means], weighting=weighting
                )
        except spi.IndicatorError as error:
            problem = str(error)
    saturated = tuple(cell.saturated and policy is not None for cell, _ in known)
    return SizeSeries(policy, table, sizes, means, saturated, tuple(fits), problem)


def _gain(small: Cell, large: Cell, n_1: int, n_2: int, *, paired: bool) -> Interval:
    before, after = n_2 / n_1 * small.performance, large.performance
    if paired:
        return difference_interval(before, after)
    return Interval(float(after.mean() - before.mean()), None, None)


def _karp_flatt(small: Cell, large: Cell, n_1: int, n_2: int, *, paired: bool) -> Interval | None:
    try:
        s = spi.scalability(small.performance, large.performance, n=n_1, m=n_2 - n_1, paired=paired)
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
    return (
        spi.karp_flatt(1.0, speed_up, n_1=1.0, n_2=growth)
        if math.isfinite(speed_up)
        else (-1.0 / (growth - 1.0))
    )


def _scaled(interval: Interval, factor: float) -> Interval:
    # A generator's length is no part of its type.
    return Interval(*(None if x is None else factor * x for x in interval))  # type: ignore[arg-type]
