"""What tables like the paper's tell of each constant: profiles of the loss, and their limits.

The limits come from simulated tables. The candidate that meets the paper's tables best is taken as
the truth, a table of single runs is drawn from it many times, and the loss of the truth is compared
with that of the best candidate for each drawn table.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import rankdata

from swarm_logistics_env.spi.summaries import Interval
from swarm_logistics_env.streams import generator
from verification.paper_constants import (
    CELLS,
    FM1,
    LEAST,
    RANGES,
    TABLE_I,
    Candidate,
    Floats,
    candidates_at,
    errors,
    spread,
)
from verification.paper_model import Model

BINS = 8
_PLACES = 2**16
_TABLES = 200
_ALL = tuple(range(len(CELLS)))


class Profile(NamedTuple):
    """The lowest loss that is possible if a constant has some value.

    Attributes:
        values: edges of the bins of the constant's range, (BINS + 1,).
        loss: lowest expected loss of any candidate whose constant lies in the bin, (BINS,).
        limit: 95 % of simulated tables put the true value's bin below this loss.
    """

    values: Floats
    loss: Floats
    limit: float

    @property
    def kept(self) -> tuple[float, float]:
        """The lowest and the highest value that the tables do not rule out."""
        bins = np.flatnonzero(self.loss <= self.limit)
        return float(self.values[bins[0]]), float(self.values[bins[-1] + 1])

    @property
    def share(self) -> float:
        """The share of the range between these two, on the logarithmic scale."""
        low, high = self.kept
        return float(np.log(high / low) / np.log(self.values[-1] / self.values[0]))


class Identified(NamedTuple):
    """What the tables tell.

    Attributes:
        best: the candidate that the model expects to meet all cells best.
        loss: its expected loss.
        limit: 95 % of simulated tables put the true constants below this loss.
        profiles: by constant.
        right: the loss of constants that are right: mean and 2.5 and 97.5 % of simulated tables.
        linked: rank correlations between constants among the candidates that are not ruled out.
        trade: expected losses on Table I and on FM1 of candidates of which no other has both lower,
            (n, 2), and these candidates.
    """

    best: Candidate
    loss: float
    limit: float
    profiles: dict[str, Profile]
    right: Interval
    linked: Floats
    trade: tuple[Floats, list[Candidate]]


def identify(model: Model, runs: Floats) -> Identified:
    """Return what the paper's tables tell of the constants.

    Args:
        model: of all cells.
        runs: P (cells, seeds) of one candidate, for the spread of single runs about their mean.
    """
    rng = generator(0, "simulated tables")
    places = spread(_PLACES, "profile")
    means = np.maximum(model.means(places), LEAST)
    of_cell = errors(means, _ALL)
    loss = of_cell.mean(axis=1)
    truth, bins = int(loss.argmin()), np.minimum((places * BINS).astype(int), BINS - 1)
    ratio = np.maximum(runs, LEAST) / np.maximum(runs.mean(axis=1, keepdims=True), LEAST)
    above, joint, right = [], [], []
    for _ in range(_TABLES):
        drawn = np.take_along_axis(ratio, rng.integers(ratio.shape[1], size=(len(CELLS), 1)), 1)
        table = np.maximum(means[truth] * drawn[:, 0], LEAST)
        lost = np.abs(np.log(means / table)).mean(axis=1)
        right.append(float(lost[truth]))
        lost[truth] = np.inf  # constants that are right are no candidate themselves
        joint.append(right[-1] - float(lost.min()))
        profiles = _lowest(lost, bins)
        above.append(profiles[np.arange(len(RANGES)), bins[truth]] - lost.min())
    limits = loss.min() + np.quantile(above, 0.95, axis=0)
    limit = float(loss.min() + np.quantile(joint, 0.95))
    lowest = _lowest(loss, bins)
    return Identified(
        best=candidates_at(places[[truth]])[0],
        loss=float(loss[truth]),
        limit=limit,
        profiles={
            name: Profile(np.geomspace(low, high, BINS + 1), lowest[k], float(limits[k]))
            for k, (name, (low, high)) in enumerate(RANGES.items())
        },
        right=Interval(float(np.mean(right)), *np.quantile(right, (0.025, 0.975)).tolist()),
        linked=_ranks_correlated(places[loss <= limit]),
        trade=_trade(places, of_cell),
    )


def _lowest(loss: Floats, bins: NDArray[np.intp]) -> Floats:
    """Return the lowest loss in each bin of each constant (constants, BINS)."""
    lowest = np.full((bins.shape[1], BINS), np.inf)
    for k in range(bins.shape[1]):
        np.minimum.at(lowest[k], bins[:, k], loss)
    return lowest


def _ranks_correlated(places: Floats) -> Floats:
    return np.atleast_2d(np.corrcoef(rankdata(places, axis=0), rowvar=False))


def _trade(places: Floats, of_cell: Floats) -> tuple[Floats, list[Candidate]]:
    both = np.column_stack([of_cell[:, cells].mean(axis=1) for cells in (TABLE_I, FM1)])
    order = np.argsort(both[:, 0])
    best_fm1 = np.minimum.accumulate(both[order, 1])
    front = order[np.flatnonzero(np.diff(best_fm1, prepend=np.inf) < 0.0)]
    return both[front], candidates_at(places[front])
