"""Two phases: how near a swarm is to its critical size, at which some runs collapse.

Above a critical density a swarm does not get worse by and by: some of its runs jam, and the others
go on (Kuckling et al. 2024, arXiv 2310.11843). A mean over both says nothing of either. What it is
that a training collapses, `hidden` says.
"""

from __future__ import annotations

import itertools
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
_FEWEST_STEPS = 5  # from the smallest P to the largest: fewer are too small counts
_MOST_LEFT = 0.75  # of the good phase's P, by the phase that collapsed
_LEAST_SHARE = 0.2  # of the runs in the smaller of two groups that are told apart by their variance
_BOTTOM = 0.06  # of the range of P: runs so near to the smallest may be a mode of their own
_TAIL_WIDTHS = 4.7  # below the median, in distances from a quartile: 3 standard deviations
_TAIL_SHARE = 0.03  # of the runs of one phase at most lie there
_MOST_DRAWN = 300  # runs of a sample with one mode
_ROUNDING = 1e-9  # of the largest P: runs that differ by less are equal
_N_DRAWS = 2_000  # of such samples, which give the level of the first test


class Phases(NamedTuple):
    """Whether the runs of a condition are of two phases.

    Attributes:
        p_value: that one phase shows them, in [0, 1]; 1 where they cannot show two.
        boundary: P between the phases, where two are named; None: they are not.
        share_low: the share of the runs below it, in [0, 1].
        untestable: why nothing was tested; empty: it was.
    """

    p_value: float
    boundary: float | None
    share_low: float = 0.0
    untestable: str = ""


def two_phases(p: ArrayLike, level: float = LEVEL) -> Phases:
    """Test whether runs are of two phases, a good one and one that has collapsed.

    A run that has collapsed has lost a quarter of the good runs' median or more. Two tests share
    the level. The first is for groups of a similar size: the share of the variance between two
    groups of at least a fifth of the runs is more than in draws with one mode, which are uniform
    but for as many at the smallest P as these runs have there. The second is for a few bad runs:
    more than 3 % lie further below the median than 4.7 times the further quartile. Equal runs are
    spread over the step from one possible P to the next, or each count would be a group. Runs at
    the largest P are left out, or a cap would be a phase of its own.

    Args:
        p: performance of one condition over runs, shape (n,).
        level: chance that two phases are named where there is one, in (0, 1).
    """
    from scipy.special import bdtrc  # scipy.stats takes a second to load

    runs = np.sort(performance("p", p))
    below_cap = runs[runs < runs[-1]]
    if len(below_cap) < FEWEST_RUNS:
        reason = f"fewer than {FEWEST_RUNS} runs lie below the largest P"
        return Phases(1.0, None, untestable=reason)
    step = _step(below_cap)
    if below_cap[-1] - below_cap[0] < (_FEWEST_STEPS - 0.5) * step:
        reason = f"counts are too small: fewer than {_FEWEST_STEPS} steps from least to most"
        return Phases(1.0, None, untestable=reason)
    spread = _spread_ties(below_cap, step)
    split, share = _best_split(spread)
    # The share falls with the number of runs: of fewer it is on the safe side.
    n_drawn = min(len(spread), _MOST_DRAWN)
    draws = _shares_of_draws(n_drawn, round(_share_at_bottom(below_cap) * n_drawn))
    p_of_groups = (1.0 + np.count_nonzero(draws >= share)) / (1.0 + len(draws))
    edge = _lower_edge(spread)
    n_below = int((spread < edge).sum()) if edge < np.median(spread) else 0
    # At least so many runs of a binomial number of them.
    p_of_tail = float(bdtrc(n_below - 1, len(spread), _TAIL_SHARE)) if n_below else 1.0
    p_value = min(1.0, 2.0 * min(p_of_groups, p_of_tail))
    boundary = split if p_of_groups <= p_of_tail else edge
    has_collapsed = runs < boundary
    if p_value > level or not has_collapsed.any():
        return Phases(p_value, None)
    if np.median(runs[has_collapsed]) > _MOST_LEFT * np.median(runs[~has_collapsed]):
        return Phases(1.0, None)
    return Phases(p_value, boundary, float(has_collapsed.mean()))


def _step(runs: Numbers) -> float:
    """Return the least difference between runs that differ by more than an error of rounding."""
    steps = np.diff(runs)
    return float(steps[steps > _ROUNDING * runs[-1]].min(initial=np.inf))


