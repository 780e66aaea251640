"""Curves with their intervals: what stands in each pair of axes, and how far these reach."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from swarm_logistics_env.study.report.curves import Curve, CurvePanel, curves
from swarm_logistics_env.study.report.drawing import COLOURS, INK

HOURS = np.array([1.0, 2.0, 4.0])


def curve(label: str, p: list[float], spread: float = np.nan) -> Curve:
    y = np.array(p)
    return Curve(label, HOURS, y, y - spread, y + spread)


def bands(axes: Axes) -> list[Any]:
    """The least and the most of each band, and its colour."""
    limits = []
    for band in axes.collections:
        y = np.asarray(band.get_paths()[0].vertices)[:, 1]
        colours: Any = band.get_facecolor()
        limits.append((y.min(), y.max(), to_hex(colours[0])))
    return limits


def lines(axes: Axes) -> list[Any]:
    return [
        (
            line.get_label(), np.asarray(line.get_ydata()).tolist(), line.get_linestyle(),
            line.get_color(), line.get_marker(), line.get_markevery(),
        )
        for line in axes.lines
    ]  # fmt: skip


def test_each_curve_has_its_look_and_a_band_that_never_falls_below_0() -> None:
    without_bands = [curve(f"{n}", [5.0, 6.0, 7.0]) for n in range(2, 6)]
    first, second = curve("first", [1.0, 4.0, 9.0], 2.0), curve("second", [8.0, 8.0, 8.0], 0.5)
    panel = CurvePanel("homing", "time [h]", [first, second, *without_bands])
    canvas = Figure()
    curves(canvas, [panel], "deliveries", onset=1.5)
    (axes,) = canvas.axes
    assert (axes.get_title(), axes.get_xlabel()) == ("homing", "time [h]")
    assert (axes.get_ylabel(), axes.get_ylim()[0], axes.get_yscale()) == ("deliveries", 0, "linear")
    assert bands(axes) == [(0.0, 11.0, COLOURS[0]), (7.5, 8.5, COLOURS[1])]
    *of_curves, onset = lines(axes)
    assert of_curves[0] == ("first", [1.0, 4.0, 9.0], "-", COLOURS[0], "o", 1)
    looks = [look[2:] for look in of_curves]
    assert [line for line, *_ in looks] == ["-", "--", "-.", ":", "-", "--"]
    assert [colour for _, colour, *_ in looks] == [*COLOURS]
    assert [marker for _, _, marker, _ in looks] == ["o", "s", "^", "D", "v", "P"]
    assert np.unique(axes.lines[-1].get_xdata()).tolist() == [1.5]
    assert onset[2:4] == (":", INK)
    (legend,) = canvas.legends
    names = [text.get_text() for text in legend.get_texts()]
    assert names == ["first", "second", "2", "3", "4", "5"]


def test_panels_fill_rows_and_have_labels_at_the_edges_alone() -> None:
    panels = [
        CurvePanel(f"{n}", f"{n} [h]", [curve("a", [1.0, 2.0, 10.0**n])]) for n in range(1, 5)
    ]
    canvas = Figure()
    curves(canvas, panels, "P", n_columns=2)
    assert [axes.get_title() for axes in canvas.axes] == ["1", "2", "3", "4"]
    assert [axes.get_xlabel() for axes in canvas.axes] == ["", "", "3 [h]", "4 [h]"]
    assert [axes.get_ylabel() for axes in canvas.axes] == ["P", "", "P", ""]
    tops = [axes.get_ylim()[1] for axes in canvas.axes]
    assert tops[0] == tops[1] < tops[2] == tops[3]
    assert [axes.get_ylim()[0] for axes in canvas.axes] == [0.0] * 4
    assert all(not axes.collections and len(axes.lines) == 1 for axes in canvas.axes)
    canvas = Figure()
    curves(canvas, panels[:3], "P", n_columns=2)
    assert [axes.get_xlabel() for axes in canvas.axes] == ["", "2 [h]", "3 [h]", ""]
    assert [axes.axison for axes in canvas.axes] == [True, True, True, False]


def test_of_many_values_some_have_a_mark_beside_those_of_other_curves() -> None:
    marked_values = []
    for n_values in (24, 25):
        x = np.arange(float(n_values))
        canvas = Figure()
        pair = [Curve(name, x, x, x, x) for name in ("a", "b")]
        curves(canvas, [CurvePanel("", "", pair)], "P")
        marked_values.append([line[-1] for line in lines(canvas.axes[0])])
    assert marked_values == [[1, 1], [(0, 12), (4, 12)]]


def test_logarithmic_axes_have_plain_numbers_at_the_places_of_values() -> None:
    canvas = Figure()
    panel = CurvePanel("", "hours", [curve("a", [3.0, 40.0, 150.0], 1.0)])
    curves(canvas, [panel], "P", logarithmic=True)
    canvas.draw_without_rendering()
    (axes,) = canvas.axes
    assert (axes.get_xscale(), axes.get_yscale()) == ("log", "log")
    assert axes.get_xticks().tolist() == HOURS.tolist()
    assert [label.get_text() for label in axes.get_xticklabels()] == ["1", "2", "4"]
    locator: Any = axes.yaxis.get_major_locator()
    assert [*locator._subs] == [1.0, 2.0, 5.0]
    assert axes.yaxis.get_major_formatter()(20.0) == "20"
    assert [*axes.get_xticks(minor=True), *axes.get_yticks(minor=True)] == []
