"""How well one policy's runs reproduce the reference: cells hit, errors, order of the sizes."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

from swarm_logistics_env.studies.judgement import Cell, Findings


@dataclass(frozen=True)
class Reproduction:
    """The figures of one policy.

    Attributes:
        policy: its label.
        cells: the cells of the reference's tables.
        misses: those whose published run lies outside our 95 % prediction interval.
        mean_relative_error: mean of |our mean P - published P| / published P.
        mean_interval_width: mean width of the prediction intervals [items]: noise must not buy
            cells. None at one seed, like `misses`.
        disorder: pairs of swarm sizes that stand opposite to the published order, with our 95 %
            intervals of the means apart.
        largest_ordered: the order is judged up to this swarm size, where the published P peaks.
    """

    policy: str
    cells: tuple[Cell, ...]
    misses: tuple[Cell, ...] | None
    mean_relative_error: float
    mean_interval_width: float | None
    disorder: tuple[tuple[Cell, Cell], ...]
    largest_ordered: int


def reproductions(findings: Findings) -> tuple[Reproduction, ...]:
    """Return the figures of every policy all of whose cells have runs; none without reference."""
    labels = dict.fromkeys(cell.policy for cell in findings.cells)
    found = []
    for label in labels:
        cells = tuple(cell for cell in findings.cells if cell.policy == label and cell.counted)
        if cells and not any(cell.problem for cell in cells):
            found.append(_reproduction(label, cells))
    return tuple(found)


def _reproduction(policy: str, cells: tuple[Cell, ...]) -> Reproduction:
    errors, widths = [], []
    for cell in cells:
        assert cell.published is not None
        assert cell.prediction is not None
        value, low, high = cell.prediction
        errors.append(abs(value - cell.published) / cell.published)
        if low is not None and high is not None:
            widths.append(high - low)
    # Beyond the peak the published fall is within one run's noise.
    sizes = [cell for cell in cells if cell.arm.level.kind == "size"]
    peak = max(sizes, key=_published) if sizes else None
    largest = int(peak.arm.level.value) if peak else 0
    ordered = [cell for cell in sizes if cell.arm.level.value <= largest]
    return Reproduction(
        policy,
        cells,
        tuple(cell for cell in cells if not cell.published_inside) if widths else None,
        sum(errors) / len(errors),
        sum(widths) / len(widths) if widths else None,
        tuple(pair for pair in combinations(ordered, 2) if _opposite(*pair)),
        largest,
    )


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
