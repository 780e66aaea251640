"""The intervals of the answer as parts of the page: a drawing a line, and the axis below them.

Places along the axis are in percent: a drawing fits any width, and its marks keep their shape.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from html import escape
from typing import NamedTuple

from swarm_logistics_env.study.verdicts.verdict import Verdict

from .answer import Answer
from .drawing import Point, limits
from .figures import forest_label
from .section import ratio


class _Axis(NamedTuple):
    """The axis of the values, from `low` to `high`."""

    low: float
    high: float

    @property
    def ticks(self) -> list[float]:
        from matplotlib.ticker import MaxNLocator

        ticks = MaxNLocator(6, steps=[1, 2, 5, 10]).tick_values(self.low, self.high)
        return [float(tick) for tick in ticks if self.low <= tick <= self.high]

    def place(self, value: float) -> str:
        inside = min(max(value, self.low), self.high)
        return f"{100 * (inside - self.low) / (self.high - self.low):.2f}%"

    def upright(self, value: float, top: float, bottom: float, css_class: str) -> str:
        x = self.place(value)
        return f'<line class="{css_class}" x1="{x}" x2="{x}" y1="{top:g}" y2="{bottom:g}"/>'


def forest(answer: Answer, points: Sequence[Point]) -> tuple[list[str], str]:
    """Return a drawing of each line of the answer, and their axis with its numbers and title.

    Args:
        points: the value of each line.
    """
    axis = _Axis(*limits(points))
    drawn = [_row(axis, point, line.verdict) for point, line in zip(points, answer.lines)]
    numbers = "".join(
        f'{axis.upright(tick, 0, 4, "axis")}<text x="{axis.place(tick)}" y="15">{tick:g}</text>'
        for tick in axis.ticks
    ).replace(">-", ">\N{MINUS SIGN}")
    numbers += f'<text x="50%" y="30">{escape(forest_label(answer))}</text>'
    line = '<line class="axis" x1="0" x2="100%" y1="0.5" y2="0.5"/>'
    return drawn, f'<svg height="34">{line}{numbers}</svg>'


_HEIGHT = 20.0  # of a row [px]


def _row(axis: _Axis, point: Point, verdict: Verdict) -> str:
    grid = "".join(axis.upright(tick, 0, _HEIGHT, "grid") for tick in axis.ticks)
    zero = axis.upright(0.0, 0, _HEIGHT, "threshold")
    marks = "".join(_mark(axis, _HEIGHT / 2, point, verdict))
    return f'<svg height="{_HEIGHT:g}" aria-hidden="true">{grid}{zero}{marks}</svg>'


def _mark(axis: _Axis, y: float, point: Point, verdict: Verdict) -> Iterator[str]:
    """Yield the parts of a value with its interval, in the colour of its verdict."""
    if point.value is None:
        return
    title = f"{verdict.compared.label}: {ratio(verdict)}, {verdict.in_words}"
    number = point.link.rpartition("-")[2]
    yield f'<g class="{verdict.conclusion}" data-question="{number}"><title>{escape(title)}</title>'
    if point.low is not None and point.high is not None:
        ends = axis.place(point.low), axis.place(point.high)
        yield f'<line x1="{ends[0]}" x2="{ends[1]}" y1="{y:g}" y2="{y:g}"/>'
        for end in (point.low, point.high):
            if axis.low < end < axis.high:  # without an end where it leaves the axis
                yield axis.upright(end, y - 2.5, y + 2.5, "end")
    if point.published:
        yield axis.upright(point.published, y - 4.5, y + 4.5, "threshold")
    hollow = "" if point.decided else ' class="hollow"'
    yield f'<use href="#mark-o"{hollow} x="{axis.place(point.value)}" y="{y:g}"/></g>'
