"""Faults in mid-run: windows, deliveries in them, and what is left of these after the onset."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.study import Study
from swarm_logistics_env.study.questions.comparison import Setting
from swarm_logistics_env.study.tasks.outcome import Outcome
from swarm_logistics_env.study.verdicts.mid_run_faults import Resilience, resiliences, window_of
from tests.made_up import judged

END = 400.0


def study(**fields: Any) -> Study:
    faults = [{"modes": ["dead"], "robots": [1], "onsets": [100.0]}]
    usual = {"scenario": {"duration": END, "n_robots": 4}, "faults": faults}
    return Study(**{"policies": ["homing"], "seeds": 3, **usual, **fields})


def play(_: str, setting: Setting, seed: int) -> Outcome:
    """Play a run whose steps between deliveries are longer by a second at each next seed."""
    step = {"dead": 5.0, "removed": 4.0}.get(setting.name, 2.0)
    return Outcome(np.arange(step / 2.0, END, step + seed), END)


def measured(**fields: Any) -> Resilience:
    (resilience,) = resiliences(judged(study(**fields), play))
    return resilience


@pytest.mark.parametrize(
    ("end", "onset", "window"),
    [
        (2000.0, 600.0, 100.0), (400.0, 100.0, 100.0), (400.0, 103.0, 99.0), (500.0, 350.0, 50.0),
        (500.0, 495.0, 2.0), (500.0, 499.0, 1.0 / 3.0),
    ],
)  # fmt: skip
def test_a_window_is_100_s_or_a_third_of_what_is_left(
    end: float, onset: float, window: float
) -> None:
    faults = [{"modes": ["dead"], "robots": [1], "onsets": [onset]}]
    plan = study(faults=faults, scenario={"duration": end, "n_robots": 4}).plan()
    assert {window_of(comparison) for comparison in plan.comparisons} == {window}


def test_deliveries_are_counted_in_windows_up_to_the_end_of_the_run() -> None:
    curves = measured().curves
    assert [curve.runs for curve in curves] == ["no fault", "removed", "fault"]
    for curve, counts in zip(curves, ([50, 34, 25], [25, 20, 17], [20, 17, 14])):
        assert curve.seconds.tolist() == [*range(100, 401, 5)]
        expected = spi.mean_interval(counts)
        first = curve.deliveries[0], curve.low[0], curve.high[0]
        assert first == pytest.approx(expected)
        assert curve.deliveries[-1] == pytest.approx(expected.value, abs=1.0)


@pytest.mark.parametrize(
    ("end", "onset", "step", "last"),
    [(44.0, 12.0, 1.1, 44.0), (903.0, 500.0, 5.0, 900.0), (20.0, 10.0, 0.3, 19.8)],
)
def test_no_window_ends_after_the_run(end: float, onset: float, step: float, last: float) -> None:
    faults = [{"modes": ["dead"], "robots": [1], "onsets": [onset]}]
    for curve in measured(scenario={"duration": end, "n_robots": 4}, faults=faults).curves:
        assert np.diff(curve.seconds) == pytest.approx(step)
        assert curve.seconds[-1] == last


def test_a_fault_is_set_beside_the_whole_swarm_and_the_robots_removed() -> None:
    resilience = measured()
    against_removed, against_whole = resilience.against_removed, resilience.against_whole
    assert against_removed is not None
    assert against_whole is not None
    assert (against_removed.threshold, against_whole.threshold) == (1.0, 0.75)
    n_after = [
        np.mean(
            [
                (play("", Setting("fault", name, 1.0), s).delivery_times > 100.0).sum()
                for s in range(3)
            ]
        )
        for name in ("dead", "removed", "none")
    ]
    assert (against_removed.value, against_whole.value) == pytest.approx(
        (n_after[0] / n_after[1], n_after[0] / n_after[2])
    )
    assert resilience.problem is None
    assert [curve.back.tolist() for curve in resilience.single] == [[False] * 3, [True] * 3]


def test_without_runs_with_the_robots_removed_no_time_to_come_back_is_told() -> None:
    resilience = measured(indicators=["R"])
    assert (resilience.compared.indicator, resilience.against_removed) == ("R", None)
    assert resilience.problem == "no runs with the robots removed are there to compare with"
    assert [curve.runs for curve in resilience.curves] == ["no fault", "fault"]
    assert resilience.single == ()
