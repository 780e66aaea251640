"""Drawing with matplotlib, which is loaded only when a figure is drawn.

The colours are those of Okabe and Ito, and every series has a marker of its own as well.
"""

from __future__ import annotations

import contextlib
import io
import math
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np

from swarm_logistics_env.spi import Interval
from swarm_logistics_env.study.verdicts.mid_run_faults import RateCurve

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

Draw: TypeAlias = "Callable[[Canvas], None]"

INK = "#1b1b1b"
PAPER = "#ffffff"
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")  # Okabe and Ito
MARKERS = ("o", "s", "^", "D", "v", "P")
LINES = ("-", "--", "-.", ":")
WIDTH = 5.2  # inch: still legible at the width of a phone
_STYLE: Any = {  # matplotlib types each of its names
    "axes.edgecolor": INK, "axes.labelcolor": INK, "text.color": INK, "grid.color": INK,
    "xtick.color": INK, "ytick.color": INK, "axes.facecolor": "none",
    "figure.facecolor": PAPER, "savefig.facecolor": PAPER,
    "axes.grid": True, "axes.grid.axis": "y", "grid.alpha": 0.25, "grid.linewidth": 0.5,
    "axes.spines.right": False, "axes.spines.top": False,
    "axes.titlelocation": "left", "axes.titlesize": "medium",
    "font.size": 9.5, "lines.linewidth": 1.6,
    "xtick.labelsize": "small", "ytick.labelsize": "small", "errorbar.capsize": 3.0,
    "lines.markersize": 5.0,
    "legend.columnspacing": 1.2, "legend.fontsize": "medium", "legend.frameon": False,
    "legend.handletextpad": 0.5,
    "svg.fonttype": "none", "svg.hashsalt": "swarm-logistics-env", "text.parse_math": False,
    "pdf.fonttype": 42,  # many publishers refuse Type 3
}  # fmt: skip
# What matplotlib writes into a file besides the drawing, and what differs at every drawing.
_METADATA = {
    "svg": ("Creator", "Date", "Format", "Type"), "png": ("Software",),
    "pdf": ("Creator", "Producer", "CreationDate"),
}  # fmt: skip
DOTS_PER_INCH = 300


class FigureStyle(NamedTuple):
    """Width of a figure [inch], and the families of its letters, which matplotlib brings."""

    width: float = WIDTH
    fonts: tuple[str, ...] = ("DejaVu Sans",)

    @property
    def scale(self) -> float:
        """The factor of letters, marks and heights: a narrow figure has smaller ones."""
        return min(1.0, math.sqrt(self.width / WIDTH))


PAGE_STYLE = FigureStyle()
SERIF = "STIXGeneral", "DejaVu Serif"  # the first looks like Times


class Images(NamedTuple):
    """One drawing as SVG, as PDF and as PNG."""

    svg: str
    pdf: bytes
    png: bytes


def images(draw: Draw, height: float, style: FigureStyle = PAGE_STYLE) -> Images:
    """Return a drawing of the given height [inch] in each format; equal ones as equal bytes."""
    with _canvas(draw, height, style) as canvas:
        svg = _file(canvas, "svg")
        canvas.set_layout_engine("none")  # the same layout, which takes long to find
        return Images(svg.decode(), _file(canvas, "pdf"), _file(canvas, "png"))


def svg_image(draw: Draw, height: float) -> str:
    """Return a drawing of the given height [inch] as SVG alone."""
    with _canvas(draw, height, PAGE_STYLE) as canvas:
        return _file(canvas, "svg").decode()


@contextlib.contextmanager
def _canvas(draw: Draw, height: float, style: FigureStyle) -> Iterator[Canvas]:
    mpl = _matplotlib()
    from matplotlib.figure import Figure as NewCanvas

    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(_STYLE)
        mpl.rcParams["font.family"] = style.fonts
        for size in ("font.size", "lines.linewidth", "lines.markersize", "errorbar.capsize"):
            mpl.rcParams[size] *= style.scale
        canvas = NewCanvas(figsize=(style.width, height * style.scale), layout="constrained")
        draw(canvas)
        yield canvas


