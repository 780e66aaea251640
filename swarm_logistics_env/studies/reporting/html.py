"""The report as one HTML page that needs nothing but itself."""

from __future__ import annotations

import re
from collections.abc import Mapping

from swarm_logistics_env.studies.reporting.document import Document

_MARKS = {
    "supported": "✓",
    "refuted": "✗",
    "inconclusive": "?",
    "unaffected": "=",
    "blocked": "!",
}


def html(document: Document, drawings: Mapping[str, str]) -> str:
    """Return the whole report.

    Args:
        document: the report.
        drawings: inline SVG of every figure, by name.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("swarm_logistics_env.studies", "reporting"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters["unbroken"] = _unbroken
    environment.filters["arrows"] = _arrows
    template = environment.get_template("report.html.jinja")
    return template.render(document=document, drawings=drawings, marks=_MARKS)


def _unbroken(text: str) -> str:
    """Return text whose numbers keep their units, and equations their two sides, on one line."""
    held = r"(?<=\d) (?=%|s\b)| (?=[=<→] )|(?<=[=<→]) "
    return re.sub(held, "\N{NO-BREAK SPACE}", _arrows(text))


def _arrows(text: str) -> str:
    return text.replace("->", "→")
