"""Figures as files: data as CSV, drawings as SVG and PNG; equal data give equal bytes."""

from __future__ import annotations

import io
import re
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.studies.reporting.drawing import INK, PAPER, WIDTH
from swarm_logistics_env.studies.reporting.figures import Figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas

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
