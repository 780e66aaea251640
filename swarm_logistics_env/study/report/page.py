"""The report as an HTML page: drawings to choose from, and what a click shows."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from importlib.resources import files
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from swarm_logistics_env.spi import Interval

from . import drawing
from .document import Document
from .inline_forest import groups_of
from .inline_svg import inline
from .points import Panel
from .section import bracketed, digits_of, width_of

if TYPE_CHECKING:
    from markupsafe import Markup

Chart: TypeAlias = tuple[str, str, Sequence[Panel]]  # name, drawing, and what it shows
_HEIGHT = 2.9  # inch, of a drawing of P
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
    environment.filters["marked_up"] = marked_up
    return environment.get_template("page.html.jinja").render(
        document=document,
        paired=document.runs.data["paired"],
        answer=document.answer,
        groups=groups_of(document.answer, document.points),
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
