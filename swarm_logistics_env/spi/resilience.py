"""Faults that begin during the run: what is delivered afterwards, against a reference."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import ArrayLike

from .estimate import Estimate, judge
from .inputs import Numbers, delivery_times, finite


def resilience_index(
    faulty: Sequence[ArrayLike],
    reference: Sequence[ArrayLike],
    *,
    onset: float,
    threshold: float = 1.0,
    confidence: float = 0.95,
    paired: bool = True,
    saturated: Collection[str] = (),
    identical: bool = False,
) -> Estimate:
    """Deliveries after the onset over the paired reference's, as a ratio of means over seeds.

    With the same robots removed at the onset as reference this is fault tolerance local in time
    (index > 1); with the unbroken swarm, robustness local in time (index > 1 - m/N).

    Args:
        faulty: Delivery times [s] of each seed's run with faults.
        reference: Delivery times [s] of the same seeds' reference runs.
        onset: When the faults begin [s]; later deliveries count.
        threshold: What the index is tested against.
        confidence: Of the interval, in (0, 1).
        paired: Whether both share their seeds, run by run.
        saturated: "faulty" or "reference", or both: where a run delivered every item.
        identical: Whether both are the same runs, seed by seed.

    Raises:
        IndicatorError: No seeds, unequal numbers of seeds, a time negative or not finite, or no
            delivery after the onset in any reference run.
    """
    finite("onset", onset)

    def after_onset(name: str, runs: Sequence[ArrayLike]) -> Numbers:
        times = delivery_times(name, runs)
        return np.array([np.count_nonzero(run > onset) for run in times], dtype=np.float64)

    return judge(
        "resilience",
        {
            "faulty": (after_onset("faulty", faulty), 1.0, 0.0),
            "reference": (after_onset("reference", reference), 0.0, 1.0),
        },
        offset=0.0,
        threshold=threshold,
        confidence=confidence,
        paired=paired,
        saturated=saturated,
        identical=identical,
    )
