"""The report as Markdown."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from swarm_logistics_env.studies.reporting.document import Document
from swarm_logistics_env.studies.reporting.sections import Section


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
