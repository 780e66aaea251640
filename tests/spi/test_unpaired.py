from __future__ import annotations

import math

import numpy as np
import pytest

from swarm_logistics_env import spi

P_O = np.array([35.0, 41, 38, 29, 44, 36, 40])
P_F = np.array([33.0, 36, 39, 25, 40])
P_S = np.array([34.0, 39, 35, 28, 43, 33])


@pytest.mark.parametrize("threshold", [-0.3, 0.0, 0.2])
def test_robustness_is_welchs_test(threshold: float) -> None:
    from scipy.stats import ttest_ind

    r = spi.robustness(P_O, P_F, n=25, m=2, threshold=threshold, paired=False)
    reference = ttest_ind(P_F, P_O * (1 + threshold - 2 / 25), equal_var=False)
    assert r.p_value == pytest.approx(reference.pvalue, rel=1e-9)
    assert r.degrees_of_freedom == pytest.approx(reference.df)


def test_fault_tolerance_at_0_compares_faulty_and_removed_only() -> None:
    from scipy.stats import ttest_ind

    ft = spi.fault_tolerance(P_O, P_F, P_S, paired=False)
    assert ft.p_value == pytest.approx(ttest_ind(P_F, P_S, equal_var=False).pvalue, rel=1e-9)
    assert ft.value == pytest.approx((P_F.mean() - P_S.mean()) / P_O.mean())


@pytest.mark.parametrize("indicator", ["S", "R", "A"])
def test_welchs_test_at_the_limits_has_p_05(indicator: str) -> None:
    from scipy.stats import ttest_ind

    if indicator == "S":
        estimate = spi.scalability(P_O, P_F, n=10, m=4, paired=False)
        gain, offset = 10 / 4, 0.0
    elif indicator == "A":
        estimate = spi.adaptability(P_O, P_F, x_o=10, x_new=8, paired=False)
        gain, offset = 5.0, 1.0
    else:
        estimate = spi.robustness(P_O, P_F, n=25, m=2, paired=False)
        gain, offset = 1.0, 2 / 25
    assert estimate.low is not None
    assert estimate.high is not None
    assert estimate.low < estimate.value < estimate.high
    for limit in (estimate.low, estimate.high):
        p = ttest_ind(P_F, P_O * (1 + (limit - offset) / gain), equal_var=False).pvalue
        assert p == pytest.approx(0.05, rel=1e-6)


def test_a_single_run_in_any_sample_gives_the_value_only() -> None:
    r = spi.robustness([39.0], P_F, n=25, m=2, paired=False)
    assert r.flags == ("single_seed",)
    assert r.value == pytest.approx(P_F.mean() / 39 - 1 + 0.08)


def test_unclear_denominator_gives_no_interval_but_a_verdict() -> None:
    r = spi.robustness([0.0, 0.0, 40.0], [100.0, 101.0, 99.0], n=25, m=1, paired=False)
    assert (r.low, r.high) == (-math.inf, math.inf)
    assert r.flags == ("assumes_normal", "unbounded")


def test_one_constant_sample_is_not_degenerate() -> None:
    r = spi.robustness(P_O, [0.0] * 5, n=25, m=1, paired=False)
    assert r.low == r.high == pytest.approx(-1 + 1 / 25)  # nothing delivered, whatever P_o
    assert r.verdict == "refuted"
    steady = spi.robustness([40.0] * 5, P_F, n=25, m=1, paired=False)
    assert steady.low is not None
    assert steady.high is not None
    assert steady.low < steady.high
