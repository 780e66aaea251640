"""The questions of an answer in groups, each with its value drawn as a part of the page.

Places along an axis are in percent: a drawing fits any width, and its marks keep their shape.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from html import escape
from typing import Literal, NamedTuple

from more_itertools import map_reduce

from .answer import Answer
from .answer_lines import Line
from .points import Point, axis_limits, has_far_values, times_limits
from .section import ratio

_ROW_HEIGHT = 20.0  # px, of the drawing of a line of the answer


class Row(NamedTuple):
    """A question.

    Attributes:
        line: of the answer.
        name: the question without its indicator.
        svg: its value, drawn.
    """

    line: Line
    name: str
    svg: str


class Group(NamedTuple):
    """The questions on one indicator of one policy and task.

    Attributes:
        heading: which indicator; with the policy and task where there are several.
        axis: the axis of the values with its numbers, drawn.
        rows: the questions.
    """

    heading: str
    axis: str
    rows: tuple[Row, ...]


def groups_of(answer: Answer, points: Sequence[Point]) -> tuple[Group, ...]:
    """Return the questions of an answer in groups.

    Args:
        points: the value of each line of the answer.
    """
    pairs = [*zip(answer.lines, points)]
    indicators = [point for line, point in pairs if not line.verdict.compares_policies]
    factors = [point for line, point in pairs if line.verdict.compares_policies]
    of_indicators = _Axis(*axis_limits(indicators), "far" if has_far_values(indicators) else "even")
    of_factors = _Axis(*times_limits(factors), "times")
    by_heading: dict[str, list[tuple[Line, Point]]] = map_reduce(
        pairs, lambda pair: _heading(answer, pair[0])
    )
    groups = []
    for heading, alike in by_heading.items():
        axis = of_factors if alike[0][0].verdict.compares_policies else of_indicators
        rows = [
            Row(line, line.name(with_subject=False), _row(axis, point, line))
            for line, point in alike
        ]
        groups.append(Group(heading, _numbers(axis), tuple(rows)))
    return tuple(groups)


def _heading(answer: Answer, line: Line) -> str:
    is_alone = len(answer.lines_by_subject) == 1
    return line.heading if is_alone else f"{line.subject}: {line.heading}"


class _Axis(NamedTuple):
    """An axis from `low` to `high`: even, "far" (beyond 1 logarithmic), or of "times" about 1."""

    low: float
    high: float
    scale: Literal["even", "far", "times"]

    @property
    def ticks(self) -> list[float]:
        from matplotlib.ticker import Locator, LogLocator, MaxNLocator, SymmetricalLogLocator

        locator: Locator = MaxNLocator(6, steps=[1, 2, 5, 10])
        if self.scale == "far":
            locator = SymmetricalLogLocator(base=10.0, linthresh=1.0)
        elif self.scale == "times":
            locator = LogLocator(subs=(1.0, 2.0, 5.0))
        ticks = locator.tick_values(self.low, self.high)
        return [float(tick) for tick in ticks if self.low <= tick <= self.high]

    @property
    def middle(self) -> float:
        """The value on which there is no effect."""
        return 1.0 if self.scale == "times" else 0.0

    def place(self, value: float) -> str:
        inside = min(max(value, self.low), self.high)
        low, at, high = map(self._scaled, (self.low, inside, self.high))
        return f"{100 * (at - low) / (high - low):.2f}%"

    def _scaled(self, value: float) -> float:
        if self.scale == "times":
            return math.log(value)
        if self.scale == "even" or abs(value) <= 1.0:
            return value
        return math.copysign(1.0 + math.log10(abs(value)), value)

    def upright(self, value: float, top: float, bottom: float, css_class: str) -> str:
        x = self.place(value)
        return f'<line class="{css_class}" x1="{x}" x2="{x}" y1="{top:g}" y2="{bottom:g}"/>'


def _numbers(axis: _Axis) -> str:
    numbers = "".join(
        f'{axis.upright(tick, 14, 18, "axis")}<text x="{axis.place(tick)}" y="11">{tick:g}</text>'
        for tick in axis.ticks
    ).replace(">-", ">\N{MINUS SIGN}")
    line = '<line class="axis" x1="0" x2="100%" y1="17.5" y2="17.5"/>'
    return f'<svg height="18" aria-hidden="true">{line}{numbers}</svg>'


def _row(axis: _Axis, point: Point, line: Line) -> str:
    grid = "".join(axis.upright(tick, 0, _ROW_HEIGHT, "grid") for tick in axis.ticks)
    middle = axis.upright(axis.middle, 0, _ROW_HEIGHT, "threshold")
    marks = "".join(_mark(axis, _ROW_HEIGHT / 2, point, line))
    return f'<svg height="{_ROW_HEIGHT:g}" aria-hidden="true">{grid}{middle}{marks}</svg>'


def _mark(axis: _Axis, y: float, point: Point, line: Line) -> Iterator[str]:
    """Yield the parts of a value with its interval, in the colour of its verdict."""
    if point.value is None:
        return
    verdict = line.verdict
    title = f"{verdict.compared.label}: {ratio(verdict)}, {verdict.in_words}"
    if verdict.compares_policies:
        title = f"{line.question}: {line.value} {line.interval}, {verdict.in_words}"
    number = point.link.rpartition("-")[2]
    yield f'<g class="{verdict.conclusion}" data-question="{number}"><title>{escape(title)}</title>'
    if point.low is not None and point.high is not None:
        ends = axis.place(point.low), axis.place(point.high)
        yield f'<line x1="{ends[0]}" x2="{ends[1]}" y1="{y:g}" y2="{y:g}"/>'
        for end, arrow in ((point.low, "left"), (point.high, "right")):
            if axis.low < end < axis.high:
                yield axis.upright(end, y - 2.5, y + 2.5, "end")
            else:  # it leaves the axis
                yield f'<use href="#arrow-{arrow}" x="{axis.place(end)}" y="{y:g}"/>'
    if point.published and point.published != axis.middle:
        yield axis.upright(point.published, y - 4.5, y + 4.5, "threshold")
    hollow = "" if point.decided else ' class="hollow"'
    yield f'<use href="#mark-o"{hollow} x="{axis.place(point.value)}" y="{y:g}"/></g>'
