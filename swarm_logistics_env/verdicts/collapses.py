"""Collapses: conditions whose runs are of two phases, and the swarm size at which half collapse."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from more_itertools import map_reduce

from swarm_logistics_env import spi
from swarm_logistics_env.questions.comparison import CONFIDENCE
from swarm_logistics_env.spi.inputs import Numbers
from swarm_logistics_env.spi.phases import LEVEL, collapsed_runs, critical_size, two_phases

from .cell import Cell


@dataclass(frozen=True)
class Collapse:
    """A condition whose runs are of two phases.

    Attributes:
        cell: of the condition.
        share: of its runs that collapsed, in [0, 1], with its exact interval.
    """

    cell: Cell
    share: spi.Interval


@dataclass(frozen=True)
class Edge:
    """How near a policy is to its critical size, where some size shows two phases.

    Attributes:
        cells: of its sizes, ascending.
        shares: of the runs that collapsed at each, with exact intervals.
        good_runs: P of the runs that did not, at each, shape (n,).
        size: at which half of the runs collapse, with its interval.
    """

    cells: tuple[Cell, ...]
    shares: tuple[spi.Interval, ...]
    good_runs: tuple[Numbers, ...]
    size: spi.Interval


def collapses(cells: Sequence[Cell]) -> list[Collapse]:
    """Return the conditions whose runs are of two phases, by Holm's procedure over a policy's."""
    unique = {(cell.policy, cell.arm.case.key): cell for cell in cells if cell.n_seeds}
    named = []
    for of_policy in map_reduce(unique.values(), lambda cell: cell.policy).values():
        tests = [(two_phases(cell.by_seed.ravel(), 1.0), cell) for cell in of_policy]
        tests.sort(key=lambda test: test[0].p_value)
        for rank, (phases, cell) in enumerate(tests):
            if phases.boundary is None or phases.p_value > LEVEL / (len(tests) - rank):
                break
            runs = cell.by_seed.ravel()
            named.append(Collapse(cell, _share(int((runs < phases.boundary).sum()), len(runs))))
    return named


def edges(cells: Sequence[Cell]) -> Iterator[Edge]:
    """Yield how near each policy is to its critical size, where one can be told."""
    sized = [cell for cell in cells if cell.arm.setting.kind == "size" and cell.n_seeds]
    for of_table in map_reduce(sized, lambda cell: (cell.policy, cell.table)).values():
        by_size = {int(cell.arm.setting.value): cell for cell in of_table}
        runs = {size: by_size[size].by_seed.ravel() for size in sorted(by_size)}
        counts = collapsed_runs(runs) if len(runs) > 1 else None
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
