"""What R in the reward buys: `python -m research.play_indicator_rewards` (40 minutes of a core).

Trains ten robots in the small warehouse, every other episode with two robots whose entering the
delivery area delivers nothing (FM4), by one recipe with several weights of R, and by the same
recipe without. R is relative to running means of the policy that learns. It writes a block of
docs/training.md. What is trained stays in results/indicator_rewards, and the same command goes on
after an interruption.

Declared before the first training: R is bought where the 95 % interval of the difference of R over
trainings (Welch's) to the recipe without it is above 0, and P is paid for it where that of P is
below 0.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from research.tables import ROOT, difference_of_means, rewrite, table
from swarm_logistics_env import Fault, policies, run_episode, spi
from swarm_logistics_env.spi.summaries import interval_of_mean
from swarm_logistics_env.study.report import section
from swarm_logistics_env.study.runs.engines import usable_cores
from swarm_logistics_env.train import Training, load_training
from swarm_logistics_env.train.trainer import train

OUT = ROOT / "results" / "indicator_rewards"
PAGE = ROOT / "docs" / "training.md"
WEIGHTS = (0.0, 10.0, 20.0, 40.0)  # of R; a delivery pays its robot 1
TRAININGS = range(3)
N_BROKEN = 2
FAULT = Fault("FM4", N_BROKEN)
N = 10
SEEDS = range(20_000, 20_040)


class Measured(NamedTuple):
    """What one training is worth: P without and with broken robots [items], and R."""

    p: float
    p_broken: float
    r: float


def training_of(weight: float, seed: int) -> Training:
    """Return the recipe with a weight of R; 0: without indicators."""
    fields: dict[str, Any] = {
        "name": f"r{weight:g}",
        "seed": seed,
        "threads": 1,
        "agent_steps": 1_000_000,
        "conditions": [{}, {"modes": [FAULT.mode], "robots": [N_BROKEN]}],
    }
    if weight:
        fields["indicators"] = {
            "weights": {"R": weight},
            "references": "measured",
            "constant": False,
        }
    return load_training("small", **fields)


def measure(weight: float, seed: int) -> Measured:
    """Return what a training is worth, trained if it was not yet."""
    training = training_of(weight, seed)
    path = train(training, OUT / f"{training.name}-{seed}")
    policy = policies.load(str(path))
    scenario = training.scenario.replace(n_robots=N)
    p, p_broken = (
        [run_episode(scenario, policy, run, faults).delivered for run in SEEDS]
        for faults in ((), (FAULT,))
    )
    r = spi.robustness(p, p_broken, n=N, m=N_BROKEN).value
    return Measured(float(np.mean(p)), float(np.mean(p_broken)), r)


def rows_of(columns: dict[float, NDArray[np.float64]]) -> Iterator[tuple[str, ...]]:
    """Yield a row of each weight; columns are (trainings, 3), as in `Measured`."""
    without = columns[0.0]
    for weight, measured in columns.items():
        means = [interval_of_mean(measured[:, column]) for column in range(3)]
        changes = [
            difference_of_means(measured[:, column], without[:, column]) for column in (0, 2)
        ]
        changed = [section.bracketed(change, digits) for change, digits in zip(changes, (1, 2))]
        yield (
            "without R" if weight == 0.0 else f"R, weight {weight:g}",
            *(section.bracketed(interval, digits) for interval, digits in zip(means, (1, 1, 2))),
            *([section.NOTHING] * 2 if weight == 0.0 else changed),
        )


def main(processes: int) -> None:
    """Train, measure, and write the table."""
    with ProcessPoolExecutor(processes) as pool:
        futures = {
            weight: [pool.submit(partial(measure, weight, seed)) for seed in TRAININGS]
            for weight in WEIGHTS
        }
        columns = {
            weight: np.array([future.result() for future in of_weight])
            for weight, of_weight in futures.items()
        }
    head = ("reward", "P", "P, two in FM4", "R", "change of P", "change of R")
    line = (
        f"{N} robots, {len(TRAININGS)} trainings each, {len(SEEDS)} seeds from {SEEDS[0]:,} on; "
        "95 % intervals over trainings, of changes by Welch's test."
    )
    rewrite(PAGE, {"indicator rewards": table(head, rows_of(columns), line)})


if __name__ == "__main__":
    main(int(sys.argv[1]) if sys.argv[1:] else usable_cores())
