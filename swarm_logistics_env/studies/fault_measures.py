"""Measures of faults besides P: fault budget, anchoring load, and what a fault in mid-run does."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import compress
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from swarm_logistics_env import spi
from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.spi import FaultBudget
from swarm_logistics_env.spi.estimate import Estimate, Verdict
from swarm_logistics_env.spi.resilience import SurvivalCurve
from swarm_logistics_env.spi.summaries import Interval
from swarm_logistics_env.tasks.task import Outcome

from .comparisons import Comparison
from .indicator_table import Finding, findings_of
from .judged_comparisons import same_runs
from .results import StudyResults, Times

if TYPE_CHECKING:
    import pandas as pd

Pair = tuple[Times, Times]
Outcomes = tuple[Outcome, ...]


class RepairCurve(NamedTuple):
    """Kaplan and Meier's curve of the times after which single runs are back.

    Attributes:
        runs: which runs: "fault", or "no fault" for the null pair.
        curve: share of runs that are not back yet.
        followed: until when the runs were watched, from the onset [s].
        censored: how many were not back by then.
        total: of how many.
    """

    runs: str
    curve: SurvivalCurve
    followed: float
    censored: int
    total: int


@dataclass(frozen=True)
class Resilience:
    """The measures of one fault that begins during the run.

    Attributes:
        compared: FT's comparison: no fault, the robots removed at the onset, the fault; R's where
            there are no runs with the robots removed.
        against_removed: deliveries after the onset over those with the robots removed: FT local
            in time, above 1; None: undefined.
        against_whole: over those of the whole swarm: R local in time, above 1 - m/N.
        single: times to come back to what the runs with the robots removed deliver, of the fault
            and of its null pair; empty: `problem` says why.
    """

    compared: Comparison
    against_removed: Estimate | None
    against_whole: Estimate | None
    single: tuple[RepairCurve, ...] = ()
    problem: str | None = None


def resiliences(results: StudyResults) -> Iterator[Resilience]:
    """Yield what is known of every fault that begins during the run and has its runs."""
    for comparison in mid_run_faults(results)["compared"]:
        m, n = comparison.changed.setting.value, comparison.original.condition.size
        faulty, whole = map(results.outcomes_of, (comparison.changed, comparison.original))
        removed = results.outcomes_of(comparison.removed) if comparison.removed else None
        if faulty is None or whole is None or (comparison.removed and removed is None):
            continue
        onset, paired = comparison.changed.setting.onset, results.plan.paired
        indices = (
            _index(faulty, removed, onset, 1.0, paired=paired) if removed else None,
            _index(faulty, whole, onset, 1.0 - m / n, paired=paired),
        )
        try:
            if removed is None:
                raise StudyError("no runs with the robots removed are there to compare with")
            null = _null(results, comparison)
            single = _repair_curves(comparison, (_times(faulty), _times(removed)), null)
        except (StudyError, spi.IndicatorError) as error:
            yield Resilience(comparison, *indices, problem=str(error))
        else:
            yield Resilience(comparison, *indices, single)


def mid_run_faults(results: StudyResults) -> pd.DataFrame:
    """Return a row of the indicators for every fault in mid-run: FT's, or else R's."""
    late = results.indicators[results.indicators["onset"] > 0]
    compares = late["compared"].map(lambda compared: compared.removed is not None)
    fault = [(one.policy, one.table, one.changed) for one in late["compared"]]
    with_removed = set(compress(fault, compares))
    kept = [has or one not in with_removed for has, one in zip(compares, fault)]
    return late[np.array(kept, dtype=np.bool_)]


def _times(runs: Outcomes) -> Times:
    return tuple(run.delivery_times for run in runs)


def _index(
    faulty: Outcomes, reference: Outcomes, onset: float, threshold: float, *, paired: bool
) -> Estimate | None:
    named = {"faulty": faulty, "reference": reference}
    try:
        return spi.resilience_index(
            _times(faulty),
            _times(reference),
            onset=onset,
            threshold=threshold,
            paired=paired,
            saturated=[name for name, runs in named.items() if any(r.all_delivered for r in runs)],
            identical=same_runs([r.digest for r in faulty], [r.digest for r in reference]),
        )
    except spi.IndicatorError:  # nothing is delivered after the onset in the reference
        return None


def _null(results: StudyResults, comparison: Comparison) -> Pair:
    """Return the pair without fault.

    Raises:
        StudyError: why there can be no times to come back.
    """
    null = results.plan.nulls.get((comparison.policy, comparison.table))
    original = results.times_of(comparison.original)
    other = results.times_of(null) if null else None
    if null is None or original is None or other is None:
        raise StudyError("the runs of the no-fault null are missing")
    arms = (*comparison.arms, null)
    if any(outcome.all_delivered for arm in arms for outcome in results.outcomes_of(arm) or ()):
        raise StudyError("the items ran out, and the rate with them: use restock")
    return original, other


def _repair_curves(comparison: Comparison, pair: Pair, null: Pair) -> tuple[RepairCurve, ...]:
    onset = comparison.changed.setting.onset
    end = comparison.original.condition.duration
    curves = []
    for runs, times in (("fault", pair), ("no fault", null)):
        window = window_of(comparison)
        seconds, back = spi.repair_times(*times, onset=onset, end=end, window=window)
        curve = spi.kaplan_meier(seconds, back)
        censored = int(np.count_nonzero(~back))
        curves.append(RepairCurve(runs, curve, end - onset - window, censored, back.size))
    return tuple(curves)


_LONGEST_WINDOW = 100.0  # s
_STEP = 5.0  # s, between the points of a curve


def window_of(comparison: Comparison) -> float:
    """Return the trailing window [s]: 100, or a third of what is left after the onset, rounded."""
    left = comparison.original.condition.duration - comparison.changed.setting.onset
    return min(_LONGEST_WINDOW, float(round(left / 3)) or left / 3)


def rate_curves(results: StudyResults, comparison: Comparison) -> pd.DataFrame:
    """Return the delivery rates without fault, with the robots removed, and with the fault.

    Returns:
        A table with a row for each kind of `runs` and end of the trailing window, `seconds` [s]:
        `deliveries` in it, mean over seeds [items], between the limits `low` and `high` of its
        pointwise 95 % t-interval.
    """
    import pandas as pd

    window = window_of(comparison)
    end = comparison.original.condition.duration
    seconds = np.arange(window, end + _STEP / 2, min(_STEP, window / 10)).round(6)
    rows = []
    arms = {
        "no fault": comparison.original,
        "removed": comparison.removed,
        "fault": comparison.changed,
    }
    for runs, arm in arms.items():
        if arm is None:
            continue
        counts = np.array(
            [
                np.searchsorted(times, seconds, side="right")
                - np.searchsorted(times, seconds - window, side="right")
                for times in results.times_of(arm) or ()
            ]
        )
        rows += [
            (runs, second, *spi.mean_interval(column)) for second, column in zip(seconds, counts.T)
        ]
    frame = pd.DataFrame(rows, columns=["runs", "seconds", "deliveries", "low", "high"])
    return frame.astype({"low": float, "high": float})


class ModeBudget(NamedTuple):
    """How many robots may fail by one mode.

    Attributes:
        compared: the comparison of the smallest m.
        tested: the numbers m of faulty robots that were tested.
        budget: None: blocked.
        verdict: on the m which ended the search; None: none did, or it was not tested.
    """

    compared: Comparison
    tested: tuple[int, ...]
    budget: FaultBudget | None
    verdict: Verdict | None


class AnchoringLoad(NamedTuple):
    """Time that working robots spent in contact range of failed ones.

    In the paired run with the robots removed there is no failed robot, so it is 0.

    Attributes:
        compared: the comparison of the fault with the robots removed.
        load: mean over seeds with 95 % interval [robot-seconds a run].
        neighbours: the same per failed robot and second of failure: how many working robots stand
            by a failed one at any time.
    """

    compared: Comparison
    load: Interval
    neighbours: Interval


def fault_budgets(results: StudyResults) -> Iterator[ModeBudget]:
    """Yield the fault budget of every policy, failure mode and onset."""
    groups: dict[object, list[Finding]] = {}
    for test in findings_of(results.indicators):
        if test.indicator == "R":
            key = test.policy, test.table, test.factor, test.onset
            groups.setdefault(key, []).append(test)
    for tests in groups.values():
        estimates = {int(test.after): test.estimate for test in tests}
        known = {m: one for m, one in estimates.items() if one is not None}
        budget = spi.fault_budget(known) if len(known) == len(estimates) else None
        last = estimates.get(budget.limit) if budget and budget.limit else None
        verdict = last.answer if last else None
        yield ModeBudget(tests[0].compared, tuple(estimates), budget, verdict)


def anchoring_loads(results: StudyResults) -> Iterator[AnchoringLoad]:
    """Yield the anchoring load of every fault whose runs are complete and tell it."""
    for comparison in results.plan.comparisons:
        outcomes = results.outcomes_of(comparison.changed)
        # Nobody recorded how long robots stood by each other in trials from elsewhere.
        if comparison.removed is None or outcomes is None or results.plan.imported_from is not None:
            continue
        if any(outcome.anchoring_seconds is None for outcome in outcomes):
            continue  # the task does not tell
        (fault,) = comparison.changed.condition.faults
        if getattr(fault, "intermittent", None) is not None:
            continue  # how long each robot had failed is not recorded
        end = fault.onset + (fault.duration or math.inf)
        seconds = np.array([outcome.anchoring_seconds for outcome in outcomes], dtype=np.float64)
        lasted = np.array([max(0.0, min(o.ended_at, end) - fault.onset) for o in outcomes])
        failed = comparison.changed.setting.value * lasted
        shares = np.divide(seconds, failed, out=np.zeros_like(seconds), where=failed > 0)
        yield AnchoringLoad(comparison, spi.mean_interval(seconds), spi.mean_interval(shares))
