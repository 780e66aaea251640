from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.spi import IndicatorError


def test_the_index_counts_deliveries_after_the_onset() -> None:
    faulty = [[50.0, 150, 200], [10.0, 100, 120, 130]]  # 2 and 2 after 100 s
    reference = [[50.0, 150, 200, 300, 310], [120.0, 130, 140]]  # 4 and 3
    index = spi.resilience_index(faulty, reference, onset=100.0)
    assert index.value == pytest.approx(4 / 7)
    assert (index.indicator, index.threshold, index.n_seeds) == ("resilience", 1.0, 2)


BAD: list[tuple[Any, Any, str]] = [
    ([], [[1.0]], "faulty is empty"),
    ([[1.0]], [], "reference is empty"),
    ([[1.0]], [[1.0], [2.0]], "unequal seed sets"),
    ([[-1.0]], [[1.0]], r"faulty\[0\]"),
    ([[1.0]], [[float("nan")]], r"reference\[0\]"),
    ([[1.0]], [[[1.0]]], r"reference\[0\]"),
    ([["late"]], [[1.0]], r"faulty\[0\] = \['late'\]: should be an array of numbers"),
    ([[900.0]], [[10.0]], "mean of reference = 0"),
]


@pytest.mark.parametrize(("faulty", "reference", "message"), BAD)
def test_bad_input_is_named(faulty: Any, reference: Any, message: str) -> None:
    with pytest.raises(IndicatorError, match=message):
        spi.resilience_index(faulty, reference, onset=100.0)
    with pytest.raises(IndicatorError, match="onset = nan"):
        spi.resilience_index([[1.0]], [[1.0]], onset=float("nan"))


ONSET, END = 1_000.0, 2_000.0


def test_each_run_is_timed_or_censored() -> None:
    sound = np.arange(0.0, END, 5.0)
    gap = sound[(sound < 1_000) | (sound > 1_200)]
    halved = np.concatenate([sound[:200], sound[200:][::2]])
    seconds, back = spi.repair_times([sound, gap, halved], [sound] * 3, onset=ONSET, end=END)
    assert back.tolist() == [True, True, False]
    assert seconds == pytest.approx([0, 200, 900], abs=6)  # followed until the last window begins
    assert spi.kaplan_meier(seconds, back).share == pytest.approx([2 / 3, 1 / 3])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"faulty": [[1.0]]}, "unequal seed sets"),
        ({"onset": END}, "onset = 2000"),
        ({"window": 1_001.0}, "window = 1001"),
        ({"window": float("nan")}, "window = nan"),
    ],
)
def test_runs_that_cannot_be_timed_are_named(change: dict[str, Any], message: str) -> None:
    runs: dict[str, Any] = {"faulty": [[1.0], [2.0]], "reference": [[1.0], [2.0]]}
    with pytest.raises(IndicatorError, match=message):
        spi.repair_times(**{**runs, "onset": ONSET, "end": END, **change})


# 6-MP arm of Freireich et al. (1963), the textbook example; True: relapse seen
WEEKS = [6, 6, 6, 6, 7, 9, 10, 10, 11, 13, 16, 17, 19, 20, 22, 23, 25, 32, 32, 34, 35]
SEEN = [1, 1, 1, 0, 1, 0, 1, 0, 0, 1, 1, 0, 0, 0, 1, 1, 0, 0, 0, 0, 0]


def test_textbook_curve() -> None:
    curve = spi.kaplan_meier(WEEKS, SEEN)
    assert curve.seconds.tolist() == [6, 7, 10, 13, 16, 22, 23]
    expected = [0.857, 0.807, 0.753, 0.690, 0.627, 0.538, 0.448]
    assert curve.share == pytest.approx(expected, abs=5e-4)
    # R survival, conf.type = "log-log"
    assert (curve.low[0], curve.high[0]) == pytest.approx((0.620, 0.952), abs=1e-3)
    assert (curve.low[-1], curve.high[-1]) == pytest.approx((0.188, 0.680), abs=1e-3)
    assert curve.median() == 23
    assert (spi.kaplan_meier(WEEKS, SEEN, confidence=0.99).low < curve.low).all()


def test_without_censoring_it_is_the_share_left() -> None:
    curve = spi.kaplan_meier([3, 1, 2, 2], [True] * 4)
    assert curve.share == pytest.approx([0.75, 0.25, 0.0])
    assert (curve.low[-1], curve.high[-1]) == (0.0, 1.0)
    assert curve.median() == 2


def test_no_event_leaves_an_empty_curve_without_median() -> None:
    curve = spi.kaplan_meier([900.0, 900.0], [False, False])
    assert curve.seconds.size == 0
    assert curve.median() is None


BAD_TIMES: list[tuple[Any, Any]] = [([], []), ([1.0], [True, False]), ([-1.0], [True]),
                              ([float("nan")], [True]), ([float("inf")], [False]),
                              (["late"], [True])]  # fmt: skip


@pytest.mark.parametrize(("seconds", "happened"), BAD_TIMES)
def test_bad_times_are_named(seconds: Any, happened: Any) -> None:
    with pytest.raises(IndicatorError, match="seconds"):
        spi.kaplan_meier(seconds, happened)
