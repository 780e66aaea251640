"""A second search of every script, by another method and in one preset at a time.

`python -m research.search_again --script homing --minutes 60`, a core-hour a script, counted in
seconds of the processor, so that a busy machine gives no shorter search; it writes the table of
docs/research/tuning.md from all that lies in docs/results/search_again.csv. With `--everywhere
realistic` the set of that preset plays in all worlds of `tune` instead, beside what it replaced.

`tune` asks for one set that serves ten worlds. This search is a referee's, who wants to beat a
script in one preset: differential evolution (Storn and Price 1997) on the logarithms of the same
parameters in the same ranges, over the mean of ln(P) on six seeds. Then the set that it found and
the shipped one play 200 fresh seeds, paired. Declared before the first run: a script is beaten in a
preset where the mean of its P rises by 5 % or more.
"""

from __future__ import annotations

import ast
import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from functools import partial
from typing import Annotated, Any

import numpy as np
import typer
from numpy.typing import NDArray

from research import tune
from research.tables import percent_change, read_rows, rewrite, signed_percent, table, write_rows
from swarm_logistics_env import Scenario, policies, run_episode, spi
from swarm_logistics_env.study.report import section
from swarm_logistics_env.study.runs.engines import usable_cores

FIRST_SEED = 5_600_000  # to 5,699,999, which nothing else has
SEARCHED = 6  # seeds
CONFIRMED = 200
SETS = 24  # of a generation
PRESETS = {
    name: Scenario.preset(name).replace(restock=True)
    for name in ("realistic", "paper", "dots", "dotbots")
}
RESULTS = tune.RESULTS.parent / "search_again.csv"
EVERYWHERE = tune.RESULTS.parent / "search_everywhere.csv"
ENDS = ("change", "low", "high")
# Constants that were shipped when a second search found better ones.
_REPLACED: Mapping[str, tune.Values] = {
    "swarm-dt-tuned": {
        "diffusion": 0.06493, "avoidance_gain": 0.42, "avoidance_range": 0.3993,
        "item_avoidance_gain": 1.198, "item_avoidance_range": 0.2428, "wall_distance": 0.3223,
        "taxis_gain": 0.8622, "drop_rate": 0.9005,
    }
}  # fmt: skip
HEAD = ("script", "preset", "sets", "shipped P", "searched P", *ENDS, "values")


def delivered(script: str, values: tune.Values, scenario: Scenario, seed: int) -> int:
    """Return P of a run with these parameters."""
    parameters: dict[str, Any] = dict(values)
    return run_episode(scenario, policies.load(script, **parameters), seed).delivered


def loss(point: NDArray[np.float64], script: str, scenario: Scenario) -> float:
    """Return minus the mean of ln(P) at a point of the unit cube, P of a run at least 1."""
    values = tune.values_at(script, point.tolist())
    seeds = range(FIRST_SEED, FIRST_SEED + SEARCHED)
    p = [delivered(script, values, scenario, seed) for seed in seeds]
    return -float(np.mean(np.log(np.maximum(p, 1))))


def loss_and_seconds(
    function: Callable[[NDArray[np.float64]], float], point: NDArray[np.float64]
) -> tuple[float, float]:
    """Return the loss at a point, and how many seconds of a core it took."""
    start = time.process_time()
    return function(point), time.process_time() - start


def search(
    script: str, scenario: Scenario, seconds: float, processes: Executor
) -> tuple[dict[str, float], int]:
    """Return the best set after so many seconds of a core, and how many were played."""
    from scipy.optimize import Bounds, OptimizeResult, differential_evolution

    n = len(tune.PARAMETERS[script])
    generator = np.random.default_rng(1)
    points = generator.uniform(size=(SETS, n))
    points[0] = 0.5  # the shipped set
    spent: list[float] = []

    def in_processes(
        function: Callable[[NDArray[np.float64]], float], sets: Iterable[NDArray[np.float64]]
    ) -> list[float]:
        played = list(processes.map(partial(loss_and_seconds, function), sets))
        spent.extend(of_a_core for _, of_a_core in played)
        return [set_loss for set_loss, _ in played]

    def end_in_time(intermediate_result: OptimizeResult) -> None:
        if sum(spent) > seconds:
            raise StopIteration

    best = differential_evolution(
        partial(loss, script=script, scenario=scenario),
        Bounds(np.zeros(n), np.ones(n)),
        init=points,
        rng=generator,
        maxiter=10_000,
        tol=0.0,
        polish=False,
        updating="deferred",
        workers=in_processes,
        callback=end_in_time,
    )
    return tune.values_at(script, best.x.tolist()), int(best.nfev)