def _file(canvas: Canvas, ending: str) -> bytes:
    file = io.BytesIO()
    metadata = dict.fromkeys(_METADATA[ending])
    canvas.savefig(file, format=ending, dpi=DOTS_PER_INCH, metadata=metadata)
    return file.getvalue()


def _matplotlib() -> ModuleType:
    """Import matplotlib, also where MPLBACKEND names a backend that is not installed.

    It is that of a notebook, if a script is started there. Nothing here is drawn with it.
    """
    if "matplotlib" in sys.modules:
        return sys.modules["matplotlib"]
    backend = os.environ.pop("MPLBACKEND", None)
    import matplotlib as mpl

    if backend is not None:
        os.environ["MPLBACKEND"] = backend
        with contextlib.suppress(ValueError):
            mpl.rcParams["backend"] = backend  # others may draw with it
    return mpl


class Point(NamedTuple):
    """One value with its interval.

    Attributes:
        series: label of its series.
        style: index of its colour and marker.
        category: where it stands on the axis.
        value, low, high: None: missing.
        published: a cross beside it; None: none.
        decided: whether it is filled.
        saturated: whether it is marked.
        link: id of its marks in the SVG: what a click on them shows in the page, "question-7" or
            "condition-3"; empty: nothing.
        runs: single runs, drawn as dots, seed by seed; None: missing.
    """

    series: str
    style: int
    category: str
    value: float | None
    low: float | None
    high: float | None
    published: float | None = None
    decided: bool = False
    saturated: bool = False
    link: str = ""
    runs: tuple[float | None, ...] = ()


@dataclass(frozen=True)
class Panel:
    """One pair of axes: series over shared categories, and thresholds."""

    title: str
    y_label: str
    points: tuple[Point, ...]
    thresholds: tuple[float, ...]
    x_label: str


def intervals(canvas: Canvas, panels: Sequence[Panel]) -> None:
    """Draw values with their intervals over categories, one panel below the other."""
    grid = canvas.subplots(len(panels), 1, squeeze=False)
    for axes, panel in zip(grid[:, 0], panels):
        _panel(axes, panel)
    if len({point.style for point in panels[0].points}) > 1:
        _legend(canvas, grid[0, 0])
    elif not panels[0].title:
        grid[0, 0].set_title(panels[0].points[0].series)


def _panel(axes: Axes, panel: Panel) -> None:
    categories = list(dict.fromkeys(point.category for point in panel.points))
    styles = sorted({point.style for point in panel.points})
    for threshold in panel.thresholds:
        axes.axhline(threshold, color=INK, linewidth=0.8, linestyle=(0, (4, 3)), zorder=1)
    spread = min(0.8, 0.24 * len(styles))
    for point in panel.points:
        index = styles.index(point.style)
        x = categories.index(point.category) + spread * ((index + 0.5) / len(styles) - 0.5)
        if point.published is not None:  # beside the mark, which would hide it
            gid = f"published-{point.link}" if point.link else None
            axes.plot(x + 0.1, point.published, "x", color=INK, zorder=4, gid=gid)
        _dots(axes, x, 0.4 * spread / len(styles), point)
        _mark(axes, x, point)
        if point.value is not None and point.saturated:
            axes.annotate("†", (x, point.value), (-9, 3), textcoords="offset points")
    axes.set_xticks(range(len(categories)), categories)
    width = axes.bbox.width / axes.figure.dpi
    if sum(len(category) + 2 for category in categories) > 20 * width:
        axes.tick_params(axis="x", rotation=40)
    axes.set(xlim=(-0.6, len(categories) - 0.4), ylim=limits(panel.points))
    if not panel.thresholds:  # P is never below 0
        axes.set_ylim(bottom=0.0)
    axes.set(ylabel=panel.y_label, xlabel=panel.x_label, title=panel.title)


def limits(points: Sequence[Point]) -> tuple[float, float]:
    """Return axis limits: 0, all values, and intervals up to twice the values' span beyond."""
    values = [0.0, *(x for p in points for x in (p.value, p.published) if x is not None)]
    values += [p for point in points for p in point.runs if p is not None]
    ends = [*values, *(x for p in points for x in (p.low, p.high) if x is not None)]
    reach = max(2.0 * (max(values) - min(values)), 1.0)
    low = max(min(ends), min(values) - reach)
    high = min(max(ends), max(values) + reach)
    margin = 0.06 * max(high - low, 0.5)
    return low - margin, high + margin


