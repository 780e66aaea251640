"""How long a swarm takes to repair itself, beside what the same measure makes of no fault."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .errors import IndicatorError
from .inputs import between_0_and_1, delivery_times

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import ArrayLike, NDArray

# Pooled curves scatter: asked for the whole reference, no swarm would ever be repaired. Of 20 seeds
# of 0.08 deliveries/s over 1333 s, simulated: the null's limit is about 230 s, a loss of a quarter
# that lasts is always seen as such, an outage to 40 % for 500 s in seven studies of eight. A share
# of 0.8 brings the limit to 0 s, but calls the lasting loss repaired in half of the studies.
RECOVERED = 0.9
_STEP = 1.0  # s, grid on which the rates are compared


@dataclass(frozen=True, slots=True)
class SelfRepair:
    """Self-repair time over seeds, beside what the same statistic makes of no fault at all.

    Attributes:
        seconds: From the onset until the rate is back [s]; None: censored, it was not back with a
            whole window left to show it.
        low: Lower limit of the bootstrap interval over seeds [s]; inf: resamples never recover.
        high: Upper limit [s]; inf where the interval reaches into censoring.
        followed: Longest self-repair time that the runs could have shown [s].
        null_seconds: The same statistic of the pair without faults [s]; None: censored.
        null_limit: 95 % quantile of the null over resampled seeds [s]; inf where censored.
        distinguishable: Whether the time exceeds `null_limit`; where not, it measures noise.
    """

    seconds: float | None
    low: float
    high: float
    followed: float
    null_seconds: float | None
    null_limit: float
    distinguishable: bool

    @property
    def censored(self) -> bool:
        """Whether the rate never came back within the runs."""
        return self.seconds is None


def self_repair(
    faulty: Sequence[ArrayLike],
    reference: Sequence[ArrayLike],
    null_pair: tuple[Sequence[ArrayLike], Sequence[ArrayLike]],
    *,
    onset: float,
    end: float,
    generator: np.random.Generator,
    window: float = 100.0,
    level: float = 0.95,
    resamples: int = 2_000,
) -> SelfRepair:
    """Self-repair time of delivery rates pooled over seeds, against the paired reference.

    The time after the onset that parts what is behind from what is back: from it on, the rate in
    the trailing window averages at least `RECOVERED` times the reference's over every stretch; up
    to it, less over every stretch that ends there. It is where the running sum of the difference
    has its minimum, the estimate of a change point (Page 1954), so neither a fault whose loss
    begins late nor a dip of chance decides alone; 0 where nothing is lost. The trailing window
    delays every recovery by up to its own length, in the null as well.

    Args:
        faulty: Delivery times [s] of each seed's run with faults.
        reference: Delivery times [s] of the same seeds' reference runs.
        null_pair: Two sets of runs without faults, of shared seeds but for the behaviour.
        onset: When the faults begin [s].
        end: When all runs end [s]; they must not run out of items before.
        generator: Only source of randomness: resamples whole seeds.
        window: Length of the trailing window [s].
        level: Confidence level of the bootstrap interval, in (0, 1).
        resamples: Number of resamples.

    Raises:
        IndicatorError: Unequal numbers of seeds within a pair, no seeds, no window's time between
            onset + window and end, or no delivery at all in a reference.
    """
    between_0_and_1("level", level)
    followed = _followed(onset, end, window)

    def observed_and_resampled(
        runs: Sequence[ArrayLike], others: Sequence[ArrayLike], names: tuple[str, str]
    ) -> tuple[float, NDArray[np.float64]]:
        behind = _behind({names[0]: runs, names[1]: others}, onset, end, window)
        n = len(behind)
        drawn = generator.integers(n, size=(resamples, n))
        times_drawn = (drawn[:, :, np.newaxis] == np.arange(n)).sum(axis=1)
        observed = float(_back_after(behind.sum(axis=0)[np.newaxis], followed)[0])
        return observed, _back_after(times_drawn @ behind, followed)

    repair, resampled = observed_and_resampled(faulty, reference, ("faulty", "reference"))
    null, null_resampled = observed_and_resampled(*null_pair, ("null_pair[0]", "null_pair[1]"))
    tail = (1.0 - level) / 2
    low, high = _quantiles(resampled, tail, 1.0 - tail)
    (null_limit,) = _quantiles(null_resampled, 0.95)
    return SelfRepair(
        seconds=None if math.isinf(repair) else repair,
        low=low,
        high=high,
        followed=followed,
        null_seconds=None if math.isinf(null) else null,
        null_limit=null_limit,
        distinguishable=repair > null_limit,
    )


def repair_times(
    faulty: Sequence[ArrayLike],
    reference: Sequence[ArrayLike],
    *,
    onset: float,
    end: float,
    window: float = 100.0,
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Self-repair time of every seed's own run, for `kaplan_meier`; see `self_repair`.

    A single run's rate scatters: most of such a time is noise, and it says little without the same
    of a pair without faults beside it.

    Args:
        faulty: Delivery times [s] of each seed's run with faults.
        reference: Delivery times [s] of the same seeds' reference runs.
        onset: When the faults begin [s].
        end: When all runs end [s]; they must not run out of items before.
        window: Length of the trailing window [s].

    Returns:
        Seconds from the onset and whether the rate came back, shapes (n_seeds,); where it did not,
        the longest time that the run could have shown.

    Raises:
        IndicatorError: As for `self_repair`.
    """
    followed = _followed(onset, end, window)
    behind = _behind({"faulty": faulty, "reference": reference}, onset, end, window)
    seconds = _back_after(behind, followed)
    back = np.isfinite(seconds)
    return np.where(back, seconds, followed), back


