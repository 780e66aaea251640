"""Everything that figures and the page's single runs show of two made-up studies."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure as Canvas
from matplotlib.text import Text

from swarm_logistics_env.study.report.document import document
from swarm_logistics_env.study.report.section import Figure
from swarm_logistics_env.study.verdicts.results import StudyResults

FROZEN = Path(__file__).parents[2] / "frozen"
RECORDED_WITH = "3.11.2"  # of matplotlib, whose versions choose ticks


def in_short(values: Any) -> str:
    """Return numbers with three digits that count, which no machine rounds otherwise."""
    return " ".join(f"{value:.3g}" for value in np.ravel(np.ma.filled(values, np.nan)))


def texts_of(texts: list[Text]) -> list[str]:
    return [f"{text.get_text()} {text.get_fontweight()}" for text in texts if text.get_text()]


def describe_axes(axes: Axes) -> Iterator[str]:
    """Yield a line for whatever stands in a panel."""
    yield f"  panel {axes.get_title()!r}: {axes.get_xlabel()!r}, {axes.get_ylabel()!r}"
    for name, axis in (("x", axes.xaxis), ("y", axes.yaxis)):
        limits = in_short(axis.get_view_interval())
        yield f"    {name} {axis.get_scale()} {limits}: {texts_of(axis.get_ticklabels())}"
    for line in axes.lines:
        look = f"{line.get_marker()} {line.get_linestyle()} {line.get_linewidth():.2g}"
        colours = f"{to_hex(line.get_color())} {to_hex(line.get_markerfacecolor(), True)}"
        points = f"{in_short(line.get_xdata())} | {in_short(line.get_ydata())}"
        yield f"    line {look} {colours}: {points}"
    for collection in axes.collections:
        segments = [in_short(path.vertices) for path in collection.get_paths()]
        yield f"    collection {in_short(collection.get_offsets())}: {segments}"
    yield f"    texts {texts_of(list(axes.texts))}, patches {len(axes.patches)}"


def describe(figure: Figure) -> Iterator[str]:
    """Yield all that a figure says and shows, a line each."""
    yield f"{figure.name}: {figure.title}; height {figure.height:.3g}"
    yield f"  {figure.caption}"
    yield f"  {figure.note}"
    canvas = Canvas(figsize=(5.2, figure.height), layout="constrained")
    figure.draw(canvas)
    for axes in canvas.axes:
        yield from describe_axes(axes)
    for legend in canvas.legends:
        yield f"  legend {texts_of(legend.get_texts())}"
    for line in figure.data.to_csv(index=False, float_format="%.4g").splitlines():
        yield f"  {line}"


@pytest.mark.skipif(matplotlib.__version__ != RECORDED_WITH, reason="of another matplotlib")
def test_figures_and_single_runs_are_as_recorded(
    compared: StudyResults, stopped: StudyResults, tmp_path: Path
) -> None:
    reports = {"compared": document(compared), "stopped": document(stopped)}
    figures = [
        f"{name} {line}"
        for name, report in reports.items()
        for figure in report.figures
        for line in describe(figure)
    ]
    runs = [
        f"{name} {json.dumps(part, sort_keys=True)}"
        for name, value in reports["stopped"].runs.data.items()
        for part in (value if isinstance(value, list) else [value])
    ]
    for file, lines in {"figures.txt": figures, "single_runs.txt": runs}.items():
        made = tmp_path / file
        made.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")
        recorded = (FROZEN / file).read_text(encoding="utf-8").splitlines()
        assert made.read_text(encoding="utf-8").splitlines() == recorded, (
            f"if {made} is as it should be, put it into {FROZEN}"
        )
