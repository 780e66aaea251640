"""Two phases: how near a swarm is to its critical size, at which some runs collapse.

Above a critical density a swarm does not get worse by and by: some of its runs jam, and the others
go on (Kuckling et al. 2024, arXiv 2310.11843). A mean over both says nothing of either.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .inputs import IndicatorError, Numbers, performance
from .summaries import Interval

FEWEST_RUNS = 10  # that can show two phases
LEVEL = 0.05  # chance that two phases are named in a set of runs that has one
_LEAST_SHARE = 0.2  # of the runs in the smaller of two groups that are told apart by their variance
_TAIL_WIDTHS = 4.5  # below the median, in distances from the lower quartile: 3 standard deviations
_TAIL_SHARE = 0.03  # of the runs of one phase at most lie there
_MOST_DRAWN = 300  # runs of a uniform sample
_N_DRAWS = 2_000  # of uniform samples, which give the level of the first test


class Phases(NamedTuple):
    """Whether the runs of a condition are of two phases.

    Attributes:
        p_value: that one phase shows them, in [0, 1]; 1 where they cannot show two.
        boundary: P between the phases, where two are named; None: they are not.
        share_low: the share of the runs below it, in [0, 1].
    """

    p_value: float
    boundary: float | None
    share_low: float = 0.0


def two_phases(p: ArrayLike, level: float = LEVEL) -> Phases:
    """Test whether runs are of two phases, a good one and one that has collapsed.

    Two tests share the level. The first is for groups of a similar size: the share of the variance
    between two groups of at least a fifth of the runs is more than in uniform draws, of which no
    set with one mode has more. The second is for a few bad runs: more than 3 % lie further below
    the median than 4.5 times the lower quartile. Runs at the largest P are left out, or a cap would
    be a phase of its own.

    Args:
        p: performance of one condition over runs, shape (n,).
        level: chance that two phases are named where there is one, in (0, 1).
    """
    from scipy.special import bdtrc  # scipy.stats takes a second to load

    runs = np.sort(performance("p", p))
    below_cap = runs[runs < runs[-1]]
    if len(below_cap) < FEWEST_RUNS:
        return Phases(1.0, None)
    split, share = _best_split(below_cap)
    # The share falls with the number of runs: of fewer it is on the safe side.
    draws = _shares_of_uniform_draws(min(len(below_cap), _MOST_DRAWN))
    p_of_groups = (1.0 + np.count_nonzero(draws >= share)) / (1.0 + len(draws))
    edge = _lower_edge(below_cap)
    n_below = int((below_cap < edge).sum()) if edge < np.median(below_cap) else 0
    # At least so many runs of a binomial number of them.
    p_of_tail = float(bdtrc(n_below - 1, len(below_cap), _TAIL_SHARE)) if n_below else 1.0
    p_value = min(1.0, 2.0 * min(p_of_groups, p_of_tail))
    if p_value > level:
        return Phases(p_value, None)
    boundary = split if p_of_groups <= p_of_tail else edge
    return Phases(p_value, boundary, float((runs < boundary).mean()))


def _best_split(runs: Numbers) -> tuple[float, float]:
    """Return the value that parts sorted runs best, and the share of the variance between parts."""
    between = _variances_between(runs)
    best = int(between.argmax())
    split = 0.5 * float(runs[best] + runs[best + 1])
    variance = float(runs.var())
    return split, float(between[best]) / variance if variance > 0.0 else 0.0


def _variances_between(runs: Numbers) -> Numbers:
    """Return the variance between two parts of sorted runs (..., n), for every split (..., n - 1).

    0 where a part has less than a fifth of the runs.
    """
    n = runs.shape[-1]
    n_low = np.arange(1, n)
    sums = np.cumsum(runs, axis=-1)
    low_means = sums[..., :-1] / n_low
    high_means = (sums[..., -1:] - sums[..., :-1]) / (n - n_low)
    between = n_low * (n - n_low) / n**2 * (high_means - low_means) ** 2
    is_balanced = (n_low >= _LEAST_SHARE * n) & (n_low <= (1.0 - _LEAST_SHARE) * n)
    return np.asarray(between * is_balanced)


@cache
def _shares_of_uniform_draws(n: int) -> Numbers:
    # The same draws in every process: a table of critical values, not a chance.
    draws = np.sort(np.random.Generator(np.random.PCG64(n)).uniform(size=(_N_DRAWS, n)), axis=1)
    return np.asarray(_variances_between(draws).max(axis=1) / draws.var(axis=1))


def collapsed_runs(
    runs_by_size: Mapping[int, ArrayLike], level: float = LEVEL
) -> dict[int, int] | None:
    """Count the runs of each swarm size that collapsed; None: no size shows two phases.

    The size that shows them most clearly, at the level divided by the number of sizes, tells the
    others: a run has collapsed that has less of its size's good P than what lies halfway between
    the phases there. The good P of a smaller size is its median; that of a larger one goes on with
    the power of N by which it grew so far.

    Args:
        runs_by_size: N -> P of its runs.
        level: chance that a size is named where all have one phase, in (0, 1).
    """
    samples = {n: performance(f"p of N = {n}", runs) for n, runs in runs_by_size.items()}
    tested = {n: two_phases(runs, 1.0) for n, runs in samples.items()}
    clearest = min(tested, key=lambda n: (tested[n].p_value, abs(tested[n].share_low - 0.5)))
    boundary = tested[clearest].boundary
    if boundary is None or tested[clearest].p_value > level / len(tested):
        return None
    counts = {}
    for n, runs in samples.items():
        here = boundary if n == clearest else _boundary_by(samples, clearest, boundary, n)
        counts[n] = int((runs < here).sum())
    return counts


def _boundary_by(samples: Mapping[int, Numbers], named: int, boundary: float, n: int) -> float:
    """Return the P below which runs of a size have collapsed, by a size that shows two phases."""
    runs = samples[named]
    low_p, good_p = (
        float(np.median(runs[runs < boundary])),
        float(np.median(runs[runs >= boundary])),
    )
    halfway = 0.5 * (1.0 + low_p / good_p)
    if n > named:
        return float(halfway * good_p * (n / named) ** _growth(samples, named, good_p))
    median, upper_quartile = np.quantile(samples[n], [0.5, 0.75])  # collapsed runs move them little
    edge = median - _TAIL_WIDTHS * (upper_quartile - median)
    return float(min(halfway * median, edge))


def _lower_edge(runs: Numbers) -> float:
    """Return the P below which few runs of one phase lie, far below the median."""
    lower_quartile, median = np.quantile(runs, [0.25, 0.5])
    return float(median - _TAIL_WIDTHS * (median - lower_quartile))


def _growth(samples: Mapping[int, Numbers], last: int, good: float) -> float:
    """Return the power of N by which P grew up to a size with that good P, from 0 to 1."""
    smaller = {n: float(np.median(runs)) for n, runs in samples.items() if n < last}
    medians = {n: median for n, median in smaller.items() if median > 0.0} | {last: good}
    if len(medians) < 2:
        return 0.0
    slope = np.polyfit(np.log([*medians]), np.log([*medians.values()]), 1)[0]
    return min(1.0, max(0.0, float(slope)))


_STEEPEST = 200.0  # logistic slope over log N: from 1 % to 99 % within 5 % of N
_LAPSES = 0.01  # share of the runs of one phase that are taken for the other


def critical_size(
    n_robots: ArrayLike, collapsed: ArrayLike, n_runs: ArrayLike, confidence: float = 0.95
) -> Interval:
    """Return the swarm size at which half of the runs collapse, with its interval.

    The share that collapses is a logistic function of log N that grows with N; the interval is that
    of the profile likelihood.

    Args:
        n_robots: swarm sizes, shape (k,), ascending.
        collapsed: how many runs of each collapsed, shape (k,).
        n_runs: how many there are of each, shape (k,).
        confidence: of the interval, in (0, 1).

    Returns:
        Value and limits, in robots; an end is 0 or infinite where the sizes do not bound it.

    Raises:
        IndicatorError: there is one size, or none of the runs or all of them collapsed.
    """
    from scipy import optimize, special

    sizes, counts, totals = (np.asarray(x, np.float64) for x in (n_robots, collapsed, n_runs))
    if len(sizes) < 2 or not 0.0 < counts.sum() < totals.sum():
        raise IndicatorError(
            f"collapsed = {counts.tolist()} of {totals.tolist()}: should be some of the runs, not "
            "all, at two sizes or more"
        )
    logs = np.log(sizes)

    def loss(slope: float, centre: float) -> float:
        score = slope * (logs - centre)
        share = _LAPSES + (1.0 - 2.0 * _LAPSES) * special.expit(score)
        return -float(counts @ np.log(share) + (totals - counts) @ np.log(1.0 - share))

    def profile(centre: float) -> float:
        # Over the logarithm of the slope the loss has one minimum.
        best = optimize.minimize_scalar(
            lambda log_slope: loss(math.exp(log_slope), centre),
            bounds=(math.log(0.01), math.log(_STEEPEST)),
            method="bounded",
        )
        return float(best.fun)

    margin = 3.0
    grid = np.linspace(logs[0] - margin, logs[-1] + margin, 241)
    losses = np.array([profile(centre) for centre in grid])
    first = int(losses.argmin())
    low, high = grid[max(first - 1, 0)], grid[min(first + 1, len(grid) - 1)]
    best = optimize.minimize_scalar(profile, bounds=(low, high), method="bounded")
    allowed = float(best.fun) + 0.5 * float(special.chdtri(1, 1.0 - confidence))

    def end(indices: range, beyond: float) -> float:
        inside = best.x
        for index in indices:
            if losses[index] > allowed:
                crossing = optimize.brentq(lambda x: profile(x) - allowed, inside, grid[index])
                return math.exp(crossing)
            inside = grid[index]
        return beyond

    return Interval(
        math.exp(best.x),
        end(range(int(np.searchsorted(grid, best.x)) - 1, -1, -1), 0.0),
        end(range(int(np.searchsorted(grid, best.x)), len(grid)), math.inf),
    )
