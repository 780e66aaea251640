"""Drawing what happens over time around a fault; see `drawing` for colours and marks."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Generic, TypeVar

import numpy as np

from swarm_logistics_env.report.drawing import COLOURS, INK, LINES, MARKERS, legend
from swarm_logistics_env.studies.mid_run_faults import RateCurve, RepairCurve

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas


CurveT = TypeVar("CurveT", RateCurve, RepairCurve)


@dataclass(frozen=True)
class TimePanel(Generic[CurveT]):
    """Curves of paired runs around one fault."""

    title: str
    curves: tuple[CurveT, ...]


def rates(
    canvas: Canvas, panels: Sequence[TimePanel[RateCurve]], onset: float, y_label: str
) -> None:
    """Draw deliveries over time, one panel below the other, on one scale."""
    for axes, panel in _axes(canvas, panels, "end of the window [s]", y_label):
        for index, curve in enumerate(panel.curves):
            colour = COLOURS[index % len(COLOURS)]
            known = [(r.low, r.high) for r in curve.rates]
            if all(low is not None and high is not None for low, high in known):
                low = [max(0.0, end or 0.0) for end, _ in known]
                high = [end or 0.0 for _, end in known]
                axes.fill_between(curve.seconds, low, high, color=colour, alpha=0.16, linewidth=0)
            axes.plot(
                curve.seconds,
                [rate.value for rate in curve.rates],
                LINES[index % len(LINES)],
                color=colour,
                marker=MARKERS[index % len(MARKERS)],
                markevery=(index * 4, 12),
                markersize=4.5,
                linewidth=1.6,
                label=curve.label,
            )
        axes.axvline(onset, color=INK, linewidth=1.0, linestyle=":")
        axes.set_ylim(bottom=0.0)


def repairs(canvas: Canvas, panels: Sequence[TimePanel[RepairCurve]]) -> None:
    """Draw the share of runs that are not back, one panel below the other, on one scale."""
    for axes, panel in _axes(canvas, panels, "time from the onset [s]", "share not back"):
        for place, curve in enumerate(panel.curves):
            # The fault's colour is that of the rates; the null's is none of theirs.
            colour, line = ((COLOURS[2], LINES[0]), (INK, LINES[1]))[place]
            seconds, share, low, high = (
                np.concatenate([[first], column, column[-1:] if column.size else [first]])
                for first, column in zip((0.0, 1.0, 1.0, 1.0), curve.curve)
            )
            seconds[-1] = curve.followed
            # Once all runs are back no interval is defined, so the last one ends there.
            known = int(np.count_nonzero(share > 0.0))
            ends = [*range(known), known - 1]
            axes.fill_between(
                np.append(seconds[:known], seconds[min(known, seconds.size - 1)]),
                low[ends],
                high[ends],
                step="post",
                color=colour,
                alpha=0.14,
                linewidth=0,
            )
            axes.step(
                seconds,
                share,
                where="post",
                linestyle=line,
                color=colour,
                linewidth=1.6,
                label=curve.label,
            )
            if curve.censored:
                axes.plot(seconds[-1], share[-1], "x", color=colour, markersize=6, clip_on=False)
        axes.set_ylim(0.0, 1.05)
        axes.set_xlim(left=0.0)


def _axes(
    canvas: Canvas, panels: Sequence[TimePanel[CurveT]], x_label: str, y_label: str
) -> Iterator[tuple[Axes, TimePanel[CurveT]]]:
    """Yield the axes of each panel to draw on, then label them."""
    grid = canvas.subplots(len(panels), 1, squeeze=False, sharex=True, sharey=True)
    for axes, panel in zip(grid[:, 0], panels):
        yield axes, panel
        axes.set(ylabel=y_label)
        axes.set_title(panel.title, fontsize="medium", loc="left")
        axes.grid(axis="y", alpha=0.25, color=INK, linewidth=0.5)
    grid[-1, 0].set_xlabel(x_label)
    legend(canvas, grid[0, 0], lines=True)