_GOLDEN = 0.618034  # spreads any number of dots evenly


def _dots(axes: Axes, x: float, reach: float, point: Point) -> None:
    """Draw single runs as dots beside each other, at the same places at every drawing."""
    runs = {seed: p for seed, p in enumerate(point.runs) if p is not None}
    if runs:
        axes.scatter(
            [x + reach * (2.0 * (seed * _GOLDEN % 1.0) - 1.0) for seed in runs],
            list(runs.values()),
            s=9.0,
            color=COLOURS[point.style % len(COLOURS)],
            alpha=0.45,
            linewidths=0.0,
            gid="-".join([point.link, "seeds", *map(str, runs)]) if point.link else None,
        )


def _mark(axes: Axes, at: float, point: Point, marker: str = "", shrink: float = 1.0) -> None:
    """Draw a value, if there is one, with its interval: upright, or level with a marker named."""
    value = point.value
    low = point.low
    high = point.high
    if value is None:
        return
    sizes = _matplotlib().rcParams
    colour = COLOURS[point.style % len(COLOURS)]
    error = None
    if low is not None and high is not None:
        # An infinite end is drawn far outside.
        error = np.clip([[value - low], [high - value]], 0.0, 1e3)
    line, caps, bars = axes.errorbar(
        value if marker else at,
        at if marker else value,
        xerr=error if marker else None,
        yerr=None if marker else error,
        fmt=marker or marker_of(point.style),
        color=colour,
        markerfacecolor=colour if point.decided else PAPER,
        markersize=sizes["lines.markersize"] * shrink,
        capsize=sizes["errorbar.capsize"] * shrink,
        label=point.series,
    )
    for artist in (line, *caps, *bars):
        artist.set_gid(point.link or None)


def forest(
    canvas: Canvas, rows: Sequence[tuple[str, Sequence[Point]]], x_label: str, title: str = ""
) -> None:
    """Draw a row for each question: its values with their intervals, from top to bottom.

    Args:
        canvas: to draw on.
        rows: the label of each, and its points; a point's `published` is its threshold. A label
            without points is a heading.
        x_label: of the axis of the values.
        title: above the axes.
    """
    axes = canvas.subplots()
    for row, (_, points) in enumerate(rows):
        for index, point in enumerate(points):
            height = row + 0.6 * ((index + 0.5) / len(points) - 0.5)
            _mark(axes, height, point, MARKERS[index % len(MARKERS)], min(1.0, 4.0 / len(points)))
            if point.published:
                axes.vlines(point.published, row - 0.4, row + 0.4, color=INK, linewidth=0.8)
    axes.axvline(0.0, color=INK, linewidth=0.8, linestyle=(0, (4, 3)), zorder=1)
    axes.set_yticks(range(len(rows)), [label for label, _ in rows])
    axes.grid(visible=False, axis="y")
    axes.grid(visible=True, axis="x")
    axes.set(ylim=(len(rows) - 0.4, -0.6), xlabel=x_label, title=title)
    axes.set_xlim(limits([point for _, points in rows for point in points]))


