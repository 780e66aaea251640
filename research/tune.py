"""One declared search over the parameters of three scripts: `make tune MINUTES=60`.

It writes docs/research/tuning.md, and every set that was played into docs/results/tune.

`swarm-dt` keeps the constants of the fit to the paper; what is better for it has another name.

Declared before the first run. Method: CMA-ES (Hansen 2016) on the logarithms of the parameters,
from the shipped values, with a spread of a sixth of each range; a range is a quarter to four times
the shipped value. Worth of a set: the mean over `WORLDS` of ln(P), P of a run at least 1; a seed
for each generation, the same for all of its sets and for no other generation. What comes out is
the mean of the search in the end, not its luckiest set, with four digits. It is shipped where the
mean over worlds of ln(P / P of the shipped set) has a 95 % interval above 0 on `CONFIRMED` fresh
seeds, and where that of no world has one below 0. Each script has the same time. Every set goes
into a CSV file at once, and a second call goes on from there.

The last condition was added after the first search: by the mean alone it found a set of
`homing-stock` that delivers nearly twice as much with 3 robots and a seventh less in `realistic`.
Since then the share of that script's robots that hold follows from robots and items, and it was
searched once more, from the values that this search found for its gains and ranges.

A third search of `homing-stock` was declared after another method had found better sets for the
worlds of `paper` and `dots` (`research.search_again`): the same method from the shipped set, with
the presets `dots` and `dotbots` among `WORLDS`, on seeds of its own, for three times as many sets.
"""

from __future__ import annotations

import csv
import importlib
import math
import shutil
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import typer

from research.tables import ROOT, read_rows, rewrite, table, write_rows
from swarm_logistics_env import Scenario, policies, run_episode
from swarm_logistics_env.spi import Interval
from swarm_logistics_env.spi.summaries import t_interval
from swarm_logistics_env.study.report import section
from swarm_logistics_env.study.runs.engines import usable_cores

# Of a script 10,000 from here on; nothing else has those from 5,500,000 to 5,599,999. The searches
# of `homing-stock` before had those from 5,520,000 on.
FIRST_SEEDS = {"swarm-dt": 5_500_000, "homing": 5_510_000, "homing-stock": 5_540_000}
CONFIRMED = 24  # fresh seeds
RANGE = 4.0  # times and parts of the shipped value
SPREAD = 1.0 / 6.0
ENDS = ("ln gain", "low", "high")
# Of each script, the parameters that are searched.
SCRIPTS: Mapping[str, tuple[str, ...]] = {
    "swarm-dt": (
        "diffusion", "avoidance_gain", "avoidance_range", "item_avoidance_gain",
        "item_avoidance_range", "wall_distance", "taxis_gain", "drop_rate",
    ),
    "homing": (
        "spread_gain", "spread_range", "avoid_gain", "avoid_range", "wall_gain", "wall_range",
        "clearance", "obstacle_range", "sure",
    ),
    "homing-stock": (
        "near", "density", "holders", "patience", "spread_gain", "spread_range", "avoid_gain",
        "avoid_range", "clearance", "obstacle_range",
    ),
}  # fmt: skip
PARAMETERS: Mapping[str, tuple[str, ...]] = {
    **SCRIPTS,
    "swarm-dt-tuned": SCRIPTS["swarm-dt"],
    # The range would pass 1 for the rate at which a search begins, so it is left out.
    "site-fidelity": ("give_up_rate", "turn", "turn_decay", "site_rate", "site_range"),
}
_BASE = Scenario.preset("realistic").replace(restock=True)
WORLDS: Mapping[str, Scenario] = {
    "realistic": _BASE,
    "30 items": _BASE.replace(n_items=30),
    "120 items": _BASE.replace(n_items=120),
    "3 robots": _BASE.replace(n_robots=3),
    "10 robots": _BASE.replace(n_robots=10),
    "60 robots, 144 items": _BASE.replace(n_robots=60, n_items=144),
    "two docks": _BASE.replace(floor="two_docks"),
    "aisles": _BASE.replace(floor="aisles"),
    "slow lifting": _BASE.replace(handling_time=3.0),
    "dots": Scenario.preset("dots").replace(restock=True),
    "dotbots": Scenario.preset("dotbots").replace(restock=True),
    "paper": Scenario(restock=True),
}
PAGE = ROOT / "docs" / "research" / "tuning.md"
RESULTS = ROOT / "docs" / "results" / "tune"
Values = Mapping[str, float]


