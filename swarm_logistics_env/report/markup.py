"""The report as Markdown, and as one HTML page that needs nothing but itself."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence

from swarm_logistics_env.report.answer import digest
from swarm_logistics_env.report.document import Document
from swarm_logistics_env.report.result_tables import Section
from swarm_logistics_env.spi.verdict_signs import SIGNS

WIDTH = 100  # of the answer [characters]


def markdown(document: Document, *, pictures: str | None = None, note: str = "") -> str:
    """Return the whole report.

    Args:
        document: the report.
        pictures: folder of the drawings beside the report; None: there are none.
        note: a sentence to put below the title.
    """
    lines = [f"# {document.title}", ""]
    for paragraph in (*document.text, note):
        lines += [paragraph, ""] if paragraph else []
    shown = digest(document.answer, WIDTH, None, most=None)
    lines += ["## Answer", "", "```text", shown, "```", ""]
    for chapter in document.chapters:
        lines += [f"## {chapter.title}", ""]
        lines += [chapter.text, ""] if chapter.text else []
        for section in chapter.sections:
            lines += [section_markdown(section, level=3, pictures=pictures)]
    return "\n".join(lines)


def section_markdown(section: Section, *, level: int = 2, pictures: str | None = None) -> str:
    """Return one section, its heading of the given level."""
    lines = [f"{'#' * level} {section.title}", ""] if section.title else []
    lines += _figures(section, pictures)
    if section.sentences:
        lines += [f"* **{one.head}** {one.text}" for one in section.sentences] + [""]
    if section.columns:
        lines += [_row(section.columns), _row(["---"] * len(section.columns))]
        lines += [_row(row) for row in section.rows] + [""]
    for line in section.lines:
        lines += [line, ""]
    return "\n".join(lines)


def _figures(section: Section, pictures: str | None) -> Iterator[str]:
    for figure in section.figures:
        if pictures is not None:
            yield from (f"![{figure.name}]({pictures}/{figure.name}.png)", "")
        yield from (figure.caption, "")


def _row(values: Sequence[str]) -> str:
    escaped = (value.replace("|", r"\|") for value in values)
    return f"| {' | '.join(escaped)} |"


def html(document: Document, drawings: Mapping[str, str]) -> str:
    """Return the whole report.

    Args:
        document: the report.
        drawings: inline SVG of every figure, by name.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("swarm_logistics_env", "report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters["unbroken"] = _unbroken
    environment.filters["arrows"] = _arrows
    template = environment.get_template("report.html.jinja")
    return template.render(
        document=document,
        drawings=drawings,
        marks={name: sign.mark for name, sign in SIGNS.items()},
    )


def _unbroken(text: str) -> str:
    """Return text whose numbers keep their units, and equations their two sides, on one line."""
    held = r"(?<=\d) (?=%|s\b)| (?=[=<→] )|(?<=[=<→]) "
    return re.sub(held, "\N{NO-BREAK SPACE}", _arrows(text))


def _arrows(text: str) -> str:
    return text.replace("->", "→")
