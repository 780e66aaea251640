"""Summaries of P and of times: means, intervals, and curves of repair."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.stats import sem, t

from swarm_logistics_env import spi

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
        (spi.median_interval, {"times": [1.0, np.nan]}, "times: should be"),
        (spi.resilience_index, {**RUNS, "faulty": []}, "faulty is empty"),
        (spi.resilience_index, {**RUNS, "faulty": [[-1.0], []]}, r"faulty\[0\]"),
        (spi.resilience_index, {**RUNS, "reference": [[1.0], []]}, "mean of reference = 0"),
        (spi.repair_times, {**TO_THE_END, "faulty": [[1.0]]}, "unequal seed sets"),
        (spi.repair_times, {**TO_THE_END, "end": 1_000.0}, "onset = 1000"),
        (spi.repair_times, {**TO_THE_END, "window": 1_001.0}, "window = 1001"),
        (spi.kaplan_meier, {"seconds": [1.0], "happened": [True, False]}, "seconds"),
        (spi.kaplan_meier, {"seconds": [float("nan")], "happened": [True]}, "seconds"),
    ],
)
def test_what_cannot_be_is_named(function: Any, arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(spi.IndicatorError, match=message):
        function(**arguments)