def _followed(onset: float, end: float, window: float) -> float:
    """Longest self-repair time that runs can show [s]: a window has to fit in behind it."""
    if not (window > 0.0 and onset >= 0.0 and onset + window < end < math.inf):
        raise IndicatorError(
            f"onset = {onset}, window = {window}, end = {end}: should leave more than one window "
            "between onset and end"
        )
    return (_grid(onset, end).size - 1 - math.ceil(window / _STEP)) * _STEP


def _grid(onset: float, end: float) -> NDArray[np.float64]:
    return np.arange(onset, end + _STEP / 2, _STEP)


def _behind(
    pair: Mapping[str, Sequence[ArrayLike]], onset: float, end: float, window: float
) -> NDArray[np.float64]:
    """Deliveries in the window less the share of the reference's that counts as back.

    Args:
        pair: Name and runs of the led, then of the reference.

    Returns:
        One row per seed on the grid from onset to end, shape (seeds, points); below 0: not back.
    """
    grid = _grid(onset, end)
    lead, other = (_windowed(name, runs, grid, window, end) for name, runs in pair.items())
    if len(lead) != len(other):
        counts = ", ".join(f"{name} has {len(runs)}" for name, runs in pair.items())
        raise IndicatorError(
            f"unequal seed sets ({counts}): should be the same seeds in the same order"
        )
    if not other.any():
        raise IndicatorError(f"{list(pair)[1]}: should deliver something after the onset")
    return lead - RECOVERED * other


def _windowed(
    name: str, runs: Sequence[ArrayLike], grid: NDArray[np.float64], window: float, end: float
) -> NDArray[np.float64]:
    """Deliveries in the window that trails each point of the grid, shape (seeds, points)."""
    rows = []
    for seed, times in enumerate(delivery_times(name, runs)):
        if times.size and times[-1] > end:
            raise IndicatorError(
                f"{name}[{seed}] delivers at {times[-1]:g} s: should not be after end = {end:g} s"
            )
        until = np.searchsorted(times, grid, side="right")
        rows.append(until - np.searchsorted(times, grid - window, side="right"))
    return np.array(rows, dtype=np.float64)


def _back_after(behind: NDArray[np.float64], followed: float) -> NDArray[np.float64]:
    """Seconds to the minimum of each row's running sum, rows of (rows, points); inf: censored."""
    total = np.cumsum(behind, axis=1)
    start = np.zeros((len(total), 1))
    # Rounded: of equal sums the first counts, and rounding is no difference.
    seconds = np.concatenate([start, total], axis=1).round(6).argmin(axis=1) * _STEP
    return np.where(seconds > followed, np.inf, seconds)


def _quantiles(seconds: NDArray[np.float64], *shares: float) -> list[float]:
    # method: no average of a time and an infinite (censored) one
    return [float(q) for q in np.quantile(seconds, shares, method="inverted_cdf")]
