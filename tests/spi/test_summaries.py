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


def test_pairing_correlation() -> None:
    other = [30.0, 36, 36, 41, 38, 30, 33]
    assert spi.pairing_correlation(P, other) == pytest.approx(np.corrcoef(P, other)[0, 1])
    assert spi.pairing_correlation(P[:2], other[:2]) is None
    assert spi.pairing_correlation(P, [3.0] * 7) is None
    assert spi.pairing_correlation([3.0] * 7, P) is None


@pytest.mark.parametrize(
    "summary",
    [spi.mean_interval, spi.prediction_interval],
)
@pytest.mark.parametrize(("bad", "message"), [([], "empty"), ([1, -1], "negative")])
def test_bad_samples_are_named(summary: Callable[..., Any], bad: list[int], message: str) -> None:
    with pytest.raises(IndicatorError, match=message):
        summary(bad)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: spi.pairing_correlation(P, P[:3]), "unequal seed sets"),
        (lambda: spi.mean_interval(P, confidence=95), "confidence = 95"),
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
