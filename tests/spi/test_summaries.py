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
    mean, further = spi.mean_interval(P)[2], spi.prediction_interval(P)[2]
    assert (further or 0) - np.mean(P) == pytest.approx(np.sqrt(8) * ((mean or 0) - np.mean(P)))
    runs = np.random.default_rng(0).normal(40, 5, (4_000, 6))
    low, high = np.transpose([spi.prediction_interval(run[:5])[1:] for run in runs]).astype(float)
    assert ((low <= runs[:, 5]) & (runs[:, 5] <= high)).mean() == pytest.approx(0.95, abs=0.012)


def test_no_interval_of_p_reaches_below_0() -> None:
    few = [0.0, 0.0, 12.0, 1.0]
    mean, run = spi.mean_interval(few), spi.prediction_interval(few)
    assert (mean.low, run.low) == (0.0, 0.0)
    assert mean.high == pytest.approx(3.25 + 3.1824 * np.std(few, ddof=1) / 2, rel=1e-4)


def test_one_run_has_no_interval() -> None:
    assert spi.mean_interval([39]) == (39.0, None, None)
    assert spi.prediction_interval([39]) == (39.0, None, None)
    assert spi.probability_of_improvement([39], [40]) == (1.0, None, None)


def test_trimmed_means() -> None:
    from scipy.stats import trim_mean

    for n in range(1, 14):
        p = np.random.default_rng(n).poisson(39, n)
        assert spi.interquartile_mean(p) == pytest.approx(trim_mean(p, 0.25))
    assert [spi.worst_decile(p) for p in (np.arange(20), np.arange(21), [7, 3, 5])] == [0.5, 1, 3]


def test_probability_of_improvement_counts_pairs_and_halves_ties() -> None:
    p_o = np.full(4, 10)
    assert spi.probability_of_improvement(p_o, [11, 12, 10, 9]).value == 0.625
    # The pairs decide, not the marginal order: each seed improves by 1 under a spread of 30.
    seeds = np.array([10.0, 20, 30, 40])
    assert spi.probability_of_improvement(seeds, seeds + 1).value == 1.0


@pytest.mark.parametrize(("better", "limits"), [(7, (0.3968, 0.8922)), (10, (0.7225, 1.0))])
def test_its_interval_is_wilsons(better: int, limits: tuple[float, float]) -> None:
    p_new = np.array([6] * better + [4] * (10 - better))  # Newcombe 1998
    found = spi.probability_of_improvement(np.full(10, 5), p_new)
    assert found[1:] == pytest.approx(limits, abs=1e-4)


def test_pairing_correlation() -> None:
    other = [30.0, 36, 36, 41, 38, 30, 33]
    assert spi.pairing_correlation(P, other) == pytest.approx(np.corrcoef(P, other)[0, 1])
    for one, two in ((P[:2], other[:2]), (P, [3.0] * 7), ([3.0] * 7, P)):
        assert spi.pairing_correlation(one, two) is None


def test_median_interval_covers_the_median_of_skewed_times() -> None:
    times = np.random.default_rng(0).exponential(1.0, (2_000, 25))
    low, high = np.transpose([spi.median_interval(row)[1:] for row in times]).astype(float)
    covered = ((low <= np.log(2.0)) & (np.log(2.0) <= high)).mean()
    assert 0.94 <= covered <= 0.975  # at least .95, up to the noise of 2,000 draws
    assert spi.median_interval([3.0, 1.0, 2.0]) == (2.0, None, None)
    assert spi.median_interval([1.0, 2.0, 3.0, 4.0, 5.0, 6.0]) == (3.5, 1.0, 6.0)
    late = [10.0, 20.0, 30.0, 40.0, *[np.inf] * 4]  # some never came
    assert spi.median_interval(late) == (np.inf, 10.0, np.inf)


@pytest.mark.parametrize(
    ("summary", "asked", "message"),
    [
        *(
            (summary, (p,), message)
            for summary in (
                spi.mean_interval,
                spi.prediction_interval,
                spi.interquartile_mean,
                spi.worst_decile,
            )
            for p, message in (([], "empty"), ([1, -1], "negative"))
        ),
        (spi.probability_of_improvement, (P, P[:3]), "unequal seed sets"),
        (spi.pairing_correlation, (P, P[:3]), "unequal seed sets"),
        (spi.mean_interval, (P, 95), "confidence = 95"),
        (spi.probability_of_improvement, (P, P, 95), "confidence = 95"),
        (spi.median_interval, ([1.0, np.nan],), "times: should be"),
        (spi.median_interval, ([],), "times: should be"),
    ],
)
def test_what_cannot_be_is_named(
    summary: Callable[..., Any], asked: tuple[Any, ...], message: str
) -> None:
    with pytest.raises(IndicatorError, match=message):
        summary(*asked)
