"""How often two phases are named, and how often a critical size is covered.

`python -m verification.phase_errors` draws sets of runs of one phase, and studies over swarm sizes
of which a planted share collapses. It prints the tables and writes them to
`docs/results/phase_errors.csv`.
"""

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from swarm_logistics_env import spi

SETS, STUDIES = 4_000, 1_000
SIZES = (10, 14, 20, 28, 40, 56, 80, 113, 160)
LEFT = 0.35  # of P, by a run that collapsed
FILE = Path(__file__).parents[1] / "docs" / "results" / "phase_errors.csv"

Draw = Callable[[np.random.Generator, tuple[int, int]], NDArray[Any]]

ONE_PHASE: Mapping[str, Draw] = {
    "Poisson, P 2": lambda rng, shape: rng.poisson(2, shape),
    "Poisson, P 40": lambda rng, shape: rng.poisson(40, shape),
    "overdispersed": lambda rng, shape: rng.negative_binomial(3, 3 / 43, shape),
    "widely overdispersed": lambda rng, shape: rng.negative_binomial(1, 1 / 101, shape),
    "capped at the mean": lambda rng, shape: np.minimum(rng.poisson(60, shape), 60),
    "mostly capped": lambda rng, shape: np.minimum(rng.poisson(70, shape), 60),
    "capped, overdispersed": lambda rng, shape: np.minimum(
        rng.negative_binomial(10, 10 / 80, shape), 60
    ),
    "uniform": lambda rng, shape: rng.uniform(0, 9, shape),
}


def share_named(draw: Draw, n: int, sets: int = SETS) -> float:
    """Return the share of sets of n runs that are taken for two phases."""
    runs = draw(np.random.default_rng(n), (sets, n))
    return sum(spi.two_phases(sample).boundary is not None for sample in runs) / sets


def study(rng: np.random.Generator, centre: float, slope: float, n: int) -> dict[int, NDArray[Any]]:
    """Return n runs of each size, of which a logistic share in log N collapses."""
    runs = {}
    for size in SIZES:
        share = 1.0 / (1.0 + (centre / size) ** slope)
        good = 6.0 * size**0.8
        runs[size] = rng.poisson(np.where(rng.random(n) < share, LEFT * good, good)) * 1.0
    return runs


def coverage(n: int, slope: float, studies: int = STUDIES) -> tuple[float, float]:
    """Return the share of studies that give a critical size, and of these that cover it."""
    rng = np.random.default_rng(n)
    n_covered, n_with_size = 0, 0
    for _ in range(studies):
        centre = float(np.exp(rng.uniform(math.log(25.0), math.log(80.0))))
        counts = spi.collapsed_runs(study(rng, centre, slope, n))
        if counts is not None:
            size = spi.critical_size(SIZES, [*counts.values()], [n] * len(SIZES))
            assert size.low is not None
            assert size.high is not None
            n_with_size += 1
            n_covered += size.low <= centre <= size.high
    return n_with_size / studies, n_covered / max(n_with_size, 1)


def main() -> None:
    """Simulate, print and write the tables."""
    named = [
        {"table": "one phase", "runs": kind, "n": n, "named": share_named(draw, n)}
        for kind, draw in ONE_PHASE.items()
        for n in (12, 20, 30, 60, 128)
    ]
    print(pd.DataFrame(named).pivot_table(index="runs", columns="n", values="named").to_string())
    planted = []
    for n, slope in ((30, 8.0), (60, 8.0), (128, 20.0)):
        named_share, covered = coverage(n, slope)
        row = {"table": "critical size", "n": n, "slope": slope}
        planted.append({**row, "named": named_share, "covered": covered})
    print(pd.DataFrame(planted).to_string(index=False))
    pd.DataFrame([*named, *planted]).to_csv(FILE, index=False, float_format="%.4g")


if __name__ == "__main__":
    main()
