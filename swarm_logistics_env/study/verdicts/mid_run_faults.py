"""Faults in mid-run, which the paper does not define: what they cost, and how fast it is back."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from more_itertools import map_reduce
from numpy.typing import NDArray

from swarm_logistics_env import spi
from swarm_logistics_env.spi.inputs import Numbers
from swarm_logistics_env.study.questions.comparison import CONFIDENCE, Arm, Comparison
from swarm_logistics_env.study.questions.plan import CellKey
from swarm_logistics_env.study.tasks.outcome import Outcome

from .cell import same_runs
from .results import StudyResults

TimesBySeed = tuple[Numbers, ...]


class RepairCurve(NamedTuple):
    """Kaplan and Meier's curve of the times after which single runs are back.

    Attributes:
        curve: share of runs that are not back yet.
        back: which runs came back by the end, (n_runs,).
    """

    curve: spi.SurvivalCurve
    back: NDArray[np.bool_]


class RateCurve(NamedTuple):
    """Deliveries over time of one kind of runs.

    Attributes:
        runs: "no fault", "removed" or "fault".
        seconds: ends of the trailing window [s], shape (k,).
        deliveries: in the window, mean over seeds [items], shape (k,).
        low, high: limits of its pointwise t-interval at `CONFIDENCE`, shape (k,); NaN at one seed.
    """

    runs: str
    seconds: Numbers
    deliveries: Numbers
    low: Numbers
    high: Numbers


RUNS_ARE_MISSING = "runs are missing"


class Resilience(NamedTuple):
    """The measures of one fault that begins during the run.

    Attributes:
        compared: FT's comparison: no fault, the robots removed at the onset, the fault; R's where
            there are no runs with the robots removed.
        curves: deliveries over time in each of its conditions that has its runs.
        against_removed: deliveries after the onset over those with the robots removed: FT local
            in time, above 1; None: undefined.
        against_whole: over those of the whole swarm: R local in time, above 1 - m/N.
        single: times to come back to what the runs with the robots removed deliver, of the fault
            and of its null pair; empty: `problem` says why.
    """

    compared: Comparison
    curves: tuple[RateCurve, ...]
    against_removed: spi.Estimate | None = None
    against_whole: spi.Estimate | None = None
    single: tuple[RepairCurve, ...] = ()
    problem: str | None = None


def resiliences(results: StudyResults) -> Iterator[Resilience]:
    """Yield what is known of every fault that begins during the run."""
    for comparison in _mid_run_faults(results):
        curves = rate_curves(results, comparison)
        if all(results.timed_outcomes[arm] for arm in comparison.arms):
            yield _resilience(results, comparison, curves)
        else:
            yield Resilience(comparison, curves, problem=RUNS_ARE_MISSING)


def _resilience(
    results: StudyResults, comparison: Comparison, curves: tuple[RateCurve, ...]
) -> Resilience:
    original = comparison.original
    removed = comparison.removed
    faulty = comparison.changed
    null = results.plan.nulls.get((comparison.table, original))
    single: tuple[RepairCurve, ...] = ()
    problem = None
    if removed is None:
        problem = "no runs with the robots removed are there to compare with"
    elif not results.plan.paired:
        problem = "the runs name no seeds, and each is compared with that of its seed"
    elif null is None or not results.timed_outcomes[null]:
        problem = "the runs of the no-fault null are missing"
    elif any(
        run.all_delivered for arm in (*comparison.arms, null) for run in results.timed_outcomes[arm]
    ):
        problem = "the items ran out, and the rate with them: use restock"
    else:
        try:
            single = tuple(
                _repair_curve(
                    comparison,
                    _times(results.timed_outcomes[arm]),
                    _times(results.timed_outcomes[reference]),
                )
                for arm, reference in ((faulty, removed), (original, null))
            )
        except spi.IndicatorError as error:
            problem = str(error)
    share = faulty.setting.value / comparison.n_robots
    references = (removed, 1.0), (original, 1.0 - share)
    against_removed, against_whole = (
        _index(results, faulty, reference, threshold) if reference else None
        for reference, threshold in references
    )
    return Resilience(comparison, curves, against_removed, against_whole, single, problem)


def _mid_run_faults(results: StudyResults) -> list[Comparison]:
    """Return a comparison for every fault in mid-run: FT's, or else R's."""
    late = [verdict.compared for verdict in results.verdicts if verdict.after.onset > 0]
    by_fault: dict[CellKey, list[Comparison]] = map_reduce(
        late, lambda comparison: (comparison.policy, comparison.table, comparison.changed)
    )
    return [
        next(
            (comparison for comparison in comparisons if comparison.removed is not None),
            comparisons[0],
        )
        for comparisons in by_fault.values()
    ]


def _index(
    results: StudyResults, faulty: Arm, reference: Arm, threshold: float
) -> spi.Estimate | None:
    runs = {
        "faulty": results.timed_outcomes[faulty],
        "reference": results.timed_outcomes[reference],
    }
    try:
        return spi.resilience_index(
            *map(_times, runs.values()),
            onset=faulty.setting.onset,
            threshold=threshold,
            paired=results.plan.paired,
            saturated=[
                name
                for name, outcomes in runs.items()
                if any(outcome.all_delivered for outcome in outcomes)
            ],
            identical=same_runs(*runs.values()),
        )
    except spi.IndicatorError:  # nothing is delivered after the onset in the reference
        return None


def _times(outcomes: Sequence[Outcome]) -> TimesBySeed:
    """Return the delivery times [s], seed by seed."""
    return tuple(outcome.delivery_times for outcome in outcomes)


def _repair_curve(
    comparison: Comparison, times: TimesBySeed, reference: TimesBySeed
) -> RepairCurve:
    onset = comparison.changed.setting.onset
    end = comparison.original.case.scenario.duration
    window = window_of(comparison)
    seconds, back = spi.repair_times(times, reference, onset=onset, end=end, window=window)
    return RepairCurve(spi.kaplan_meier(seconds, back), back)


_LONGEST_WINDOW = 100.0  # s
_STEP = 5.0  # s, between the points of a curve


def window_of(comparison: Comparison) -> float:
    """Return the trailing window [s]: 100, or a third of what is left after the onset, rounded."""
    left = comparison.original.case.scenario.duration - comparison.changed.setting.onset
    return min(_LONGEST_WINDOW, float(round(left / 3)) or left / 3)


def rate_curves(results: StudyResults, comparison: Comparison) -> tuple[RateCurve, ...]:
    """Return the delivery rates without fault, with the robots removed, and with the fault."""
    window = window_of(comparison)
    end = comparison.original.case.scenario.duration
    step = min(_STEP, window / 10)
    n_steps = math.floor((end - window) / step + 1e-9)
    seconds = (window + step * np.arange(n_steps + 1, dtype=np.float64)).round(6)
    original = comparison.original
    removed = comparison.removed
    faulty = comparison.changed
    arms = {"no fault": original, "removed": removed, "fault": faulty}
    curves = []
    for runs, arm in arms.items():
        times = _times(results.timed_outcomes[arm]) if arm else ()
        if times:
            ends = [
                np.searchsorted(run_times, [seconds - window, seconds], "right")
                for run_times in times
            ]
            counts = np.diff(ends, axis=1)[:, 0]
            limits = np.array([spi.mean_interval(n, CONFIDENCE) for n in counts.T], np.float64)
            curves.append(RateCurve(runs, seconds, *limits.T))
    return tuple(curves)