class Tried(NamedTuple):
    """One set of parameters at one seed, with P in every world."""

    generation: int
    seed: int
    values: Values
    p: Mapping[str, int]


def shipped(script: str) -> dict[str, float]:
    """Return the shipped values of what is searched."""
    policy: Any = policies.load(script)
    return {name: float(getattr(policy.parameters, name)) for name in PARAMETERS[script]}


def values_at(script: str, point: Sequence[float]) -> dict[str, float]:
    """Return the parameters at a point of the unit cube, four digits of each."""
    return {
        name: float(f"{value * RANGE ** (2.0 * min(max(x, 0.0), 1.0) - 1.0):.4g}")
        for (name, value), x in zip(shipped(script).items(), point, strict=True)
    }


def play(script: str, seed: int, values: Values) -> dict[str, int]:
    """Return P in every world at a seed."""
    parameters: dict[str, Any] = dict(values)
    return {
        name: run_episode(scenario, policies.load(script, **parameters), seed).delivered
        for name, scenario in WORLDS.items()
    }


def worth(p: Mapping[str, int]) -> float:
    """Return the mean of ln(P) over worlds."""
    return float(np.mean(np.log(np.maximum(list(p.values()), 1))))


def read_tried(path: Path, script: str) -> list[Tried]:
    """Return what was tried; a last line that was cut short is left out."""
    if not path.exists():
        return []
    *_, last_world = WORLDS
    return [
        Tried(
            int(row["generation"]),
            int(row["seed"]),
            {name: float(row[name]) for name in SCRIPTS[script]},
            {name: int(row[name]) for name in WORLDS},
        )
        for row in read_rows(path)
        if row[last_world] is not None
    ]


def append(tried: Tried, path: Path) -> None:
    """Append a set to the file, with its head if it is new."""
    is_new = not path.exists()
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        if is_new:
            writer.writerow(["generation", "seed", *tried.values, *tried.p])
        writer.writerow([tried.generation, tried.seed, *tried.values.values(), *tried.p.values()])


def evaluate(script: str, generation: int, values: Values) -> Tried:
    """Play a set at the seed of its generation."""
    seed = FIRST_SEEDS[script] + generation
    return Tried(generation, seed, values, play(script, seed, values))


def search(script: str, path: Path, is_over: Callable[[], bool]) -> dict[str, float]:
    """Search until the time is up, from what was tried before on; return the mean in the end."""
    cma: Any = importlib.import_module("cma")  # in this script's environment alone

    start = [0.5] * len(SCRIPTS[script])
    options = {"bounds": [0.0, 1.0], "seed": 1, "verbose": -9}
    strategy = cma.CMAEvolutionStrategy(start, SPREAD, options)
    before = read_tried(path, script)
    for generation in count():
        points = strategy.ask()
        values = [values_at(script, point) for point in points]
        # A call that goes on asks for the same points, as the seed is the same.
        sets = before[: len(points)]
        before = before[len(points) :]
        if [tried.values for tried in sets] != values[: len(sets)]:
            raise SystemExit(f"{path} was searched from other constants: search in a new folder")
        untried = values[len(sets) :]
        if untried and is_over():
            break
        with ProcessPoolExecutor(usable_cores()) as processes:
            for tried in processes.map(partial(evaluate, script, generation), untried):
                append(tried, path)  # as they come: a kill loses few sets
                sets.append(tried)
        strategy.tell(points, [-worth(tried.p) for tried in sets])
        mean = values_at(script, strategy.result.xfavorite)
        print(script, generation, f"{np.mean([worth(tried.p) for tried in sets]):.3f}", mean)
    return values_at(script, strategy.result.xfavorite)


