"""P of one condition: its runs, their mean, and what limits it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.spi import Interval
from swarm_logistics_env.study import Study
from swarm_logistics_env.study.tasks.outcome import Outcome
from swarm_logistics_env.study.verdicts.cell import Cell
from swarm_logistics_env.study.verdicts.reference import PAPER
from tests.made_up import delivered

PLAN = Study(policies=["homing"], seeds=4, scenario={"n_items": 10}, sizes=[{"values": [5, 25]}])
ARM = PLAN.plan().cells[0][2]
FAILED = Outcome(error="Traceback")


def cell_of(*outcomes: Outcome | None, **options: Any) -> Cell:
    return Cell.of("homing", "Sizes", ARM, outcomes, **options)


@pytest.mark.parametrize(
    ("outcomes", "paired", "n_seeds", "problem"),
    [
        ([delivered(1), delivered(2)], True, 2, None),
        ([delivered(1), FAILED, FAILED], True, 1, "2 of 3 runs failed"),
        ([delivered(1), None, FAILED], True, 1, "1 of 3 runs failed, 1 of 3 runs missing"),
        ([delivered(1), None, FAILED], False, 1, "1 of 3 runs failed"),
        ([delivered(1), None], False, 1, None),
        ([None, None], False, 0, "2 of 2 runs missing"),
    ],
)
def test_a_cell_says_which_runs_it_lacks(
    outcomes: list[Outcome | None], paired: bool, n_seeds: int, problem: str | None
) -> None:
    cell = cell_of(*outcomes, paired=paired)
    assert (cell.n_seeds, cell.problem) == (n_seeds, problem)
    assert (cell.published, cell.counted, cell.published_inside) == (None, False, None)


def test_a_cell_without_runs_tells_nothing() -> None:
    cell = cell_of(None)
    for interval in (cell.mean, cell.one_run, cell.contacts):
        assert np.isnan(interval.value)
        assert interval[1:] == (None, None)
    assert (cell.stalled, cell.saturated, cell.fast_contacts) == (0.0, False, None)
    assert (cell.phases.p_value, cell.phases.boundary) == (1.0, None)
    assert cell.mean_of("delivered") is None


def test_means_and_intervals_are_those_of_the_runs_up_to_the_most_items() -> None:
    p = [2, 6, 7, 9]
    cell = cell_of(*map(delivered, p))
    assert cell.by_seed.tolist() == p
    mean = spi.mean_interval(p)
    one_run = spi.prediction_interval(p)
    assert mean.high is not None
    assert one_run.high is not None
    assert mean.high < 14.0 < one_run.high
    assert cell.mean == mean._replace(high=10.0)
    assert cell.one_run == one_run._replace(high=10.0)
    assert cell_of(*map(delivered, [2, 2, 3, 3])).mean == spi.mean_interval([2, 2, 3, 3])
    assert cell_of(delivered(4)).mean == Interval(4.0, None, None)
    assert cell.words == "N = 5"
    assert not cell.saturated
    assert cell_of(delivered(10, all_delivered=True), delivered(3)).saturated
    # Less than a quarter of the median 6.5.
    assert [cell_of(*map(delivered, [low, 6, 7, 9])).stalled for low in (1, 2)] == [0.25, 0.0]


def test_the_mean_of_stopped_trials_may_be_as_low_as_what_they_delivered_at_least() -> None:
    cell = cell_of(delivered(6), delivered(7, least=1), delivered(8, least=0))
    assert cell.has_stopped
    assert cell.least_by_seed.tolist() == [6.0, 1.0, 0.0]
    whole = cell_of(*map(delivered, (6, 7, 8)))
    assert not whole.has_stopped
    assert cell.mean[::2] == whole.mean[::2]
    assert cell.mean.low == spi.mean_interval([6.0, 1.0, 0.0]).low


def test_contacts_are_told_where_each_run_counted_them() -> None:
    def run(rate: float | None, fast: float | None = None) -> Outcome:
        return delivered(5, contacts_per_robot_minute=rate, fast_contacts=fast)

    cell = cell_of(run(1.0, 0.5), run(3.0, 0.1), run(0.0))
    assert cell.contacts == spi.mean_interval([1.0, 3.0, 0.0])
    assert cell.fast_contacts == pytest.approx((1.0 * 0.5 + 3.0 * 0.1) / 4.0)
    assert cell.mean_of("contacts_per_robot_minute") == pytest.approx(4.0 / 3.0)
    for uncounted in (cell_of(run(1.0, 0.5), run(None)), cell_of(run(0.0), run(0.0))):
        assert uncounted.fast_contacts is None
    assert np.isnan(cell_of(run(1.0), run(None)).contacts.value)
    assert cell_of(run(1.0), run(None)).mean_of("contacts_per_robot_minute") is None


def test_a_published_p_lies_inside_the_interval_of_one_run_or_not() -> None:
    arm = Study.preset("paper", seeds=4).plan().cells[0][2]
    cell = Cell.of("swarm-dt", "", arm, [delivered(n) for n in (6, 8, 10)], reference=PAPER)
    assert (cell.published, cell.counted) == (PAPER.performance[arm.setting], True)
    _, low, high = cell.one_run
    assert low is not None
    assert high is not None
    inside = [
        replace(cell, published=p).published_inside for p in (low - 0.1, low, 8.0, high, high + 0.1)
    ]
    assert inside == [False, True, True, True, False]
    assert replace(cell, outcomes=cell.outcomes[:1]).published_inside is None
