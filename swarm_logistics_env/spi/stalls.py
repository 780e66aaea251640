"""Runs that stall: how many are seen, and what those that no run showed could do to a verdict.

A policy that stalls in 5 % of its runs shows none in 36 % of studies of 20 seeds. Their mean is
then too high and their spread too small for any test to notice. So p has to hold for every share s
up to 10 %: it is at least 1.25 (1 - s)^n p(s), where (1 - s)^n is the chance that n runs show no
stall, and p(s) the p of the test if the share had lowered the mean. Where a run did stall, the
spread tells, and the test keeps its level by itself.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .inputs import Numbers, performance

# Half the median is a bad run; below a quarter lies no run of a condition that never stalls (the
# least of 2,000 Poisson counts of mean 30 is about 13). Counts that stop at random, as under FM4,
# have 17 % of their runs there: they did stall, and their spread tells it.
SHARE_OF_MEDIAN = 0.25
# Of larger shares 10, 20 and 30 runs show nothing in at most 35, 12 and 4 % of studies. To guard
# against them too would take the verdict from a clear loss of a fifth at ten seeds.
LARGEST_SHARE = 0.1
# Studies that show fewer stalls than their share err a little too, which the chance that they show
# none makes room for: all of them together stay below 6 % a side at 3, 5 and 10 % of stalls.
MARGIN = 1.25


def share_stalled(p: ArrayLike) -> float:
    """Share of runs that stalled, in [0, 1]: that have less than a quarter of the median.

    Where more than half of the runs deliver next to nothing, that is the rule, and none stands out.

    Args:
        p: Performance of one condition over seeds, shape (n_seeds,), in any unit.

    Raises:
        IndicatorError: p empty, negative or not finite.
    """
    return float(_stalled(performance("p", p)).mean())


def at_stake(terms: Sequence[tuple[float, Numbers]]) -> tuple[Numbers, Numbers]:
    """What a stall of every run would take from mean(D), and add to it, where no run stalled.

    Args:
        terms: Weight in D and performances, shape (..., n), of each condition.

    Returns:
        Two arrays of shape (...), not negative, in the unit of D. A condition with a stalled run
        counts in neither.
    """
    taken, added = np.zeros(()), np.zeros(())
    for weight, sample in terms:
        moved = np.where(_stalled(sample).any(axis=-1), 0.0, abs(weight) * sample.mean(axis=-1))
        if weight > 0.0:
            taken = taken + moved
        else:
            added = added + moved
    return taken, added


def p_with_hidden(
    p_above: Callable[[Numbers], Numbers], statistic: Numbers, loss: Numbers, n: int
) -> Numbers:
    """One-sided p of a statistic that holds for every share of stalled runs that n runs may hide.

    Args:
        p_above: One-sided p of a statistic, both of shape (...).
        statistic: mean(D) / se(D).
        loss: What a stall of every run would take from it, shape (...).
        n: Runs of which none stalled.
    """
    worst = np.zeros(())
    for share, chance in zip(*_hidden(n), strict=True):
        worst = np.maximum(worst, chance * p_above(statistic - share * loss))
    return worst


def critical_with_hidden(
    quantile: Callable[[Numbers], Numbers], error: float, loss: float, n: int
) -> float:
    """Statistic above which `p_with_hidden` is below `error`.

    Args:
        quantile: The statistic at which the one-sided p is the one given, shape (k,).
        error: One-sided, in (0, 0.5).
        loss, n: As in `p_with_hidden`.
    """
    shares, chances = _hidden(n)
    likely = chances > error
    return float((quantile(error / chances[likely]) + shares[likely] * loss).max())


def _hidden(n: int) -> tuple[Numbers, Numbers]:
    """Shares from 0 up and the chances that n runs hide them, to the bootstrap's smallest p."""
    shares = np.linspace(0.0, min(LARGEST_SHARE, 9.4 / n), 48)
    return shares, np.minimum(1.0, MARGIN * (1.0 - shares) ** n)


def _stalled(p: Numbers) -> NDArray[np.bool_]:
    return np.asarray(p < SHARE_OF_MEDIAN * np.median(p, axis=-1, keepdims=True))
