"""Agreement: how near a policy comes to published values."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from more_itertools import map_reduce

from .cell import Cell


class Agreement(NamedTuple):
    """How near one policy comes to the reference.

    Attributes:
        policy: its label.
        cells: those of the reference's tables.
        misses: those whose published value lies outside our prediction interval of one run: a
            weak test, which quite different policies pass as well. Empty at one seed.
        met: those whose published value lies inside the interval of our mean. Empty as above.
        mean_log_error: mean of |ln(our mean P / published P)|; None where a mean is 0.
    """

    policy: str
    cells: tuple[Cell, ...]
    misses: tuple[Cell, ...]
    met: tuple[Cell, ...]
    mean_log_error: float | None


def agreements(cells: Iterable[Cell]) -> tuple[Agreement, ...]:
    """Return the agreement of every policy all of whose cells have runs; none without reference."""
    counted = [cell for cell in cells if cell.counted]
    by_policy: dict[str, list[Cell]] = map_reduce(counted, lambda cell: cell.policy)
    return tuple(
        agreement(policy, cells)
        for policy, cells in by_policy.items()
        if not any(cell.problem for cell in cells)
    )


def agreement(policy: str, cells: Sequence[Cell]) -> Agreement:
    """Return the agreement of these cells, all of them with a published value and with runs."""
    published_cells = [(cell, cell.published) for cell in cells if cell.published is not None]
    ratio = np.array([cell.mean.value / published for cell, published in published_cells])
    return Agreement(
        policy,
        tuple(cells),
        tuple(cell for cell in cells if cell.published_inside is False),
        tuple(
            cell
            for cell, p in published_cells
            if cell.mean.low is not None and cell.mean.low <= p <= (cell.mean.high or 0.0)
        ),
        float(np.abs(np.log(ratio)).mean()) if ratio.all() else None,
    )
