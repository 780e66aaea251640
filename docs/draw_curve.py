"""Draws what a training reached on its way, beside scripted policies in the same worlds.

swarm-logistics train delivery
python docs/draw_curve.py results/train/ppo-delivery docs/media/training_curve.png
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path

import matplotlib

from swarm_logistics_env import policies
from swarm_logistics_env.report.drawing import COLOURS, INK, MARKERS, WIDTH
from swarm_logistics_env.train.evaluation import evaluate
from swarm_logistics_env.train.training import Training

SCRIPTED = ("homing", "swarm-dt", "random-walk")
MILLION = 1e6


def draw(directory: Path, picture: Path) -> None:
    """Draw P of a training's evaluations over what it had learned from."""
    matplotlib.use("agg")
    from matplotlib import pyplot

    (file,) = directory.glob("*.safetensors")
    training = Training(**policies.read_card(file).training)
    with (directory / "curve.csv").open(encoding="utf-8", newline="") as curve:
        rows = list(csv.DictReader(curve))
    steps = [int(row["agent_steps"]) / MILLION for row in rows]
    canvas, axes = pyplot.subplots(figsize=(WIDTH, 0.62 * WIDTH), layout="constrained")
    axes.plot(steps, [float(row["P"]) for row in rows], MARKERS[0] + "-", color=COLOURS[0])
    for name in SCRIPTED:
        p = evaluate(policies.load(name), training.scenario, training.evaluation, 2).means()["P"]
        axes.axhline(p, color=INK, linestyle="--", linewidth=0.8)
        axes.annotate(name, (steps[-1], p), ha="right", va="bottom", fontsize="small")
    asked = training.evaluation
    axes.set_xlabel("million agent-steps")
    axes.set_ylabel(f"P, mean over {asked.seeds} seeds [items]")
    axes.set_title(f"{training.name}, N = {asked.n_robots}", fontsize="medium")
    axes.set_ylim(bottom=0.0)
    axes.spines[["top", "right"]].set_visible(False)
    canvas.savefig(picture, dpi=150)


if __name__ == "__main__":
    draw(Path(sys.argv[1]), Path(sys.argv[2]))
