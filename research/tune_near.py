"""A search of one parameter: how deep the stock of `homing-stock` is where lifting takes no time.

`python -m research.tune_near` writes docs/results/tune/near.csv and its table in
docs/research/tuning.md; two minutes of two cores.

The third search of `research.tune` found a set that one world of twelve loses by, so it was not
shipped. Its gain in `dots` and in the paper's world was that of `near` alone, which acts only where
lifting takes no time: elsewhere `density` says how deep the stock is. A first search of it, over
seeds from 5,550,000 on, found the best depth at 0.55 to 0.6 m in `dots`, 0.45 m in the paper's
world and 0.4 m in `dotbots`, as far apart as the distances in which these robots brake from top
speed: 0.25, 0.1 and 0.02 m. So the script adds that distance, and the search was declared anew, on
other seeds, before its first run: the value of `VALUES` with the largest mean of ln(P) over these
worlds, each on `SEARCHED` seeds, is shipped if the mean of ln(P / P of the depth before) over the
worlds has a 95 % interval above 0 on `CONFIRMED` fresh seeds, and that of no world has one below 0.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from concurrent.futures import Executor, ProcessPoolExecutor
from functools import partial

import numpy as np
from numpy.typing import NDArray

from research import tune
from research.search_again import delivered
from research.tables import rewrite, table, write_rows
from swarm_logistics_env.spi import Interval
from swarm_logistics_env.spi.summaries import t_interval
from swarm_logistics_env.study.report import section
from swarm_logistics_env.study.runs.engines import usable_cores

FIRST_SEED = 5_560_000
SEARCHED = 40
CONFIRMED = 100
DEPTH_BEFORE = 0.6898  # [m]
VALUES = (0.25, 0.3, 0.35, 0.4, 0.45)
WORLDS = {name: tune.WORLDS[name] for name in ("dots", "dotbots", "paper")}


def log_p(near_in: Mapping[str, float], seeds: range, processes: Executor) -> NDArray[np.float64]:
    """Return ln(P) in each world at each seed, P of a run at least 1, shape (worlds, seeds)."""
    p = [
        [*processes.map(partial(delivered, "homing-stock", {"near": near}, WORLDS[name]), seeds)]
        for name, near in near_in.items()
    ]
    return np.log(np.maximum(p, 1))


def near_before() -> dict[str, float]:
    """Return the parameter that makes the stock as deep as before, in each world."""
    return {
        name: DEPTH_BEFORE - scenario.max_speed**2 / (2.0 * scenario.max_acceleration)
        for name, scenario in WORLDS.items()
    }


def main() -> None:
    """Search, confirm, and write the table."""
    searched = range(FIRST_SEED, FIRST_SEED + SEARCHED)
    fresh = range(FIRST_SEED + 5_000, FIRST_SEED + 5_000 + CONFIRMED)
    with ProcessPoolExecutor(usable_cores()) as processes:
        means = {
            near: log_p(dict.fromkeys(WORLDS, near), searched, processes).mean(axis=1)
            for near in VALUES
        }
        best = max(VALUES, key=lambda near: float(means[near].mean()))
        gains = log_p(dict.fromkeys(WORLDS, best), fresh, processes)
        gains -= log_p(near_before(), fresh, processes)
    write_rows(
        tune.RESULTS / "near.csv",
        ("near", *WORLDS),
        [(near, *of_worlds) for near, of_worlds in means.items()],
    )
    intervals = [t_interval(of_world) for of_world in gains] + [t_interval(gains.mean(axis=0))]
    changes = [
        Interval(*(100.0 * math.expm1(end or 0.0) for end in interval)) for interval in intervals
    ]
    rows = [
        *((f"{near:g}", *(f"{np.exp(mean):.1f}" for mean in means[near]), "") for near in VALUES),
        (f"change of P by {best:g} [%]", *(section.bracketed(change, 0) for change in changes)),
    ]
    line = (
        f"Geometric means of P over {SEARCHED} seeds; the change over {CONFIRMED} fresh ones, 95 %."
    )
    rewrite(tune.PAGE, {"near": table(("`near` [m]", *WORLDS, "all"), rows, line)})
    print(best, changes)


if __name__ == "__main__":
    main()
