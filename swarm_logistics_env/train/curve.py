"""What a training measured: a sentence while it runs, then a table and a picture."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from swarm_logistics_env.errors import TrainingError
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

    def sentence(self, means: Mapping[str, float]) -> str:
        """Return what was measured, each beside that of the scripted policies."""
        told = []
        for name, value in means.items():
            beside = [f"{n} {of[name]:.4g}" for n, of in self.references.items() if name in of]
            told.append(f"{name} = {value:.4g}" + (f" ({', '.join(beside)})" if beside else ""))
        return ", ".join(told)

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
