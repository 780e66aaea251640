"""How far axes reach."""

from __future__ import annotations

import pytest

from swarm_logistics_env.study.report.points import Point, axis_limits

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
    ],
)
def test_axes_hold_zero_all_values_and_a_margin(
    points: list[Point], low: float, high: float
) -> None:
    margin = 0.06 * max(high - low, 0.5)
    assert axis_limits(points) == pytest.approx((low - margin, high + margin))
