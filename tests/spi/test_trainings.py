"""Intervals over trainings and seeds, judged by worlds in which the truth is known."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from swarm_logistics_env import spi

ONE_BY_SEED = np.random.default_rng(5).poisson(40, 12).astype(float)


def drawn(rng: np.random.Generator, kind: str, mean: NDArray[np.float64]) -> NDArray[np.int64]:
    """Counts of a mean, as deliveries scatter."""
    if kind == "poisson":
        return rng.poisson(mean)
    if kind == "overdispersed":
        return rng.poisson(mean * rng.gamma(5, 1 / 5, mean.shape))
    return rng.geometric(1 / (1 + mean)) - 1


def study(
    rng: np.random.Generator, kind: str, k: int, s: int, spread: float, ratio: float = 0.8
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """P_o and P_F of k trainings over s seeds: trainings differ in both, and so do seeds."""

    def factor(shape: tuple[int, int], sd: float) -> NDArray[np.float64]:
        return np.exp(sd * rng.standard_normal(shape) - sd**2 / 2)

    p_o = 40 * factor((k, 1), spread) * factor((1, s), 0.2)
    p_f = ratio * p_o * factor((k, 1), spread) * factor((1, s), 0.2)
    return drawn(rng, kind, p_o), drawn(rng, kind, p_f)


@pytest.mark.parametrize("kind", ["poisson", "overdispersed", "geometric"])
@pytest.mark.parametrize("k", [5, 10])
def test_an_interval_holds_the_truth_in_93_of_100_studies(kind: str, k: int) -> None:
    rng = np.random.default_rng(k)
    studies, held, seen = 500, 0, 0
    for _ in range(studies):
        p_o, p_f = study(rng, kind, k, 10, 0.1)
        found = spi.robustness(p_o, p_f, n=25, m=3, threshold=-0.2 + 3 / 25)
        assert found.p_value is not None
        held += found.p_value >= 0.05
        over_seeds = spi.robustness(p_o[0], p_f[0], n=25, m=3)
        assert over_seeds.low is not None
        assert over_seeds.high is not None
        seen += over_seeds.low <= -0.2 + 3 / 25 <= over_seeds.high
    # Two standard errors of 500 studies are .02.
    assert held / studies >= 0.93 - 0.02
    # What is known of one training alone does not hold for the recipe.
    assert held > seen or kind == "geometric"


def test_trainings_that_do_not_differ_leave_the_interval_of_the_seeds() -> None:
    alone = spi.mean_interval(ONE_BY_SEED)
    assert spi.mean_interval(np.tile(ONE_BY_SEED, (6, 1))) == pytest.approx(alone)


def test_seeds_that_do_not_differ_leave_the_interval_of_the_trainings() -> None:
    alone = spi.mean_interval(ONE_BY_SEED)
    assert spi.mean_interval(np.tile(ONE_BY_SEED[:, None], (1, 6))) == pytest.approx(alone)


@given(st.integers(0, 10_000), st.booleans(), st.floats(-0.4, 0.4))
def test_interval_and_verdict_agree_at_any_threshold(
    seed: int, paired: bool, threshold: float
) -> None:
    p_o, p_f = study(np.random.default_rng(seed), "poisson", 5, 8, 0.1)
    found = spi.robustness(p_o, p_f, n=25, m=3, paired=paired, threshold=threshold)
    assert found.low is not None
    assert found.high is not None
    inside = found.low <= threshold <= found.high
    assert inside == (found.verdict == "inconclusive")


def test_unpaired_seeds_are_of_the_same_trainings() -> None:
    # P of a training is high in both conditions or in none: that is no spread of their ratio.
    rng = np.random.default_rng(0)
    skill = rng.uniform(10, 90, (8, 1))
    p_n, p_nm = (np.round(skill * by + rng.normal(0, 1, (8, 12))) for by in (1.0, 1.5))
    found = spi.scalability(p_n, p_nm, n=10, m=10, paired=False)
    assert found.low == pytest.approx(0.5, abs=0.05)
    assert found.high == pytest.approx(0.5, abs=0.05)


def test_three_trainings_are_too_few_for_a_verdict() -> None:
    p_o, p_f = study(np.random.default_rng(0), "poisson", 3, 20, 0.0, ratio=0.2)
    found = spi.robustness(p_o, p_f, n=25, m=3)
    assert found.verdict == "inconclusive"
    assert "few_trainings" in found.flags
    assert found.low is not None
    assert "3 trainings x 20 paired seeds" in str(found)


def test_no_number_of_seeds_is_planned_over_trainings() -> None:
    p_o, p_f = study(np.random.default_rng(0), "poisson", 5, 20, 0.1)
    found = spi.robustness(p_o, p_f, n=25, m=3)
    assert spi.seeds_for_power(found, 0.1) is None
    assert spi.minimum_detectable_effect(found) is None
    assert "more trainings" in str(spi.no_plan_because(found, 0.1))


@pytest.mark.parametrize(
    ("p_o", "p_f", "told"),
    [
        (np.ones((5, 4)), np.ones((4, 4)), "p_f has 4 x 4, p_o has 5 x 4"),
        (np.ones((5, 4)), np.ones(20), "p_f has 20, p_o has 5 x 4"),
        (np.ones((1, 4)), np.ones((1, 4)), "two trainings or more"),
        (np.ones((5, 4)) * np.nan, np.ones((5, 4)), r"p_o\[0, 0\] = nan"),
    ],
)
def test_what_cannot_be_compared_is_named(
    p_o: NDArray[np.float64], p_f: NDArray[np.float64], told: str
) -> None:
    with pytest.raises(spi.IndicatorError, match=told):
        spi.robustness(p_o, p_f, n=25, m=3)


def test_unpaired_conditions_need_the_same_trainings() -> None:
    with pytest.raises(spi.IndicatorError, match="same trainings"):
        spi.robustness(np.ones((5, 4)), np.ones((6, 4)), n=25, m=3, paired=False)
