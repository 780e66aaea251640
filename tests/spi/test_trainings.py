"""Intervals over trainings and seeds, judged by worlds in which the truth is known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from swarm_logistics_env import spi
from verification.verdict_errors import over_trainings


def study(
    rng: np.random.Generator, k: int, s: int, spread: float, ratio: float = 0.8
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """P_o and P_F of k trainings over s seeds: Poisson counts around means that both change."""

    def factor(shape: tuple[int, int], sd: float) -> NDArray[np.float64]:
        return np.exp(sd * rng.standard_normal(shape) - sd**2 / 2)

    p_o = 40 * factor((k, 1), spread) * factor((1, s), 0.2)
    return rng.poisson(p_o), rng.poisson(ratio * p_o * factor((k, 1), spread))


@pytest.mark.parametrize("world", ["sd .1, R sd .1", "sd .3, R sd .05", "sd .1, geometric"])
@pytest.mark.parametrize("k", [5, 10])
def test_an_interval_holds_the_truth_in_93_of_100_studies(world: str, k: int) -> None:
    # Two standard errors of 500 studies are .02.
    assert over_trainings(world, k, 10, studies=500).coverage >= 0.93 - 0.02


def test_trainings_or_seeds_that_do_not_differ_leave_the_interval_of_the_others() -> None:
    p_of_training = np.random.default_rng(5).poisson(40, 12).astype(float)
    for p in (np.tile(p_of_training, (6, 1)), np.tile(p_of_training[:, None], (1, 6))):
        assert spi.mean_interval(p) == pytest.approx(spi.mean_interval(p_of_training))


@pytest.mark.daily
@given(st.integers(0, 10_000), st.booleans(), st.floats(-0.4, 0.4))
def test_interval_and_verdict_agree_at_any_threshold(
    seed: int, paired: bool, threshold: float
) -> None:
    p_o, p_f = study(np.random.default_rng(seed), 5, 8, 0.1)
    estimate = spi.robustness(p_o, p_f, n=25, m=3, paired=paired, threshold=threshold)
    assert estimate.low is not None
    assert estimate.high is not None
    inside = estimate.low <= threshold <= estimate.high
    assert inside == (estimate.verdict == "open" and "hidden_collapses" not in estimate.flags)


def test_unpaired_seeds_are_of_the_same_trainings() -> None:
    # P of a training is high in both conditions or in none: that is no spread of their ratio.
    rng = np.random.default_rng(0)
    skill = rng.uniform(10, 90, (8, 1))
    p_n, p_nm = (np.round(skill * by + rng.normal(0, 1, (8, 12))) for by in (1.0, 1.5))
    estimate = spi.scalability(p_n, p_nm, n=10, m=10, paired=False)
    assert [estimate.low, estimate.high] == pytest.approx([0.5, 0.5], abs=0.05)


def test_a_script_is_the_same_beside_every_training() -> None:
    p_o = np.random.default_rng(1).poisson(40, 12)
    p_new, _ = study(np.random.default_rng(0), 5, 12, 0.2)
    change = spi.relative_change(p_o, p_new)
    assert change.n_trainings == 5
    assert change == spi.relative_change(np.tile(p_o, (5, 1)), p_new)


def test_three_trainings_are_too_few_for_a_verdict_and_none_plans_seeds() -> None:
    estimate = spi.robustness(*study(np.random.default_rng(0), 3, 20, 0.0, ratio=0.2), n=25, m=3)
    assert estimate.verdict == "open"
    assert "few_trainings" in estimate.flags
    assert estimate.low is not None
    assert "3 trainings x 20 paired seeds" in str(estimate)
    assert spi.seeds_for_power(estimate, 0.1) is None
    assert spi.minimum_detectable_effect(estimate) is None
    assert "more trainings" in str(spi.no_plan_because(estimate, 0.1))


@pytest.mark.parametrize(
    ("p_o", "p_f", "paired", "reason"),
    [
        (np.ones((5, 4)), np.ones((4, 4)), True, "p_f has 4 x 4, p_o has 5 x 4"),
        (np.ones((1, 4)), np.ones((1, 4)), True, "two trainings or more"),
        (np.ones((5, 4)) * np.nan, np.ones((5, 4)), True, r"p_o\[0, 0\] = nan"),
        (np.ones((5, 4)), np.ones((6, 4)), False, "same trainings"),
    ],
)
def test_what_cannot_be_compared_is_named(
    p_o: NDArray[np.float64], p_f: NDArray[np.float64], paired: bool, reason: str
) -> None:
    with pytest.raises(spi.IndicatorError, match=reason):
        spi.robustness(p_o, p_f, n=25, m=3, paired=paired)