def _spread_ties(runs: Numbers, step: float) -> Numbers:
    """Return sorted runs, equal ones evenly over the step around them."""
    is_new = np.diff(runs, prepend=-np.inf) > _ROUNDING * runs[-1]
    first = np.flatnonzero(is_new)
    n_equal = np.diff(first, append=len(runs))
    rank = np.arange(len(runs)) - np.repeat(first, n_equal)
    return np.asarray(runs + step * ((rank + 0.5) / np.repeat(n_equal, n_equal) - 0.5))


def _share_at_bottom(runs: Numbers) -> float:
    """Return which share of sorted runs lies beside the smallest of them."""
    is_near = runs[1:] <= runs[0] + _BOTTOM * (runs[-1] - runs[0])
    return float(is_near.sum()) / len(runs)


def _best_split(runs: Numbers) -> tuple[float, float]:
    """Return the value that parts sorted runs best, and the share of the variance between parts."""
    between = _variances_between(runs)
    best = int(between.argmax())
    split = 0.5 * float(runs[best] + runs[best + 1])
    return split, float(between[best]) / float(runs.var())


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
def _shares_of_draws(n: int, n_at_bottom: int) -> Numbers:
    # The same draws in every process: a table of critical values, not a chance.
    draws = np.random.Generator(np.random.PCG64(n)).uniform(size=(_N_DRAWS, n))
    draws[:, :n_at_bottom] = 0.0
    draws.sort(axis=1)
    return np.asarray(_variances_between(draws).max(axis=1) / draws.var(axis=1))


def collapsed_runs(
    runs_by_size: Mapping[int, ArrayLike],
    phases: Mapping[int, Phases] | None = None,
) -> dict[int, int] | None:
    """Count the runs of each swarm size that collapsed; None: no size shows two phases.

    The size that shows them most clearly, at LEVEL divided by the number of sizes, tells the
    others: a run has collapsed that has less of its size's good P than what lies halfway between
    the phases there. The good P of a smaller size is its median; that of a larger one goes on with
    the power of N by which it grew so far.

    Args:
        runs_by_size: N -> P of its runs.
        phases: N -> `two_phases` of its runs at level 1; None: they are tested here.
    """
    samples = {n: performance(f"p of N = {n}", runs) for n, runs in runs_by_size.items()}
    tested = phases or {n: two_phases(runs, 1.0) for n, runs in samples.items()}
    clearest = min(samples, key=lambda n: (tested[n].p_value, abs(tested[n].share_low - 0.5)))
    boundary = tested[clearest].boundary
    if boundary is None or tested[clearest].p_value > LEVEL / len(tested):
        return None
    counts = {}
    for n, runs in samples.items():
        limit = boundary if n == clearest else _boundary_by(samples, clearest, boundary, n)
        counts[n] = int((runs < limit).sum())
    return counts


def _boundary_by(samples: Mapping[int, Numbers], named: int, boundary: float, n: int) -> float:
    """Return the P below which runs of a size have collapsed, by a size that shows two phases."""
    runs = samples[named]
    low_p = float(np.median(runs[runs < boundary]))
    good_p = float(np.median(runs[runs >= boundary]))
    halfway = 0.5 * (1.0 + low_p / good_p)
    if n > named:
        return float(halfway * good_p * (n / named) ** _growth(samples, named, good_p))
    return float(halfway * np.median(samples[n]))


def _lower_edge(runs: Numbers) -> float:
    """Return the P below which few runs of one phase lie, far below the median."""
    lower_quartile, median, upper_quartile = np.quantile(runs, [0.25, 0.5, 0.75])
    # Of small counts one of the two may be next to nothing.
    width = max(median - lower_quartile, upper_quartile - median)
    return float(median - _TAIL_WIDTHS * width)


def _growth(samples: Mapping[int, Numbers], last: int, good: float) -> float:
    """Return the power of N by which P grew up to a size with that good P, from 0 to 1."""
    smaller = {n: float(np.median(runs)) for n, runs in samples.items() if n < last}
    medians = {n: median for n, median in smaller.items() if median > 0.0} | {last: good}
    if len(medians) < 2:
        return 0.0
    slope = np.polyfit(np.log([*medians]), np.log([*medians.values()]), 1)[0]
    return min(1.0, max(0.0, float(slope)))


