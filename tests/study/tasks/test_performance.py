"""A measure of orders or of deliveries as P: what it is, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env.core.errors import StudyError
from swarm_logistics_env.study.report.answer import answer
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.tasks.outcome import Outcome
from swarm_logistics_env.study.tasks.performance import MEASURES, Performance
from swarm_logistics_env.study.tasks.task_world import largest_performance
from tests.study.tasks.lane import LANE

FAULTS: dict[str, Any] = {"faults": [{"modes": ["FM1"], "robots": [2]}], "indicators": ["R"]}
ORDERS = {"preset": "orders", "duration": 60.0}
SERVED = Outcome(
    delivery_times=np.array([20.0, 70.0]),
    ended_at=100.0,
    on_time=2,
    share_on_time=0.5,
    mean_tardiness=15.0,
    p95_tardiness=45.0,
    longest_queue=8,
)


@pytest.mark.parametrize(
    ("text", "p"),
    [
        ("on_time", 2.0),
        ("share_on_time", 0.5),
        ("mean_tardiness:60", 0.75),
        ("p95_tardiness:60", 0.25),
        ("p95_tardiness:30", 0.0),  # later than the worst is as bad as the worst
        ("longest_queue:10", 0.2),
        ("longest_standstill:100", 0.5),
        ("stands_still", 0.0),
        ("p95_tardiness:1234567.5", 1.0 - 45.0 / 1234567.5),  # its text keeps every digit
    ],
)
def test_p_is_the_measure_or_how_far_it_is_from_its_worst_value(text: str, p: float) -> None:
    performance = Performance.of(text)
    assert isinstance(performance, Performance)
    assert str(performance) == text
    assert performance.of_run(SERVED) == pytest.approx(p)
    assert not performance.is_capped(SERVED)
    perfect = Outcome(
        delivery_times=np.array([99.9, 100.0]), ended_at=100.0, on_time=4, share_on_time=1.0,
        mean_tardiness=0.0, p95_tardiness=0.0, longest_queue=0,
    )  # fmt: skip
    is_capped = performance.measure != "longest_standstill"
    assert performance.is_capped(perfect) == is_capped
    p_of_perfect = {"on_time": 4.0, "longest_standstill": 0.001}.get(performance.measure, 1.0)
    assert performance.of_run(perfect) == pytest.approx(p_of_perfect)
    # Where no order was due none was late, and none on time.
    idle = Outcome(delivery_times=np.array([99.9]), ended_at=100.0)
    if MEASURES[performance.measure].needs:
        assert performance.of_run(idle) == (0.0 if text == "on_time" else 1.0)


LATE = "the time by which orders were late"
DUE = "orders that were served by their due time"


@pytest.mark.parametrize(
    ("text", "words", "counted", "largest"),
    [
        ("on_time", f"the number of {DUE}", "orders", None),
        ("share_on_time", f"the share of the {DUE}", "", 1.0),
        (
            "mean_tardiness:60",
            "1 - x / 60 s, at least 0; x is the mean time by which orders were late",
            "",
            1.0,
        ),
        (
            "p95_tardiness:2.5",
            f"1 - x / 2.5 s, at least 0; x is the 95th percentile of {LATE}",
            "",
            1,
        ),
        (
            "longest_queue:9",
            (
                "1 - x / 9 orders, at least 0; x is the largest number of orders that were open or "
                "waited"
            ),
            "",
            1.0,
        ),
        (
            "longest_standstill:9",
            "1 - x / 9 s, at least 0; x is the longest time without a delivery",
            "",
            1.0,
        ),
        (
            "stands_still",
            (
                "share of runs that do not stand still: 1 where something was delivered in the "
                "last fifth, or nothing was left, else 0"
            ),
            "",
            1.0,
        ),
    ],
)
def test_a_measure_tells_what_p_is_what_it_counts_and_how_large_it_can_be(
    text: str, words: str, counted: str, largest: float | None
) -> None:
    performance = Performance.of(text)
    assert isinstance(performance, Performance)
    assert Performance.of(performance) is performance
    assert (performance.words, performance.counted) == (words, counted)
    assert performance.largest == largest


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("ontime", "no measure 'ontime'; did you mean 'on_time'"),
        ("mean_tardiness", "which value counts as P = 0, e.g. 'mean_tardiness:60' [s]"),
        ("on_time:4", "has no worst value: should be 'on_time'"),
        ("longest_queue:0", "greater than 0"),
        ("share_on_time:1", "has no worst value: should be 'share_on_time'"),
        ("stands_still:1", "has no worst value: should be 'stands_still'"),
        ("longest_queue", "less of longest_queue is better: should say which value counts as P = "),
    ],
)
def test_a_measure_that_cannot_be_p_is_refused(text: str, words: str) -> None:
    with pytest.raises(StudyError) as caught:
        Study(performance=text)
    assert words in str(caught.value)
    assert "performance" in str(caught.value)


def test_a_condition_without_the_measure_is_refused_before_it_is_played() -> None:
    with pytest.raises(StudyError, match="'on_time': order_due = None: should be set"):
        Study(performance="on_time", **FAULTS).plan()
    with pytest.raises(StudyError, match="'longest_queue:9': orders = 'next': should be set"):
        Study(performance="longest_queue:9", **FAULTS).plan()
    # Without due times orders wait all the same.
    assert (
        Study(performance="longest_queue:9", scenario={"orders": "poisson"}, **FAULTS).plan().cases
    )
    listed = {"orders": "time,item/0,4/5,2", "order_due": 30.0}  # a file says itself what is due
    with pytest.raises(StudyError, match="no row of the file of orders has a due time"):
        Study(performance="p95_tardiness:60", scenario=listed, **FAULTS).plan()
    with pytest.raises(StudyError, match="should be of the warehouse's orders"):
        Study(
            performance="on_time", task=LANE, policies=["walker"], sizes=[{"values": [2, 4]}]
        ).plan()
    with pytest.raises(StudyError, match="tells when something was delivered"):
        Performance(measure="stands_still").of_run(Outcome(untimed=3.0))


@pytest.mark.unmeasured
def test_the_same_runs_are_judged_by_another_measure_which_is_exploratory(tmp_path: Path) -> None:
    asked = {"scenario": ORDERS, "policies": ["homing"], "seeds": 3, **FAULTS}
    study = Study(out=tmp_path, performance="on_time", **asked)
    assert study.run().played == 6
    results = study.findings()
    assert not results.exploratory
    for cell in results.cells:
        assert list(cell.by_seed) == [outcome.on_time for outcome in cell.outcomes]
        assert cell.mean.value > 1.0
    sentence = answer(results).head[0]
    assert sentence.startswith("homing: P (on_time) [95 %] = ")
    assert " orders in 60 s, N = 25, " in sentence
    other = Study(out=tmp_path, performance="share_on_time", **asked)
    assert other.run().played == 0
    results = other.findings()
    assert results.exploratory
    for cell in results.cells:
        assert list(cell.by_seed) == [outcome.share_on_time for outcome in cell.outcomes]
        assert cell.mean.high is not None
        assert cell.mean.high <= largest_performance(cell.arm.case) == 1.0
        assert cell.saturated == any(outcome.share_on_time == 1.0 for outcome in cell.outcomes)


def test_nothing_in_time_is_no_run_without_deliveries() -> None:
    study = Study(scenario=ORDERS, policies=["homing"], seeds=2, performance="on_time", **FAULTS)
    study.run()
    results = study.findings()
    outcomes = {key: replace(outcome, on_time=0) for key, outcome in results.outcomes.items()}
    cells = tuple(
        replace(cell, outcomes=tuple(replace(o, on_time=0) for o in cell.outcomes))
        for cell in results.cells
    )
    answer_of_none = answer(replace(results, outcomes=outcomes, cells=cells))
    assert "delivered anything" not in " ".join(answer_of_none.head)
