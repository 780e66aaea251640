"""How often intervals hold the truth and verdicts are wrong, over simulated studies."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from swarm_logistics_env.spi.ratio import Term, paired_ratio, unpaired_ratio

STUDIES = 10_000
CHUNK = 500  # studies whose resamples fit into memory at once
M_OVER_N = 2 / 25
P_O, P_F = 39.0, 34.0  # true means, items
TRUE_R = P_F / P_O - 1 + M_OVER_N

Samples = tuple[np.ndarray, np.ndarray]
Draw = Callable[[np.random.Generator, tuple[int, int]], Samples]


def binomial(rng: np.random.Generator, shape: tuple[int, int]) -> Samples:
    """60 items, each delivered or not; the layout of a seed helps or hinders both conditions."""
    ease = rng.normal(0.0, 0.05, shape)
    return tuple(  # type: ignore[return-value]
        rng.binomial(60, np.clip(mean / 60 + ease, 0, 1)).astype(float) for mean in (P_O, P_F)
    )


def overdispersed(rng: np.random.Generator, shape: tuple[int, int]) -> Samples:
    """Poisson around a rate that a seed shares, gamma distributed: variance 3 times the mean."""
    rate = rng.gamma(20.0, 1 / 20.0, shape)
    return rng.poisson(P_O * rate).astype(float), rng.poisson(P_F * rate).astype(float)


def poisson(rng: np.random.Generator, shape: tuple[int, int]) -> Samples:
    return rng.poisson(P_O, shape).astype(float), rng.poisson(P_F, shape).astype(float)


def stopped_at_random(rng: np.random.Generator, shape: tuple[int, int]) -> Samples:
    """As FM4 has it: the sequence is deadlocked for good at a nearly geometric count of mean 10."""
    return rng.binomial(60, P_O / 60, shape).astype(float), rng.geometric(1 / 11, shape) - 1.0


def simulated(draw: Draw, n: int, truth: float, studies: int) -> tuple[float, float, float]:
    """Share of intervals that hold the truth, and of wrong verdicts above and below it."""
    p_o, p_f = draw(np.random.default_rng(n), (studies, n))
    covered, above, below = 0, 0, 0
    for start in range(0, studies, CHUNK):
        old, new = p_o[start : start + CHUNK], p_f[start : start + CHUNK]
        test = paired_ratio(new - old, old, offset=M_OVER_N, threshold=truth)
        covered += int(((test.low <= truth) & (truth <= test.high)).sum())
        wrong = test.p_value < 0.05
        above += int((wrong & (test.probability > 0.5)).sum())
        below += int((wrong & (test.probability < 0.5)).sum())
    return covered / studies, above / studies, below / studies


@pytest.mark.parametrize("draw", [binomial, overdispersed])
def test_below_ten_seeds_the_interval_of_normal_differences_covers_95_percent(draw: Draw) -> None:
    covered, above, below = simulated(draw, 5, TRUE_R, STUDIES)
    assert 0.94 <= covered <= 0.96
    assert above + below == pytest.approx(1 - covered)


@pytest.mark.parametrize("n", [10, 20])
@pytest.mark.parametrize("draw", [binomial, overdispersed])
def test_from_ten_seeds_on_the_interval_covers_at_least_95_percent(draw: Draw, n: int) -> None:
    covered, above, below = simulated(draw, n, TRUE_R, 1_500)
    assert 0.945 <= covered <= 0.975
    # A statistic may equal a pivot up to rounding.
    assert above + below == pytest.approx(1 - covered, abs=1e-3)


@pytest.mark.parametrize(("n", "most"), [(10, 0.06), (20, 0.05), (30, 0.045)])
@pytest.mark.parametrize(
    ("draw", "truth"),
    [(poisson, TRUE_R), (overdispersed, TRUE_R), (stopped_at_random, 10 / P_O - 1 + M_OVER_N)],
)
def test_wrong_verdicts_are_bounded_on_either_side(
    draw: Draw, truth: float, n: int, most: float
) -> None:
    _, above, below = simulated(draw, n, truth, 1_500)
    assert max(above, below) <= most


def test_the_unpaired_interval_covers_independent_samples_of_unequal_size() -> None:
    studies, rng = 1_000, np.random.default_rng(6)
    covered = 0
    for _ in range(studies):
        p_o = rng.negative_binomial(12, 12 / (12 + P_O), 6).astype(float)
        p_f = rng.negative_binomial(40, 40 / (40 + P_F), 9).astype(float)
        test = unpaired_ratio([Term(p_f, 1, 0), Term(p_o, -1, 1)], offset=M_OVER_N)
        covered += bool(test.low <= TRUE_R <= test.high)
    assert 0.93 <= covered / studies <= 0.97
