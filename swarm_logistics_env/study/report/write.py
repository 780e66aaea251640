"""The report as files: HTML, Markdown, LaTeX, drawings, and CSV.

Equal rows give equal bytes.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

from swarm_logistics_env.core.errors import StudyError, how_to_install
from swarm_logistics_env.core.records import atomic_write, plain, write_csv
from swarm_logistics_env.study.verdicts.results import StudyResults

from .document import Document, document
from .drawing import PAGE_STYLE, FigureStyle, images, svg_image
from .latex import latex_tables
from .page import html
from .section import Section


def write_report(results: StudyResults, directory: Path) -> tuple[Path, ...]:
    """Write the report on a study's results, as `write_document` does."""
    return write_document(document(results), directory)


def write_document(
    report: Document, directory: Path, style: FigureStyle = PAGE_STYLE
) -> tuple[Path, ...]:
    """Write report.md, cells.csv, claims.csv, tables.tex, every figure's data, and with the extra
    `study` report.html and every figure as SVG, PDF and PNG; return the paths of report and tables.

    Raises:
        StudyError: a file cannot be written.
    """
    advice = how_to_get_figures()
    pictures = directory / "figures"
    figures = () if advice else report.figures
    texts = {"tables.tex": latex_tables(report.paper)}
    texts["report.md"] = markdown(report, pictures=None if advice else pictures.name, note=advice)
    tables = {"cells.csv": report.cells, "claims.csv": report.claims}
    tables |= {f"{pictures.name}/{figure.name}.csv": figure.data for figure in report.figures}
    try:
        pictures.mkdir(parents=True, exist_ok=True)
        drawings = {
            figure.name: images(figure.draw, figure.height, figure.note, style)
            for figure in figures
        }
        if not advice:
            svgs = {name: drawing.svg for name, drawing in drawings.items()}
            if style != PAGE_STYLE:
                svgs = {
                    figure.name: svg_image(figure.draw, figure.height, figure.note)
                    for figure in figures
                }
            texts["report.html"] = html(report, svgs, texts["tables.tex"])
        for name, table in tables.items():
            write_csv(directory / name, table, StudyError)
        for name, drawing in drawings.items():
            write_text(pictures / f"{name}.svg", drawing.svg)
            for ending, content in (("pdf", drawing.pdf), ("png", drawing.png)):
                with atomic_write(pictures / f"{name}.{ending}", StudyError) as part:
                    part.write_bytes(content)
        for name, text in texts.items():
            write_text(directory / name, text)
    except OSError as error:
        raise StudyError(f"cannot write {error.filename}: {error.strerror}") from error
    names = "report.html", "report.md", "cells.csv", "claims.csv", "tables.tex"
    return tuple(directory / name for name in names if name in texts or name in tables)


def write_text(path: Path, text: str) -> None:
    """Write a text file with Unix line ends.

    Raises:
        StudyError: the file cannot be written.
    """
    with atomic_write(path, StudyError) as part:
        part.write_text(text, encoding="utf-8", newline="\n")


def how_to_get_figures() -> str:
    """Return what to install for figures and HTML; empty: their packages are there."""
    missing = [name for name in ("jinja2", "matplotlib") if find_spec(name) is None]
    if not missing:
        return ""
    return (
        f"report.html and the drawings of figures need {' and '.join(missing)}: "
        f"{how_to_install('study')}, then ask for the report again."
    )


def markdown(document: Document, *, pictures: str | None = None, note: str = "") -> str:
    """Return the whole report.

    Args:
        document: the report.
        pictures: folder of the drawings beside the report; None: there are none.
        note: a sentence to put below the title.
    """
    lines = [f"# {document.answer.title}", ""]
    for paragraph in (*document.text, note):
        lines += [_inert(paragraph), ""] if paragraph else []
    answer = document.answer
    overview = answer.overview or Section("")
    opening = Section("Answer", lines=tuple(answer.opening))
    summary = overview._replace(lines=tuple(answer.summary))
    lines += map(section_markdown, (opening, summary, answer.section))
    for chapter in document.chapters:
        lines += [f"## {chapter.title}", ""]
        lines += [chapter.text, ""] if chapter.text else []
        for section in chapter.sections:
            lines += [section_markdown(section, level=3, pictures=pictures)]
    return "\n".join(lines)


def section_markdown(section: Section, *, level: int = 2, pictures: str | None = None) -> str:
    """Return one section, its heading of the given level."""
    lines = [f"{'#' * level} {_inert(section.title)}", ""] if section.title else []
    for figure in section.figures:
        if pictures is not None:
            lines += [f"![{figure.name}]({pictures}/{figure.name}.png)", ""]
        lines += [_inert(f"{figure.caption} {figure.note}"), ""]
    if section.sentences:
        for sentence in section.sentences:
            lines += [f"* **{_inert(sentence.head)}** {_inert(sentence.text)}"]
        lines += [""]
    if section.columns:
        lines += [_row(section.columns), _row(["---"] * len(section.columns))]
        lines += [_row(row) for row in section.rows] + [""]
    for line in section.lines:
        lines += [_inert(line), ""]
    return "\n".join(lines)


def _row(values: Sequence[str]) -> str:
    escaped = (_inert(value).replace("|", r"\|") for value in values)
    return f"| {' | '.join(escaped)} |"


def _inert(text: str) -> str:
    """Return a text of which Markdown makes neither a tag, nor a link, nor a picture."""
    live = r"<(?=[A-Za-z/!?])|(?<=\])(?=\()"
    return re.sub(live, lambda match: "&lt;" if match[0] else "\\", plain(text))
