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
from textwrap import wrap
from types import ModuleType
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np

from .points import Panel, Point, axis_limits, has_far_values, times_limits

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
_LEGEND_WIDTH = 1.6  # inch, of a column, at least
_LEGEND_SHARE = 0.97  # of the width of a figure, at most
_LETTERS_OF_AN_INCH = 16.0  # of a note
_LINE_HEIGHT = 0.15  # inch, of a note
_WIDEST = 30.0  # times the smallest P, up to which an axis of P is linear
_MARGIN = 1.5  # of a logarithmic axis, to both sides
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


def images(draw: Draw, height: float, note: str = "", style: FigureStyle = PAGE_STYLE) -> Images:
    """Return a drawing in each format; equal ones as equal bytes.

    Args:
        draw: draws it on an empty canvas.
        height: without its note [inch].
        note: what its values, bars and marks are; stands below it.
        style: its width and letters.
    """
    with _canvas(draw, height, note, style) as canvas:
        svg = _file(canvas, "svg")
        canvas.set_layout_engine("none")  # the same layout, which takes long to find
        return Images(svg.decode(), _file(canvas, "pdf"), _file(canvas, "png"))


def svg_image(draw: Draw, height: float, note: str = "", style: FigureStyle = PAGE_STYLE) -> str:
    """Return a drawing as SVG alone; see `images`."""
    with _canvas(draw, height, note, style) as canvas:
        return _file(canvas, "svg").decode()


@contextlib.contextmanager
def _canvas(draw: Draw, height: float, note: str, style: FigureStyle) -> Iterator[Canvas]:
    mpl = _matplotlib()
    from matplotlib.figure import Figure as NewCanvas

    unbroken = note.replace(" %", "\N{NO-BREAK SPACE}%")
    lines = wrap(unbroken, round(_LETTERS_OF_AN_INCH * style.width / style.scale))
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(_STYLE)
        mpl.rcParams["font.family"] = style.fonts
        for size in ("font.size", "lines.linewidth", "lines.markersize", "errorbar.capsize"):
            mpl.rcParams[size] *= style.scale
        inches = (height + _LINE_HEIGHT * len(lines)) * style.scale
        canvas = NewCanvas(figsize=(style.width, inches), layout="constrained")
        draw(canvas)
        if lines:
            canvas.supxlabel("\n".join(lines), x=0.01, ha="left", fontsize="small")
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


def intervals(canvas: Canvas, panels: Sequence[Panel]) -> None:
    """Draw values with their intervals over categories, one panel below the other."""
    grid = canvas.subplots(len(panels), 1, squeeze=False)
    for axes, panel in zip(grid[:, 0], panels):
        _panel(axes, panel)
    if len({point.style for point in panels[0].points}) > 1:
        add_legend(canvas, grid[0, 0])
    elif not panels[0].title:
        grid[0, 0].set_title(panels[0].points[0].series)


def _panel(axes: Axes, panel: Panel) -> None:
    categories = list(dict.fromkeys(point.category for point in panel.points))
    styles = sorted({point.style for point in panel.points})
    for threshold in panel.thresholds:
        axes.axhline(threshold, color=INK, linewidth=0.8, linestyle=(0, (4, 3)), zorder=1)
    spread = min(0.8, 0.24 * len(styles))
    drawn: list[tuple[float, Point]] = []
    for point in panel.points:
        index = styles.index(point.style)
        x = categories.index(point.category) + spread * ((index + 0.5) / len(styles) - 0.5)
        if point.published is not None:  # beside the mark, which would hide it
            gid = f"published-{point.link}" if point.link else None
            axes.plot(x + 0.1, point.published, "x", color=INK, zorder=4, gid=gid)
        _dots(axes, x, 0.4 * spread / len(styles), point)
        _mark(axes, x, point)
        drawn.append((x, point))
        if point.value is not None and point.saturated:
            axes.annotate("†", (x, point.value), (-9, 3), textcoords="offset points")
    axes.set_xticks(range(len(categories)), categories)
    width = axes.bbox.width / axes.figure.dpi
    if sum(len(category) + 2 for category in categories) > 20 * width:
        axes.tick_params(axis="x", rotation=40)
    axes.set(xlim=(-0.6, len(categories) - 0.4), ylim=axis_limits(panel.points))
    if not panel.thresholds:  # P is never below 0
        axes.set_ylim(bottom=0.0)
        _stretch(axes, panel.points)
    elif has_far_values(panel.points):
        axes.set_yscale("symlog", linthresh=1.0)
        axes.yaxis.set_major_formatter("{x:g}")
        axes.set_ylim(*(_MARGIN * end for end in axes.get_ylim()))
    _add_arrows(axes, drawn)
    axes.set(ylabel=panel.y_label, xlabel=panel.x_label, title=panel.title)


def _stretch(axes: Axes, points: Sequence[Point]) -> None:
    """Let the axis of P be logarithmic where small ones would lie on a heap at its foot."""
    values = [point.value for point in points if point.value is not None]
    if not (values and max(values) > _WIDEST * min(values) > 0.0):
        return
    values += [p for point in points for p in point.runs if p is not None]
    lowest = min(p for p in values if p > 0.0)
    axes.set_ylim(auto=True)
    make_logarithmic(axes)
    if lowest == min(values):
        axes.set_ylim(bottom=lowest / 2.0)
    else:  # a run of 0 has no place on a logarithmic axis
        axes.set_yscale("symlog", linthresh=lowest)
        axes.yaxis.set_major_formatter("{x:g}")
        axes.set_ylim(bottom=0.0)


def make_logarithmic(axes: Axes) -> None:
    """Let the upright axis be logarithmic, with plain numbers."""
    from matplotlib.ticker import LogLocator, NullLocator

    axes.set_yscale("log", nonpositive="clip")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_minor_locator(NullLocator())


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


