"""Drawing with matplotlib, which is loaded only when a figure is drawn.

Colours are Okabe and Ito's, every series has its own marker as well, and all ink is `INK` and all
paper `PAPER`, so that a page can put its own colours in their place.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from swarm_logistics_env.spi.scaling import ScalingFit
from swarm_logistics_env.studies.size_series import SizeSeries

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

Draw: TypeAlias = "Callable[[Canvas], None]"

INK, PAPER = "#1b1b1b", "#ffffff"
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")  # Okabe and Ito
MARKERS = ("o", "s", "^", "D", "v", "P")
LINES = ("-", "--", "-.", ":")
WIDTH = 5.2  # inch: still legible at the width of a phone
LAWS = {"usl": "USL", "power_exponential": "kN^p exp(-qN)"}


@dataclass(frozen=True)
class Point:
    """One value in its category; None: it is not known."""

    category: str
    value: float | None
    low: float | None
    high: float | None
    decided: bool
    saturated: bool
    published: float | None


@dataclass(frozen=True)
class Series:
    """Points of one label, drawn alike.

    Attributes:
        style: place of its colour and marker; None: that of the series in its panel.
    """

    label: str
    points: tuple[Point, ...]
    style: int | None = None


@dataclass(frozen=True)
class Panel:
    """One pair of axes: series over shared categories, and thresholds."""

    title: str
    y_label: str
    series: tuple[Series, ...]
    thresholds: tuple[float, ...]
    x_label: str


def intervals(canvas: Canvas, panels: Sequence[Panel]) -> None:
    """Draw values with their intervals over categories, one panel below the other."""
    grid = canvas.subplots(len(panels), 1, squeeze=False)
    for axes, panel in zip(grid[:, 0], panels):
        _panel(axes, panel)
    if len(panels[0].series) > 1:
        legend(canvas, grid[0, 0], lines=False)


def _panel(axes: Axes, panel: Panel) -> None:
    categories = list(dict.fromkeys(p.category for s in panel.series for p in s.points))
    bottom, top = _range(panel)
    for threshold in panel.thresholds:
        if bottom <= threshold <= top:
            axes.axhline(threshold, color=INK, linewidth=0.8, linestyle=(0, (4, 3)), zorder=1)
    spread = min(0.8, 0.24 * len(panel.series))
    for index, series in enumerate(panel.series):
        shift = spread * ((index + 0.5) / len(panel.series) - 0.5)
        style = index if series.style is None else series.style
        colour, marker = COLOURS[style % len(COLOURS)], MARKERS[style % len(MARKERS)]
        points = [(categories.index(p.category) + shift, p) for p in series.points]
        known = [(x, point, point.value) for x, point in points if point.value is not None]
        _bars(axes, [(x, p.low, p.high) for x, p, _ in known], (bottom, top), colour)
        for decided in (True, False):
            here = [(x, value) for x, point, value in known if point.decided is decided]
            axes.plot(
                [x for x, _ in here],
                [value for _, value in here],
                marker,
                color=colour,
                markerfacecolor=colour if decided else PAPER,
                markersize=6,
                zorder=3,
                # Only the filled marks name the series.
                label=series.label if decided else None,
            )
        # Beside the mark, which would hide it.
        published = [(x + 0.1, p.published) for x, p in points if p.published is not None]
        axes.plot(*_columns(published), "x", color=INK, markersize=4.5, zorder=4)
        for x, _, value in (point for point in known if point[1].saturated):
            axes.annotate("†", (x, value), (-9, 3), textcoords="offset points", fontsize=9)
    axes.set_xticks(range(len(categories)), categories)
    if len(categories) > 6:
        axes.tick_params(axis="x", labelsize=8.0)
    if sum(len(category) + 2 for category in categories) > 80:
        axes.tick_params(axis="x", rotation=40)
    axes.set_xlim(-0.6, len(categories) - 0.4)
    axes.set_ylim(bottom, top)
    axes.set(ylabel=panel.y_label, xlabel=panel.x_label)
    axes.set_title(panel.title, fontsize="medium", loc="left")
    axes.grid(axis="y", alpha=0.25, color=INK, linewidth=0.5)


def _range(panel: Panel) -> tuple[float, float]:
    """Axis limits: all values and thresholds, and intervals up to twice their span beyond."""
    points = [p for s in panel.series for p in s.points]
    values = [x for p in points for x in (p.value, p.published) if x is not None]
    inner = [*values, *panel.thresholds[:1]]
    if values and max(values) > 0.5 * panel.thresholds[-1]:
        inner.append(panel.thresholds[-1])
    low, high = min(inner), max(inner)
    reach = max(2.0 * (high - low), 1.5)
    ends = [x for p in points for x in (p.low, p.high) if x is not None and math.isfinite(x)]
    low = max(low - reach, min([low, *ends]))
    high = min(high + reach, max([high, *ends]))
    margin = 0.06 * max(high - low, 0.5)
    return low - margin, high + margin


def _bars(
    axes: Axes,
    bars: Sequence[tuple[float, float | None, float | None]],
    limits: tuple[float, float],
    colour: str,
) -> None:
    """Draw intervals (x, low, high); an arrow where one leaves the axis limits."""
    bottom, top = limits
    known = [(x, low, high) for x, low, high in bars if low is not None and high is not None]
    axes.vlines(
        [x for x, _, _ in known],
        [max(low, bottom) for _, low, _ in known],
        [min(high, top) for _, _, high in known],
        color=colour,
        linewidth=1.4,
        zorder=2,
    )
    ends = [(x, end) for x, low, high in known for end in (low, high) if bottom <= end <= top]
    axes.plot(*_columns(ends), "_", color=colour, markersize=5)
    for edge, arrow, leaving in (
        (bottom, "v", [x for x, low, _ in known if low < bottom]),
        (top, "^", [x for x, _, high in known if high > top]),
    ):
        if leaving:  # an empty line that is not clipped spoils the layout
            edges = [edge] * len(leaving)
            axes.plot(leaving, edges, arrow, color=colour, markersize=5, clip_on=False)


def _columns(pairs: Sequence[tuple[float, float]]) -> tuple[list[float], list[float]]:
    return [x for x, _ in pairs], [y for _, y in pairs]


def size_grid(sizes: Sequence[int]) -> list[float]:
    """Return swarm sizes [robots] at which fitted laws are drawn."""
    return [float(n) for n in np.linspace(min(sizes), 1.1 * max(sizes), 60).round(6)]


def scaling(canvas: Canvas, series: SizeSeries, fits: Sequence[ScalingFit]) -> None:
    """Draw P(N), fitted laws, and N* with its interval at the foot."""
    axes = canvas.subplots()
    grid = size_grid(series.sizes)
    right = grid[-1]
    curves = {fit.law: fit.predict(grid) for fit in fits}
    tops = [mean.value if mean.high is None else mean.high for mean in series.performance]
    highest = max([*tops, *(float(curve.max()) for curve in curves.values()), 1.0])
    for fit in sorted(fits, key=lambda fit: list(LAWS).index(fit.law)):
        place = list(LAWS).index(fit.law)
        colour, marker = COLOURS[place + 1], MARKERS[place + 1]
        axes.plot(
            grid, curves[fit.law], LINES[place], color=colour, label=LAWS[fit.law], linewidth=1.6
        )
        if fit.peak is None or fit.peak_low is None or fit.peak_high is None:
            continue
        height = -(0.06 + 0.07 * place) * highest
        low, high = min(fit.peak_low, right), min(fit.peak_high, right)
        axes.plot([low, high], [height, height], color=colour, linewidth=1.6)
        axes.plot(low, height, "|", color=colour, markersize=7)
        goes_on = fit.peak_high > right
        axes.plot(
            high, height, ">" if goes_on else "|", color=colour, markersize=6, clip_on=not goes_on
        )
        if fit.peak <= right:
            axes.plot(fit.peak, height, marker, color=colour, markersize=6)
    means = [(float(size), mean) for size, mean in zip(series.sizes, series.performance)]
    _bars(axes, [(n, mean.low, mean.high) for n, mean in means], (0.0, math.inf), COLOURS[0])
    axes.plot(
        *_columns([(n, mean.value) for n, mean in means]),
        MARKERS[0],
        color=COLOURS[0],
        markersize=5,
        zorder=3,
        label="mean P" if series.policy else "P",
    )
    for (size, mean), saturated in zip(means, series.saturated):
        if saturated:
            axes.annotate("†", (size, mean.value), (5, 2), textcoords="offset points", fontsize=8)
    if any(fit.peak is not None for fit in fits):
        axes.axhline(0.0, color=INK, linewidth=0.5)
        axes.annotate("N*", (0.0, -0.08 * highest), (4, -3), textcoords="offset points", fontsize=8)
    axes.set_xlim(0.0, right)
    axes.set_ylim(-0.2 * highest if fits else 0.0, 1.08 * highest)
    axes.set_yticks([tick for tick in axes.get_yticks() if 0 <= tick <= 1.08 * highest])
    axes.set(xlabel="swarm size N [robots]", ylabel="P [items]")
    axes.grid(axis="y", alpha=0.25, color=INK, linewidth=0.5)
    legend(canvas, axes, lines=True)


def legend(canvas: Canvas, axes: Axes, *, lines: bool) -> None:
    """Put the legend of one pair of axes above all of them."""
    handles, labels = axes.get_legend_handles_labels()
    canvas.legend(
        handles,
        labels,
        loc="outside upper left",
        ncols=min(len(labels), 3),
        frameon=False,
        handlelength=2.6 if lines else 1.0,
        handletextpad=0.5,
        columnspacing=1.2,
    )
