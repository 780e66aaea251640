"""Faults that begin during a run: delivery rates, resilience and self-repair."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import spi, streams
from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.spi.estimate import Estimate
from swarm_logistics_env.spi.self_repair import SelfRepair
from swarm_logistics_env.spi.summaries import Interval
from swarm_logistics_env.spi.survival import SurvivalCurve
from swarm_logistics_env.studies.comparisons import Comparison
from swarm_logistics_env.studies.results import StudyResults, Times

Pair = tuple[Times, Times]


@dataclass(frozen=True)
class Resilience:
    """The measures of one fault that begins during the run.

    Attributes:
        comparison: FT's: no fault, the robots removed at the onset, the fault; R's where there are
            no runs with the robots removed.
        against_removed: deliveries after the onset over those with the robots removed: FT local
            in time, above 1; None: undefined.
        against_whole: over those of the whole swarm: R local in time, above 1 - m/N.
        repair: self-repair time against the swarm with the robots removed; None: `problem` says
            why.
        single: the same run by run, of the fault and of its null; None as `repair`.
    """

    comparison: Comparison
    against_removed: Estimate | None
    against_whole: Estimate | None
    repair: SelfRepair | None
    single: SingleRepairs | None
    problem: str | None


@dataclass(frozen=True)
class RepairCurve:
    """Kaplan and Meier's curve of the self-repair times of single runs.

    Attributes:
        label: which runs.
        curve: share of runs that are not back yet.
        followed: until when the runs were watched, from the onset [s].
        censored: how many were not back by then; runs: of how many.
    """

    label: str
    curve: SurvivalCurve
    followed: float
    censored: int
    runs: int


class SingleRepairs(NamedTuple):
    """Self-repair run by run: with the fault, and of the pair without."""

    fault: RepairCurve
    null: RepairCurve


def resiliences(results: StudyResults) -> Iterator[Resilience]:
    """Yield what is known of every fault that begins during the run and has its runs."""
    for comparison in mid_run_faults(results):
        m, n = comparison.changed.setting.value, comparison.original.condition.size
        faulty, whole = map(results.times_of, (comparison.changed, comparison.original))
        removed = results.times_of(comparison.removed) if comparison.removed else None
        if faulty is None or whole is None or (comparison.removed and removed is None):
            continue
        onset = comparison.changed.setting.onset
        repair: SelfRepair | None = None
        single: SingleRepairs | None = None
        problem: str | None = None
        try:
            if removed is None:
                raise StudyError("no runs with the robots removed are there to compare with")
            repair, single = _self_repair(comparison, (faulty, removed), _null(results, comparison))
        except (StudyError, spi.IndicatorError) as error:
            problem = str(error)
        yield Resilience(
            comparison,
            None if removed is None else _index(results, faulty, removed, onset, 1.0),
            _index(results, faulty, whole, onset, 1.0 - m / n),
            repair,
            single,
            problem,
        )


def mid_run_faults(results: StudyResults) -> Iterator[Comparison]:
    """Yield one comparison of every fault that begins during the run: FT's, or else R's."""
    late = [c for c in results.plan.comparisons if c.changed.setting.onset > 0]
    with_removed = {(c.policy, c.table, c.changed) for c in late if c.removed}
    for comparison in late:
        key = comparison.policy, comparison.table, comparison.changed
        if comparison.removed is not None or key not in with_removed:
            yield comparison


def _index(
    results: StudyResults, faulty: Times, reference: Times, onset: float, threshold: float
) -> Estimate | None:
    paired = results.plan.paired
    try:
        return spi.resilience_index(
            faulty, reference, onset=onset, threshold=threshold, paired=paired
        )
    except spi.IndicatorError:  # nothing is delivered after the onset in the reference
        return None


def _null(results: StudyResults, comparison: Comparison) -> Pair:
    """Return the pair without fault.

    Raises:
        StudyError: why there can be no self-repair time.
    """
    null_pair = next(
        (
            null_pair
            for null_pair in results.plan.null_pairs
            if (null_pair.policy, null_pair.table) == (comparison.policy, comparison.table)
        ),
        None,
    )
    missing = StudyError("the runs of the no-fault null are missing")
    if null_pair is None:
        raise missing
    original, other = results.times_of(null_pair.original), results.times_of(null_pair.other)
    if original is None or other is None:
        raise missing
    arms = (*comparison.arms, null_pair.other)
    if any(outcome.all_delivered for arm in arms for outcome in results.outcomes_of(arm) or ()):
        raise StudyError("the items ran out, and the rate with them: use restock")
    return original, other


def _self_repair(
    comparison: Comparison, pair: Pair, null: Pair
) -> tuple[SelfRepair, SingleRepairs]:
    onset = comparison.changed.setting.onset
    end = comparison.original.condition.duration
    generator = streams.generator(0, "self-repair")
    pooled = spi.self_repair(*pair, null, onset=onset, end=end, generator=generator)
    times = [spi.repair_times(*runs, onset=onset, end=end) for runs in (pair, null)]
    fault, without = (
        RepairCurve(
            label,
            spi.kaplan_meier(seconds, back),
            pooled.followed,
            int(np.count_nonzero(~back)),
            back.size,
        )
        for label, (seconds, back) in zip(("fault", "no fault"), times)
    )
    return pooled, SingleRepairs(fault, without)


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
    left = comparison.original.condition.duration - comparison.changed.setting.onset
    return min(_LONGEST_WINDOW, float(round(left / 3)) or left / 3)


def rate_curves(results: StudyResults, comparison: Comparison) -> tuple[RateCurve, ...]:
    """Return the delivery rates without fault, with the robots removed, and with the fault."""
    arms = {
        "no fault": comparison.original,
        "removed": comparison.removed,
        "fault": comparison.changed,
    }
    window = window_of(comparison)
    end = comparison.original.condition.duration
    seconds = np.arange(window, end + _STEP / 2, min(_STEP, window / 10)).round(6)
    curves = []
    for label, arm in arms.items():
        if arm is not None and (times := results.times_of(arm)) is not None:
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
