"""Times to an event that some runs never reach: Kaplan and Meier's (1958) curve."""

from __future__ import annotations

import warnings
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .inputs import IndicatorError, Numbers, between_0_and_1, numbers


class SurvivalCurve(NamedTuple):
    """Share of runs still without the event after each event time, shapes (k,)."""

    seconds: Numbers
    share: Numbers
    low: Numbers
    high: Numbers

    def median(self) -> float | None:
        """First time at which half the runs have had the event [s]; None where never reached."""
        reached = np.flatnonzero(self.share <= 0.5)
        return float(self.seconds[reached[0]]) if reached.size else None


def kaplan_meier(
    seconds: ArrayLike, happened: ArrayLike, confidence: float = 0.95
) -> SurvivalCurve:
    """Kaplan-Meier curve with Greenwood's interval on the log(-log) scale.

    Args:
        seconds: Time of the event, or until which the run was watched without it [s], shape (n,).
        happened: Whether the event was seen, shape (n,); False: censored.
        confidence: Of the pointwise interval, in (0, 1).

    Returns:
        One entry per distinct event time, rising; empty where every run is censored.

    Raises:
        IndicatorError: Empty or unequal arrays, a time negative or not finite, confidence not
            in (0, 1).
    """
    from scipy.stats import CensoredData, ecdf

    between_0_and_1("confidence", confidence)
    time = numbers("seconds", seconds)
    event = np.asarray(happened, dtype=bool)
    if time.ndim != 1 or time.shape != event.shape or time.size == 0:
        raise IndicatorError(
            f"seconds has shape {time.shape}, happened {event.shape}: should be equal, one per run"
        )
    for value in time.tolist():
        if not 0.0 <= value < np.inf:
            raise IndicatorError(f"seconds holds {value}: should be finite and not negative")
    if not event.any():
        return SurvivalCurve(*np.empty((4, 0)))
    curve = ecdf(CensoredData(uncensored=time[event], right=time[~event])).sf
    with np.errstate(divide="ignore", invalid="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # share 0 has no limits, which is dealt with below
        limits: Any = curve.confidence_interval(confidence, method="log-log")
    times, share, low, high = np.array(
        [curve.quantiles, curve.probabilities, limits.low.probabilities, limits.high.probabilities]
    )[:, np.isin(curve.quantiles, time[event])]
    # At share 0 the scale ends and no interval is defined: all that is known is [0, 1].
    inside = (share > 0.0) & (share < 1.0)
    return SurvivalCurve(times, share, np.where(inside, low, 0.0), np.where(inside, high, 1.0))
