"""Curves with their intervals as bands: deliveries over time, or P over what is varied."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from swarm_logistics_env.spi.inputs import Numbers

from .drawing import COLOURS, INK, LINES, add_legend, make_logarithmic, marker_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

_MOST_MARKS = 24  # of a curve, up to which each value has one


class Curve(NamedTuple):
    """Values over a number, each with its interval.

    Attributes:
        label: what it is of.
        x, y: places and values, shape (k,).
        low, high: limits of the intervals, shape (k,); NaN: there are none.
    """

    label: str
    x: Numbers
    y: Numbers
    low: Numbers
    high: Numbers


class CurvePanel(NamedTuple):
    """Curves on one pair of axes."""

    title: str
    x_label: str
    curves: Sequence[Curve]


def curves(
    canvas: Canvas,
    panels: Sequence[CurvePanel],
    y_label: str,
    *,
    onset: float | None = None,
    n_columns: int = 1,
    logarithmic: bool = False,
) -> None:
    """Draw curves with their intervals, a pair of axes for each panel.

    Args:
        canvas: to draw on.
        panels: from left to right, then from top to bottom.
        y_label: label of the axes of values.
        onset: where a dotted line stands upright; None: nowhere.
        n_columns: of panels. Those beside each other have one scale, in a single column all.
        logarithmic: whether both axes are.
    """
    n_rows = math.ceil(len(panels) / n_columns)
    sharey: Literal["row", "all"] = "row" if n_columns > 1 else "all"
    grid = canvas.subplots(n_rows, n_columns, squeeze=False, sharey=sharey)
    for axes, panel in zip(grid.flat, panels):
        for index, curve in enumerate(panel.curves):
            _draw(axes, curve, index)
        if onset is not None:
            axes.axvline(onset, color=INK, linewidth=1.0, linestyle=":")
        axes.set_title(panel.title)
        if logarithmic:
            places = panel.curves[0].x
            axes.set_xscale("log")
            axes.minorticks_off()
            axes.set_xticks(places, [f"{place:g}" for place in places])
            make_logarithmic(axes)
    lowest = grid.flat[max(0, len(panels) - n_columns) : len(panels)]
    for axes, panel in zip(lowest, panels[-n_columns:]):
        axes.set_xlabel(panel.x_label)
    for axes in grid.flat[len(panels) :]:
        axes.set_axis_off()
    for axes in grid[:, 0]:
        axes.set_ylabel(y_label)
        if not logarithmic:  # after the last curve, as this fixes the scale
            axes.set_ylim(bottom=0.0)
    add_legend(canvas, grid[0, 0])


def _draw(axes: Axes, curve: Curve, index: int) -> None:
    colour = COLOURS[index % len(COLOURS)]
    if not np.isnan(curve.low).any():
        band = curve.x, curve.low.clip(0.0), curve.high
        axes.fill_between(*band, color=colour, alpha=0.16, linewidth=0)
    axes.plot(
        curve.x,
        curve.y,
        LINES[index % len(LINES)],
        color=colour,
        label=curve.label,
        marker=marker_of(index),
        markevery=1 if len(curve.x) <= _MOST_MARKS else (index * 4, 12),
    )
