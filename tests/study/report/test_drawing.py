from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.figure import Figure

from swarm_logistics_env.study.report import drawing
from swarm_logistics_env.study.report.points import Panel, Point
from tests.conftest import figures_drawn

DRAW = """
import os
from swarm_logistics_env.study.report.drawing import svg_image

svg = svg_image(lambda canvas: canvas.subplots().plot([1, 2]), 2.0)
import matplotlib
assert svg.startswith("<?xml")
print(os.environ["MPLBACKEND"], matplotlib.rcParams["backend"])
"""


@pytest.mark.daily
@pytest.mark.parametrize(
    ("backend", "left"),
    [
        ("module://matplotlib_inline.backend_inline", None),  # of a notebook, not installed here
        ("TkAgg", "tkagg"),
    ],
)
def test_figures_are_drawn_whatever_backend_is_set(backend: str, left: str | None) -> None:
    done = subprocess.run(
        [sys.executable, "-c", DRAW],
        env={**os.environ, "MPLBACKEND": backend}, capture_output=True, text=True, check=True,
    )  # fmt: skip
    named, used = done.stdout.split()
    assert named == backend
    assert left is None or used.lower() == left


def test_matplotlib_is_imported_without_the_backend_that_is_set_and_has_it_afterwards(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stand_in = "import os\nat_import = os.environ.get('MPLBACKEND')\nrcParams = {}\n"
    (tmp_path / "matplotlib.py").write_text(stand_in)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "matplotlib")
    monkeypatch.setenv("MPLBACKEND", "TkAgg")
    module = drawing._matplotlib()
    assert (module.at_import, module.rcParams) == (None, {"backend": "TkAgg"})
    assert os.environ["MPLBACKEND"] == "TkAgg"


def test_thirty_six_series_have_marks_of_their_own() -> None:
    colours = drawing.COLOURS
    marks = {(colours[index % len(colours)], drawing.marker_of(index)) for index in range(36)}
    assert len(marks) == 36


POINT = Point("homing", 0, "N = 5", 4.0, 3.0, 6.0, decided=True)
PANEL = Panel("P", "P", (POINT,), (1.0,), "N")


@pytest.mark.parametrize(
    ("draw", "arguments", "mark", "bars"),
    [
        (drawing.intervals, ([PANEL],), (0, 4), [[(0, 3), (0, 6)]]),
        (drawing.forest, ({"S": [("N = 5", [POINT])]},), (4, 0), [[(3, 0), (6, 0)]]),
    ],
)
def test_a_value_has_a_mark_and_each_of_its_intervals_a_bar(
    draw: Callable[..., None], arguments: Any, mark: Any, bars: Any
) -> None:
    canvas = Figure()
    draw(canvas, *arguments)
    (axes,) = canvas.axes
    marks = [np.asarray(line.get_xydata()).tolist() for line in axes.lines]
    assert [[*mark]] in marks
    collections: list[Any] = [*axes.collections]
    lines = [line for bar in collections for line in bar.get_segments()]
    assert [[tuple(end) for end in line] for line in lines] == bars


def test_a_legend_of_long_names_is_no_wider_than_its_figure() -> None:
    names = ("homing+charging", "homing-stock+charging", "ppo-robust+charging")
    points = [Point(name, i, "N", 4.0, 3.0, 6.0, True) for i, name in enumerate(names)]
    canvas = Figure(figsize=(drawing.WIDTH, 3.0), layout="constrained")
    drawing.intervals(canvas, [Panel("P", "P", tuple(points), (1.0,), "N")])
    canvas.draw_without_rendering()
    assert canvas.legends[0].get_window_extent().x1 <= canvas.bbox.x1


def test_columns_of_a_forest_have_scales_of_their_own_and_one_legend() -> None:
    other = POINT._replace(series="central", style=1, value=8.0, high=9.0)
    rows = [("N = 5", [POINT, other])]
    canvas = Figure()
    drawing.forest(canvas, {"P": rows, "contacts": [("N = 5", [POINT, POINT])]})
    left, right = canvas.axes
    assert (left.get_xlabel(), right.get_xlabel()) == ("P", "contacts")
    assert left.get_xlim()[1] > 9.0 > right.get_xlim()[1]
    (legend,) = canvas.legends
    assert [text.get_text() for text in legend.get_texts()] == ["homing", "central"]


def drawn_scale(values: list[float], thresholds: tuple[float, ...]) -> str:
    points = tuple(
        Point("homing", 0, f"N = {value:g}", value, value - 1.0, value + 1.0) for value in values
    )
    canvas = Figure()
    drawing.intervals(canvas, [Panel("", "", points, thresholds, "")])
    (axes,) = canvas.axes
    low, high = axes.get_ylim()
    assert low <= min(values) <= max(values) < high
    transform = axes.yaxis.get_transform()
    assert getattr(transform, "linthresh", 1.0) == 1.0  # between -1 and 1 it is linear
    return axes.get_yscale()


@pytest.mark.parametrize(
    ("values", "thresholds", "scale"),
    [
        ([10.0, 200.0], (), "linear"),
        ([2.0, 200.0], (), "log"),  # P of a small swarm and of a large one
        ([0.02, 2.0], (), "log"),  # of a throughput
        ([0.0, 200.0], (), "linear"),
        ([-0.6, 0.0, 1.4], (0.0,), "linear"),
        ([-0.6, 0.0, 14.0], (0.0,), "symlog"),
    ],
)
def test_a_value_far_from_all_others_leaves_them_apart(
    values: list[float], thresholds: tuple[float, ...], scale: str
) -> None:
    assert drawn_scale(values, thresholds) == scale


def test_a_run_of_0_has_its_dot_where_the_others_are_far_apart() -> None:
    points = (
        POINT._replace(category="a", value=2.0, low=1.0, high=3.0, runs=(0.0, 4.0), link="a"),
        POINT._replace(category="b", value=200.0, low=190.0, high=210.0, link="b"),
    )
    panel = Panel("", "", points, (), "")
    with figures_drawn("svg"):
        svg = drawing.svg_image(lambda canvas: drawing.intervals(canvas, [panel]), 3.0)
    (dots,) = ElementTree.fromstring(svg).iterfind(".//*[@id='a-seeds-0-1']")
    assert len(list(dots.iterfind(".//{*}use"))) == 2


def test_the_dots_of_runs_spread_to_both_sides_of_the_mean() -> None:
    runs = tuple(float(seed) for seed in range(40))
    canvas = Figure()
    drawing.intervals(canvas, [Panel("", "", (POINT._replace(runs=runs),), (), "")])
    dots: Any = canvas.axes[0].collections[0].get_offsets()
    x = np.asarray(dots)[:, 0]
    assert x.mean() == pytest.approx(0.0, abs=0.02)
    assert x.min() == pytest.approx(-x.max(), abs=0.02)
    assert x.max() > 0.05


def test_an_interval_that_leaves_the_axis_ends_in_an_arrow() -> None:
    points = (POINT._replace(value=0.1, low=-10.0, high=30.0), POINT._replace(category="N = 6"))
    canvas = Figure()
    drawing.forest(canvas, {"S": [("N = 5", [points[0]]), ("N = 6", [points[1]])]})
    (axes,) = canvas.axes
    arrows = {line.get_marker(): np.asarray(line.get_xydata()).tolist() for line in axes.lines}
    low, high = axes.get_xlim()
    assert (arrows["<"], arrows[">"]) == ([[low, 0.0]], [[high, 0.0]])
