"""Points: the values that a drawing shows, and how far its axis reaches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

_MARGIN_OF_TIMES = 1.15  # of a logarithmic axis of factors, to both sides
# An indicator from which on axes are linear up to 1 alone, and logarithmic beyond; and how many
# times the most extreme factor an interval of factors is drawn to.
_FAR = 5.0


class Point(NamedTuple):
    """One value with its interval.

    Attributes:
        series: label of its series.
        style: index of its colour and marker.
        category: where it stands on the axis.
        value, low, high: None: missing.
        published: a cross beside it; None: none.
        decided: whether it is filled.
        saturated: whether it is marked.
        link: id of its marks in the SVG: what a click on them shows in the page, "question-7" or
            "condition-3"; empty: nothing.
        runs: single runs, drawn as dots, seed by seed; None: missing.
    """

    series: str
    style: int
    category: str
    value: float | None
    low: float | None
    high: float | None
    published: float | None = None
    decided: bool = False
    saturated: bool = False
    link: str = ""
    runs: tuple[float | None, ...] = ()


@dataclass(frozen=True)
class Panel:
    """One pair of axes: series over shared categories, and thresholds."""

    title: str
    y_label: str
    points: tuple[Point, ...]
    thresholds: tuple[float, ...]
    x_label: str


def axis_limits(points: Sequence[Point]) -> tuple[float, float]:
    """Return axis limits: 0, all values, and intervals up to twice the values' span beyond."""
    values = [0.0, *(x for p in points for x in (p.value, p.published) if x is not None)]
    values += [p for point in points for p in point.runs if p is not None]
    ends = [*values, *(x for p in points for x in (p.low, p.high) if x is not None)]
    reach = max(2.0 * (max(values) - min(values)), 1.0)
    low = max(min(ends), min(values) - reach)
    high = min(max(ends), max(values) + reach)
    margin = 0.06 * max(high - low, 0.5)
    return low - margin, high + margin


def times_limits(points: Sequence[Point]) -> tuple[float, float]:
    """Return limits of a logarithmic axis of factors: 1, all values, and intervals to 5 times."""
    values = [1.0, *(point.value for point in points if point.value and point.value > 0.0)]
    ends = [end for point in points for end in (point.low, point.high) if end is not None]
    low = max(min([*values, *(end for end in ends if end > 0.0)]), min(values) / _FAR)
    high = min(max([*values, *ends]), max(values) * _FAR)
    return low / _MARGIN_OF_TIMES, high * _MARGIN_OF_TIMES


def cuts_intervals(points: Sequence[Point], *, is_of_times: bool = False) -> bool:
    """Return whether an interval ends beyond the axis that shows these values."""
    low, high = times_limits(points) if is_of_times else axis_limits(points)
    lows = [point.low for point in points if point.low is not None]
    highs = [point.high for point in points if point.high is not None]
    return min(lows, default=low) < low or max(highs, default=high) > high


def has_far_values(points: Sequence[Point]) -> bool:
    """Return whether indicators are so large that others would lie on a heap at 0."""
    return any(abs(point.value) > _FAR for point in points if point.value is not None)
