"""How often the default interval holds the truth, over 10,000 simulated studies a cell."""

from __future__ import annotations

import sys
from collections.abc import Callable

import numpy as np
import pytest

from swarm_logistics_env.spi.bootstrap import studentised_bootstrap
from swarm_logistics_env.spi.ratio import paired_ratio
from swarm_logistics_env.spi.unpaired import Term, unpaired_ratio

STUDIES = 10_000
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


def stopped_at_random(rng: np.random.Generator, shape: tuple[int, int]) -> Samples:
    """As FM4 has it: the sequence is deadlocked for good at a nearly geometric count of mean 10."""
    return rng.binomial(60, P_O / 60, shape).astype(float), rng.geometric(1 / 11, shape) - 1.0


def coverage(draw: Draw, n: int, truth: float) -> tuple[float, float]:
    """Share of intervals that hold the truth, and of verdicts that err at a true R = threshold."""
    p_o, p_f = draw(np.random.default_rng(n), (STUDIES, n))
    test = paired_ratio(p_f - p_o, p_o, offset=M_OVER_N, threshold=truth)
    covered = (test.low <= truth) & (truth <= test.high)
    return float(covered.mean()), float((test.p_value < 0.05).mean())


@pytest.mark.parametrize("n", [5, 10, 20])
@pytest.mark.parametrize("draw", [binomial, overdispersed])
def test_the_default_interval_covers_95_percent(draw: Draw, n: int) -> None:
    covered, errors = coverage(draw, n, TRUE_R)
    assert 0.94 <= covered <= 0.96
    assert errors == pytest.approx(1 - covered)


@pytest.mark.parametrize("n", [5, 10, 20])
def test_counts_like_fm4s_are_covered_less_and_measured(
    n: int, capsys: pytest.CaptureFixture[str]
) -> None:
    covered, _ = coverage(stopped_at_random, n, 10 / P_O - 1 + M_OVER_N)
    with capsys.disabled():
        sys.stdout.write(f"\n  counts like FM4's, n = {n}: 95 % intervals cover {covered:.3f}\n")
    assert 0.86 <= covered < 0.94


def test_the_percentile_bootstrap_is_why_it_is_no_default() -> None:
    n, studies, resamples = 5, 2_000, 400
    rng = np.random.default_rng(0)
    p_o, p_f = overdispersed(rng, (studies, n))
    drawn = rng.integers(n, size=(resamples, studies, n))
    rows = np.arange(studies)[:, np.newaxis]
    ratios = p_f[rows, drawn].mean(axis=2) / p_o[rows, drawn].mean(axis=2) - 1 + M_OVER_N
    low, high = np.quantile(ratios, [0.025, 0.975], axis=0)
    percentile = float(((low <= TRUE_R) & (high >= TRUE_R)).mean())
    assert 0.78 < percentile < 0.88


def test_the_studentised_bootstrap_covers_from_ten_seeds_on() -> None:
    studies, rng = 1_000, np.random.default_rng(4)
    p_o, p_f = overdispersed(rng, (studies, 10))
    covered = 0
    for o, f in zip(p_o, p_f, strict=True):
        low, high = studentised_bootstrap(f - o, o, rng, offset=M_OVER_N, resamples=599)
        covered += low <= TRUE_R <= high
    assert 0.93 <= covered / studies <= 0.975


def test_the_unpaired_interval_covers_independent_samples_of_unequal_size() -> None:
    studies, rng = 1_000, np.random.default_rng(6)
    covered = 0
    for _ in range(studies):
        p_o = rng.negative_binomial(12, 12 / (12 + P_O), 6).astype(float)
        p_f = rng.negative_binomial(40, 40 / (40 + P_F), 9).astype(float)
        test = unpaired_ratio([Term(p_f, 1, 0), Term(p_o, -1, 1)], offset=M_OVER_N)
        covered += bool(test.low <= TRUE_R <= test.high)
    assert 0.93 <= covered / studies <= 0.97
