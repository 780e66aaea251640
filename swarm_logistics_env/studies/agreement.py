"""Agreement of a policy's runs with the published values: cells met, errors, order of sizes."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from swarm_logistics_env.studies.performance_table import Row, groups_of, rows_of
from swarm_logistics_env.studies.results import StudyResults

if TYPE_CHECKING:
    import pandas as pd


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
    disorder: tuple[tuple[Row, Row], ...]
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
    ordered = rows_of(sizes[sizes["value"] <= largest].sort_values("published", kind="stable"))
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
