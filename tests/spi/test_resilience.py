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


def test_it_is_judged_like_any_ratio() -> None:
    rng = np.random.default_rng(0)
    reference = [rng.uniform(0, 2_000, 160) for _ in range(12)]
    half = [times[::2] for times in reference]
    against_removed = spi.resilience_index(half, reference, onset=1_000)
    assert against_removed.verdict == "refuted"
    against_share = spi.resilience_index(half, reference, onset=1_000, threshold=1 - 20 / 25)
    assert against_share.verdict == "supported"


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


def test_the_onset_is_finite() -> None:
    with pytest.raises(IndicatorError, match="onset = nan"):
        spi.resilience_index([[1.0]], [[1.0]], onset=float("nan"))
