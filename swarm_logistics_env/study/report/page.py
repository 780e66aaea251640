"""The report as an HTML page: drawings to choose from, and what a click shows."""

from __future__ import annotations

import base64
import json
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from html import escape
from importlib.resources import files
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from swarm_logistics_env.spi import Interval
from swarm_logistics_env.study.verdicts.verdict import Verdict

from . import drawing
from .answer import Answer
from .document import Document
from .inline_svg import inline
from .points import Panel, Point, axis_limits, has_far_values
from .section import bracketed, digits_of, ratio, width_of

if TYPE_CHECKING:
    from markupsafe import Markup

Chart: TypeAlias = tuple[str, str, Sequence[Panel]]  # name, drawing, and what it shows
_HEIGHT = 2.9  # inch, of a drawing of P
_ROW_HEIGHT = 20.0  # px, of the drawing of a line of the answer
# Of decisions, on light and on dark paper, after Okabe and Ito.
_COLOURS = {
    "supported": ("#006b4c", "#3fc79a"),
    "refuted": ("#a84300", "#f5915a"),
    "equivalent": ("#005b94", "#6cb8ee"),
    "open": ("#5b6068", "#a9afb8"),
    "unaffected": ("#5b6068", "#a9afb8"),
    "untestable": ("#5b6068", "#a9afb8"),
    "undefined": ("#a84300", "#f5915a"),
}


class View(NamedTuple):
    """A drawing that the page's reader may choose to see.

    Attributes:
        name: what it shows.
        svg: the drawing, as a part of the page.
    """

    name: str
    svg: str


def html(document: Document, drawings: Mapping[str, str], latex: str) -> str:
    """Return the whole report as one page that loads nothing.

    Args:
        document: the report.
        drawings: SVG of every figure, by name.
        latex: the tables for a paper, which the page shows as text.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("swarm_logistics_env", "study/report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    views = list(_views(document, drawings))
    rows, axis = _forest(document.answer, document.points)
    environment.filters["marked_up"] = marked_up
    return environment.get_template("page.html.jinja").render(
        document=document,
        paired=document.runs.data["paired"],
        answer=document.answer,
        groups=len(document.answer.lines_by_subject),
        forest=rows,
        axis=axis,
        views=views,
        colours=_COLOURS,
        drawings={name: base64.b64encode(svg.encode()).decode() for name, svg in drawings.items()},
        latex=latex,
        # A text must not end the script that it stands in.
        data=json.dumps(document.runs.data, separators=(",", ":")).replace("<", "\\u003c"),
        script=files(__package__).joinpath("page.js").read_text(encoding="utf-8"),
    )


def marked_up(text: str) -> Markup:
    """Return a text as HTML: counted verdicts have their colours, and no line ends in an option."""
    from markupsafe import Markup
    from markupsafe import escape as escaped

    html = re.sub(r"--[a-z][\w-]*", r'<span class="option">\g<0></span>', str(escaped(text)))
    counted = rf"\d+ ({'|'.join(_COLOURS)})\b"
    return Markup(re.sub(counted, r'<span class="word \1">\g<0></span>', html))


def _views(document: Document, drawings: Mapping[str, str]) -> Iterator[View]:
    """Yield P of every policy in the conditions of each table, then the figures of indicators."""
    charts: list[Chart] = []
    for table, panel in document.runs.panels.items():
        draw = partial(drawing.intervals, panels=[panel])
        svg = drawing.svg_image(draw, _HEIGHT, document.runs.note)
        charts.append((f"P: {table}", svg, [panel]))
    charts += [
        (figure.title, drawings[figure.name], figure.panels)
        for figure in document.figures
        if figure.panels
    ]
    for number, (name, svg, panels) in enumerate(charts):
        yield View(name, inline(svg, f"v{number}", _titles(panels)))


def _titles(panels: Sequence[Panel]) -> dict[str, str]:
    """Return what each mark shows in words, by its id."""
    titles = {}
    for panel in panels:
        for point in panel.points:
            if point.value is not None:
                interval = Interval(point.value, point.low, point.high)
                digits = 3 if panel.thresholds else digits_of(point.value, width_of(interval))
                text = bracketed(interval, digits, panel.thresholds)
                titles[point.link] = f"{point.series}, {point.category}: {text}"
            if point.published is not None:
                titles[f"published-{point.link}"] = f"published: {point.published:g}"
    return titles


class _Axis(NamedTuple):
    """The axis of the values, from `low` to `high`; beyond 1 it may be logarithmic."""

    low: float
    high: float
    is_stretched: bool

    @property
    def ticks(self) -> list[float]:
        from matplotlib.ticker import Locator, MaxNLocator, SymmetricalLogLocator

        locator: Locator = MaxNLocator(6, steps=[1, 2, 5, 10])
        if self.is_stretched:
            locator = SymmetricalLogLocator(base=10.0, linthresh=1.0)
        ticks = locator.tick_values(self.low, self.high)
        return [float(tick) for tick in ticks if self.low <= tick <= self.high]

    def place(self, value: float) -> str:
        inside = min(max(value, self.low), self.high)
        low, at, high = map(self._scaled, (self.low, inside, self.high))
        return f"{100 * (at - low) / (high - low):.2f}%"

    def _scaled(self, value: float) -> float:
        if not self.is_stretched or abs(value) <= 1.0:
            return value
        return math.copysign(1.0 + math.log10(abs(value)), value)

    def upright(self, value: float, top: float, bottom: float, css_class: str) -> str:
        x = self.place(value)
        return f'<line class="{css_class}" x1="{x}" x2="{x}" y1="{top:g}" y2="{bottom:g}"/>'


def _forest(answer: Answer, points: Sequence[Point]) -> tuple[list[str], str]:
    """Return a drawing of each line of the answer, and their axis with its numbers.

    Places along the axis are in percent: a drawing fits any width, and its marks keep their shape.

    Args:
        points: the value of each line.
    """
    axis = _Axis(*axis_limits(points), has_far_values(points))
    drawn = [_row(axis, point, line.verdict) for point, line in zip(points, answer.lines)]
    numbers = "".join(
        f'{axis.upright(tick, 14, 18, "axis")}<text x="{axis.place(tick)}" y="11">{tick:g}</text>'
        for tick in axis.ticks
    ).replace(">-", ">\N{MINUS SIGN}")
    line = '<line class="axis" x1="0" x2="100%" y1="17.5" y2="17.5"/>'
    return drawn, f'<svg height="18" aria-hidden="true">{line}{numbers}</svg>'


def _row(axis: _Axis, point: Point, verdict: Verdict) -> str:
    grid = "".join(axis.upright(tick, 0, _ROW_HEIGHT, "grid") for tick in axis.ticks)
    zero = axis.upright(0.0, 0, _ROW_HEIGHT, "threshold")
    marks = "".join(_mark(axis, _ROW_HEIGHT / 2, point, verdict))
    return f'<svg height="{_ROW_HEIGHT:g}" aria-hidden="true">{grid}{zero}{marks}</svg>'


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
