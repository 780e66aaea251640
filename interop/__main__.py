"""Four learners of other people's code, three trainings each: `make interop`.

What results/interop has already is not trained again. One training more of a row, run by hand with
`--seed 3`, is shown beside the row's prediction interval when this is called again.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import typer

from interop.small_world import FAULTY, MODES, RESULTS, SEEDS, WORLDS, Learning
from swarm_logistics_env import policies, spi
from swarm_logistics_env.study.report.curves import Curve, CurvePanel, curves
from swarm_logistics_env.study.report.drawing import COLOURS, svg_image
from swarm_logistics_env.study.report.section import Section, bracketed
from swarm_logistics_env.study.report.write import section_markdown
from swarm_logistics_env.train.evaluation import performances

ROOT = RESULTS.parents[1]
TRAININGS = range(3)
BEST = 2  # learners that learn in the paper's world too
REFERENCES = ("swarm-dt-2026", "ppo-delivery")
NOTE = (
    "Mean P of 4 evaluation seeds; thin: single trainings; band: 95 % t-interval of the mean over "
    "trainings, cut off at 0; straight: shipped policies on 20 other seeds."
)
Beside = dict[str, dict[str, list[float]]]  # P of policies on the same seeds, by world and name


class Learner(NamedTuple):
    """Where a learner lives, and what a run costs."""

    venv: str  # in .venvs
    module: str
    minutes: dict[str, float]  # of one core, for a training in each world and its row, as measured


LEARNERS = {
    "sb3-ppo": Learner("dev", "interop.sb3_ppo", {"small": 2, "paper": 5}),
    "torchrl-ppo": Learner("torchrl", "interop.torchrl_ppo", {"small": 3, "paper": 7}),
    "benchmarl-ippo": Learner("benchmarl", "interop.benchmarl_ppo", {"small": 4, "paper": 7}),
    "benchmarl-mappo": Learner("benchmarl", "interop.benchmarl_ppo", {"small": 4, "paper": 7}),
}


def main(processes: int = 1) -> None:
    """Say how long it takes, train what is missing, so many at once; write table and picture."""
    small = missing("small", LEARNERS)
    slowest = max(each.minutes["paper"] for each in LEARNERS.values())
    minutes = sum(LEARNERS[name].minutes["small"] for name, _ in small)
    done = sum(len(first(rows("paper", name))) for name in LEARNERS)
    minutes += slowest * max(0, BEST * len(TRAININGS) - done)
    print(f"at most {minutes / 60:.1f} core-hours; what is done is kept, so it may be stopped")
    train("small", small, processes)
    reached = {name: np.mean([row["P"] for row in first(rows("small", name))]) for name in LEARNERS}
    best = sorted(reached, key=lambda name: -reached[name])[:BEST]
    train("paper", missing("paper", best), processes)
    scripted = references()
    text = table(scripted)
    (RESULTS / "table.md").write_text(text, encoding="utf-8")
    picture = svg_image(lambda canvas: draw(canvas, scripted), 6.0, NOTE)
    (RESULTS / "learners.svg").write_text(picture, encoding="utf-8")
    print(text)


def rows(world: str, learner: str) -> list[dict[str, Any]]:
    """Return the rows of a learner's whole trainings that are there, by seed."""
    paths, steps = RESULTS.glob(f"{learner}-{world}@*.json"), Learning("", world, 0).agent_steps
    trainings = [json.loads(path.read_text("utf-8")) for path in paths]
    complete = [row for row in trainings if row["agent_steps"] == steps]
    return sorted(complete, key=lambda row: int(row["seed"]))


