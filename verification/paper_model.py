"""A model of the mean P of each cell, as a function of the constants, fitted to single runs.

A Gaussian process for ln(P + 1/2), with a length scale of its own for each constant. All cells
share the length scales and the noise, under which all runs together are likeliest.
"""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize

Floats: TypeAlias = NDArray[np.float64]

_ONE_HALF = 0.5  # so that a run that delivers nothing has a logarithm
_SCALES, _NOISE = (0.1, 10.0), (0.01, 10.0)  # lowest and highest


class Model(NamedTuple):
    """The mean P of each cell.

    Attributes:
        parts: of the cells, by the constants that they depend on.
        explained: share of the variance of ln(P + 1/2) that the model explains in runs that were
            left out one by one (cells,).
    """

    parts: tuple[_Part, ...]
    explained: Floats

    def means(self, places: Floats) -> Floats:
        """Return E[P] (n, cells) at places (n, constants) of the unit cube."""
        means = np.empty((len(places), len(self.explained)))
        for part in self.parts:
            alike = _alike(places[:, part.uses], part.places, part.scales)
            means[:, part.cells] = part.factor * np.exp(part.centre + alike @ part.weights)
        return means


class _Part(NamedTuple):
    """Cells that depend on the same constants.

    Attributes:
        cells, uses: which cells these are, and which constants they depend on.
        scales: length scales of these constants; one with a long scale hardly matters.
        places, weights, centre: of the process, (n, constants), (n, cells), (cells,).
        factor: by which the exponential of what is expected falls short of the mean P (cells,).
    """

    cells: NDArray[np.bool_]
    uses: NDArray[np.bool_]
    scales: Floats
    places: Floats
    weights: Floats
    centre: Floats
    factor: Floats


def fitted(places: Floats, p: Floats, uses: NDArray[np.bool_]) -> Model:
    """Return the model of runs.

    Args:
        places: of the constants in the unit cube, (n, constants).
        p: items delivered in one run each, (n, cells).
        uses: which constants each cell depends on, (cells, constants).
    """
    parts, explained = [], np.empty(p.shape[1])
    for some in np.unique(uses, axis=0):
        cells = (uses == some).all(axis=1)
        part, explained[cells] = _part(places[:, some], p[:, cells], cells, some)
        parts.append(part)
    return Model(tuple(parts), explained)


def _part(
    places: Floats, p: Floats, cells: NDArray[np.bool_], uses: NDArray[np.bool_]
) -> tuple[_Part, Floats]:
    """Return the model of some cells, and how much of each it explains."""
    logs = np.log(p + _ONE_HALF)
    centre = logs.mean(axis=0)
    normal = (logs - centre) / np.maximum(logs.std(axis=0), 1e-9)

    def unlikely(parameters: Floats) -> float:
        root = cho_factor(_covariance(places, np.exp(parameters)), lower=True)
        fit = (normal * cho_solve(root, normal)).sum(axis=0)
        # Each cell has a variance of its own, at which its runs are likeliest.
        doubts = np.log(np.diag(root[0])).sum() * p.shape[1]
        return float(doubts + len(p) / 2 * np.log(np.maximum(fit, 1e-9)).sum())

    lowest_highest = [_SCALES] * places.shape[1] + [_NOISE]
    start = np.log([*(1.0,) * places.shape[1], 0.3])
    found = minimize(unlikely, start, bounds=np.log(lowest_highest).tolist(), method="L-BFGS-B")
    parameters: Floats = np.exp(found.x)
    inverse = np.linalg.inv(_covariance(places, parameters))
    weights: Floats = inverse @ (logs - centre)
    left_out = weights / np.diag(inverse)[:, None]  # what a run is off if the others predict it
    factor = p.sum(axis=0) / np.exp(logs - left_out).sum(axis=0)
    explained = 1.0 - (left_out**2).mean(axis=0) / np.maximum(logs.var(axis=0), 1e-9)
    return _Part(cells, uses, parameters[:-1], places, weights, centre, factor), explained


def _covariance(places: Floats, parameters: Floats) -> Floats:
    covariance: Floats = _alike(places, places, parameters[:-1])
    covariance += parameters[-1] * np.eye(len(places))
    return covariance


def _alike(places: Floats, others: Floats, scales: Floats) -> Floats:
    a, b = places / scales, others / scales
    squared = (a**2).sum(axis=1)[:, None] + (b**2).sum(axis=1) - 2.0 * a @ b.T
    alike: Floats = np.exp(-0.5 * np.maximum(squared, 0.0))
    return alike