def compare(
    script: str, values: tune.Values, scenario: Scenario, processes: Executor
) -> tuple[float, float, spi.Interval]:
    """Return the means of P of the shipped set and of these values, and the change in percent."""
    first = FIRST_SEED + 50_000
    seeds = range(first, first + CONFIRMED)
    shipped, searched = (
        np.array(list(processes.map(partial(delivered, script, chosen, scenario), seeds)))
        for chosen in (tune.shipped(script), values)
    )
    return shipped.mean(), searched.mean(), percent_change(shipped, searched)


def confirm_everywhere(script: str, preset: str) -> None:
    """Play a set that was searched in a preset in all worlds of `tune`, and write the table."""
    (row,) = [row for row in _rows() if (row["script"], row["preset"]) == (script, preset)]
    values = ast.literal_eval(row["values"])
    gains = tune.confirm(script, values, _REPLACED[script], FIRST_SEED + 80_000)
    write_rows(EVERYWHERE, ("world", *tune.ENDS), [(world, *gain) for world, gain in gains.items()])
    body = []
    for world, gain in gains.items():
        low, high = (None if x is None else 100.0 * math.expm1(x) for x in (gain.low, gain.high))
        percent = spi.Interval(100.0 * math.expm1(gain.value), low, high)
        body.append((world, section.bracketed(percent, 0)))
    heads = ("world", f"`{script}` with the set of `{preset}` [%]")
    line = (
        f"{tune.CONFIRMED} fresh seeds; geometric means of P over that of the set shipped before, "
        "95 %."
    )
    rewrite(tune.PAGE, {"searched everywhere": table(heads, body, line)})


def publish(rows: Sequence[dict[str, Any]]) -> None:
    """Write the table of the page."""
    body = []
    for row in rows:
        # Without spread between seeds there are no limits.
        limits = (float(row[end]) if row[end] else None for end in ("low", "high"))
        change = spi.Interval(float(row["change"]), *limits)
        p = (f"{float(row[name]):.1f}" for name in ("shipped P", "searched P"))
        body.append((f"`{row['script']}`", row["preset"], row["sets"], *p, _percent(change)))
    head = ("script", "preset", "sets", "P, shipped", "P, searched there alone", "change")
    line = f"{CONFIRMED} fresh seeds, paired; 95 % intervals of the change of the mean."
    rewrite(tune.PAGE, {"searched again": table(head, body, line)})


def _percent(change: spi.Interval) -> str:
    return signed_percent(change, 0) if math.isfinite(change.value) else section.NOTHING


def main(
    script: Annotated[
        list[str], typer.Option(help="A name of `tune.PARAMETERS`; again for several.")
    ],
    minutes: Annotated[
        float, typer.Option(help="Of a core, for each script, all presets together.")
    ] = 30.0,
    preset: Annotated[list[str] | None, typer.Option(help="All of them without it.")] = None,
    everywhere: Annotated[
        str | None, typer.Option(help="Play the set of this preset in all worlds; no search.")
    ] = None,
) -> None:
    """Search scripts anew in each preset, compare with the shipped sets, and write the table."""
    if everywhere is not None:
        for name in script:
            confirm_everywhere(name, everywhere)
        return
    chosen = preset or list(PRESETS)
    with ProcessPoolExecutor(usable_cores()) as processes:
        for name in script:
            for preset_name in chosen:
                scenario = PRESETS[preset_name]
                seconds = 60.0 * minutes / len(chosen)
                values, n_sets = search(name, scenario, seconds, processes)
                before, after, change = compare(name, values, scenario, processes)
                row = (name, preset_name, n_sets, before, after, *change, dict(values))
                rows = [line for line in _rows() if (line["script"], line["preset"]) != row[:2]]
                lines = [tuple(line.values()) for line in rows]
                write_rows(RESULTS, HEAD, [*lines, row])  # at once: a kill loses one preset
                print(name, preset_name, n_sets, _percent(change), values, flush=True)
    publish(_rows())


def _rows() -> list[dict[str, Any]]:
    return read_rows(RESULTS) if RESULTS.exists() else []


if __name__ == "__main__":
    typer.run(main)
