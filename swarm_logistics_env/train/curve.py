"""What a training tells: a live table while it runs; then a table and a picture."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from rich.console import Console, Group, RenderableType
from rich.table import Table

from swarm_logistics_env.errors import TrainingError
from swarm_logistics_env.progress_bar import ProgressBar
from swarm_logistics_env.records import becoming
from swarm_logistics_env.report.drawing import COLOURS, INK, MARKERS, WIDTH

CURVE, PICTURE = "curve.csv", "curve.png"
BEST = "best.safetensors"  # the policy as it was at the best evaluation
MILLION = 1e6


@dataclass
class TrainingLog:
    """What a training keeps beside the learner.

    Attributes:
        curve: of each evaluation "agent_steps", "seconds" of training (wall clock), "cpu_seconds"
            of the processor for collecting and updating alone, and what was measured.
        references: name of a scripted policy -> what it measures on the same seeds.
        seconds: trained before this session (wall clock).
        cpu_seconds: processor time of collecting and updating so far [s].
        versions: that it learned with last.
    """

    curve: list[dict[str, float]] = field(default_factory=list)
    references: dict[str, dict[str, float]] = field(default_factory=dict)
    seconds: float = 0.0
    cpu_seconds: float = 0.0
    versions: dict[str, str] | None = None

    @property
    def best(self) -> dict[str, float]:
        """The evaluation with the highest P, the earliest of equals."""
        return max(self.curve, key=lambda row: row["P"])

    def measures(self, row: dict[str, float]) -> dict[str, float]:
        """Return what was measured in a row of the curve, without where and when."""
        return {n: v for n, v in row.items() if n not in ("agent_steps", "seconds", "cpu_seconds")}

    def write(self, directory: Path) -> None:
        """Write curve.csv, whole or not at all."""
        with (
            becoming(directory / CURVE, TrainingError) as part,
            part.open("w", encoding="utf-8", newline="") as file,
        ):
            writer = csv.DictWriter(file, self.curve[0])
            writer.writeheader()
            writer.writerows(self.curve)

    def draw(self, picture: Path, title: str, seeds: int) -> None:
        """Draw P over agent-steps as a PNG, with a line for each scripted policy."""
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        canvas = Figure(figsize=(WIDTH, 0.62 * WIDTH), layout="constrained")
        FigureCanvasAgg(canvas)
        axes = canvas.subplots()
        steps = [row["agent_steps"] / MILLION for row in self.curve]
        axes.plot(steps, [row["P"] for row in self.curve], MARKERS[0] + "-", color=COLOURS[0])
        for name, measured in self.references.items():
            axes.axhline(measured["P"], color=INK, linestyle="--", linewidth=0.8)
            axes.annotate(name, (steps[-1], measured["P"]), ha="right", va="bottom", fontsize=8)
        axes.set_xlabel("million agent-steps")
        axes.set_ylabel(f"P, mean over {seeds} seeds [items]")
        axes.set_title(title, fontsize="medium", loc="left")
        axes.set_ylim(bottom=0.0)
        axes.spines[["top", "right"]].set_visible(False)
        canvas.savefig(picture, dpi=150)


Measured = Mapping[str, float]


class LiveTable(ProgressBar):
    """Shows on standard error how far a training is, and what it reached, while it is entered.

    Args:
        label: what is done.
        total: how much there is to do, in `unit`.
        unit: in words.
        done: of it before now.
        about: in what the measures were taken, for the corner of the table.
        references: name -> measures of what stands beside it.
        before: (done, measures) of what was measured before now, in order.
        console: the console to write to; None means standard error.
    """

    def __init__(
        self,
        label: str,
        total: int,
        unit: str,
        *,
        done: int = 0,
        about: str = "",
        references: Mapping[str, Measured] | None = None,
        before: list[tuple[int, Measured]] | None = None,
        console: Console | None = None,
    ) -> None:
        super().__init__(label, total, unit, done=done, console=console)
        self._about, self._references = about, dict(references or {})
        self._latest: tuple[int, Measured] | None = None
        self._best: tuple[int, Measured] | None = None
        for at, measures in before or []:
            self._keep(at, measures)

    def measured(self, measures: Measured) -> None:
        """Show what was measured; the first measure decides what counts as the best."""
        self._keep(self._done, measures)
        if self._live:
            return
        told = []
        for name, value in measures.items():
            others = ", ".join(
                f"{other} {values[name]:.4g}"
                for other, values in self._references.items()
                if name in values
            )
            told.append(f"{name} = {value:.4g}" + (f" ({others})" if others else ""))
        self.say(", ".join(told))

    def _keep(self, at: int, measures: Measured) -> None:
        self._latest = at, measures
        first = next(iter(measures))
        if self._best is None or measures[first] > self._best[1][first]:
            self._best = self._latest

    def __rich__(self) -> RenderableType:
        """Return the table as it is now; it takes 80 columns."""
        bar = super().__rich__()
        if self._latest and self._best:
            return Group(bar, self._table(self._latest, self._best))
        return bar

    def _table(self, latest: tuple[int, Measured], best: tuple[int, Measured]) -> Table:
        table = Table(box=None, pad_edge=False, header_style="bold")
        table.add_column(self._about)
        for name in ("latest", "best", *self._references):
            table.add_column(name, justify="right")
        columns = (latest[1], best[1], *self._references.values())
        for name in latest[1]:
            row = (f"{column[name]:.4g}" if name in column else "" for column in columns)
            table.add_row(name, *row)
        table.add_row(self._unit, f"{latest[0]:,}", f"{best[0]:,}")
        return table
