"""Agreement of a policy's runs with the published values: cells met, errors, order of sizes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations

from swarm_logistics_env.studies.results import Cell, StudyResults


@dataclass(frozen=True)
class Agreement:
    """The figures of one policy.

    Attributes:
        policy: its label.
        cells: the cells of the reference's tables.
        misses: those whose published value lies outside our 95 % prediction interval of one run: a
            weak test, which quite different policies pass as well.
        met: those whose published value lies inside the 95 % interval of our mean; None at one
            seed, like `misses`.
        mean_relative_error: mean of |our mean P - published P| / published P.
        mean_log_error: mean of |ln(our mean P / published P)|; None where a mean is 0.
        mean_interval_width: mean width of the prediction intervals [items]: noise must not buy
            cells. None at one seed.
        disorder: pairs of swarm sizes that stand opposite to the published order, with our 95 %
            intervals of the means apart.
        largest_ordered: the order is judged up to this swarm size, where the published P peaks.
    """

    policy: str
    cells: tuple[Cell, ...]
    misses: tuple[Cell, ...] | None
    met: tuple[Cell, ...] | None
    mean_relative_error: float
    mean_log_error: float | None
    mean_interval_width: float | None
    disorder: tuple[tuple[Cell, Cell], ...]
    largest_ordered: int


def agreements(results: StudyResults) -> tuple[Agreement, ...]:
    """Return the figures of every policy all of whose cells have runs; none without reference."""
    labels = dict.fromkeys(cell.policy for cell in results.cells)
    found = []
    for label in labels:
        cells = tuple(cell for cell in results.cells if cell.policy == label and cell.counted)
        if cells and not any(cell.problem for cell in cells):
            found.append(agreement(label, cells))
    return tuple(found)


def agreement(policy: str, cells: tuple[Cell, ...]) -> Agreement:
    """Return the figures of these cells, all of them with a published value and with runs."""
    errors, ratios, widths = [], [], []
    for cell in cells:
        assert cell.published is not None
        assert cell.prediction is not None
        value, low, high = cell.prediction
        errors.append(abs(value - cell.published) / cell.published)
        ratios.append(value / cell.published)
        if low is not None and high is not None:
            widths.append(high - low)
    # Beyond the peak the published fall is within one run's noise.
    sizes = [cell for cell in cells if cell.arm.setting.kind == "size"]
    peak = max(sizes, key=_published) if sizes else None
    largest = int(peak.arm.setting.value) if peak else 0
    ordered = [cell for cell in sizes if cell.arm.setting.value <= largest]
    return Agreement(
        policy,
        cells,
        tuple(cell for cell in cells if not cell.published_inside) if widths else None,
        tuple(cell for cell in cells if _in_interval_of_mean(cell)) if widths else None,
        sum(errors) / len(errors),
        sum(abs(math.log(r)) for r in ratios) / len(ratios) if all(ratios) else None,
        sum(widths) / len(widths) if widths else None,
        tuple(pair for pair in combinations(ordered, 2) if _opposite(*pair)),
        largest,
    )


def _in_interval_of_mean(cell: Cell) -> bool:
    mean = cell.mean
    if mean is None or mean.low is None or mean.high is None:
        return False
    return mean.low <= _published(cell) <= mean.high


def _published(cell: Cell) -> float:
    assert cell.published is not None
    return cell.published


def _opposite(a: Cell, b: Cell) -> bool:
    if _published(a) > _published(b):
        a, b = b, a
    if _published(a) == _published(b) or a.mean is None or b.mean is None:
        return False
    # Published a below b; ours with a above b, the intervals apart.
    if a.mean.low is None or b.mean.high is None:
        return False
    return a.mean.low > b.mean.high
