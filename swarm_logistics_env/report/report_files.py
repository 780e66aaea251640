"""The report as files: HTML and Markdown to read, drawings, CSV to compute with.

Equal rows give equal bytes.
"""

from __future__ import annotations

import io
import re
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.report.document import Document, document
from swarm_logistics_env.report.drawing import INK, PAPER, WIDTH
from swarm_logistics_env.report.figures import Figure
from swarm_logistics_env.report.markup import html, markdown
from swarm_logistics_env.studies.export import write_csv
from swarm_logistics_env.studies.results import StudyResults

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas


def write_report(
    results: StudyResults, directory: Path, whole: Document | None = None
) -> tuple[Path, ...]:
    """Write report.md, cells.csv, claims.csv, every figure's data, and with the extra `study`
    installed report.html and every figure as SVG and PNG; return the paths of report and tables.

    Raises:
        StudyError: a file cannot be written.
    """
    pictures = directory / "figures"
    try:
        pictures.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StudyError(f"cannot write to {pictures}: {error.strerror}") from error
    whole = whole or document(results)
    for figure in whole.figures():
        write_csv(pictures / f"{figure.name}.csv", figure.data)
    missing = missing_packages()
    if missing:
        text = markdown(whole, note=how_to_get_figures(missing))
    else:
        text = markdown(whole, pictures=pictures.name)
        drawings = {
            figure.name: inline_svg(figure, write_images(figure, pictures))
            for figure in whole.figures()
        }
        write_text(directory / "report.html", html(whole, drawings))
    files = directory / "report.md", directory / "cells.csv", directory / "claims.csv"
    write_text(files[0], text)
    write_csv(files[1], results.performance.drop(columns=["arm", "by_seed", "digests"]))
    write_csv(files[2], results.indicators.drop(columns=["compared", "estimate"]))
    return files if missing else (directory / "report.html", *files)


def write_text(path: Path, text: str) -> None:
    """Write a text file with Unix line ends.

    Raises:
        StudyError: the file cannot be written.
    """
    try:
        path.write_text(text, encoding="utf-8", newline="\n")
    except OSError as error:
        raise StudyError(f"cannot write {path}: {error.strerror}") from error


_STYLE: Any = {
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "axes.facecolor": "none",
    "axes.spines.right": False,
    "axes.spines.top": False,
    "figure.facecolor": PAPER,
    "font.family": "DejaVu Sans",
    "font.size": 9.5,
    "legend.fontsize": 9.0,
    "savefig.facecolor": PAPER,
    "svg.fonttype": "none",
    "svg.hashsalt": "swarm-logistics-env",
    "text.color": INK,
    "text.parse_math": False,
    "xtick.color": INK,
    "ytick.color": INK,
}
_NO_METADATA = {"Creator": None, "Date": None, "Format": None, "Type": None}
DOTS_PER_INCH = 200


def write_images(figure: Figure, directory: Path) -> str:
    """Draw a figure into NAME.svg and NAME.png and return the SVG.

    Raises:
        StudyError: a file cannot be written.
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure as NewCanvas

    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(_STYLE)
        canvas: Canvas = NewCanvas(figsize=(WIDTH, figure.height), layout="constrained")
        figure.draw(canvas)
        svg, png = io.StringIO(), io.BytesIO()
        canvas.savefig(svg, format="svg", metadata=_NO_METADATA)
        canvas.savefig(png, format="png", dpi=DOTS_PER_INCH, metadata={"Software": None})
    path = directory / figure.name
    try:
        path.with_name(f"{figure.name}.svg").write_text(
            svg.getvalue(), encoding="utf-8", newline="\n"
        )
        path.with_name(f"{figure.name}.png").write_bytes(png.getvalue())
    except OSError as error:
        raise StudyError(f"cannot write {path}: {error.strerror}") from error
    return svg.getvalue()


def inline_svg(figure: Figure, svg: str) -> str:
    """Return an SVG drawing as part of a page: its ink, its paper, its width, ids of its own."""
    drawing = svg[svg.index("<svg") :]
    drawing = re.sub(r"<metadata>.*?</metadata>", "", drawing, flags=re.DOTALL)
    head, rest = drawing.split(">", 1)
    box = re.search(r'viewBox="[^"]*"', head)
    assert box is not None
    rest = rest.replace(INK, "currentColor").replace(PAPER, "var(--paper)")
    rest = re.sub(r'\bid="', f'id="{figure.name}-', rest)
    rest = re.sub(r'(href="|url\()#', rf"\1#{figure.name}-", rest)
    return f'<svg {box.group(0)} role="img" aria-label="{figure.name}">{rest}'


def missing_packages() -> tuple[str, ...]:
    """Return which packages that figures and HTML need cannot be loaded."""
    return tuple(name for name in ("jinja2", "matplotlib") if find_spec(name) is None)


def how_to_get_figures(missing: Sequence[str]) -> str:
    """Return the sentence that says what to install."""
    return (
        f"report.html and the drawings of figures need {' and '.join(missing)}: "
        "pip install 'swarm-logistics-env[study]', then ask for the report again."
    )