def confirm(script: str, values: Values, before: Values, first: int) -> dict[str, Interval]:
    """Return ln(P / P of the set before): in each world, and in the mean of all.

    Args:
        first: of the seeds, which are fresh.
    """
    seeds = range(first, first + CONFIRMED)
    with ProcessPoolExecutor(usable_cores()) as processes:
        new, old = (
            list(processes.map(partial(play, script, values=chosen), seeds))
            for chosen in (values, before)
        )
    gains = np.array(
        [
            [math.log(max(p[world], 1) / max(q[world], 1)) for world in WORLDS]
            for p, q in zip(new, old)
        ]
    )
    by_world = {world: t_interval(gains[:, index]) for index, world in enumerate(WORLDS)}
    return {**by_world, "all": t_interval(gains.mean(axis=1))}


def publish(out: Path) -> None:
    """Copy what lies in `out`, and write the page of all scripts that were ever searched."""
    value_rows = []
    gains: dict[str, dict[str, str]] = {}
    for script in SCRIPTS:
        for name in (f"{script}.csv", f"{script}-values.csv", f"{script}-confirmed.csv"):
            RESULTS.mkdir(parents=True, exist_ok=True)
            if (out / name).exists():
                shutil.copyfile(out / name, RESULTS / name)
        before, after = read_rows(RESULTS / f"{script}-values.csv")
        value_rows += [(f"`{script}`", name, before[name], after[name]) for name in SCRIPTS[script]]
        for row in read_rows(RESULTS / f"{script}-confirmed.csv"):
            gain = Interval(*(100.0 * math.expm1(float(row[end])) for end in ENDS))
            gains.setdefault(row["world"], {})[script] = section.bracketed(gain, 0)
    n_sets = {script: len(read_rows(RESULTS / f"{script}.csv")) for script in SCRIPTS}
    # Two worlds came with the third search.
    gain_rows = [
        (world, *(gains[world].get(script, section.NOTHING) for script in SCRIPTS))
        for world in (*WORLDS, "all")
        if world in gains
    ]
    heads = [f"`{script}`, {n_sets[script]} sets" for script in SCRIPTS]
    line = f"{CONFIRMED} fresh seeds; geometric means of P over that of the set before, 95 %."
    blocks = {
        "tuned values": table(("script", "parameter", "before", "found"), value_rows),
        "tuned gains": table(("change of P [%]", *heads), gain_rows, line),
    }
    rewrite(PAGE, blocks)


def main(
    minutes: float = 60.0, out: Path = Path("results/tune"), scripts: list[str] | None = None
) -> None:
    """Search scripts, each for an equal part of the time, confirm what comes out, and print it."""
    scripts = scripts or list(SCRIPTS)
    for script in scripts:
        end = time.monotonic() + 60.0 * minutes / len(scripts)
        values = search(script, out / f"{script}.csv", partial(_is_after, end))
        sets = {"shipped": shipped(script), "searched": values}
        rows = [(name, *chosen.values()) for name, chosen in sets.items()]
        write_rows(out / f"{script}-values.csv", ("set", *values), rows)
        gains = confirm(script, values, shipped(script), FIRST_SEEDS[script] + 5_000)
        gain_rows = [(world, *interval) for world, interval in gains.items()]
        write_rows(out / f"{script}-confirmed.csv", ("world", *ENDS), gain_rows)
        print(script, values, {world: section.bracketed(g, 2) for world, g in gains.items()})
    publish(out)


def _is_after(end: float) -> bool:
    return time.monotonic() > end


if __name__ == "__main__":
    typer.run(main)
