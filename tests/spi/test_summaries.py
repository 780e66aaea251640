from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.spi import IndicatorError

P = [31.0, 38, 35, 44, 40, 29, 36]


def test_mean_interval_is_students() -> None:
    from scipy.stats import sem, t

    interval = spi.mean_interval(P, confidence=0.9)
    assert interval.value == pytest.approx(np.mean(P))
    assert interval[1:] == pytest.approx(t.interval(0.9, 6, np.mean(P), sem(P)))


def test_prediction_interval_is_that_of_one_further_run() -> None:
    mean, further = spi.mean_interval(P), spi.prediction_interval(P)
    assert mean.high is not None
    assert further.high is not None
    assert (further.high - further.value) / (mean.high - mean.value) == pytest.approx(np.sqrt(8))


def test_one_run_has_no_interval() -> None:
    assert spi.mean_interval([39]) == (39.0, None, None)
    assert spi.prediction_interval([39]) == (39.0, None, None)
    assert spi.probability_of_improvement([39], [40]) == (1.0, None, None)


def test_interquartile_mean_drops_a_quarter_on_each_side() -> None:
    from scipy.stats import trim_mean

    assert spi.interquartile_mean([100, 1, 3, 0]) == 2.0
    assert spi.interquartile_mean([5, 1, 9]) == 5.0
    for n in range(1, 14):
        p = np.random.default_rng(n).poisson(39, n)
        assert spi.interquartile_mean(p) == pytest.approx(trim_mean(p, 0.25))


def test_worst_decile_is_the_mean_of_the_worst_tenth() -> None:
    assert spi.worst_decile(np.arange(20)) == 0.5
    assert spi.worst_decile(np.arange(21)) == 1.0
    assert spi.worst_decile([7, 3, 5]) == 3.0


def test_probability_of_improvement_counts_pairs_and_halves_ties() -> None:
    p_o = np.array([10, 10, 10, 10])
    interval = spi.probability_of_improvement(p_o, [11, 12, 10, 9])
    assert interval.value == 0.625
    # The pairs decide, not the marginal order: each seed improves by 1 under a spread of 30.
    seeds = np.array([10.0, 20, 30, 40])
    assert spi.probability_of_improvement(seeds, seeds + 1).value == 1.0


def test_its_interval_is_wilsons() -> None:
    # 7 of 10: Wilson .397 to .892 (Newcombe 1998)
    p_o = np.full(10, 5)
    p_new = np.array([6] * 7 + [4] * 3)
    _, low, high = spi.probability_of_improvement(p_o, p_new)
    assert low == pytest.approx(0.3968, abs=1e-4)
    assert high == pytest.approx(0.8922, abs=1e-4)
    all_better = spi.probability_of_improvement(p_o, p_o + 1)
    assert all_better.low == pytest.approx(0.7225, abs=1e-4)
    assert all_better.high == 1.0


def test_pairing_correlation() -> None:
    other = [30.0, 36, 36, 41, 38, 30, 33]
    assert spi.pairing_correlation(P, other) == pytest.approx(np.corrcoef(P, other)[0, 1])
    assert spi.pairing_correlation(P[:2], other[:2]) is None
    assert spi.pairing_correlation(P, [3.0] * 7) is None
    assert spi.pairing_correlation([3.0] * 7, P) is None


@pytest.mark.parametrize(
    "summary",
    [spi.mean_interval, spi.prediction_interval, spi.interquartile_mean, spi.worst_decile],
)
@pytest.mark.parametrize(("bad", "message"), [([], "empty"), ([1, -1], "negative")])
def test_bad_samples_are_named(summary: Callable[..., Any], bad: list[int], message: str) -> None:
    with pytest.raises(IndicatorError, match=message):
        summary(bad)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: spi.probability_of_improvement(P, P[:3]), "unequal seed sets"),
        (lambda: spi.pairing_correlation(P, P[:3]), "unequal seed sets"),
        (lambda: spi.mean_interval(P, confidence=95), "confidence = 95"),
        (lambda: spi.probability_of_improvement(P, P, confidence=95), "confidence = 95"),
    ],
)
def test_bad_comparisons_are_named(call: Callable[[], Any], message: str) -> None:
    with pytest.raises(IndicatorError, match=message):
        call()


def test_no_interval_of_p_reaches_below_0() -> None:
    few = [0.0, 0.0, 12.0, 1.0]
    mean, run = spi.mean_interval(few), spi.prediction_interval(few)
    assert (mean.low, run.low) == (0.0, 0.0)
    assert mean.high is not None
    assert mean.high == pytest.approx(3.25 + 3.1824 * np.std(few, ddof=1) / 2, rel=1e-4)
