"""Fit the constants of Swarm D-T and the radio's range to the paper's tables, by CMA-ES.

    make paper-fit MINUTES=40

Three fits: `sound` sees the cells without a failed robot alone (Tables I and III, P_o and P_S of
Table II), so that it predicts R and FT; `all` sees the cells of the failure modes, too; `shipped`
is as `sound`, with the radio's range of the default scenario. Every set
that is tried is played at one seed a cell, the same for all sets of a generation and for no other
generation, and goes into tried.csv at once; a second call goes on from there. Robots always drive
at full speed, as in the simulator of the paper's author. `play_paper_fit` confirms the fits.

Declared before the first run: a set fits if the mean of |ln(P / paper's P)| over the sound cells is
at most what Poisson counts of these means leave in 19 of 20 draws, where the paper's P are single
runs. The constants are CMA's mean in the end, not the best set, which would be the luckiest.
"""

from __future__ import annotations

import csv
import functools
import importlib
import itertools
import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import typer

from research.tables import read_rows
from swarm_logistics_env import Fault, Scenario, run_episode
from swarm_logistics_env.core.streams import generator
from swarm_logistics_env.policies import SwarmDT
from swarm_logistics_env.study.questions.comparison import Setting
from swarm_logistics_env.study.verdicts.reference import PAPER

FITS = ("sound", "all", "shipped")
FIRST_SEED = 5_300_000  # nothing else uses the seeds from here to 5,399,999
# The range of each constant, searched by its logarithm: those of
# examples/tune_swarm_dt.py, and a radio from the cameras' range to the warehouse's width.
RANGES = {
    "diffusion": (0.05, 3.0),
    "avoidance_gain": (0.2, 5.0),
    "avoidance_range": (0.25, 1.0),
    "item_avoidance_gain": (0.2, 5.0),
    "item_avoidance_range": (0.25, 1.0),
    "wall_distance": (0.13, 1.0),
    "taxis_gain": (0.1, 3.0),
    "drop_rate": (0.1, 10.0),
    "radio_range": (1.0, 10.0),
}
SOUND = tuple(
    setting
    for setting in PAPER.cells
    if setting.kind != "fault" or setting.name == "removed" or not setting.value
)
FAULTY = tuple(setting for setting in PAPER.cells if setting not in SOUND)
CONSTANTS = (*RANGES, "full_speed")
LARGE = tuple(s for s in SOUND if s.kind == "size" and s.value >= 100.0)  # half of the cost
Constants = Mapping[str, float]
Performances = dict[str, int]  # P by the name of the cell


class Tried(NamedTuple):
    """One set of constants at one seed, with P of the cells that were played."""

    fit: str
    generation: int
    seed: int
    constants: Constants
    performance: Performances


def cell_name(setting: Setting) -> str:
    """Return a cell's column, e.g. "FM1 = 2"."""
    return f"{setting.name} = {setting.value:g}"


def conditions(setting: Setting, radio_range: float) -> tuple[Scenario, list[Fault]]:
    """Return the scenario and the faults of a cell of the paper."""
    kind, name, value, *_ = setting
    scenario = Scenario(radio_range=radio_range)
    if kind == "size":
        large = Scenario.preset("paper_scalability")
        return large.replace(n_robots=int(value), radio_range=radio_range), []
    if kind == "parameter":
        return scenario.replace(**{name: int(value) if name == "n_items" else value}), []
    return scenario, [Fault(name, int(value))] if value else []


def policy_of(constants: Constants) -> SwarmDT:
    """Return Swarm D-T with these constants."""
    parameters: dict[str, Any] = {name: x for name, x in constants.items() if name != "radio_range"}
    return SwarmDT(**{**parameters, "full_speed": bool(parameters["full_speed"])})


def play(settings: Iterable[Setting], constants: Constants, seed: int) -> Performances:
    """Return P of each cell at this seed; what several cells share is played once."""
    played: dict[Any, int] = {}
    performance: Performances = {}
    for setting in settings:
        scenario, faults = conditions(setting, constants["radio_range"])
        what = scenario, tuple(map(str, faults))
        if what not in played:
            played[what] = run_episode(scenario, policy_of(constants), seed, faults).delivered
        performance[cell_name(setting)] = played[what]
    return performance


def log_error(performance: Mapping[str, float], settings: Sequence[Setting]) -> float:
    """Return the mean of |ln(P / paper's P)| over those of these cells that were played."""
    played = [setting for setting in settings if cell_name(setting) in performance]
    ratios = [max(performance[cell_name(s)], 0.5) / PAPER.performance[s] for s in played]
    return float(np.mean([abs(math.log(ratio)) for ratio in ratios]))


@functools.cache
def largest_error(
    n_seeds: int | tuple[int, ...] = 1, settings: tuple[Setting, ...] = SOUND
) -> float:
    """Return the mean |ln| that a true set exceeds in one draw of twenty, by seeds of each cell."""
    draws = generator(0, "noise of one run a cell")
    means = np.array([PAPER.performance[setting] for setting in settings])
    papers = np.maximum(draws.poisson(means, (20_000, len(means))), 0.5)
    n = np.array(n_seeds)
    our_p = np.maximum(draws.poisson(means * n, papers.shape) / n, 0.5)
    return float(np.quantile(np.abs(np.log(our_p / papers)).mean(axis=1), 0.95))


