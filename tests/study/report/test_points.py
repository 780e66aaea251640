"""How far axes reach."""

from __future__ import annotations

import pytest

from swarm_logistics_env.study.report.points import (
    Point,
    axis_limits,
    cuts_intervals,
    has_far_values,
    times_limits,
)

POINT = Point("homing", 0, "N = 5", 4.0, 3.0, 6.0, decided=True)


@pytest.mark.parametrize(
    ("points", "low", "high"),
    [
        ([POINT], 0.0, 6.0),
        ([POINT._replace(value=-4.0, low=-6.0, high=-3.0)], -6.0, 0.0),
        ([POINT._replace(published=9.0)], 0.0, 9.0),
        ([POINT._replace(runs=(2.0, None, 7.0))], 0.0, 7.0),
        ([POINT._replace(value=None, low=None, high=None)], 0.0, 0.0),
        # An interval far from all values would hide them: a part of it is left out.
        ([POINT._replace(value=2.0, low=-10.0, high=30.0)], -4.0, 6.0),
        ([POINT._replace(value=0.1, low=-10.0, high=30.0)], -1.0, 1.1),
        ([POINT._replace(value=0.5, low=-1.0, high=1.5)], -1.0, 1.5),
        ([POINT._replace(low=None), POINT._replace(high=9.0)], 0.0, 9.0),
        ([], 0.0, 0.0),
    ],
)
def test_axes_hold_zero_all_values_and_a_margin(
    points: list[Point], low: float, high: float
) -> None:
    margin = 0.06 * max(high - low, 0.5)
    assert axis_limits(points) == pytest.approx((low - margin, high + margin))


NOTHING = Point("homing", 0, "N = 5", None, None, None)


@pytest.mark.parametrize(
    ("points", "low", "high"),
    [
        ([], 1.0, 1.0),
        ([NOTHING], 1.0, 1.0),
        ([POINT], 1.0, 6.0),
        ([POINT._replace(value=0.5, low=0.25, high=0.75)], 0.25, 1.0),
        # An interval is shown to five times the values, and of 0 or less nothing is.
        ([POINT._replace(low=0.1, high=30.0)], 0.2, 20.0),
        ([POINT._replace(value=0.0, low=-1.0, high=None)], 1.0, 1.0),
        ([POINT._replace(value=2.0, low=0.0, high=3.0), POINT], 1.0, 6.0),
    ],
)
def test_axes_of_factors_hold_one_all_values_and_a_margin(
    points: list[Point], low: float, high: float
) -> None:
    assert times_limits(points) == pytest.approx((low / 1.15, 1.15 * high))


@pytest.mark.parametrize(
    ("points", "cuts", "cuts_factors"),
    [
        ([], False, False),
        ([NOTHING, POINT], False, False),
        ([POINT._replace(low=-10.0, high=None)], True, True),
        ([POINT._replace(low=None, high=21.0)], True, False),
        ([POINT._replace(low=0.15)], False, True),
        ([POINT._replace(low=0.18)], False, False),
        ([POINT, POINT._replace(high=24.0)], True, True),
    ],
)
def test_an_interval_beyond_its_axis_is_cut(
    points: list[Point], cuts: bool, cuts_factors: bool
) -> None:
    assert cuts_intervals(points) is cuts
    assert cuts_intervals(points, is_of_times=True) is cuts_factors


def test_values_beyond_5_are_far() -> None:
    for value, is_far in ((5.0, False), (5.1, True), (-5.0, False), (-5.1, True)):
        assert has_far_values([NOTHING, POINT._replace(value=value)]) is is_far
    assert not has_far_values([NOTHING])