def _mark(axes: Axes, at: float, point: Point, *, level: bool = False, shrink: float = 1.0) -> None:
    """Draw a value, if there is one, with its interval, upright or level."""
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
        value if level else at,
        at if level else value,
        xerr=error if level else None,
        yerr=None if level else error,
        fmt=marker_of(point.style),
        color=colour,
        markerfacecolor=colour if point.decided else PAPER,
        markersize=sizes["lines.markersize"] * shrink,
        capsize=sizes["errorbar.capsize"] * shrink,
        label=point.series,
    )
    for artist in (line, *caps, *bars):
        artist.set_gid(point.link or None)


Rows: TypeAlias = Sequence[tuple[str, Sequence[Point]]]  # each with its label


def forest(
    canvas: Canvas, columns: Mapping[str, Rows], title: str = "", *, is_of_times: bool = False
) -> None:
    """Draw values with their intervals in rows, from top to bottom.

    Args:
        canvas: to draw on.
        columns: rows by the label of the axis of their values; with the same labels in each column.
            A point's `published` is its threshold; a label without points is a heading.
        title: above the first axes.
        is_of_times: whether values are factors, so that the axis is logarithmic, about 1.
    """
    grid = canvas.subplots(1, len(columns), squeeze=False, sharey=True)
    for axes, (x_label, rows) in zip(grid[0], columns.items()):
        _forest(axes, rows, is_of_times=is_of_times)
        axes.set_xlabel(x_label)
    grid[0, 0].set_title(title)
    grid[0, 0].set_yticks(range(len(rows)), [label for label, _ in rows])
    for label, tick, (_, points) in zip(
        grid[0, 0].get_yticklabels(), grid[0, 0].yaxis.get_major_ticks(), rows
    ):
        if not points:
            label.set_fontweight("bold")
            tick.tick1line.set_visible(False)
    grid[0, 0].set_ylim(len(rows) - 0.4, -0.6)
    series = {point.series for column in columns.values() for _, row in column for point in row}
    if len(series) > 1:
        add_legend(canvas, grid[0, 0])


def _forest(axes: Axes, rows: Rows, *, is_of_times: bool) -> None:
    drawn: list[tuple[float, Point]] = []
    for row, (_, points) in enumerate(rows):
        for index, point in enumerate(points):
            height = row + 0.6 * ((index + 0.5) / len(points) - 0.5)
            _mark(axes, height, point, level=True, shrink=min(1.0, 4.0 / len(points)))
            drawn.append((height, point))
            if point.published and not is_of_times:
                axes.vlines(point.published, row - 0.4, row + 0.4, color=INK, linewidth=0.8)
    axes.axvline(float(is_of_times), color=INK, linewidth=0.8, linestyle=(0, (4, 3)), zorder=1)
    axes.grid(visible=False, axis="y")
    axes.grid(visible=True, axis="x")
    all_points = [point for _, points in rows for point in points]
    if is_of_times:
        _scale_by_times(axes, all_points)
        _add_arrows(axes, drawn, level=True)
        return
    axes.set_xlim(axis_limits(all_points))
    is_of_indicators = any(point.published is not None for point in all_points)
    if is_of_indicators and has_far_values(all_points):
        axes.set_xscale("symlog", linthresh=1.0)
        axes.xaxis.set_major_formatter("{x:g}")
        axes.set_xlim(*(_MARGIN * end for end in axes.get_xlim()))
    _add_arrows(axes, drawn, level=True)


def _add_arrows(axes: Axes, drawn: Sequence[tuple[float, Point]], *, level: bool = False) -> None:
    """Draw an arrow where an interval leaves the axis."""
    low, high = axes.get_xlim() if level else axes.get_ylim()
    for at, point in drawn:
        colour = COLOURS[point.style % len(COLOURS)]
        for end, limit, marker in (
            (point.low, low, "<" if level else "v"),
            (point.high, high, ">" if level else "^"),
        ):
            if end is not None and (end < low or end > high):
                place = ([limit], [at]) if level else ([at], [limit])
                axes.plot(*place, marker, color=colour, clip_on=False, markersize=4.0)


def _scale_by_times(axes: Axes, points: Sequence[Point]) -> None:
    """Let the axis be logarithmic, as far as values and intervals reach, but for their extremes."""
    from matplotlib.ticker import LogLocator, NullLocator

    axes.set_xscale("log")
    axes.set_xlim(*times_limits(points))
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter("{x:g}")


def add_legend(canvas: Canvas, axes: Axes) -> None:
    """Put the legend of one pair of axes above all of them, each series once, its mark filled.

    It has as many columns as the figure is wide enough for.
    """
    from matplotlib.container import ErrorbarContainer
    from matplotlib.lines import Line2D

    series: dict[str, Any] = {}
    for handle, label in zip(*axes.get_legend_handles_labels()):
        if isinstance(handle, ErrorbarContainer):
            mark = handle.lines[0]
            handle = Line2D([], [], color=mark.get_color(), marker=mark.get_marker(), linestyle="")
        series[label] = handle
    most = max(1, int(canvas.get_figwidth() / _LEGEND_WIDTH))
    for n_columns in range(most, 0, -1):
        legend = canvas.legend(series.values(), series, loc="outside upper left", ncols=n_columns)
        width = legend.get_window_extent().width
        if n_columns == 1 or width <= _LEGEND_SHARE * canvas.bbox.width:
            return
        legend.remove()


def marker_of(index: int) -> str:
    """Return the marker of a series; from the seventh on, colours return with other markers."""
    return MARKERS[(index + index // len(COLOURS)) % len(MARKERS)]
