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
from swarm_logistics_env.study.report.points import Panel, Point, axis_limits, times_limits
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
    ("backend", "backend_of_matplotlib"),
    [
        ("module://matplotlib_inline.backend_inline", None),  # of a notebook, not installed here
        ("TkAgg", "tkagg"),
    ],
)
def test_figures_are_drawn_whatever_backend_is_set(
    backend: str, backend_of_matplotlib: str | None
) -> None:
    process = subprocess.run(
        [sys.executable, "-c", DRAW],
        env={**os.environ, "MPLBACKEND": backend}, capture_output=True, text=True, check=True,
    )  # fmt: skip
    in_environment, in_matplotlib = process.stdout.split()
    assert in_environment == backend
    assert backend_of_matplotlib in (None, in_matplotlib.lower())


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


@pytest.mark.parametrize(
    ("width", "letters", "n_series", "n_columns"),
    [(5.2, 4, 4, 3), (5.2, 16, 4, 2), (5.2, 40, 4, 1), (1.3, 4, 2, 1), (1.3, 40, 2, 1)],
)
def test_a_legend_has_as_many_columns_as_its_figure_is_wide_enough_for(
    width: float, letters: int, n_series: int, n_columns: int
) -> None:
    names = [str(number) * letters for number in range(n_series)]
    canvases = []

    def draw(canvas: Figure) -> None:
        axes = canvas.subplots()
        for name in names:
            axes.errorbar([1.0], [2.0], [0.5], fmt="s", color=drawing.COLOURS[1], label=name)
        drawing.add_legend(canvas, axes)
        canvas.draw_without_rendering()
        canvases.append(canvas)

    drawing.svg_image(draw, 3.0, style=drawing.FigureStyle(width))
    (canvas,) = canvases
    legend: Any
    (legend,) = canvas.legends
    assert n_columns == 1 or legend.get_window_extent().x1 <= canvas.bbox.x1
    assert [text.get_text() for text in legend.get_texts()] == names
    assert len({round(text.get_window_extent().x0) for text in legend.get_texts()}) == n_columns
    for line in legend.get_lines():
        look = line.get_marker(), line.get_color(), line.get_linestyle()
        assert look == ("s", drawing.COLOURS[1], "None")


def test_columns_of_a_forest_have_scales_of_their_own_and_one_legend() -> None:
    central = POINT._replace(series="central", style=1, value=8.0, high=9.0)
    rows = [("N = 5", [POINT, central])]
    canvas = Figure()
    drawing.forest(canvas, {"P": rows, "contacts": [("N = 5", [POINT, POINT])]}, "Sizes")
    left, right = canvas.axes
    assert (left.get_xlabel(), right.get_xlabel()) == ("P", "contacts")
    assert (left.get_title(), right.get_title()) == ("Sizes", "")
    assert left.get_xlim()[1] > 9.0 > right.get_xlim()[1]
    (legend,) = canvas.legends
    assert [text.get_text() for text in legend.get_texts()] == ["homing", "central"]


def assert_numbers_are_plain(axis: Any) -> None:
    """Numbers are 1, 2, 5, 10, 20 and so on if an axis is logarithmic, and have no powers."""
    assert axis.get_major_formatter()(20.0) == "20"
    if axis.get_scale() == "log":
        assert [*axis.get_major_locator()._subs] == [1.0, 2.0, 5.0]
        assert axis.get_minorticklocs().size == 0


def scale_of(values: list[float], thresholds: tuple[float, ...]) -> str:
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
    scale = axes.get_yscale()
    if scale != "linear":
        assert_numbers_are_plain(axes.yaxis)
    return scale


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
    assert scale_of(values, thresholds) == scale


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


def places_of(axes: Any) -> list[Any]:
    """Where each line of some axes lies, with its mark."""
    return [
        (line.get_marker(), np.round(np.asarray(line.get_xydata()), 3).tolist())
        for line in axes.lines
    ]


def test_series_stand_beside_each_other_with_what_was_published_and_where_p_is_capped() -> None:
    second = POINT._replace(series="central", style=1, value=2.0, low=None, high=None)
    points = (
        POINT._replace(published=5.0, saturated=True, link="question-7"),
        second,
        POINT._replace(category="N = 10", decided=False),
    )
    canvas = Figure(figsize=(drawing.WIDTH, 3.0))
    panels = [Panel("One", "R", points, (0.0, 1.0), "N"), Panel("Two", "S", points[:1], (), "M")]
    drawing.intervals(canvas, panels)
    names = [text.get_text() for text in canvas.legends[0].get_texts()]
    assert names == ["homing", "central"]
    all_axes: list[Any] = [*canvas.axes]
    first, last = all_axes
    assert (first.get_title(), first.get_ylabel(), first.get_xlabel()) == ("One", "R", "N")
    assert (last.get_title(), last.get_ylabel(), last.get_xlabel()) == ("Two", "S", "M")
    assert places_of(first)[:4] == [
        ("None", [[0.0, 0.0], [1.0, 0.0]]), ("None", [[0.0, 1.0], [1.0, 1.0]]),
        ("x", [[-0.02, 5.0]]), ("o", [[-0.12, 4.0]]),
    ]  # fmt: skip
    marks = [(mark, *point) for mark, (point, *_) in places_of(first) if mark in ("o", "s")]
    assert marks == [("o", -0.12, 4.0), ("s", 0.12, 2.0), ("o", 0.88, 4.0)]
    fills = [line.get_markerfacecolor() for line in first.lines if line.get_marker() in ("o", "s")]
    assert fills == [*drawing.COLOURS[:2], drawing.PAPER]
    gids = {line.get_marker(): line.get_gid() for line in reversed(first.lines)}
    assert (gids["x"], gids["o"], gids["s"]) == ("published-question-7", "question-7", None)
    (dagger,) = first.texts
    assert (dagger.get_text(), dagger.xy) == ("†", (pytest.approx(-0.12), 4.0))
    assert [tick.get_text() for tick in first.get_xticklabels()] == ["N = 5", "N = 10"]
    assert first.get_xlim() == (-0.6, 1.6)
    assert first.get_ylim() == pytest.approx(axis_limits(points))
    assert last.get_ylim() == (0.0, pytest.approx(axis_limits(points[:1])[1]))
    assert last.get_xlim() == (-0.6, 0.6)
    assert [len(axes.lines[0].get_xydata()) for axes in (first, last)] == [2, 1]


