"""Faults that begin during the run: what is delivered afterwards, and when it is as much again."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .estimate import Estimate, Options, estimate_ratio
from .inputs import IndicatorError, Numbers, delivery_times, finite, numbers, performance


def resilience_index(
    faulty: Sequence[ArrayLike],
    reference: Sequence[ArrayLike],
    *,
    onset: float,
    **options: Unpack[Options],
) -> Estimate:
    """Deliveries after the onset over the paired reference's, as a ratio of means over seeds.

    With the same robots removed at the onset as reference this is fault tolerance local in time
    (index > 1); with the unbroken swarm, robustness local in time (index > 1 - m/N).

    Args:
        faulty: Delivery times [s] of each seed's run with faults.
        reference: Delivery times [s] of the same seeds' reference runs.
        onset: When the faults begin [s]; later deliveries count.
        options: Threshold (1 if not given), confidence, pairing and the like: see `Options`.

    Raises:
        IndicatorError: No seeds, unequal numbers of seeds, a time negative or not finite, or no
            delivery after the onset in any reference run.
    """
    finite("onset", onset)
    options.setdefault("threshold", 1.0)

    def after_onset(name: str, runs: Sequence[ArrayLike]) -> Numbers:
        times = delivery_times(name, runs)
        return np.array([np.count_nonzero(run > onset) for run in times], dtype=np.float64)

    broken = after_onset("faulty", faulty)
    sound = after_onset("reference", reference)
    terms = {"faulty": (broken, 1.0), "reference": (sound, 0.0)}
    return estimate_ratio("resilience", terms, **options)


def repair_times(
    faulty: Sequence[ArrayLike],
    reference: Sequence[ArrayLike],
    *,
    onset: float,
    end: float,
    window: float = 100.0,
) -> tuple[Numbers, NDArray[np.bool_]]:
    """Time after which each seed's run delivers as much again as its reference, for `kaplan_meier`.

    It ends with the first window, begun after the onset, in which the run delivers at least as much
    as the reference. Deliveries scatter, so such a time says little without that of a pair of runs
    without faults beside it.

    Args:
        faulty: Delivery times [s] of each seed's run with faults.
        reference: Delivery times [s] of the same seeds' reference runs.
        onset: When the faults begin [s].
        end: When all runs end [s]; they must not run out of items before.
        window: Length of the window [s], at most end - onset.

    Returns:
        Seconds from the onset to the start of that window, and whether there was one, shapes
        (n_seeds,); where there was none, how long the run was followed, as censored.

    Raises:
        IndicatorError: No seeds, unequal numbers of seeds, a time negative or not finite, not
            0 <= onset < end, or not 0 < window <= end - onset.
    """
    if not 0.0 <= onset < end < math.inf:
        raise IndicatorError(f"onset = {onset}, end = {end}: should be 0 <= onset < end")
    if not 0.0 < window <= end - onset:
        raise IndicatorError(f"window = {window}: should be above 0, at most end - onset")
    pair = delivery_times("faulty", faulty), delivery_times("reference", reference)
    if len(pair[0]) != len(pair[1]):
        raise IndicatorError(
            f"unequal seed sets (faulty has {len(pair[0])}, reference has {len(pair[1])}): should "
            "be the same seeds in the same order"
        )
    followed = end - onset - window
    starts = np.linspace(0.0, followed, math.floor(followed) + 1)  # about 1 s apart

    def counts(times: Numbers) -> Numbers:
        before = np.searchsorted(times, onset + starts, side="right")
        return np.asarray(np.searchsorted(times, onset + starts + window, side="right") - before)

    enough = np.array([counts(run) >= counts(other) for run, other in zip(*pair)])
    back: NDArray[np.bool_] = np.asarray(enough.any(axis=1))
    return np.where(back, starts[enough.argmax(axis=1)], followed), back


class SurvivalCurve(NamedTuple):
    """Share of runs still without the event after each event time, shapes (k,)."""

    seconds: Numbers
    share: Numbers

    def median(self) -> float | None:
        """First time at which half the runs have had the event [s]; None where never reached."""
        reached = np.flatnonzero(self.share <= 0.5)
        return float(self.seconds[reached[0]]) if reached.size else None


def kaplan_meier(seconds: ArrayLike, happened: ArrayLike) -> SurvivalCurve:
    """Kaplan-Meier curve.

    Args:
        seconds: Time of the event, or until which the run was watched without it [s], shape (n,).
        happened: Whether the event was seen, shape (n,); False: censored.

    Returns:
        One entry per distinct event time, rising; empty where every run is censored.

    Raises:
        IndicatorError: Empty or unequal arrays, a time negative or not finite.
    """
    from scipy.stats import CensoredData, ecdf

    time = performance("seconds", seconds)
    event = numbers("happened", happened) != 0.0
    if time.shape != event.shape:
        raise IndicatorError(
            f"seconds has shape {time.shape}, happened {event.shape}: should be equal, one per run"
        )
    curve = ecdf(CensoredData(uncensored=time[event], right=time[~event])).sf
    seen = np.isin(curve.quantiles, time[event])
    return SurvivalCurve(curve.quantiles[seen], curve.probabilities[seen])
