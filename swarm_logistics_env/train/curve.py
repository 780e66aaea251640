"""What a training measured on its way: a table, a summary with its speed, and a picture."""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass, field
from math import isnan
from pathlib import Path
from typing import Any

from swarm_logistics_env.errors import TrainingError
from swarm_logistics_env.report.drawing import COLOURS, INK, MARKERS, WIDTH
from swarm_logistics_env.writing import becoming

CURVE, SUMMARY, PICTURE = "curve.csv", "summary.json", "curve.png"
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
        collecting, updating: processor time of both so far [s].
        versions: that it learned with last.
    """

    curve: list[dict[str, float]] = field(default_factory=list)
    references: dict[str, dict[str, float]] = field(default_factory=dict)
    seconds: float = 0.0
    collecting: float = 0.0
    updating: float = 0.0
    versions: dict[str, str] | None = None

    @property
    def best(self) -> dict[str, float]:
        """The evaluation with the highest P, the earliest of equals."""
        return max(self.curve, key=lambda row: row["P"])

    def measures(self, row: dict[str, float]) -> dict[str, float]:
        """Return what was measured in a row of the curve, without where and when."""
        return {n: v for n, v in row.items() if n not in ("agent_steps", "seconds", "cpu_seconds")}

    def write(self, directory: Path) -> None:
        """Write curve.csv and summary.json, each whole or not at all.

        The summary holds the best evaluation, what the scripted policies reach on the same seeds,
        the first evaluation that passed each of them (None: none did), and agent-steps per second
        of the processor for collecting and updating.
        """
        with (
            becoming(directory / CURVE, TrainingError) as part,
            part.open("w", encoding="utf-8", newline="") as file,
        ):
            writer = csv.DictWriter(file, self.curve[0])
            writer.writeheader()
            writer.writerows(self.curve)
        done = self.curve[-1]["agent_steps"]
        summary: dict[str, Any] = {
            "best": _told(self.best),
            "references": {name: _told(measured) for name, measured in self.references.items()},
            "passed": {
                name: next((_told(row) for row in self.curve if row["P"] > measured["P"]), None)
                for name, measured in self.references.items()
            },
            "agent_steps_per_cpu_second": {
                name: round(done / seconds) if seconds else None
                for name, seconds in (
                    ("collecting", self.collecting),
                    ("updating", self.updating),
                    ("both", self.collecting + self.updating),
                )
            },
        }
        with becoming(directory / SUMMARY, TrainingError) as part:
            part.write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")

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


def _told(measured: dict[str, float]) -> dict[str, float | None]:
    """Return the measures with None for nan, which JSON does not know."""
    return {name: None if isnan(value) else value for name, value in measured.items()}
