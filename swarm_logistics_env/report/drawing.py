"""Drawing with matplotlib, which is loaded only when a figure is drawn.

The colours are those of Okabe and Ito, and every series has a marker of its own as well. Lines and
letters are drawn in `INK` on `PAPER`, and a page puts its own colours in the place of these two.
"""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from swarm_logistics_env.studies.fault_measures import RepairCurve
from swarm_logistics_env.studies.performance_table import groups_of

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

Draw: TypeAlias = "Callable[[Canvas], None]"

INK, PAPER = "#1b1b1b", "#ffffff"
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")  # Okabe and Ito
MARKERS = ("o", "s", "^", "D", "v", "P")
LINES = ("-", "--", "-.", ":")
WIDTH = 5.2  # inch: still legible at the width of a phone
_STYLE: Any = {
    "axes.edgecolor": INK,
    "axes.facecolor": "none",
    "axes.grid": True,
    "axes.grid.axis": "y",
    "axes.labelcolor": INK,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titlesize": "medium",
    "figure.facecolor": PAPER,
    "font.family": "DejaVu Sans",
    "font.size": 9.5,
    "grid.alpha": 0.25,
    "grid.color": INK,
    "grid.linewidth": 0.5,
    "legend.columnspacing": 1.2,
    "legend.fontsize": 9.0,
    "legend.frameon": False,
    "legend.handletextpad": 0.5,
    "lines.linewidth": 1.6,
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


def images(draw: Draw, height: float) -> tuple[str, bytes]:
    """Return a drawing of the given height [inch] as SVG and as PNG; equal ones as equal bytes."""
    import matplotlib as mpl
    from matplotlib.figure import Figure as NewCanvas

    svg, png = io.StringIO(), io.BytesIO()
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(_STYLE)
        canvas = NewCanvas(figsize=(WIDTH, height), layout="constrained")
        draw(canvas)
        canvas.savefig(svg, format="svg", metadata=_NO_METADATA)
        canvas.savefig(png, format="png", dpi=DOTS_PER_INCH, metadata={"Software": None})
    return svg.getvalue(), png.getvalue()


@dataclass(frozen=True)
class Panel:
    """One pair of axes: series over shared categories, and thresholds.

    Attributes:
        points: a row for each point, with the columns `series` (label), `style` (place of its
            colour and marker), `category`, `value`, `low`, `high`, `decided` (filled), `saturated`
            (marked) and `published` (a cross beside it); missing numbers are NaN.
    """

    title: str
    y_label: str
    points: pd.DataFrame
    thresholds: tuple[float, ...]
    x_label: str


def intervals(canvas: Canvas, panels: Sequence[Panel]) -> None:
    """Draw values with their intervals over categories, one panel below the other."""
    grid = canvas.subplots(len(panels), 1, squeeze=False)
    for axes, panel in zip(grid[:, 0], panels):
        _panel(axes, panel)
    if len(panels[0].points["style"].unique()) > 1:
        _legend(canvas, grid[0, 0], lines=False)


def _panel(axes: Axes, panel: Panel) -> None:
    categories = list(panel.points["category"].unique())
    bottom, top = _range(panel)
    for threshold in panel.thresholds:
        if bottom <= threshold <= top:
            axes.axhline(threshold, color=INK, linewidth=0.8, linestyle=(0, (4, 3)), zorder=1)
    styles = sorted(panel.points["style"].unique())
    spread = min(0.8, 0.24 * len(styles))
    for index, style in enumerate(styles):
        shift = spread * ((index + 0.5) / len(styles) - 0.5)
        colour, marker = COLOURS[style % len(COLOURS)], MARKERS[style % len(MARKERS)]
        points = panel.points[panel.points["style"] == style]
        points = points.assign(x=points["category"].map(categories.index) + shift)
        known = points.dropna(subset="value")
        _bars(axes, known["x"], known["low"], known["high"], (bottom, top), colour)
        for decided in (True, False):
            here = known[known["decided"] == decided]
            # Only the filled marks name the series.
            label = points["series"].iloc[0] if decided else None
            fill = colour if decided else PAPER
            (marks,) = axes.plot(here["x"], here["value"], marker, color=colour, zorder=3)
            marks.set(markerfacecolor=fill, label=label)
        # Beside the mark, which would hide it.
        published = points.dropna(subset="published")
        crosses = published["x"] + 0.1, published["published"]
        axes.plot(*crosses, "x", color=INK, markersize=4.5, zorder=4)
        capped = known[known["saturated"]]
        for place in zip(capped["x"], capped["value"]):
            axes.annotate("†", place, (-9, 3), textcoords="offset points", fontsize=9)
    axes.set_xticks(range(len(categories)), categories)
    if len(categories) > 6:
        axes.tick_params(axis="x", labelsize=8.0)
    if sum(len(category) + 2 for category in categories) > 80:
        axes.tick_params(axis="x", rotation=40)
    axes.set(xlim=(-0.6, len(categories) - 0.4), ylim=(bottom, top))
    axes.set(ylabel=panel.y_label, xlabel=panel.x_label, title=panel.title)


def _range(panel: Panel) -> tuple[float, float]:
    """Axis limits: all values and thresholds, and intervals up to twice their span beyond."""
    values = [*panel.points["value"].dropna(), *panel.points["published"].dropna()]
    inner = [*values, *panel.thresholds[:1]]
    if values and max(values) > 0.5 * panel.thresholds[-1]:
        inner.append(panel.thresholds[-1])
    low, high = min(inner), max(inner)
    reach = max(2.0 * (high - low), 1.5)
    limits = [*panel.points["low"], *panel.points["high"]]
    ends = [limit for limit in limits if math.isfinite(limit)]
    low = max(low - reach, min([low, *ends]))
    high = min(high + reach, max([high, *ends]))
    margin = 0.06 * max(high - low, 0.5)
    return low - margin, high + margin


def _bars(
    axes: Axes,
    x: pd.Series[float],
    low: pd.Series[float],
    high: pd.Series[float],
    limits: tuple[float, float],
    colour: str,
) -> None:
    """Draw intervals; an arrow where one leaves the axis limits."""
    bottom, top = limits
    known = low.notna()
    x, low, high = x[known], low[known], high[known]
    ends = low.clip(lower=bottom), high.clip(upper=top)
    axes.vlines(x, *ends, color=colour, linewidth=1.4, zorder=2)
    for limit in (low, high):
        inside = limit.between(bottom, top)
        axes.plot(x[inside], limit[inside], "_", color=colour, markersize=5)
    for edge, arrow, leaving in ((bottom, "v", x[low < bottom]), (top, "^", x[high > top])):
        if len(leaving):  # an empty line that is not clipped spoils the layout
            edges = [edge] * len(leaving)
            axes.plot(leaving, edges, arrow, color=colour, markersize=5, clip_on=False)


def sizes(canvas: Canvas, cells: pd.DataFrame) -> None:
    """Draw P against swarm size."""
    axes = canvas.subplots()
    right, highest = 1.1 * cells["value"].max(), 1.08 * cells["high"].fillna(cells["mean"]).max()
    _bars(axes, cells["value"], cells["low"], cells["high"], (0.0, math.inf), COLOURS[0])
    axes.plot(cells["value"], cells["mean"], MARKERS[0], color=COLOURS[0], markersize=5, zorder=3)
    capped = cells[cells["saturated"]]
    for point in zip(capped["value"], capped["mean"]):
        axes.annotate("†", point, (5, 2), textcoords="offset points", fontsize=8)
    axes.set(xlim=(0.0, right), ylim=(0.0, max(highest, 1.0)))
    axes.set(xlabel="swarm size N [robots]", ylabel="performance P")


def rates(canvas: Canvas, panels: Mapping[str, pd.DataFrame], onset: float, y_label: str) -> None:
    """Draw deliveries over time, one panel below the other, on one scale.

    Args:
        canvas: to draw on.
        panels: the rates (`fault_measures.rate_curves`) by the title of their panel.
        onset: when the fault begins [s].
        y_label: label of the axis of the rates.
    """
    for axes, frame in _over_time(canvas, panels, "end of the window [s]", y_label):
        for index, (runs, curve) in enumerate(groups_of(frame, "runs")):
            colour = COLOURS[index % len(COLOURS)]
            if curve["low"].notna().all():
                low, high = curve["low"].clip(lower=0.0), curve["high"]
                axes.fill_between(
                    curve["seconds"], low, high, color=colour, alpha=0.16, linewidth=0
                )
            (line,) = axes.plot(curve["seconds"], curve["deliveries"], color=colour, label=runs)
            line.set(linestyle=LINES[index % len(LINES)], marker=MARKERS[index % len(MARKERS)])
            line.set(markevery=(index * 4, 12), markersize=4.5)
        axes.axvline(onset, color=INK, linewidth=1.0, linestyle=":")
    # After the last panel, as this fixes the scale, which all panels share.
    axes.set_ylim(bottom=0.0)


def repairs(canvas: Canvas, panels: Mapping[str, Sequence[RepairCurve]]) -> None:
    """Draw the share of runs that are not back, one panel below the other, on one scale."""
    for axes, curves in _over_time(canvas, panels, "time from the onset [s]", "share not back"):
        # The fault's colour is that of the rates; the null's is none of theirs.
        for curve, colour, line in zip(curves, (COLOURS[2], INK), LINES):
            seconds, share, low, high = (
                np.concatenate([[first], column, column[-1:] if column.size else [first]])
                for first, column in zip((0.0, 1.0, 1.0, 1.0), curve.curve)
            )
            seconds[-1] = curve.followed
            # Once all runs are back no interval is defined, so the last one ends there.
            known = int(np.count_nonzero(share > 0.0))
            ends = [*range(known), known - 1]
            until = np.append(seconds[:known], seconds[min(known, seconds.size - 1)])
            band = until, low[ends], high[ends]
            axes.fill_between(*band, step="post", color=colour, alpha=0.14, linewidth=0)
            axes.step(seconds, share, line, where="post", color=colour, label=curve.runs)
            if curve.censored:
                axes.plot(seconds[-1], share[-1], "x", color=colour, markersize=6, clip_on=False)
        axes.set(xlim=(0.0, None), ylim=(0.0, 1.05))


def _over_time(
    canvas: Canvas, panels: Mapping[str, Any], x_label: str, y_label: str
) -> Iterator[tuple[Axes, Any]]:
    """Yield the axes of each panel to draw on, then label them."""
    grid = canvas.subplots(len(panels), 1, squeeze=False, sharex=True, sharey=True)
    for axes, (title, curves) in zip(grid[:, 0], panels.items()):
        yield axes, curves
        axes.set(ylabel=y_label, title=title)
    grid[-1, 0].set_xlabel(x_label)
    _legend(canvas, grid[0, 0], lines=True)


def _legend(canvas: Canvas, axes: Axes, *, lines: bool) -> None:
    """Put the legend of one pair of axes above all of them."""
    handles, labels = axes.get_legend_handles_labels()
    canvas.legend(
        handles,
        labels,
        loc="outside upper left",
        ncols=min(len(labels), 3),
        handlelength=2.6 if lines else 1.0,
    )
