from __future__ import annotations

import math

import numpy as np
import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.spi import IndicatorError

rng = np.random.default_rng(2)
P_O = rng.poisson(39, 12).astype(float)
P_F = np.round(P_O * 0.9 + rng.normal(0, 2, 12))


def interval(seed: int) -> tuple[float, float]:
    return spi.studentised_bootstrap(P_F - P_O, P_O, np.random.default_rng(seed), offset=0.08)


def test_its_generator_is_its_only_randomness() -> None:
    np.random.seed(0)  # noqa: NPY002 - the global state must not matter
    first = interval(1)
    np.random.seed(1)  # noqa: NPY002
    assert interval(1) == first
    assert interval(2) != first


def test_a_generator_is_used_up_not_restarted() -> None:
    generator = np.random.default_rng(1)
    first = spi.studentised_bootstrap(P_F - P_O, P_O, generator)
    assert spi.studentised_bootstrap(P_F - P_O, P_O, generator) != first


def test_it_checks_the_default_interval() -> None:
    r = spi.robustness(P_O, P_F, n=25, m=2, bootstrap=np.random.default_rng(1))
    assert (r.bootstrap_low, r.bootstrap_high) == interval(1)
    assert r.bootstrap_low == pytest.approx(r.low, abs=0.02)
    assert r.bootstrap_high == pytest.approx(r.high, abs=0.02)


def test_with_equal_denominators_by_hand() -> None:
    low, high = spi.studentised_bootstrap(P_F, np.ones(12), np.random.default_rng(3), resamples=999)
    pivots = []
    for drawn in np.random.default_rng(3).integers(12, size=(999, 12)):
        again = P_F[drawn]
        error = math.sqrt(((again - again.mean()) ** 2).sum() / 11 / 12)
        pivots.append((again.mean() - P_F.mean()) / error)
    pivots.sort()
    error = math.sqrt(((P_F - P_F.mean()) ** 2).sum() / 11 / 12)
    # The 25th and the 975th of 999: the 2.5 % and 97.5 % quantiles.
    assert low == pytest.approx(P_F.mean() - pivots[974] * error, rel=1e-9)
    assert high == pytest.approx(P_F.mean() - pivots[24] * error, rel=1e-9)


def test_normal_pivots_give_students_interval() -> None:
    sample = rng.normal(0, 1, 400) + 10
    low, high = spi.studentised_bootstrap(sample, np.ones(400), np.random.default_rng(0))
    expected = spi.mean_interval(sample)
    assert low == pytest.approx(expected.low, abs=0.02)
    assert high == pytest.approx(expected.high, abs=0.02)


def test_skewness_shifts_it_where_fieller_stays_symmetric() -> None:
    sample = np.random.default_rng(8).exponential(10, 30)
    low, high = spi.studentised_bootstrap(sample, np.ones(30), np.random.default_rng(0))
    assert high - sample.mean() > 1.2 * (sample.mean() - low)


def test_ten_seeds_are_the_least() -> None:
    with pytest.raises(IndicatorError, match="9 seeds"):
        spi.studentised_bootstrap(P_F[:9], P_O[:9], np.random.default_rng(0))
    few = spi.robustness(P_O[:9], P_F[:9], n=25, m=2, bootstrap=np.random.default_rng(0))
    assert (few.bootstrap_low, few.bootstrap_high) == (None, None)
    ten = spi.robustness(P_O[:10], P_F[:10], n=25, m=2, bootstrap=np.random.default_rng(0))
    assert ten.bootstrap_low is not None


def test_unpaired_seeds_cannot_be_resampled_in_pairs() -> None:
    with pytest.raises(IndicatorError, match="bootstrap with paired=False"):
        spi.robustness(P_O, P_F, n=25, m=2, paired=False, bootstrap=np.random.default_rng(0))


def test_level_out_of_range() -> None:
    with pytest.raises(IndicatorError, match="level"):
        spi.studentised_bootstrap(P_F, P_O, np.random.default_rng(0), level=1.0)


def test_no_spread_is_the_point() -> None:
    low, high = spi.studentised_bootstrap(P_O / 2, P_O, np.random.default_rng(0), offset=1.0)
    assert low == high == pytest.approx(1.5)


def test_an_unclear_denominator_bounds_nothing() -> None:
    scattered = np.array([0.0] * 11 + [50.0])
    limits = spi.studentised_bootstrap(P_F, scattered, np.random.default_rng(0))
    assert limits == (-math.inf, math.inf)


def test_resamples_without_spread_are_not_left_out() -> None:
    # All but one seed alike: a third of the resamples are flat, beyond any finite quantile.
    num = np.array([1.0] * 11 + [30.0])
    limits = spi.studentised_bootstrap(num, np.full(12, 40.0), np.random.default_rng(0))
    assert limits == (-math.inf, math.inf)
