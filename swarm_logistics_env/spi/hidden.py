"""Runs that stall and trainings that collapse: how many were seen, and how many may be hidden.

A policy that stalls in 5 % of its runs shows none in 36 % of studies of 20 seeds, and a recipe of
which one training in ten collapses shows none in 59 % of studies of five. Their mean is then too
high and their spread too small for any test to notice. So p holds for every share s that may be
hidden: it is at least 1.25 B(s) p(s), where B(s) is the chance to see at most as many as were seen
and p(s) the p of the test if the share had lowered the mean.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .inputs import Numbers, performance

# Half the median is a bad run; below a quarter lies no run of a condition that never stalls (the
# least of 2,000 Poisson counts of mean 30 is about 13). Counts that end at random, as under FM4,
# have 17 % of their runs there: they did stall, and their spread tells it.
SHARE_OF_MEDIAN = 0.25
# The assumption of verdicts over seeds: at most so many runs of a condition stall, if fewer do in
# the runs seen. A larger share would take small effects from verdicts at any usual number of seeds.
STALL_SHARE = 0.05
# A training has collapsed under a change if it keeps less than half of its own P; to stand out from
# the others, which p has to hold for, it keeps less than half of what the median training keeps.
# Trainings are too few to assume how many collapse: any share may.
COLLAPSED_BELOW = 0.5
COLLAPSE_CONFIDENCE = 0.95  # of the upper limit of the share that collapses
# Studies that show fewer than their share err a little too, which the chance that they show none
# makes room for.
MARGIN_OF_CHANCE = 1.25
_SHARES = 33  # points of the grid on which p has to hold


class Hidden(NamedTuple):
    """What one condition shows of runs that stall, or of trainings that collapse.

    Attributes:
        seen: How many did, shape (...).
        of: Of how many.
        most: The largest share that may, in [0, 1].
    """

    seen: Numbers
    of: int
    most: float


class Collapsed(NamedTuple):
    """Trainings that collapsed under a change, with the exact limit of their share.

    Attributes:
        number: Trainings that keep less than half of their own P.
        of: Trainings played.
        upper: One-sided 95 % upper limit of the share that collapses (Clopper and Pearson 1934).
    """

    number: int
    of: int
    upper: float

    def __str__(self) -> str:
        """Return both in words, e.g. "0 of 5 collapsed, at most 45 %"."""
        return f"{self.number} of {self.of} collapsed, at most {100 * self.upper:.0f} %"


def share_stalled(p: ArrayLike) -> float:
    """Share of runs that stalled, in [0, 1]: that have less than a quarter of the median.

    Where more than half of the runs deliver next to nothing, that is the rule, and none stands out.

    Args:
        p: Performance of one condition over seeds, shape (n_seeds,), in any unit.

    Raises:
        IndicatorError: p empty, negative or not finite.
    """
    return float(_stalled(performance("p", p)).mean())


def stalls(sample: Numbers) -> Hidden:
    """Return what a sample (..., n) shows of runs that stall."""
    return Hidden(_stalled(sample).sum(axis=-1).astype(np.float64), sample.shape[-1], STALL_SHARE)


def hidden_of(
    samples: Sequence[Numbers], *, trainings: bool, reference_too: bool = False
) -> list[Hidden | None]:
    """Return what each sample may hide: stalled runs, or collapsed trainings.

    Args:
        samples: Of all conditions, the reference last: shape (..., n), or (K, S) of trainings.
        trainings: Whether they are of trainings. A sample whose rows are equal is of none.
        reference_too: Whether a training may collapse in the reference alone. Of conditions that
            one training is played under it does not: what fails without a change fails with it.
    """
    if not trainings:
        return [stalls(sample) for sample in samples]
    changed, *_, reference = samples
    compared_with = [*[reference] * (len(samples) - 1), changed]
    collapses: list[Hidden | None] = [
        None if (sample == sample[..., :1, :]).all() else _collapses(sample, other)
        for sample, other in zip(samples, compared_with)
    ]
    return collapses if reference_too else [*collapses[:-1], None]


def _collapses(sample: Numbers, reference: Numbers) -> Hidden:
    changed = sample.mean(axis=-1)
    original = reference.mean(axis=-1)
    # A training that delivers nothing in its reference counts as one that keeps all.
    retained = np.divide(
        changed, original, out=np.full(changed.shape, np.inf), where=original > 0.0
    )
    median = np.median(retained, axis=-1, keepdims=True)
    seen = (retained < COLLAPSED_BELOW * np.where(np.isfinite(median), median, 0.0)).sum(axis=-1)
    return Hidden(seen.astype(np.float64), changed.shape[-1], 1.0)


def collapsed(changed: Numbers, reference: Numbers) -> Collapsed:
    """Return the trainings that collapsed under a change with the limit of their share.

    Args:
        changed: Their P under the change, shape (K, S), row k being one training.
        reference: Their P without it, shape (K, S).
    """
    from scipy.special import betaincinv

    has_collapsed = changed.mean(axis=-1) < COLLAPSED_BELOW * reference.mean(axis=-1)
    number = int(has_collapsed.sum())
    of = len(changed)
    upper = 1.0 if number == of else float(betaincinv(number + 1, of - number, COLLAPSE_CONFIDENCE))
    return Collapsed(number, of, upper)


def least_seen(of_terms: Sequence[Hidden]) -> Hidden | None:
    """Return what may be hidden of a sum: that term counts which showed the fewest."""
    if not of_terms:
        return None
    seen, of, most = zip(*of_terms)
    return Hidden(np.minimum.reduce(seen), min(of), max(most))


def p_with_hidden(p_if_kept: Callable[[Numbers], Numbers], hidden: Hidden | None) -> Numbers:
    """One-sided p that holds for every share that may be hidden.

    Args:
        p_if_kept: One-sided p if the mean were this share of what was seen, both of shape (...).
        hidden: None: nothing is.
    """
    p = p_if_kept(np.ones(()))
    if hidden is None:
        return p
    shares = hidden.most * np.linspace(0.0, 1.0, _SHARES)[1:] ** 2
    remaining, chance = remainder_and_chance(shares.reshape(-1, *(1,) * p.ndim), hidden)
    return np.asarray(np.maximum(p, (chance * p_if_kept(remaining)).max(axis=0)))


def remainder_and_chance(share: Numbers | float, hidden: Hidden) -> tuple[Numbers, Numbers]:
    """What is left of the mean seen if that share stalls, and the chance to see as few.

    A share of shape (s, ...) beside `hidden` of shape (...) gives (s, ...).
    """
    from scipy.special import bdtr

    working = 1.0 - hidden.seen / hidden.of
    remaining = np.minimum(1.0, (1.0 - share) / np.maximum(working, 1.0 / hidden.of))
    chance = np.minimum(1.0, MARGIN_OF_CHANCE * bdtr(hidden.seen, hidden.of, share))
    return remaining, np.where(hidden.seen < share * hidden.of, chance, 0.0)


def _stalled(p: Numbers) -> NDArray[np.bool_]:
    return np.asarray(p < SHARE_OF_MEDIAN * np.median(p, axis=-1, keepdims=True))
