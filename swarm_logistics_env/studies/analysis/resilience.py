"""Faults that begin during a run: what is delivered afterwards, and when the rate is back."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import spi, streams
from swarm_logistics_env.spi.estimate import Estimate
from swarm_logistics_env.spi.self_repair import SelfRepair
from swarm_logistics_env.spi.summaries import Interval
from swarm_logistics_env.studies.analysis.runs import outcomes_of
from swarm_logistics_env.studies.comparisons import Arm, Comparison
from swarm_logistics_env.studies.judgement import Findings

_LONGEST_WINDOW = 100.0  # s
_STEP = 5.0  # s, between the points of a curve

Times = tuple[NDArray[np.float64], ...]


@dataclass(frozen=True)
class Resilience:
    """What one fault in mid-run does.

    Attributes:
        comparison: FT's: no fault, the robots removed at the onset, the fault.
        against_removed: deliveries after the onset over those with the robots removed: FT local
            in time, above 1; None: undefined.
        against_whole: over those of the whole swarm: R local in time, above 1 - m/N.
        repair: self-repair time against the swarm with the robots removed; None: `problem` says
            why.
    """

    comparison: Comparison
    against_removed: Estimate | None
    against_whole: Estimate | None
    repair: SelfRepair | None
    problem: str | None


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


def resiliences(findings: Findings) -> Iterator[Resilience]:
    """Yield what is known of every fault that begins during the run and has its runs."""
    for comparison in mid_run_faults(findings):
        assert comparison.removed is not None
        m, n = comparison.changed.level.value, comparison.original.condition.scenario.n_robots
        faulty, removed, whole = (
            _times(findings, arm)
            for arm in (comparison.changed, comparison.removed, comparison.original)
        )
        if faulty is None or removed is None or whole is None:
            continue
        onset = comparison.changed.level.onset
        repair, problem = _self_repair(findings, comparison, faulty, removed)
        yield Resilience(
            comparison,
            _index(faulty, removed, onset, 1.0),
            _index(faulty, whole, onset, 1.0 - m / n),
            repair,
            problem,
        )


def mid_run_faults(findings: Findings) -> Iterator[Comparison]:
    """Yield FT's comparison of every fault that begins during the run."""
    for comparison in findings.plan.comparisons:
        if comparison.removed is not None and comparison.changed.level.onset > 0:
            yield comparison


def window_of(comparison: Comparison) -> float:
    """Return the trailing window [s]: 100, or a third of what is left after the onset."""
    left = comparison.original.condition.scenario.duration - comparison.changed.level.onset
    return min(_LONGEST_WINDOW, left / 3)


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
        if (times := _times(findings, arm)) is not None:
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


def _times(findings: Findings, arm: Arm) -> Times | None:
    outcomes = outcomes_of(findings, arm)
    return None if outcomes is None else tuple(outcome.delivery_times for outcome in outcomes)


def _index(faulty: Times, reference: Times, onset: float, threshold: float) -> Estimate | None:
    try:
        return spi.resilience_index(faulty, reference, onset=onset, threshold=threshold)
    except spi.IndicatorError:  # nothing is delivered after the onset in the reference
        return None


def _self_repair(
    findings: Findings, comparison: Comparison, faulty: Times, removed: Times
) -> tuple[SelfRepair | None, str | None]:
    twins = next(
        (
            twins
            for twins in findings.plan.twins
            if (twins.policy, twins.table) == (comparison.policy, comparison.table)
        ),
        None,
    )
    null = (
        None if twins is None else (_times(findings, twins.original), _times(findings, twins.other))
    )
    if null is None or null[0] is None or null[1] is None:
        return None, "the runs of the no-fault null are missing"
    arms = comparison.arms
    if any(outcome.all_delivered for arm in arms for outcome in outcomes_of(findings, arm) or ()):
        return None, "the items ran out, and the rate with them: use restock"
    try:
        return spi.self_repair(
            faulty,
            removed,
            (null[0], null[1]),
            onset=comparison.changed.level.onset,
            end=comparison.original.condition.scenario.duration,
            generator=streams.generator(0, "self-repair"),
            window=window_of(comparison),
        ), None
    except spi.IndicatorError as error:
        return None, str(error)
