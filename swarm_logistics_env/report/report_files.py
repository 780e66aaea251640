"""The report as files: HTML and Markdown to read, drawings, CSV to compute with.

Equal rows give equal bytes.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.report.document import Document, document
from swarm_logistics_env.report.drawing import INK, PAPER, images
from swarm_logistics_env.report.markup import html, markdown
from swarm_logistics_env.studies.results import StudyResults
from swarm_logistics_env.studies.store import write_csv


def write_report(
    results: StudyResults, directory: Path, whole: Document | None = None
) -> tuple[Path, ...]:
    """Write report.md, cells.csv, claims.csv, every figure's data, and with the extra `study`
    installed report.html and every figure as SVG and PNG; return the paths of report and tables.

    Raises:
        StudyError: a file cannot be written.
    """
    whole = whole or document(results)
    files = directory / "report.md", directory / "cells.csv", directory / "claims.csv"
    pictures, page = directory / "figures", directory / "report.html"
    try:
        pictures.mkdir(parents=True, exist_ok=True)
        write_csv(files[1], results.performance.drop(columns=["arm", "by_seed", "digests"]))
        write_csv(files[2], results.indicators.drop(columns=["compared", "estimate"]))
        for figure in whole.figures():
            write_csv(pictures / f"{figure.name}.csv", figure.data)
        if missing := missing_packages():
            write_text(files[0], markdown(whole, note=how_to_get_figures(missing)))
            return files
        drawings = {}
        for figure in whole.figures():
            svg, png = images(figure.draw, figure.height)
            write_text(pictures / f"{figure.name}.svg", svg)
            (pictures / f"{figure.name}.png").write_bytes(png)
            drawings[figure.name] = _inline_svg(figure.name, svg)
        write_text(files[0], markdown(whole, pictures=pictures.name))
        write_text(page, html(whole, drawings))
    except OSError as error:
        raise StudyError(f"cannot write {error.filename}: {error.strerror}") from error
    return page, *files


def write_text(path: Path, text: str) -> None:
    """Write a text file with Unix line ends.

    Raises:
        StudyError: the file cannot be written.
    """
    try:
        path.write_text(text, encoding="utf-8", newline="\n")
    except OSError as error:
        raise StudyError(f"cannot write {path}: {error.strerror}") from error


def _inline_svg(name: str, svg: str) -> str:
    """Return an SVG drawing as part of a page: its ink, its paper, its width, ids of its own."""
    drawing = svg[svg.index("<svg") :]
    drawing = re.sub(r"<metadata>.*?</metadata>", "", drawing, flags=re.DOTALL)
    head, rest = drawing.split(">", 1)
    box = re.search(r'viewBox="[^"]*"', head)
    assert box is not None
    rest = rest.replace(INK, "currentColor").replace(PAPER, "var(--paper)")
    rest = re.sub(r'\bid="', f'id="{name}-', rest)
    rest = re.sub(r'(href="|url\()#', rf"\1#{name}-", rest)
    return f'<svg {box.group(0)} role="img" aria-label="{name}">{rest}'


def missing_packages() -> tuple[str, ...]:
    """Return which packages that figures and HTML need cannot be loaded."""
    return tuple(name for name in ("jinja2", "matplotlib") if find_spec(name) is None)


def how_to_get_figures(missing: Sequence[str]) -> str:
    """Return the sentence that says what to install."""
    return (
        f"report.html and the drawings of figures need {' and '.join(missing)}: "
        "pip install 'swarm-logistics-env[study]', then ask for the report again."
    )
