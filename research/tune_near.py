"""Is a stock better that is the less deep, the longer robots brake? `python -m research.tune_near`.

It writes docs/results/tune/near.csv and its table in docs/research/tuning.md; ten minutes of a
core.

The third search of `research.tune` found a set that one world of twelve loses by, so it was not
shipped. Its gain in `dots` and in the paper's world was that of `near` alone, which acts only where
lifting takes no time: elsewhere `density` says how deep the stock is. Two searches of `near`
followed. The first found the best depth at 0.55 to 0.6 m in `dots`, at 0.45 m in the paper's world
and at 0.4 m in `dotbots`; over these three a depth of 0.3 m and the braking distance (0.25, 0.1
and 0.02 m) gained 10 % [6, 13]. But it lost 18 % with five requests at a time, 17 % with items
that are asked for often, and 15 % in a hall of 20 m, worlds that no search had met, so it was not
shipped either. In the paper's world the depth matters little, in `dots` much.

Declared before its first run: `near` less half of the braking distance, which is 0.56 m in `dots`,
0.64 m in the paper's world and 0.68 m in `dotbots`, is shipped if the mean of ln(P / P of the depth
before) over the presets has a 95 % interval above 0 on `SEEDS`, which are fresh, and that of no
world has one below 0, those of docs/results.md in which the other one lost among them.

It gained 12 % [10, 15] over the presets and lost 4 % [3, 5] with five requests at a time. So it is
taken where one item is asked for at a time, and where several are the depth stays: that world has
no change since then, and the others the same runs as in that test.
Later the script's lengths began to go with the radius of its robots, which makes other runs of
`dotbots` alone.
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
from swarm_logistics_env import Scenario
from swarm_logistics_env.spi import Interval
from swarm_logistics_env.spi.summaries import t_interval
from swarm_logistics_env.study.report import section
from swarm_logistics_env.study.runs.engines import usable_cores

SEEDS = range(5_570_000, 5_570_100)
PRESETS = {name: tune.WORLDS[name] for name in ("dots", "dotbots", "paper")}
WORLDS = {
    **PRESETS,
    "five requests at a time": PRESETS["paper"].replace(n_requests=5),
    "a few items asked for often": PRESETS["paper"].replace(demand="zipf"),
    "20 x 20 m": PRESETS["paper"].replace(warehouse_width=20.0, warehouse_height=20.0),
}


def log_p(near_in: Mapping[str, float], processes: Executor) -> NDArray[np.float64]:
    """Return ln(P) in each world at each seed, P of a run at least 1, shape (worlds, seeds)."""
    p = [
        [*processes.map(partial(delivered, "homing-stock", {"near": near}, WORLDS[name]), SEEDS)]
        for name, near in near_in.items()
    ]
    return np.log(np.maximum(p, 1))


def _is_taken(scenario: Scenario) -> bool:
    return scenario.n_requests == 1


def main() -> None:
    """Play both depths, and write the table."""
    near = tune.shipped("homing-stock")["near"]
    # The parameter that makes the stock as deep as before, whatever is taken from it.
    before = {
        name: near + 0.25 * scenario.max_speed**2 / scenario.max_acceleration * _is_taken(scenario)
        for name, scenario in WORLDS.items()
    }
    with ProcessPoolExecutor(usable_cores()) as processes:
        p_before = log_p(before, processes)
        p_after = log_p(dict.fromkeys(WORLDS, near), processes)
    gains = p_after - p_before
    intervals = dict(zip(WORLDS, map(t_interval, gains)))
    intervals["the three presets"] = t_interval(gains[: len(PRESETS)].mean(axis=0))
    write_rows(
        tune.RESULTS / "near.csv",
        ("world", *tune.ENDS),
        [(world, *interval) for world, interval in intervals.items()],
    )
    changes = [
        (world, section.bracketed(Interval(*(100.0 * math.expm1(end or 0.0) for end in ends)), 0))
        for world, ends in intervals.items()
    ]
    line = f"{len(SEEDS)} fresh seeds; of the geometric mean of P, 95 %."
    rewrite(tune.PAGE, {"near": table(("world", "change of P [%]"), changes, line)})
    print(changes)


if __name__ == "__main__":
    main()
