"""Times to an event that some runs never reach: Kaplan and Meier's (1958) curve."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .inputs import IndicatorError, between_0_and_1, numbers

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


class SurvivalCurve(NamedTuple):
    """Share of runs still without the event after each event time, shapes (k,)."""

    seconds: NDArray[np.float64]
    share: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]

    def median(self) -> float | None:
        """First time at which half the runs have had the event [s]; None where never reached."""
        reached = np.flatnonzero(self.share <= 0.5)
        return float(self.seconds[reached[0]]) if reached.size else None


def kaplan_meier(seconds: ArrayLike, happened: ArrayLike, level: float = 0.95) -> SurvivalCurve:
    """Kaplan-Meier curve with Greenwood's interval on the log(-log) scale.

    Args:
        seconds: Time of the event, or until which the run was watched without it [s], shape (n,).
        happened: Whether the event was seen, shape (n,); False: censored.
        level: Confidence level of the pointwise interval, in (0, 1).

    Returns:
        One entry per distinct event time, rising; empty where every run is censored.

    Raises:
        IndicatorError: Empty or unequal arrays, a time negative or not finite, level out of range.
    """
    from scipy.special import ndtri

    between_0_and_1("level", level)
    time = numbers("seconds", seconds)
    event = np.asarray(happened, dtype=bool)
    if time.ndim != 1 or time.shape != event.shape or time.size == 0:
        raise IndicatorError(
            f"seconds has shape {time.shape}, happened {event.shape}: should be equal, one per run"
        )
    for value in time.tolist():
        if not 0.0 <= value < np.inf:
            raise IndicatorError(f"seconds holds {value}: should be finite and not negative")
    times, events = np.unique(time[event], return_counts=True)
    at_risk = (time >= times[:, np.newaxis]).sum(axis=1)
    share = np.cumprod(1.0 - events / at_risk)
    inside = (share > 0.0) & (share < 1.0)
    left = np.where(at_risk > events, at_risk - events, 1)
    variance = np.cumsum(events / (at_risk * left))
    log_share = np.log(np.where(inside, share, 0.5))
    half = float(ndtri(0.5 + level / 2)) * np.sqrt(variance) / np.abs(log_share)
    # At share 0 the scale ends and no interval is defined: all that is known is [0, 1].
    low = np.where(inside, np.exp(log_share * np.exp(half)), 0.0)
    high = np.where(inside, np.exp(log_share * np.exp(-half)), 1.0)
    return SurvivalCurve(times, share, low, high)