def trade_off(canvas: Canvas, panels: Mapping[str, Sequence[tuple[Point, Interval]]]) -> None:
    """Draw values against contacts per robot-minute with their intervals, on one scale.

    Points of a single panel are named by their categories where there is room for the name.

    Args:
        canvas: to draw on.
        panels: points, each with its contacts, by the title of their panel.
    """
    n_rows = math.ceil(len(panels) / 2)
    n_columns = min(len(panels), 2)
    grid = canvas.subplots(n_rows, n_columns, squeeze=False, sharex=True, sharey=True)
    for axes, (title, points) in zip(grid.flat, panels.items()):
        for point, contacts in points:
            if contacts.low is not None and contacts.high is not None:
                colour = COLOURS[point.style % len(COLOURS)]
                axes.hlines(point.value or 0.0, contacts.low, contacts.high, color=colour)
            _mark(axes, contacts.value, point)
        axes.set_title(title)
    for axes in grid.flat[len(panels) :]:
        axes.set_visible(False)
        grid[-2, -1].tick_params(labelbottom=True)
    canvas.supxlabel("contacts per robot-minute", fontsize="medium")
    canvas.supylabel("performance P", fontsize="medium")
    grid[0, 0].set_ylim(limits([point for points in panels.values() for point, _ in points]))
    grid[0, 0].set_ylim(bottom=0.0)
    grid[0, 0].set_xlim(left=0.0)
    _legend(canvas, grid[0, 0])
    if len(panels) == 1:  # a panel of several is of one condition, which is its title
        canvas.draw_without_rendering()  # so that it is known where the points stand
        _name_points(grid[0, 0], [(c.value, p) for points in panels.values() for p, c in points])


def _name_points(axes: Axes, points: Sequence[tuple[float, Point]]) -> None:
    """Write the category of each point beside it where there is room, of lonely ones first."""
    from matplotlib.transforms import Bbox

    spots = [(x, point.value or 0.0) for x, point in points]
    pixels = axes.transData.transform(spots)
    apart = np.linalg.norm(pixels[:, None] - pixels, axis=2)
    np.fill_diagonal(apart, np.inf)
    taken = [Bbox.from_bounds(x - 4.0, y - 4.0, 8.0, 8.0) for x, y in pixels.tolist()]
    style: Any = {"textcoords": "offset points", "fontsize": "x-small"}
    style["bbox"] = {"facecolor": PAPER, "edgecolor": "none", "alpha": 0.7, "pad": 0.5}
    for index in np.argsort(-apart.min(axis=1), kind="stable").tolist():
        for side, beside in (("left", 5.0), ("right", -5.0)):
            name = points[index][1].category
            text = axes.annotate(name, spots[index], (beside, 4.0), ha=side, **style)
            box = text.get_window_extent()
            is_inside = axes.bbox.x0 < box.x0 and box.x1 < axes.bbox.x1
            if is_inside and not any(box.overlaps(other) for other in taken):
                taken.append(box)
                break
            text.remove()


def rates(
    canvas: Canvas, panels: Mapping[str, Sequence[RateCurve]], onset: float, y_label: str
) -> None:
    """Draw deliveries over time, one panel below the other, on one scale.

    Args:
        canvas: to draw on.
        panels: the curves by the title of their panel.
        onset: when the fault begins [s].
        y_label: label of the axis of the rates.
    """
    grid = canvas.subplots(len(panels), 1, squeeze=False, sharex=True, sharey=True)
    for axes, (title, curves) in zip(grid[:, 0], panels.items()):
        for index, curve in enumerate(curves):
            colour = COLOURS[index % len(COLOURS)]
            if not np.isnan(curve.low).any():
                band = curve.seconds, curve.low.clip(0.0), curve.high
                axes.fill_between(*band, color=colour, alpha=0.16, linewidth=0)
            axes.plot(
                curve.seconds,
                curve.deliveries,
                LINES[index % len(LINES)],
                color=colour,
                label=curve.runs,
                marker=marker_of(index),
                markevery=(index * 4, 12),
            )
        axes.axvline(onset, color=INK, linewidth=1.0, linestyle=":")
        axes.set(ylabel=y_label, title=title)
    grid[-1, 0].set_xlabel("end of the window [s]")
    _legend(canvas, grid[0, 0])
    # After the last panel, as this fixes the scale, which all panels share.
    axes.set_ylim(bottom=0.0)


def _legend(canvas: Canvas, axes: Axes) -> None:
    """Put the legend of one pair of axes above all of them, each series once."""
    handles, labels = axes.get_legend_handles_labels()
    series = dict(zip(labels, handles))
    most = 2 if max(map(len, series)) > 16 else 3  # three longer names are wider than the figure
    canvas.legend(series.values(), series, loc="outside upper left", ncols=min(len(series), most))


def marker_of(index: int) -> str:
    """Return the marker of a series; from the seventh on, colours return with other markers."""
    return MARKERS[(index + index // len(COLOURS)) % len(MARKERS)]
