"""What indicators take: real numbers, none of them masked, and no times that become counts."""

from __future__ import annotations

import datetime
from typing import Any

import numpy as np
import pandas as pd
import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.core.errors import SwarmLogisticsError

MASKED = np.ma.masked_equal([20.0, 21.0, 22.0, 9999.0], 9999.0)
REFUSED: list[tuple[Any, str]] = [
    (MASKED, r"p\[3\] is masked: should be left out"),
    ([20.0, np.ma.masked, 22.0], r"p\[1\] is masked"),
    ([MASKED, MASKED], r"p\[0, 3\] is masked"),
    (pd.to_timedelta([1, 2, 3], unit="s"), r"p is of times .*timedelta64.*seconds"),
    (np.array(["2026-01-01"], dtype="M8[D]"), r"p is of times .*datetime64"),
    (np.array([np.timedelta64(1, "s"), 2.0], dtype=object), r"p is of times"),
    ([datetime.timedelta(seconds=1)], r"p = .*should be an array of numbers"),
    ([20 + 5j, 21, 22], r"p is of complex"),
    ([10**400, 1], r"p has a number that is too large"),
    ([1.7e308] * 3, r"p goes up to 1.7e\+308: should go up to a number from 1e-60 to 1e\+60"),
    ([1e-160, 2e-160], r"p goes up to 2e-160: .* use another unit"),
    ([None, 1.0], r"p\[0\] = nan"),
]


@pytest.mark.parametrize(("values", "words"), REFUSED)
def test_what_is_no_real_number_is_refused_by_its_place_or_kind(values: Any, words: str) -> None:
    for ask in (spi.mean_interval, spi.share_stalled):
        with pytest.raises(spi.IndicatorError, match=words) as refused:
            ask(values)
        assert isinstance(refused.value, SwarmLogisticsError)


def test_what_has_a_mask_or_another_type_of_number_is_read_as_its_numbers() -> None:
    plain = spi.mean_interval([1.0, 2.0, 4.0])
    for values in (np.ma.array([1, 2, 4]), pd.Series([1, 2, 4]), np.array([1, 2, 4], np.float32)):
        assert spi.mean_interval(values) == plain


@pytest.mark.parametrize("size", [2e-60, 1.0, 5e59])
@pytest.mark.parametrize("paired", [True, False])
def test_a_unit_as_large_or_small_as_is_taken_changes_no_indicator(
    size: float, paired: bool
) -> None:
    before, after = np.array([1.0, 0.9, 0.8, 0.95] * 4), np.array([0.7, 0.5, 0.72, 0.6] * 4)
    usual = spi.robustness(before, after, n=10, m=2, paired=paired)
    scaled = spi.robustness(size * before, size * after, n=10, m=2, paired=paired)
    for name in ("value", "low", "high", "p_value"):
        assert getattr(scaled, name) == pytest.approx(getattr(usual, name), rel=1e-9)


def test_the_largest_and_the_least_performances_are_taken_and_so_are_zeros() -> None:
    for most in (1e60, 1e-60, 0.0):
        assert spi.mean_interval([0.0, most]).value == most / 2
    for count in (1, np.int64(3)):
        assert spi.robustness([40.0, 41], [39.0, 40], n=25, m=count).threshold == 0.0
    for wrong in ({"threshold": np.inf}, {"confidence": 0.0}, {"confidence": "0.9"}):
        with pytest.raises(spi.IndicatorError, match=f"^{next(iter(wrong))} = "):
            spi.relative_change([40.0, 41], [39.0, 40], **wrong)


def test_times_and_events_are_read_the_same_way() -> None:
    with pytest.raises(spi.IndicatorError, match=r"times is of times"):
        spi.median_interval(np.array([1, 2, 3], dtype="m8[s]"))
    with pytest.raises(spi.IndicatorError, match=r"happened\[0\] is masked"):
        spi.kaplan_meier([1.0, 2.0], np.ma.array([1, 0], mask=[True, False]))
    with pytest.raises(spi.IndicatorError, match=r"happened = .*should be an array of numbers"):
        spi.kaplan_meier([1.0, 2.0], ["True", "False"])