_SLOPES = np.geomspace(1.0, 200.0, 16)  # over log N: from 1 % to 99 % within 5 % of N at most
_MARGIN = math.log(2.0)  # beyond the smallest and largest size, where critical sizes are looked for
_N_CENTRES = 120
_FLAT = 0.1  # of deviance, which tells no centre from another
_FLOORS = np.array([0.0, 0.03, 0.08, 0.15, 0.22, 0.3])  # share at the smallest sizes
_CEILINGS = 1.0 - _FLOORS  # at the largest
_MOST_LAPSES = 0.25  # where floor or ceiling may lie further from 0 or 1, no interval is given
_LEAST_CHANCE = 1e-4  # of a collapse, or logarithms would be infinite
_CORRELATION = 0.15  # of collapses within a size: their share may scatter by .2 around the curve


def critical_size(
    n_robots: ArrayLike, collapsed: ArrayLike, n_runs: ArrayLike, confidence: float = 0.95
) -> Interval:
    """Return the swarm size at which half of the runs collapse, with its interval.

    The share that collapses is a logistic function of log N that grows with N, from a floor, as
    good runs are taken for collapsed ones, to a ceiling. The value is midway between the two. The
    interval is that of the profile quasi-likelihood, in which collapses within a size correlate by
    .15, as those of a beta-binomial share, or scatter as much as they do. It is given where the
    sizes show floor and ceiling within a quarter of 0 and 1: half may never collapse otherwise.

    Args:
        n_robots: swarm sizes, shape (k,), ascending.
        collapsed: how many runs of each collapsed, shape (k,).
        n_runs: how many there are of each, shape (k,).
        confidence: of the interval, in (0, 1).

    Returns:
        Value and limits, in robots; an end is 0 or infinite where the sizes do not bound it, and
        both are where no interval is given.

    Raises:
        IndicatorError: there is one size, or none of the runs or all of them collapsed.
    """
    from scipy import special

    sizes = np.asarray(n_robots, np.float64)
    counts = np.asarray(collapsed, np.float64)
    totals = np.asarray(n_runs, np.float64)
    if len(sizes) < 2 or not 0.0 < counts.sum() < totals.sum():
        raise IndicatorError(
            f"collapsed = {counts.tolist()} of {totals.tolist()}: should be some of the runs, not "
            "all, at two sizes or more"
        )
    logs = np.log(sizes)
    centres = np.linspace(logs[0] - _MARGIN, logs[-1] + _MARGIN, _N_CENTRES)
    rises = special.expit(_SLOPES[:, np.newaxis] * (logs - centres[:, np.newaxis, np.newaxis]))
    weights = 1.0 / (1.0 + _CORRELATION * (totals - 1.0))
    of_pairs = [
        _deviances(floor + (ceiling - floor) * rises, weights * counts, weights * totals)
        for ceiling, floor in itertools.product(_CEILINGS, _FLOORS)
    ]
    deviances = np.reshape(of_pairs, (len(_CEILINGS), len(_FLOORS), _N_CENTRES))
    n_free = len(sizes) - 4
    dispersion = max(1.0, deviances.min() / n_free) if n_free > 0 else 1.0
    allowed = deviances.min() + dispersion * float(special.chdtri(1, 1.0 - confidence))
    profile = deviances.min(axis=(0, 1))
    # Between two sizes the profile may be flat: the value is in its middle.
    value = math.exp(centres[profile <= profile.min() + _FLAT].mean())
    is_far = _FLOORS > _MOST_LAPSES
    if min(deviances[is_far].min(), deviances[:, is_far].min()) <= allowed:
        return Interval(value, 0.0, math.inf)
    within = np.flatnonzero(profile <= allowed)
    low = _crossing(profile, centres, allowed, within[0], within[0] - 1)
    high = _crossing(profile, centres, allowed, within[-1], within[-1] + 1)
    return Interval(value, low or 0.0, high or math.inf)


def _crossing(
    profile: Numbers, centres: Numbers, allowed: float, inside: int, outside: int
) -> float | None:
    """Return the size at which the profile crosses what is allowed; None: beyond all centres."""
    if not 0 <= outside < len(centres):
        return None
    ends = [inside, outside]
    return math.exp(np.interp(allowed, profile[ends], centres[ends]))


def _deviances(shares: Numbers, counts: Numbers, totals: Numbers) -> Numbers:
    """Return the least deviance over slopes for each centre; shares are (centres, slopes, k)."""
    from scipy.special import xlogy

    bounded = np.clip(shares, _LEAST_CHANCE, 1.0 - _LEAST_CHANCE)
    likelihood = np.log(bounded) @ counts + np.log1p(-bounded) @ (totals - counts)
    saturated = xlogy(counts, counts / totals) + xlogy(totals - counts, 1.0 - counts / totals)
    return np.asarray(2.0 * (saturated.sum() - likelihood).min(axis=1))
