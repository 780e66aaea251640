"""How long a swarm takes to repair itself: the change point of its delivery rate after a fault."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .inputs import IndicatorError, Numbers, between_0_and_1, delivery_times

SWAPS = 999  # random swaps in the test that there is any loss
SIMULATIONS = 400  # for each candidate time; they fix its 95 % limit to +-1 %
_CANDIDATES = 16  # times at which that limit is simulated; between them it is interpolated
_FAR_OFF = 25.0  # likelihood ratio that no candidate's limit comes near
_MOST_BINS = 400
_ONE_DELIVERY = math.log(2.0)  # what one delivery of the reference more says for a loss
_BLOCK = 100.0  # s, over which the null pair's counts are compared to find their dispersion


@dataclass(frozen=True, slots=True)
class SelfRepair:
    """Self-repair time over seeds.

    Attributes:
        seconds: From the onset until the rate is back, the likeliest time [s]; 0: no loss; None:
            censored, something is lost and that it was so to the end is not excluded.
        low: Lower limit of its interval [s].
        high: Upper limit [s]; inf where a loss that lasts to the end is not excluded.
        followed: How long the runs were followed after the onset [s].
        p_value: One-sided p of "nothing is lost": how often pairs swapped at random lose as much.
        null_seconds: The likeliest time of the pair without faults [s]: noise.
        distinguishable: Whether p_value < 1 - confidence; where not, the time measures noise.
    """

    seconds: float | None
    low: float
    high: float
    followed: float
    p_value: float
    null_seconds: float
    distinguishable: bool

    @property
    def censored(self) -> bool:
        """Whether the runs show a loss and not that the rate came back."""
        return self.seconds is None


def self_repair(
    faulty: Sequence[ArrayLike],
    reference: Sequence[ArrayLike],
    null_pair: tuple[Sequence[ArrayLike], Sequence[ArrayLike]],
    *,
    onset: float,
    end: float,
    generator: np.random.Generator,
    confidence: float = 0.95,
) -> SelfRepair:
    """Estimate the self-repair time from counts pooled over seeds, against the paired reference.

    The model: from the onset to the change point the faulty runs deliver a share r < 1 of what the
    reference delivers, afterwards as much. Given how many both deliver in a moment, the faulty
    runs' part is binomial, so the rate itself may vary. The estimate maximises the likelihood. The
    interval holds every time whose likelihood ratio is below the 95 % limit of runs simulated with
    that time (a bootstrap of change points is inconsistent). The ratio is divided by the
    dispersion that the pair without faults shows. No window smooths the counts: it would delay
    every recovery by nearly its own length.

    Args:
        faulty: Delivery times [s] of each seed's run with faults.
        reference: Delivery times [s] of the same seeds' reference runs.
        null_pair: Two sets of runs without faults, of shared seeds but for the behaviour.
        onset: When the faults begin [s].
        end: When all runs end [s]; they must not run out of items before.
        generator: Only source of randomness: swaps pairs and simulates counts.
        confidence: Of interval and test, in (0, 1).

    Raises:
        IndicatorError: Unequal numbers of seeds within a pair, no seeds, not 0 <= onset < end, a
            delivery after the end, or no delivery after the onset in a reference.
    """
    between_0_and_1("confidence", confidence)
    followed, bin_seconds = _followed(onset, end)
    lead, other = _paired_counts(("faulty", "reference"), (faulty, reference), onset, end)
    null_names = ("null_pair[0]", "null_pair[1]")
    null_lead, null_other = _paired_counts(null_names, null_pair, onset, end)
    curve = _log_likelihood(lead.sum(axis=0), other.sum(axis=0))
    best = int(curve.argmax())
    p_value = _swapped_p(lead, other, float(curve[best]), generator)
    dispersion = _dispersion(null_lead, null_other, bin_seconds)
    kept = _kept(lead.sum(axis=0), other.sum(axis=0), curve, dispersion, confidence, generator)
    null_best = int(_log_likelihood(null_lead.sum(axis=0), null_other.sum(axis=0)).argmax())

    distinguishable = p_value < 1.0 - confidence
    to_the_end = bool(kept[-1] == curve.size - 1)
    # A change inside a bin shows at one of its edges: the interval reaches a bin further.
    return SelfRepair(
        seconds=None if distinguishable and to_the_end else best * bin_seconds,
        low=max(0.0, float(kept[0] - 1) * bin_seconds),
        high=math.inf if to_the_end else float(kept[-1] + 1) * bin_seconds,
        followed=followed,
        p_value=p_value,
        null_seconds=null_best * bin_seconds,
        distinguishable=distinguishable,
    )


def repair_times(
    faulty: Sequence[ArrayLike], reference: Sequence[ArrayLike], *, onset: float, end: float
) -> tuple[Numbers, NDArray[np.bool_]]:
    """Self-repair time of every seed's own run, for `kaplan_meier`; see `self_repair`.

    A single run delivers too little to place a change: most of such a time is noise, and it says
    little without the same of a pair without faults beside it.

    Args:
        faulty: Delivery times [s] of each seed's run with faults.
        reference: Delivery times [s] of the same seeds' reference runs.
        onset: When the faults begin [s].
        end: When all runs end [s]; they must not run out of items before.

    Returns:
        Seconds from the onset and whether the rate came back, shapes (n_seeds,); where that rests
        on one delivery or less, how long the run was followed, as censored.

    Raises:
        IndicatorError: As for `self_repair`.
    """
    followed, bin_seconds = _followed(onset, end)
    lead, other = _paired_counts(("faulty", "reference"), (faulty, reference), onset, end)
    curves = _log_likelihood(lead, other)
    back = curves[:, -1] < curves.max(axis=1) - _ONE_DELIVERY
    back |= curves.max(axis=1) == 0.0
    return np.where(back, curves.argmax(axis=1) * bin_seconds, followed), back


def _followed(onset: float, end: float) -> tuple[float, float]:
    """Return how long runs are followed after the onset and the width of a bin [s]."""
    if not 0.0 <= onset < end < math.inf:
        raise IndicatorError(f"onset = {onset}, end = {end}: should be 0 <= onset < end")
    followed = end - onset
    return followed, followed / min(_MOST_BINS, max(1, math.floor(followed)))


def _counts(name: str, runs: Sequence[ArrayLike], onset: float, end: float) -> Numbers:
    """Return the deliveries of each seed in bins from onset to end, shape (seeds, bins)."""
    followed, bin_seconds = _followed(onset, end)
    edges = onset + bin_seconds * np.arange(round(followed / bin_seconds) + 1)
    rows = []
    for seed, times in enumerate(delivery_times(name, runs)):
        if times.size and times[-1] > end:
            raise IndicatorError(
                f"{name}[{seed}] delivers at {times[-1]:g} s: should not be after end = {end:g} s"
            )
        # A delivery at the onset was before the fault, one at an edge belongs to the bin before.
        rows.append(np.diff(np.searchsorted(times, edges, side="right")))
    return np.array(rows, dtype=np.float64)


def _paired_counts(
    names: tuple[str, str],
    pair: tuple[Sequence[ArrayLike], Sequence[ArrayLike]],
    onset: float,
    end: float,
) -> tuple[Numbers, Numbers]:
    lead, other = (_counts(name, runs, onset, end) for name, runs in zip(names, pair, strict=True))
    if len(lead) != len(other):
        raise IndicatorError(
            f"unequal seed sets ({names[0]} has {len(lead)}, {names[1]} has {len(other)}): should "
            "be the same seeds in the same order"
        )
    if not other.any():
        raise IndicatorError(f"{names[1]}: should deliver something after the onset")
    return lead, other


def _log_likelihood(lead: Numbers, other: Numbers) -> Numbers:
    """Return how much likelier a loss up to each bin's start is than none.

    Args:
        lead: Counts of the faulty runs, shape (..., bins).
        other: Counts of the reference.

    Returns:
        Shape (..., bins + 1): entry k is of a loss through the first k bins, the last of one that
        lasts to the end; entry 0 is 0.
    """
    from scipy.special import xlogy

    zero = np.zeros((*lead.shape[:-1], 1))
    delivered = np.concatenate([zero, np.cumsum(lead, axis=-1)], axis=-1)
    expected = np.concatenate([zero, np.cumsum(other, axis=-1)], axis=-1)
    both = delivered + expected
    share = np.minimum(0.5, delivered / np.where(both > 0.0, both, 1.0))
    return np.asarray(xlogy(delivered, 2.0 * share) + xlogy(expected, 2.0 * (1.0 - share)))


def _swapped_p(
    lead: Numbers, other: Numbers, observed: float, generator: np.random.Generator
) -> float:
    """Return the p of no loss: without one, the runs of a seed could as well be swapped."""
    difference, reference = lead - other, other.sum(axis=0)
    kept = generator.integers(2, size=(SWAPS, len(lead))).astype(np.float64)
    pooled = reference + kept @ difference
    swapped = _log_likelihood(pooled, lead.sum(axis=0) + reference - pooled).max(axis=-1)
    # Sums of the same counts in another order differ by rounding.
    return float(1 + (swapped >= observed - 1e-9).sum()) / (SWAPS + 1)


def _dispersion(lead: Numbers, other: Numbers, bin_seconds: float) -> float:
    """Return the variance of the pair's difference over a Poisson one's, at least 1."""
    width = max(1, min(lead.shape[1], round(_BLOCK / bin_seconds)))
    starts = np.arange(0, lead.shape[1], width)
    difference = np.add.reduceat(lead - other, starts, axis=1)
    return max(1.0, float(np.square(difference).sum() / (lead + other).sum()))


def _kept(
    lead: Numbers,
    other: Numbers,
    curve: Numbers,
    dispersion: float,
    confidence: float,
    generator: np.random.Generator,
) -> NDArray[np.intp]:
    """Return the change points that the likelihood ratio does not reject, ascending."""
    ratio = 2.0 * (curve.max() - curve) / dispersion
    near = np.flatnonzero(ratio <= _FAR_OFF)
    places = np.linspace(0, near.size - 1, min(near.size, _CANDIDATES)).round().astype(np.intp)
    candidates = near[np.unique(places)]
    both = (lead + other).astype(np.int64)
    limits = []
    for change in candidates:
        delivered, expected = lead[:change].sum(), other[:change].sum()
        share = np.full(both.size, 0.5)
        if expected > 0.0:
            share[:change] = min(0.5, delivered / (delivered + expected))
        drawn = generator.binomial(both, share, size=(SIMULATIONS, both.size))
        simulated = drawn.astype(np.float64)
        curves = _log_likelihood(simulated, both - simulated)
        ratios = 2.0 * (curves.max(axis=1) - curves[:, change])
        limits.append(float(np.quantile(ratios, confidence, method="higher")))
    inside = ratio <= np.interp(np.arange(curve.size), candidates, limits)
    inside[int(curve.argmax())] = True
    return np.flatnonzero(inside)
