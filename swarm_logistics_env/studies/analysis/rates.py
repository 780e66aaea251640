"""Deliveries over time around a fault that begins during the run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import spi
from swarm_logistics_env.spi.summaries import Interval
from swarm_logistics_env.studies.analysis.runs import times_of
from swarm_logistics_env.studies.comparisons import Comparison
from swarm_logistics_env.studies.judgement import Findings

_LONGEST_WINDOW = 100.0  # s
_STEP = 5.0  # s, between the points of a curve


@dataclass(frozen=True)
class RateCurve:
    """Deliveries in the trailing window, mean over seeds with pointwise 95 % t-intervals.

    Attributes:
        label: which runs.
        seconds: end of the window [s]; shape (k,).
        rates: [items a window], shape (k,).
    """

    label: str
    seconds: tuple[float, ...]
    rates: tuple[Interval, ...]


def window_of(comparison: Comparison) -> float:
    """Return the trailing window [s]: 100, or a third of what is left after the onset, rounded."""
    left = comparison.original.condition.scenario.duration - comparison.changed.level.onset
    return min(_LONGEST_WINDOW, float(round(left / 3)) or left / 3)


def rate_curves(findings: Findings, comparison: Comparison) -> tuple[RateCurve, ...]:
    """Return the delivery rates without fault, with the robots removed, and with the fault."""
    assert comparison.removed is not None
    arms = {
        "no fault": comparison.original,
        "removed": comparison.removed,
        "fault": comparison.changed,
    }
    window = window_of(comparison)
    end = comparison.original.condition.scenario.duration
    seconds = np.arange(window, end + _STEP / 2, min(_STEP, window / 10)).round(6)
    curves = []
    for label, arm in arms.items():
        if (times := times_of(findings, arm)) is not None:
            counts = np.array([_in_window(run, seconds, window) for run in times])
            rates = tuple(spi.mean_interval(column) for column in counts.T)
            curves.append(RateCurve(label, tuple(seconds.tolist()), rates))
    return tuple(curves)


def _in_window(
    times: NDArray[np.float64], seconds: NDArray[np.float64], window: float
) -> NDArray[np.float64]:
    until = np.searchsorted(times, seconds, side="right")
    since = np.searchsorted(times, seconds - window, side="right")
    return np.asarray(until - since, dtype=np.float64)
