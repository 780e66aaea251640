"""Summaries of P and of times: means, intervals, and curves of repair."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.stats import sem, t

from swarm_logistics_env import spi
from swarm_logistics_env.spi.summaries import mean_over_trainings

P = [31.0, 38, 35, 44, 40, 29, 36]


def test_interval_of_the_mean_is_students_and_that_of_one_further_run_is_wider() -> None:
    interval = spi.mean_interval(P, confidence=0.9)
    assert interval.value == pytest.approx(np.mean(P))
    assert interval[1:] == pytest.approx(t.interval(0.9, 6, np.mean(P), sem(P)))
    mean, further = spi.mean_interval(P)[2], spi.prediction_interval(P)[2]
    assert (further or 0) - np.mean(P) == pytest.approx(np.sqrt(8) * ((mean or 0) - np.mean(P)))
    few = [0.0, 0.0, 12.0, 1.0]
    for function in (spi.mean_interval, spi.prediction_interval):
        assert function(few).low == 0.0  # none of P reaches below 0
        assert function([39]) == (39.0, None, None)


def test_median_interval_covers_the_median_of_skewed_times() -> None:
    times = np.random.default_rng(0).exponential(1.0, (2_000, 25))
    low, high = np.transpose([spi.median_interval(row)[1:] for row in times]).astype(float)
    covered = ((low <= np.log(2.0)) & (np.log(2.0) <= high)).mean()
    assert 0.94 <= covered <= 0.975  # at least .95, up to the noise of 2,000 draws
    assert spi.median_interval([3.0, 1.0, 2.0]) == (2.0, None, None)
    late = [10.0, 20.0, 30.0, 40.0, *[np.inf] * 4]  # some never came
    assert spi.median_interval(late) == (np.inf, 10.0, np.inf)


def test_the_index_counts_deliveries_after_the_onset() -> None:
    faulty = [[50.0, 150, 200], [10.0, 100, 120, 130]]  # 2 and 2 after 100 s
    reference = [[50.0, 150, 200, 300, 310], [120.0, 130, 140]]  # 4 and 3
    index = spi.resilience_index(faulty, reference, onset=100.0)
    assert index.value == pytest.approx(4 / 7)
    assert (index.indicator, index.threshold, index.n_seeds) == ("resilience", 1.0, 2)


def test_each_run_is_timed_or_censored() -> None:
    sound = np.arange(0.0, 2_000.0, 5.0)
    gap = sound[(sound < 1_000) | (sound > 1_200)]
    halved = np.concatenate([sound[:200], sound[200:][::2]])
    runs = [sound, gap, halved]
    seconds, back = spi.repair_times(runs, [sound] * 3, onset=1_000.0, end=2_000.0)
    assert back.tolist() == [True, True, False]
    assert seconds == pytest.approx([0, 200, 900], abs=6)  # followed until the last window begins
    assert spi.kaplan_meier(seconds, back).share == pytest.approx([2 / 3, 1 / 3])
    nothing = spi.kaplan_meier([900.0, 900.0], [False, False])
    assert (nothing.seconds.size, nothing.median()) == (0, None)


@pytest.mark.parametrize(
    ("faulty", "reference", "end", "seconds", "is_back"),
    [
        # A window holds what comes after its begin, up to its end.
        ([1.0, 12.0], [2.0, 10.0, 12.0], 14.0, 0.0, True),
        ([10.0], [11.0, 12.0], 14.0, 2.0, True),
        ([13.5], [11.0, 12.0], 14.0, 2.0, True),
        ([12.5], [11.0, 13.5], 14.0, 1.0, True),
        ([], [11.5, 13.5], 14.0, 2.0, False),
        ([12.0], [10.0, 12.0], 12.0, 0.0, True),
        ([12.1], [12.0], 12.0, 0.0, False),
    ],
)
def test_a_run_is_back_with_the_first_window_in_which_it_delivers_as_much(
    faulty: list[float], reference: list[float], end: float, seconds: float, is_back: bool
) -> None:
    times = spi.repair_times([faulty], [reference], onset=10.0, end=end, window=2.0)
    assert [part.tolist() for part in times] == [[seconds], [is_back]]


def test_half_the_runs_are_enough_for_a_median_and_correlation_takes_three() -> None:
    assert spi.kaplan_meier([1, 2], [1, 0]).median() == 1.0
    assert spi.kaplan_meier([1, 2, 3], [1, 0, 0]).median() is None
    assert spi.median_interval([1, 2, 3, 4, 5, 6.0]) == (3.5, 1.0, 6.0)
    assert spi.median_interval([0, 1, 2, 3, 4, 5, 6, 7, 8.0], 0.9) == (4.0, 1.0, 7.0)
    for second, correlation in (([1, 2, 3], 1.0), ([3, 2, 1], -1.0), ([1, 1, 1], None)):
        assert spi.pairing_correlation([1, 2, 3], second) == pytest.approx(correlation)
        assert spi.pairing_correlation(second, [1, 2, 3]) == pytest.approx(correlation)
    assert spi.pairing_correlation([1, 2], [1, 2]) is None


def test_means_over_trainings_have_the_variance_of_crossed_factors() -> None:
    p_f = np.array([[1.0, 5, 2, 8], [2, 7, 3, 9], [3, 6, 4, 12]])
    p_o = np.array([[2.0, 9, 1], [4, 8, 3], [3, 12, 2]])
    unpaired = mean_over_trainings([p_f, p_o], paired=False)
    assert [*map(float, unpaired)] == pytest.approx([10.0555556, 9.7530864, 4.6318411])
    paired = mean_over_trainings([p_f, -0.5 * p_f[::-1]], paired=True)
    assert [*map(float, paired)] == pytest.approx([2.5833333, 1.6111111, 4.0879149])


# 6-MP arm of Freireich et al. (1963), the textbook example; True: relapse seen
WEEKS = [6, 6, 6, 6, 7, 9, 10, 10, 11, 13, 16, 17, 19, 20, 22, 23, 25, 32, 32, 34, 35]
SEEN = [1, 1, 1, 0, 1, 0, 1, 0, 0, 1, 1, 0, 0, 0, 1, 1, 0, 0, 0, 0, 0]


def test_textbook_curve() -> None:
    curve = spi.kaplan_meier(WEEKS, SEEN)
    assert curve.seconds.tolist() == [6, 7, 10, 13, 16, 22, 23]
    expected = [0.857, 0.807, 0.753, 0.690, 0.627, 0.538, 0.448]
    assert curve.share == pytest.approx(expected, abs=5e-4)
    assert curve.median() == 23


RUNS: dict[str, Any] = {"faulty": [[1.0], [2.0]], "reference": [[1.0], [2.0]], "onset": 1_000.0}
TO_THE_END = {**RUNS, "end": 2_000.0}


@pytest.mark.parametrize(
    ("function", "arguments", "message"),
    [
        (spi.mean_interval, {"p": []}, "empty"),
        (spi.mean_interval, {"p": [1, -1]}, "negative"),
        (spi.mean_interval, {"p": P, "confidence": 95}, "confidence = 95"),
        (spi.mean_interval, {"p": [P, P], "confidence": 95}, "confidence = 95"),
        (spi.prediction_interval, {"p": P, "confidence": 0.0}, "confidence = 0.0"),
        (spi.median_interval, {"times": P, "confidence": 1.0}, "confidence = 1.0"),
        (spi.median_interval, {"times": [1.0, np.nan]}, "times: should be"),
        (spi.resilience_index, {**RUNS, "faulty": []}, "faulty is empty"),
        (spi.resilience_index, {**RUNS, "faulty": [[-1.0], []]}, r"faulty\[0\]"),
        (
            spi.resilience_index,
            {**RUNS, "faulty": [[], [[1.0]]]},
            r"faulty\[1\] = \[\[1.0\]\]: sho",
        ),
        (
            spi.resilience_index,
            {**RUNS, "faulty": [[], [np.inf]]},
            r"faulty\[1\] = \[inf\]: should",
        ),
        (spi.resilience_index, {**RUNS, "onset": np.inf}, "onset = inf: should be finite"),
        (spi.resilience_index, {**RUNS, "reference": [[1.0], []]}, "mean of reference = 0"),
        (spi.repair_times, {**TO_THE_END, "faulty": [[1.0]]}, "unequal seed sets"),
        (spi.repair_times, {**TO_THE_END, "end": 1_000.0}, "onset = 1000"),
        (spi.repair_times, {**TO_THE_END, "onset": -0.1}, "onset = -0.1"),
        (spi.repair_times, {**TO_THE_END, "end": np.inf}, "onset = 1000.0, end = inf"),
        (spi.repair_times, {**TO_THE_END, "window": 0.0}, "window = 0.0"),
        (spi.median_interval, {"times": []}, "times: should be"),
        (spi.median_interval, {"times": [-0.1, 3.0]}, "times: should be"),
        (spi.median_interval, {"times": [[1.0, 2.0]]}, "times: should be"),
        (spi.pairing_correlation, {"p_a": P, "p_b": P[:3]}, "unequal seed sets"),
        (spi.mean_interval, {"p": [P]}, "shape .1, 7.: .*or a row for each of two trainings"),
        (spi.prediction_interval, {"p": [P, P]}, r"shape \(2, 7\): .* shape \(n,\)$"),
        (spi.repair_times, {**TO_THE_END, "window": 1_001.0}, "window = 1001"),
        (spi.kaplan_meier, {"seconds": [1.0], "happened": [True, False]}, "seconds"),
        (spi.kaplan_meier, {"seconds": [float("nan")], "happened": [True]}, "seconds"),
    ],
)
def test_what_cannot_be_is_named(function: Any, arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(spi.IndicatorError, match=message):
        function(**arguments)