@pytest.mark.parametrize(("title", "heading"), [("", "homing"), ("R", "R")])
def test_a_single_series_stands_in_the_title(title: str, heading: str) -> None:
    canvas = Figure()
    drawing.intervals(canvas, [Panel(title, "", (POINT,), (), "")])
    assert canvas.axes[0].get_title() == heading
    assert canvas.legends == []


@pytest.mark.parametrize(("letters", "rotation"), [(40, 0.0), (41, 40.0)])
def test_long_categories_are_turned(letters: int, rotation: float) -> None:
    points = tuple(POINT._replace(category=c * letters) for c in "ab")
    canvas = Figure(figsize=(4.2 / 0.775, 3.0))
    drawing.intervals(canvas, [Panel("", "", points, (), "")])
    assert {tick.get_rotation() for tick in canvas.axes[0].get_xticklabels()} == {rotation}


def test_rows_of_a_forest_have_headings_thresholds_and_far_values() -> None:
    far = POINT._replace(value=20.0, low=10.0, high=30.0, published=1.0)
    rows = [("Sizes", []), ("N = 5", [POINT._replace(published=0.0), far]), ("N = 6", [far] * 8)]
    canvas = Figure()
    drawing.forest(canvas, {"S": rows})
    axes: Any = canvas.axes[0]
    labels = axes.get_yticklabels()
    assert [label.get_text() for label in labels] == ["Sizes", "N = 5", "N = 6"]
    assert [label.get_fontweight() for label in labels] == ["bold", "normal", "normal"]
    ticks = axes.yaxis.get_major_ticks()
    assert [tick.tick1line.get_visible() for tick in ticks] == [False, True, True]
    assert axes.get_ylim() == (2.6, -0.6)
    heights = [y for mark, ((_, y), *_) in places_of(axes) if mark == "o"]
    assert heights == [0.85, 1.15, *np.round(1.7375 + 0.075 * np.arange(8), 3)]
    sizes = [line.get_markersize() for line in axes.lines if line.get_marker() == "o"]
    assert sizes[2:] == [sizes[0] / 2.0] * 8
    thresholds = [c for c in axes.collections if len(c.get_paths()[0].vertices) == 2]
    segments = [bar.get_segments()[0].tolist() for bar in thresholds]
    assert [s for s in segments if s[0][0] == s[1][0]] == [
        [[1.0, row - 0.4], [1.0, row + 0.4]] for row in (1, *[2] * 8)
    ]
    assert ("None", [[0.0, 0.0], [0.0, 1.0]]) in places_of(axes)
    low, high = axis_limits([POINT._replace(published=0.0), far])
    assert axes.get_xlim() == pytest.approx((1.5 * low, 1.5 * high))
    transform = axes.xaxis.get_transform()
    assert (axes.get_xscale(), transform.linthresh) == ("symlog", 1.0)
    assert_numbers_are_plain(axes.xaxis)


def test_factors_lie_on_a_logarithmic_axis_about_1() -> None:
    point = POINT._replace(value=0.5, low=0.25, high=30.0, published=1.0)
    canvas = Figure()
    drawing.forest(canvas, {"times": [("N = 5", [point])]}, is_of_times=True)
    axes: Any = canvas.axes[0]
    assert (axes.get_xscale(), axes.get_xlim()) == ("log", pytest.approx(times_limits([point])))
    assert_numbers_are_plain(axes.xaxis)
    assert ("None", [[1.0, 0.0], [1.0, 1.0]]) in places_of(axes)
    assert (">", [[5.75, 0.0]]) in places_of(axes)
    assert len(axes.collections) == 1


@pytest.mark.parametrize(
    ("note", "style", "size", "lines"),
    [
        ("", drawing.PAGE_STYLE, ("374.4pt", "144pt"), []),
        (
            f"Bars: 95 % {17 * 'word '}end.",
            drawing.PAGE_STYLE,
            ("374.4pt", "165.6pt"),
            ["Bars: 95\N{NO-BREAK SPACE}% " + " ".join(14 * ["word"]), "word word word end."],
        ),
        (  # a quarter as wide has letters of half the size
            f"Bars: 95 % {17 * 'word '}end.",
            drawing.FigureStyle(1.3, drawing.SERIF),
            ("93.6pt", "88.2pt"),
            [
                "Bars: 95\N{NO-BREAK SPACE}% word word word word word word",
                "word word word word word word word word",
                "word word word end.",
            ],
        ),
    ],
)
def test_a_note_is_folded_below_its_drawing(
    note: str, style: drawing.FigureStyle, size: tuple[str, str], lines: list[str]
) -> None:
    with figures_drawn("svg"):
        svg = drawing.svg_image(lambda canvas: canvas.subplots().set_axis_off(), 2.0, note, style)
    root = ElementTree.fromstring(svg)
    assert (root.get("width"), root.get("height")) == size
    texts = [str(text.text) for text in root.iterfind(".//{*}text")]
    assert [text for text in texts if text[0] in "Bw"] == lines
    assert "<dc:date>" not in svg
