from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import ttest_1samp

from swarm_logistics_env import spi
from swarm_logistics_env.spi.bootstrap import (
    RESAMPLES,
    critical_value,
    resampled_pivots,
    upper_p,
)
from swarm_logistics_env.spi.ratio import paired_ratio

rng = np.random.default_rng(2)
P_O = rng.poisson(39, 12).astype(float)
P_F = np.round(P_O * 0.9 + rng.normal(0, 2, 12))
RESIDUAL = P_F - P_F.mean() / P_O.mean() * P_O


def test_equal_data_give_equal_pivots_whatever_the_global_state() -> None:
    np.random.seed(0)  # noqa: NPY002 - the global state must not matter
    first = resampled_pivots(RESIDUAL)
    np.random.seed(1)  # noqa: NPY002
    assert (resampled_pivots(RESIDUAL) == first).all()


def test_pivots_are_students_statistic_of_resampled_seeds() -> None:
    pivots = resampled_pivots(RESIDUAL)
    assert pivots.shape == (RESAMPLES,)
    assert (np.diff(pivots) >= 0).all()
    again = RESIDUAL[np.random.default_rng(0).integers(12, size=(20_000, 12))]
    by_hand = np.sqrt(12) * again.mean(axis=1) / again.std(axis=1, ddof=1)
    for share in (0.025, 0.25, 0.5, 0.75, 0.975):
        assert np.quantile(pivots, share) == pytest.approx(np.quantile(by_hand, share), abs=0.12)


@pytest.mark.parametrize("alpha", [0.05, 0.0005, 0.3])
def test_the_critical_value_is_the_largest_statistic_that_is_kept(alpha: float) -> None:
    pivots = resampled_pivots(RESIDUAL)
    critical = critical_value(pivots, alpha)
    assert upper_p(pivots, critical) >= alpha / 2
    assert upper_p(pivots, np.nextafter(critical, np.inf)) < alpha / 2


def test_an_alpha_beyond_its_resamples_rejects_nothing() -> None:
    assert critical_value(resampled_pivots(RESIDUAL), 1e-6) == math.inf


def test_resamples_without_spread_are_not_left_out() -> None:
    # All but one seed alike: a third of the resamples are flat, beyond any finite quantile.
    pivots = resampled_pivots(np.array([-1.0] * 11 + [11.0]))
    assert 0.3 < np.isneginf(pivots).mean() < 0.4


def test_from_ten_seeds_on_the_larger_p_counts() -> None:
    p_o = np.array([39.0, 41, 38, 40, 42, 37, 40, 39, 41, 38, 40, 39])
    lucky = np.array([2.0, 1, 0, 3, 1, 0, 2, 1, 0, 1, 30, 35])
    r = spi.robustness(p_o, lucky, n=25, m=2, threshold=-0.6)
    difference = lucky - p_o * (1 - 0.6 - 0.08)
    assert r.p_value is not None
    assert r.p_value > 1.1 * ttest_1samp(difference, 0.0).pvalue
    assert "assumes_normal" not in r.flags
    nine = spi.robustness(p_o[:9], lucky[:9], n=25, m=2, threshold=-0.6)
    assert nine.p_value == pytest.approx(ttest_1samp(difference[:9], 0.0).pvalue)
    assert "assumes_normal" in nine.flags


def test_the_two_sides_mirror_each_other() -> None:
    skewed = P_O * 0.9 - 4.0 + np.geomspace(0.1, 12.0, 12) - P_O
    one, other = (paired_ratio(side * skewed, P_O, threshold=side * -0.05) for side in (1, -1))
    assert one.p_value == other.p_value
    assert float(one.low) == pytest.approx(-float(other.high))
    assert float(one.high) == pytest.approx(-float(other.low))