def constants_at(point: Sequence[float]) -> dict[str, float]:
    """Return the constants at a point of the unit cube, four digits of each."""
    fitted = {
        name: float(f"{low * (high / low) ** min(max(x, 0.0), 1.0):.4g}")
        for (name, (low, high)), x in zip(RANGES.items(), point, strict=True)
    }
    return {**fitted, "full_speed": 1.0}


def point_of(constants: Constants) -> list[float]:
    """Return the point of the unit cube where these constants are."""
    return [
        math.log(constants[name] / low) / math.log(high / low)
        for name, (low, high) in RANGES.items()
    ]


# Where a search of 32 generations ended that began in the middle of the ranges: the start of ours.
START = {
    "diffusion": 0.08176,
    "avoidance_gain": 0.4469,
    "avoidance_range": 0.3461,
    "item_avoidance_gain": 0.3128,
    "item_avoidance_range": 0.9376,
    "wall_distance": 0.1887,
    "taxis_gain": 0.6486,
    "drop_rate": 0.7229,
    "radio_range": 2.668,
}


def read_tried(path: Path) -> list[Tried]:
    """Return what was tried; a last line that was cut short is left out."""
    if not path.exists():
        return []
    cells = list(map(cell_name, PAPER.cells))
    rows = [row for row in read_rows(path) if row[cells[-1]] is not None]
    return [
        Tried(
            row["fit"],
            int(row["generation"]),
            int(row["seed"]),
            {name: float(row[name]) for name in CONSTANTS},
            {name: int(row[name]) for name in cells if row[name]},
        )
        for row in rows
    ]


def append(tried: Tried, path: Path) -> None:
    """Append a set to the file, with its head if it is new."""
    cells = list(map(cell_name, PAPER.cells))
    is_new = not path.exists()
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        if is_new:
            writer.writerow(["fit", "generation", "seed", *CONSTANTS, *cells])
        performance = [tried.performance.get(name, "") for name in cells]
        constants = [f"{tried.constants[name]:g}" for name in CONSTANTS]
        writer.writerow([tried.fit, tried.generation, tried.seed, *constants, *performance])


def is_full(tried: Tried) -> bool:
    """Return whether all cells were played."""
    return len(tried.performance) == len(PAPER.cells)


def evaluate(fit: str, generation: int, constants: Constants) -> Tried:
    """Play a set: the sound cells of up to 60 robots, and if it may fit, all others."""
    seed = FIRST_SEED + 1000 * FITS.index(fit) + generation
    cheap = tuple(setting for setting in SOUND if setting not in LARGE)
    performance = play(cheap, constants, seed)
    if log_error(performance, cheap) <= largest_error(1, cheap):
        performance |= play((*FAULTY, *LARGE), constants, seed)
    return Tried(fit, generation, seed, constants, performance)


def search(fit: str, path: Path, is_over: Callable[[], bool] = lambda: True) -> dict[str, float]:
    """Fit until the time is up, from what was tried before on; return the mean in the end."""
    cma: Any = importlib.import_module("cma")  # in this script's environment alone

    settings = PAPER.cells if fit == "all" else SOUND
    start = point_of(START)
    fixed: list[float] = []
    if fit == "shipped":  # the radio's range is the last constant
        *start, default_range = point_of({**START, "radio_range": Scenario().radio_range})
        fixed = [default_range]
    rows = read_tried(path)
    before = [tried for tried in rows if tried.fit == fit]
    if fit == "all":  # it may see everything, so it begins where the other one was best
        rows_before = itertools.takewhile(lambda t: t.fit != "all", rows)
        remaining_sets = [tried for tried in rows_before if tried.fit == "sound" and is_full(tried)]
        remaining_sets.sort(key=lambda t: log_error(t.performance, PAPER.cells))
        start = np.mean([point_of(t.constants) for t in remaining_sets[:10]], axis=0).tolist()
    options = {"bounds": [0.0, 1.0], "seed": 1, "verbose": -9}
    strategy = cma.CMAEvolutionStrategy(start, 0.1, options)
    generation = 0
    while not is_over() or any(tried.generation >= generation for tried in before):
        points = strategy.ask()
        constants = [constants_at([*point, *fixed]) for point in points]
        # A call that goes on asks for the same points, as the seed is the same.
        sets = before[: len(points)]
        before = before[len(points) :]
        untried = constants[len(sets) :]
        if untried and is_over():
            break
        with ProcessPoolExecutor() as processes:  # append() as they come: a kill loses few sets
            for tried in processes.map(functools.partial(evaluate, fit, generation), untried):
                append(tried, path)
                sets.append(tried)
        errors = [log_error(tried.performance, settings) for tried in sets]
        strategy.tell(points, errors)
        generation += 1
        mean = constants_at([*strategy.result.xfavorite, *fixed])
        print(fit, generation, f"{np.mean(errors):.3f} {min(errors):.3f}", mean, flush=True)
    return constants_at([*strategy.result.xfavorite, *fixed])


def main(minutes: float = 30.0, out: Path = Path("results/paper_fit")) -> None:
    """Fit three times, each in a third of the time."""
    for fit in FITS:
        end = time.monotonic() + 20.0 * minutes
        print(fit, search(fit, out / "tried.csv", functools.partial(_is_after, end)))


def _is_after(end: float) -> bool:
    return time.monotonic() > end


if __name__ == "__main__":
    typer.run(main)
