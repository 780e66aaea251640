"""How often two phases are named, and how often a critical size is covered.

`python -m verification.phase_errors` draws sets of runs of one phase and of two, and studies over
swarm sizes of which a planted share collapses. The constants of `spi/phases.py` were chosen on the
generators in `CHOSEN` and `STUDIES_CHOSEN`. Those in `HELD_OUT` and `STUDIES_HELD_OUT` chose
nothing, and the docs quote them. It prints the tables and writes them to
`docs/results/phase_errors.csv`.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from swarm_logistics_env import spi

SETS, STUDIES = 400, 30
N_RUNS = (12, 20, 30, 60, 128, 200)
SIZES = (10, 14, 20, 28, 40, 56, 80, 113, 160)
FILE = Path(__file__).parents[1] / "docs" / "results" / "phase_errors.csv"

Rng = np.random.Generator
Floats = NDArray[Any]
Draw = Callable[[Rng, tuple[int, int]], Floats]


def _poisson(mean: float, box: int = 1) -> Draw:
    return lambda rng, shape: box * rng.poisson(mean, shape)


def _binomial(most: int, share: float) -> Draw:
    return lambda rng, shape: rng.binomial(most, share, shape)


def _overdispersed(size: float, mean: float) -> Draw:
    return lambda rng, shape: rng.negative_binomial(size, size / (size + mean), shape)


def _capped(draw: Draw, cap: float) -> Draw:
    return lambda rng, shape: np.minimum(draw(rng, shape), cap)


def _below(top: float, draw: Draw) -> Draw:
    """Return runs that lie below a top by what is drawn: skewed to the left."""
    return lambda rng, shape: np.maximum(top - draw(rng, shape), 0.0)


def _mixed(share: float, low: Draw, good: Draw) -> Draw:
    return lambda rng, shape: np.where(rng.random(shape) < share, low(rng, shape), good(rng, shape))


def _maps(n_maps: int, spread: float, scatter: float) -> Draw:
    """Return runs on few maps, whose means around 100 scatter, one after the other."""

    def draw(rng: Rng, shape: tuple[int, int]) -> Floats:
        means = rng.normal(100.0, spread, (shape[0], n_maps))
        of_runs = means[:, np.arange(shape[1]) % n_maps]
        return of_runs + rng.normal(0.0, scatter, shape)

    return draw


def _rounded(draw: Draw, step: float) -> Draw:
    return lambda rng, shape: np.round(draw(rng, shape) / step) * step


def _normal(mean: float, deviation: float) -> Draw:
    return lambda rng, shape: np.maximum(rng.normal(mean, deviation, shape), 0.0)


def _with_ties(rng: Rng, shape: tuple[int, int]) -> Floats:
    """Return continuous P drawn again with replacement, as of runs that were copied."""
    return np.take_along_axis(
        rng.normal(100.0, 15.0, shape), rng.integers(0, shape[1], shape), axis=1
    )


def _nothing(rng: Rng, shape: tuple[int, int]) -> Floats:
    return np.zeros(shape)


def _flat(rng: Rng, shape: tuple[int, int]) -> Floats:
    return rng.uniform(0.0, 100.0, shape)


CHOSEN: Mapping[str, Draw] = {
    **{f"Poisson {mean:g}": _poisson(mean) for mean in (0.1, 0.2, 0.4, 0.7, 1, 2, 5, 10, 30)},
    "Poisson 1 in tens": _poisson(1.0, box=10),
    "Binomial(10, .9)": _binomial(10, 0.9),
    "Binomial(10, .7)": _binomial(10, 0.7),
    "Binomial(5, .5)": _binomial(5, 0.5),
    "Binomial(20, .95)": _binomial(20, 0.95),
    "60 % zero, else Poisson 2": _mixed(0.6, _nothing, _poisson(2.0)),
    "50 % zero, else Poisson 3": _mixed(0.5, _nothing, _poisson(3.0)),
    "80 % zero, else Poisson 2": _mixed(0.8, _nothing, _poisson(2.0)),
    "mean 2, most zero": _overdispersed(0.3, 2.0),
    "overdispersed, mean 100": _overdispersed(1.0, 100.0),
    "30 % zero, else flat": _mixed(0.3, _nothing, _flat),
    "50 % zero, else flat": _mixed(0.5, _nothing, _flat),
    "70 % zero, else flat": _mixed(0.7, _nothing, _flat),
    "6 maps, spread 10, scatter 1": _maps(6, 10.0, 1.0),
    "4 maps, spread 10, scatter 2": _maps(4, 10.0, 2.0),
    "100 - lognormal(.8)": _below(100.0, lambda rng, shape: rng.lognormal(0.0, 0.8, shape)),
    "100 - 10 lognormal(.8)": _below(100.0, lambda rng, shape: rng.lognormal(2.3, 0.8, shape)),
    "100 - Exp(15)": _below(100.0, lambda rng, shape: rng.exponential(15.0, shape)),
    "normal": _normal(100.0, 15.0),
    "Laplace": lambda rng, shape: np.maximum(rng.laplace(100.0, 8.0, shape), 0.0),
    "t with 3": lambda rng, shape: np.maximum(100.0 + 8.0 * rng.standard_t(3, shape), 0.0),
    "lognormal(.8)": lambda rng, shape: rng.lognormal(3.0, 0.8, shape),
    "geometric .1": lambda rng, shape: rng.geometric(0.1, shape),
    "normal in fives": _rounded(_normal(100.0, 15.0), 5.0),
    "shares beta(8, 2)": lambda rng, shape: rng.beta(8.0, 2.0, shape),
    "shares beta(5, .5)": lambda rng, shape: rng.beta(5.0, 0.5, shape),
    "continuous with ties": _with_ties,
    "uniform": _flat,
    "capped at the mean": _capped(_poisson(60.0), 60.0),
    "mostly capped": _capped(_poisson(70.0), 60.0),
}
HELD_OUT: Mapping[str, Draw] = {
    **{f"Poisson {mean:g}": _poisson(mean) for mean in (0.15, 0.3, 0.55, 0.9, 1.3, 3, 7, 20)},
    "Poisson 0.8 in sixes": _poisson(0.8, box=6),
    "Binomial(8, .85)": _binomial(8, 0.85),
    "Binomial(12, .95)": _binomial(12, 0.95),
    "Binomial(4, .6)": _binomial(4, 0.6),
    "Binomial(30, .9)": _binomial(30, 0.9),
    "70 % zero, else Poisson 1.5": _mixed(0.7, _nothing, _poisson(1.5)),
    "55 % zero, else Poisson 2.5": _mixed(0.55, _nothing, _poisson(2.5)),
    "mean 3, most zero": _overdispersed(0.25, 3.0),
    "overdispersed, mean 60": _overdispersed(2.0, 60.0),
    "40 % zero, else flat": _mixed(0.4, _nothing, _flat),
    "60 % zero, else flat": _mixed(0.6, _nothing, _flat),
    "50 % zero, else 0 to 20": _mixed(0.5, _nothing, lambda rng, shape: rng.integers(0, 21, shape)),
    "5 maps, spread 8, scatter 1": _maps(5, 8.0, 1.0),
    "8 maps, spread 12, scatter 2": _maps(8, 12.0, 2.0),
    "100 - lognormal(.6)": _below(100.0, lambda rng, shape: rng.lognormal(2.7, 0.6, shape)),
    "100 - Weibull(.9)": _below(100.0, lambda rng, shape: 18.0 * rng.weibull(0.9, shape)),
    "100 - gamma(2)": _below(100.0, lambda rng, shape: rng.gamma(2.0, 12.0, shape)),
    "logistic": lambda rng, shape: np.maximum(rng.logistic(100.0, 9.0, shape), 0.0),
    "t with 4": lambda rng, shape: np.maximum(100.0 + 10.0 * rng.standard_t(4, shape), 0.0),
    "gamma(2)": lambda rng, shape: rng.gamma(2.0, 20.0, shape),
    "lognormal(.5)": lambda rng, shape: rng.lognormal(3.0, 0.5, shape),
    "geometric .3": lambda rng, shape: rng.geometric(0.3, shape),
    "normal in threes": _rounded(_normal(60.0, 8.0), 3.0),
    "shares beta(6, 1.5)": lambda rng, shape: rng.beta(6.0, 1.5, shape),
    "shares of 12": lambda rng, shape: rng.binomial(12, rng.beta(4.0, 2.0, shape)) / 12.0,
    "triangular": lambda rng, shape: rng.triangular(0.0, 70.0, 100.0, shape),
    "capped, overdispersed": _capped(_overdispersed(10.0, 70.0), 60.0),
    "mostly capped shares": _capped(_normal(1.1, 0.2), 1.0),
}
TWO_PHASES: Mapping[str, Draw] = {
    "30 % lose 65 %, normal": _mixed(0.3, _normal(35.0, 11.0), _normal(100.0, 11.0)),
    "30 % lose 65 %, Poisson 60": _mixed(0.3, _poisson(21.0), _poisson(60.0)),
    "10 % lose all, normal": _mixed(0.1, _nothing, _normal(100.0, 11.0)),
    "10 % lose all, Poisson 60": _mixed(0.1, _nothing, _poisson(60.0)),
}


class Growth(NamedTuple):
    """How the share of the runs that collapses grows with N, and how the runs scatter.

    Attributes:
        slope: of the logistic function of log N.
        scatter: standard deviation of the good P beside Poisson's, as a share of it.
        floor, ceiling: the share at the smallest and the largest sizes.
        correlation: of collapses within a size, by a beta-binomial share.
        left: of P, by a run that collapsed.
    """

    slope: float
    scatter: float = 0.0
    floor: float = 0.0
    ceiling: float = 1.0
    correlation: float = 0.0
    left: float = 0.35


STUDIES_CHOSEN: Mapping[str, Growth] = {
    "logistic, slope 8": Growth(8.0),
    "slope 4": Growth(4.0),
    "scatter of 18 %": Growth(8.0, scatter=0.18),
    "levels off at 70 %": Growth(8.0, ceiling=0.7),
    "levels off at 85 %": Growth(8.0, ceiling=0.85),
    "lapses of 6 %": Growth(8.0, floor=0.06, ceiling=0.94),
    "correlation .05": Growth(8.0, correlation=0.05),
    "correlation .1": Growth(8.0, correlation=0.1),
}
STUDIES_HELD_OUT: Mapping[str, Growth] = {
    "logistic, slope 12": Growth(12.0, left=0.3),
    "slope 5": Growth(5.0),
    "slope 4, scatter of 12 %": Growth(4.0, scatter=0.12),
    "scatter of 15 %": Growth(8.0, scatter=0.15, left=0.25),
    "levels off at 60 %": Growth(6.0, ceiling=0.6),
    "levels off at 80 %": Growth(10.0, ceiling=0.8),
    "lapses of 4 %, slope 5": Growth(5.0, floor=0.04, ceiling=0.96),
    "correlation .08, slope 6": Growth(6.0, correlation=0.08),
}


def share_named(draw: Draw, n: int, sets: int = SETS) -> float:
    """Return the share of sets of n runs that are taken for two phases."""
    runs = draw(np.random.default_rng(n), (sets, n))
    return sum(spi.two_phases(sample).boundary is not None for sample in runs) / sets


def study(rng: Rng, centre: float, growth: Growth, n: int) -> dict[int, Floats]:
    """Return n runs of each size, of which a share collapses that grows with log N."""
    runs = {}
    for size in SIZES:
        rise = growth.ceiling - growth.floor
        share = growth.floor + rise / (1.0 + (centre / size) ** growth.slope)
        if growth.correlation:
            n_equivalent = 1.0 / growth.correlation - 1.0
            share = rng.beta(share * n_equivalent, (1.0 - share) * n_equivalent)
        good = 6.0 * size**0.8 * np.maximum(rng.normal(1.0, growth.scatter, n), 0.05)
        left = np.where(rng.random(n) < share, growth.left, 1.0)
        runs[size] = rng.poisson(left * good) * 1.0
    return runs


class Coverage(NamedTuple):
    """Shares of studies: a size shows two phases, an interval is given, and is so in vain."""

    named: float
    with_interval: float
    missed: float

    @property
    def covered(self) -> float:
        """The share of the intervals that hold the planted size; NaN: there are none."""
        return 1.0 - self.missed / self.with_interval if self.with_interval else math.nan


def coverage(n: int, growth: Growth, studies: int = STUDIES) -> Coverage:
    """Return how often studies of n runs a size give an interval, and miss the planted size."""
    rng = np.random.default_rng(n)
    n_named = 0
    n_with_interval = 0
    n_missed = 0
    for _ in range(studies):
        centre = float(np.exp(rng.uniform(math.log(25.0), math.log(80.0))))
        counts = spi.collapsed_runs(study(rng, centre, growth, n))
        if counts is None:
            continue
        n_named += 1
        size = spi.critical_size(SIZES, [*counts.values()], [n] * len(SIZES))
        assert size.low is not None
        assert size.high is not None
        if size.low > 0.0 or size.high < math.inf:
            n_with_interval += 1
            n_missed += not size.low <= centre <= size.high
    return Coverage(n_named / studies, n_with_interval / studies, n_missed / studies)


def _rows_of_sets() -> Iterator[dict[str, object]]:
    halves = {"chosen on": CHOSEN, "held out": HELD_OUT, "two phases": TWO_PHASES}
    for half, generators in halves.items():
        for kind, draw in generators.items():
            for n in N_RUNS:
                named = share_named(draw, n)
                yield {"table": half, "runs": kind, "n": n, "named": named}


def _rows_of_studies() -> Iterator[dict[str, object]]:
    halves = {"size, chosen on": STUDIES_CHOSEN, "size, held out": STUDIES_HELD_OUT}
    for half, generators in halves.items():
        for kind, growth in generators.items():
            for n in (30, 60):
                shares = coverage(n, growth)
                row = {"table": half, "runs": kind, "n": n, "covered": shares.covered}
                yield {**row, **shares._asdict()}


def main() -> None:
    """Simulate, print and write the tables."""
    sets = pd.DataFrame(_rows_of_sets())
    for half, of_half in sets.groupby("table", sort=False):
        table = of_half.pivot_table(index="runs", columns="n", values="named", sort=False)
        print(f"Two phases named, {half}:\n{(100.0 * table).round(1).to_string()}")
        print(f"At most {100.0 * of_half['named'].max():.1f} %.\n")
    studies = pd.DataFrame(_rows_of_studies())
    for half, of_half in studies.groupby("table", sort=False):
        print(f"Critical size, {half}:\n{of_half.drop(columns='table').to_string(index=False)}")
        print(f"Covered: at least {100.0 * of_half['covered'].min():.0f} % of the intervals.\n")
    pd.concat([sets, studies]).to_csv(FILE, index=False, float_format="%.4g")


if __name__ == "__main__":
    main()