def first(trainings: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the rows that the table is about, without trainings that were run by hand."""
    return [row for row in trainings if row["seed"] in TRAININGS]


def missing(world: str, learners: Iterable[str]) -> list[tuple[str, int]]:
    """Return learner and seed of the trainings that have no row yet."""
    untrained = []
    for name in learners:
        done = {row["seed"] for row in rows(world, name)}
        untrained += [(name, seed) for seed in TRAININGS if seed not in done]
    return untrained


def train(world: str, runs: list[tuple[str, int]], processes: int) -> None:
    """Train each in a process of its own, with its library's Python."""

    def one(run: tuple[str, int]) -> None:
        name, seed = run
        python = ROOT / ".venvs" / LEARNERS[name].venv / "bin" / "python"
        command = [str(python) if python.exists() else sys.executable, "-m", LEARNERS[name].module]
        command += ["--learner", name, "--world", world, "--seed", str(seed)]
        subprocess.run(command, cwd=ROOT, check=True)

    with ThreadPoolExecutor(processes) as pool:
        list(pool.map(one, runs))


def references() -> Beside:
    """Return P of the shipped policies on the same seeds, by world."""
    p_by_world: Beside = {world: {} for world in WORLDS}
    for world, name in product(WORLDS, REFERENCES):
        p = performances(policies.load(name), WORLDS[world], [()], SEEDS)[0]
        p_by_world[world][name] = p.tolist()
    return p_by_world


def table(scripted: Beside) -> str:
    """Return the rows as Markdown: P and R over trainings and seeds, each with its interval."""
    head = ["learner", "world", "agent-steps", "CPU minutes", "P", "P of each training"]
    head += ["clear of Swarm D-T", *(f"R, {mode}, m = {FAULTY}" for mode in MODES)]
    lines = []
    for world, name in product(WORLDS, LEARNERS):
        trainings = rows(world, name)
        if counted := first(trainings):
            p = [row["P"] for row in counted]
            lines.append((
                name, world, f"{counted[0]['agent_steps']:,}",
                f"{np.mean([row['cpu_minutes'] for row in counted]):.1f}",
                bracketed(spi.mean_interval(p), 1), each_training(trainings),
                f"{sum(is_clear(each, scripted[world][REFERENCES[0]]) for each in p)} of {len(p)}",
                *(robustness(p, [row["P_F"][mode] for row in counted], world) for mode in MODES),
            ))  # fmt: skip
    for world, name in product(WORLDS, REFERENCES):
        p_of = bracketed(spi.mean_interval(scripted[world][name]), 1)
        lines.append((name, world, "", "", p_of, *[""] * (len(head) - 5)))
    return section_markdown(Section("", tuple(head), tuple(lines)))


def robustness(p_o: list[list[float]], p_f: list[list[float]], world: str) -> str:
    """Return R over trainings and seeds with its interval; "-": nothing was delivered."""
    if not np.any(p_o):
        return "-"
    return bracketed(spi.robustness(p_o, p_f, n=WORLDS[world].n_robots, m=FAULTY), 2)


def each_training(trainings: list[dict[str, Any]]) -> str:
    """Return mean P of each training; one more stands beside the interval predicted for it."""
    means = [float(np.mean(row["P"])) for row in first(trainings)]
    words = ", ".join(f"{mean:.1f}" for mean in means)
    predicted = bracketed(spi.prediction_interval(means), 1)
    for row in trainings[len(means) :]:
        words += f"; seed {row['seed']}: {np.mean(row['P']):.1f}, predicted {predicted}"
    return words


def is_clear(p: list[float], reference: list[float]) -> bool:
    """Return whether a training delivers clearly more than a reference on the same seeds."""
    return spi.relative_change(reference, p).verdict == "supported"


def draw(canvas: Any, scripted: Beside) -> None:
    """Draw P over agent-steps, a panel for each learner in each world where it has trainings."""
    panels = []
    p_by_panel = []
    for world, name in product(WORLDS, LEARNERS):
        paths = [RESULTS / f"{name}-{world}@{seed}.csv" for seed in TRAININGS]
        files = [np.loadtxt(path, delimiter=",", skiprows=1) for path in paths if path.exists()]
        if not files:
            continue
        millions = files[0][:, 0] / 1e6
        p = np.array([file[:, 2] for file in files])  # (trainings, k)
        mean, low, high = np.array([spi.mean_interval(at_step) for at_step in p.T]).T
        ends = millions[[0, -1]]
        no_limits = np.full(2, np.nan)
        beside = [
            Curve(reference, ends, np.full(2, np.mean(delivered)), no_limits, no_limits)
            for reference, delivered in scripted[world].items()
        ]
        trained = Curve(f"mean of {len(p)} trainings", millions, mean, low, high)
        panels.append(
            CurvePanel(f"{name}, {world} world", "million agent-steps", [trained, *beside])
        )
        p_by_panel.append(p)
    curves(canvas, panels, "P [items]", n_columns=2)
    for axes, panel, p in zip(canvas.axes, panels, p_by_panel):
        axes.plot(panel.curves[0].x, p.T, color=COLOURS[0], linewidth=0.7)


if __name__ == "__main__":
    typer.run(main)
