"""Looks at a growing study, each with an alpha that keeps the declared error over all of them."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Literal, get_args

import numpy as np

from .inputs import IndicatorError, Numbers, between_0_and_1, count

Spending = Literal["obrien-fleming", "linear"]
_REACH = 9.0  # standard deviations that the integration grid covers
_GRID = 801  # its points: the boundaries are then right to five digits


def look_alphas(
    looks: Sequence[int], alpha: float = 0.05, *, spending: Spending = "obrien-fleming"
) -> tuple[float, ...]:
    """Two-sided p below which to stop at each declared look, in order.

    Lan and DeMets' (1983) spending of alpha on both sides, with the share of the final number of
    seeds as information. A single look gives (alpha,).

    Args:
        looks: Numbers of seeds at which the study is looked at, rising.
        alpha: Chance of any false verdict over all looks, in (0, 1).
        spending: "obrien-fleming" leaves nearly all of alpha to the last look; "linear" spends it
            in proportion to the seeds (Kim and DeMets 1987), so that clear cases stop early.

    Raises:
        IndicatorError: No looks, one below 1, not rising; alpha outside (0, 1); no such spending.
    """
    if spending not in get_args(Spending):
        raise IndicatorError(
            f"spending = {spending!r}: should be one of {', '.join(get_args(Spending))}"
        )
    between_0_and_1("alpha", alpha)
    seeds = [count("look", look) for look in looks]
    if not seeds or any(later <= earlier for earlier, later in pairwise(seeds)):
        raise IndicatorError(f"looks = {tuple(looks)}: should be rising numbers of seeds")
    return _boundaries(tuple(seeds), alpha, spending)


@functools.lru_cache(maxsize=256)
def _boundaries(seeds: tuple[int, ...], alpha: float, spending: Spending) -> tuple[float, ...]:
    from scipy.optimize import brentq
    from scipy.special import ndtr

    # The sum process is Brownian motion on [0, 1]; `density` is that of paths not stopped so far,
    # on the points of the last look, where they start.
    points, density, weights = np.zeros(1), np.ones(1), np.ones(1)
    alphas, information, spent = [], 0.0, 0.0
    for look in seeds:
        now = look / seeds[-1]
        step = math.sqrt(now - information)
        to_spend = _spent(now, alpha, spending) - spent

        def stopped(
            boundary: float,
            to_spend: float = to_spend,
            step: float = step,
            start: Numbers = points,
            mass: Numbers = weights * density,
        ) -> float:
            """Chance of a first crossing here, over both sides, less what may be spent."""
            return 2.0 * float((mass * ndtr((start - boundary) / step)).sum()) - to_spend

        reach = _REACH * math.sqrt(now)
        boundary = reach if stopped(reach) >= 0.0 else float(brentq(stopped, 0.0, reach))
        alphas.append(2.0 * float(ndtr(-boundary / math.sqrt(now))))
        start, mass = points, weights * density
        points = np.linspace(-boundary, boundary, _GRID)
        steps = (points[:, np.newaxis] - start) / step
        density = np.exp(-0.5 * steps**2) @ mass / (step * math.sqrt(2.0 * math.pi))
        weights = _simpson(points)
        information, spent = now, spent + to_spend
    return tuple(alphas)


def _spent(information: float, alpha: float, spending: Spending) -> float:
    """Error spent, over both sides, when `information` in (0, 1] of the seeds are in."""
    if spending == "linear":
        return alpha * information
    from scipy.special import ndtr, ndtri

    return 4.0 * float(ndtr(ndtri(alpha / 4.0) / math.sqrt(information)))


def _simpson(points: Numbers) -> Numbers:
    weights = np.full(points.size, 2.0)
    weights[1::2] = 4.0
    weights[[0, -1]] = 1.0
    return weights * (float(points[1] - points[0]) / 3.0)
