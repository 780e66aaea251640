from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.spi import IndicatorError

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


def test_without_censoring_it_is_the_share_left() -> None:
    curve = spi.kaplan_meier([3, 1, 2, 2], [True] * 4)
    assert curve.share == pytest.approx([0.75, 0.25, 0.0])
    assert (curve.low[-1], curve.high[-1]) == (0.0, 1.0)
    assert curve.median() == 2


def test_no_event_leaves_an_empty_curve_without_median() -> None:
    curve = spi.kaplan_meier([900.0, 900.0], [False, False])
    assert curve.seconds.size == 0
    assert curve.median() is None


def test_confidence_widens() -> None:
    narrow, wide = (
        spi.kaplan_meier(WEEKS, SEEN, confidence=confidence) for confidence in (0.8, 0.99)
    )
    assert (wide.low < narrow.low).all()
    assert (wide.high > narrow.high).all()
    assert np.array_equal(wide.share, narrow.share)


BAD: list[tuple[Any, Any]] = [([], []), ([1.0], [True, False]), ([-1.0], [True]),
                              ([float("nan")], [True]), ([float("inf")], [False]),
                              (["late"], [True])]  # fmt: skip


@pytest.mark.parametrize(("seconds", "happened"), BAD)
def test_bad_input_is_named(seconds: Any, happened: Any) -> None:
    with pytest.raises(IndicatorError, match="seconds"):
        spi.kaplan_meier(seconds, happened)
