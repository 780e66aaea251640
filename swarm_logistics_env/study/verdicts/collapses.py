"""Collapses: conditions whose runs are of two phases, and the swarm size at which half collapse."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from more_itertools import map_reduce
from numpy.typing import NDArray

from swarm_logistics_env import spi
from swarm_logistics_env.spi.inputs import Numbers
from swarm_logistics_env.spi.phases import FEWEST_RUNS, LEVEL, collapsed_runs, critical_size
from swarm_logistics_env.study.questions.comparison import CONFIDENCE
from swarm_logistics_env.study.tasks.outcome import Outcome

from .cell import Cell

# Of log-likelihood by a change of rate: one steady run in two hundred gains more.
_LEAST_GAIN = 7.0


@dataclass(frozen=True)
class Collapse:
    """A condition whose runs are of two phases.

    Attributes:
        cell: of the condition.
        share: of its runs that collapsed, in [0, 1], with its exact interval.
        n_collapsed: the number of its runs that collapsed.
        breaks: when those of them that had delivered like the others before did so no more,
            ascending [s], shape (k,); none where the times of deliveries are not known.
    """

    cell: Cell
    share: spi.Interval
    n_collapsed: int
    breaks: Numbers


@dataclass(frozen=True)
class Edge:
    """How near a policy is to its critical size, where some size shows two phases.

    Attributes:
        cells: of its sizes, ascending.
        shares: of the runs that collapsed at each, with exact intervals.
        good_runs: P of the runs that did not, at each, shape (n,).
        size: at which half of the runs collapse, with its interval; its ends are 0 and infinite
            where none is given.
    """

    cells: tuple[Cell, ...]
    shares: tuple[spi.Interval, ...]
    good_runs: tuple[Numbers, ...]
    size: spi.Interval

    def scalabilities(self, runs: Sequence[Numbers]) -> Iterator[float | None]:
        """Yield S of mean P from the size before, for each size; None: it has none.

        Args:
            runs: P of runs at each size, shape (n,).
        """
        yield None
        sizes = [cell.arm.setting.value for cell in self.cells]
        for (size, before), (next_size, after) in pairwise(zip(sizes, runs)):
            if len(before) and len(after) and before.mean() > 0.0:
                yield (after.mean() / before.mean() - 1.0) / (next_size / size - 1.0)
            else:
                yield None


def collapses(cells: Sequence[Cell]) -> tuple[Collapse, ...]:
    """Return the conditions whose runs are of two phases, by Holm's procedure over a policy's."""
    unique = {(cell.policy, cell.arm.case.key): cell for cell in cells if cell.n_seeds}
    named = []
    for of_policy in map_reduce(unique.values(), lambda cell: cell.policy).values():
        for rank, cell in enumerate(sorted(of_policy, key=lambda cell: cell.phases.p_value)):
            phases = cell.phases
            if phases.boundary is None or phases.p_value > LEVEL / (len(of_policy) - rank):
                break
            has_collapsed = cell.by_seed.ravel() < phases.boundary
            n_collapsed = int(has_collapsed.sum())
            share = _share(n_collapsed, len(has_collapsed))
            named.append(Collapse(cell, share, n_collapsed, _breaks(cell.outcomes, has_collapsed)))
    return tuple(named)


def untestable(cells: Sequence[Cell]) -> dict[str, list[Cell]]:
    """Return the conditions with enough runs that were not tested for two phases, by the reason."""
    unique = {(cell.policy, cell.arm.case.key): cell for cell in cells}
    # The largest P is left out of the test.
    with_runs = [cell for cell in unique.values() if cell.n_seeds > FEWEST_RUNS]
    by_reason: dict[str, list[Cell]] = map_reduce(with_runs, lambda cell: cell.phases.untestable)
    by_reason.pop("", None)
    return by_reason


def _breaks(outcomes: Sequence[Outcome], has_collapsed: NDArray[np.bool_]) -> Numbers:
    """Return when runs broke off that had delivered at half of the others' rate or more [s]."""
    # A run without deliveries never began; where P is no number of times, none is known.
    is_timed = np.array([len(run.delivery_times) > 0 and run.ended_at > 0.0 for run in outcomes])
    working = [outcomes[i] for i in np.flatnonzero(is_timed & ~has_collapsed).tolist()]
    if not working:
        return np.empty(0)
    usual = float(np.median([len(run.delivery_times) / run.ended_at for run in working]))
    breaks = []
    for i in np.flatnonzero(is_timed & has_collapsed).tolist():
        change = _change_of_rate(outcomes[i].delivery_times, outcomes[i].ended_at)
        if change is not None and change.after < 0.5 * usual <= change.before:
            breaks.append(change.time)
    return np.sort(breaks)


class _Change(NamedTuple):
    """When the rate of a run's deliveries changed [s], and the rates around it [1/s]."""

    time: float
    before: float
    after: float


def _change_of_rate(times: Numbers, end: float) -> _Change | None:
    """Return the most likely change of a Poisson rate; None: a steady one will do."""
    inside = times[(times > 0.0) & (times < end)]
    if not len(inside):
        return None
    n_before = np.arange(1, len(inside) + 1)
    n_after = len(inside) - n_before
    before = n_before / inside
    after = n_after / (end - inside)
    # n ln(rate) is 0 where nothing is delivered.
    likelihood = n_before * np.log(before) + n_after * np.log(np.where(n_after, after, 1.0))
    best = int(np.argmax(likelihood))
    gain = likelihood[best] - len(inside) * np.log(len(inside) / end)
    if gain < _LEAST_GAIN:
        return None
    return _Change(float(inside[best]), float(before[best]), float(after[best]))


def edges(cells: Sequence[Cell]) -> Iterator[Edge]:
    """Yield how near each policy is to its critical size, where one can be told."""
    sized = [cell for cell in cells if cell.arm.setting.kind == "size" and cell.n_seeds]
    for of_table in map_reduce(sized, lambda cell: (cell.policy, cell.table)).values():
        by_size = {int(cell.arm.setting.value): cell for cell in of_table}
        runs = {size: by_size[size].by_seed.ravel() for size in sorted(by_size)}
        phases = {size: cell.phases for size, cell in by_size.items()}
        counts = collapsed_runs(runs, phases=phases) if len(runs) > 1 else None
        if counts is None:
            continue
        totals = [len(sample) for sample in runs.values()]
        yield Edge(
            tuple(by_size[size] for size in runs),
            tuple(_share(counts[size], total) for size, total in zip(runs, totals)),
            tuple(np.sort(sample)[counts[size] :] for size, sample in runs.items()),
            critical_size([*runs], [*counts.values()], totals, CONFIDENCE),
        )


def _share(count: int, total: int) -> spi.Interval:
    """Return a share with its interval after Clopper and Pearson."""
    from scipy.special import betaincinv  # late: scipy is slow to load

    tail = 0.5 * (1.0 - CONFIDENCE)
    low = float(betaincinv(count, total - count + 1, tail)) if count else 0.0
    high = float(betaincinv(count + 1, total - count, 1.0 - tail)) if count < total else 1.0
    return spi.Interval(count / total, low, high)
