from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from swarm_logistics_env import spi
from swarm_logistics_env.spi.ratio import paired_ratio

P_O = np.array([35.0, 41, 38, 29, 44, 36, 40])
P_F = np.array([33.0, 36, 39, 25, 40, 36, 35])
P_S = np.array([34.0, 39, 35, 28, 43, 33, 37])
MORE = np.array([1, 0, 2, 1, 0, 1, 2])


@pytest.mark.parametrize("confidence", [0.8, 0.95, 0.99])
def test_t_test_at_the_limits_has_one_minus_confidence_as_p(confidence: float) -> None:
    from scipy.stats import ttest_1samp

    test = paired_ratio(P_F - P_O, P_O, offset=0.08, confidence=confidence)
    for limit in (float(test.low), float(test.high)):
        d = (P_F - P_O) - (limit - 0.08) * P_O
        assert ttest_1samp(d, 0.0).pvalue == pytest.approx(1 - confidence, rel=1e-9)


def test_limits_are_fiellers_quadratic_as_written() -> None:
    from scipy.stats import t

    num, den, n = P_F - P_S, P_O, P_O.size
    (s_nn, s_nd), (_, s_dd) = np.cov(num, den) / n
    q = t.ppf(0.975, n - 1)
    a = den.mean() ** 2 - q**2 * s_dd
    b = num.mean() * den.mean() - q**2 * s_nd
    c = num.mean() ** 2 - q**2 * s_nn
    ft = spi.fault_tolerance(P_O, P_F, P_S)
    assert ft.low == pytest.approx((b - math.sqrt(b * b - a * c)) / a)
    assert ft.high == pytest.approx((b + math.sqrt(b * b - a * c)) / a)


@pytest.mark.parametrize("threshold", [-0.2, 0.0, 1.0])
def test_verdict_is_the_paired_t_test(threshold: float) -> None:
    from scipy.stats import ttest_rel

    r = spi.robustness(P_O, P_F, n=25, m=2, threshold=threshold)
    reference = ttest_rel(P_F, P_O * (1 + threshold - 2 / 25))
    assert r.p_value == pytest.approx(reference.pvalue, rel=1e-9)
    one_sided = ttest_rel(P_F, P_O * (1 + threshold - 2 / 25), alternative="greater").pvalue
    assert r.probability == pytest.approx(1 - one_sided, rel=1e-9)


counts = st.integers(1, 60)


@given(
    pairs=st.lists(st.tuples(counts, st.integers(0, 60)), min_size=2, max_size=12),
    threshold=st.floats(-1.0, 2.0),
    m=st.integers(1, 25),
)
def test_verdict_and_interval_agree(pairs: list[tuple[int, int]], threshold: float, m: int) -> None:
    p_o, p_f = (np.array(side, dtype=float) for side in zip(*pairs, strict=True))
    for paired in (True, False):
        r = spi.robustness(p_o, p_f, n=25, m=m, threshold=threshold, paired=paired)
        assert r.p_value is not None
        if not {"unbounded", "degenerate", "too_few_seeds"}.isdisjoint(r.flags):
            continue
        assert r.low is not None
        assert r.high is not None
        assume(abs(r.p_value - 0.05) > 1e-6)
        # Two seeds may give Welch's test a p that is not monotone in theta.
        if not paired and len(pairs) < 3:
            continue
        expected = {(True, False): "supported", (False, True): "refuted"}
        by_interval = (r.low > threshold, r.high < threshold)
        assert r.verdict == expected.get(by_interval, "inconclusive")


def test_many_studies_at_once_are_the_studies_one_by_one() -> None:
    rng = np.random.default_rng(3)
    num, den = rng.normal(0, 5, (4, 6, 8)), rng.normal(40, 5, (4, 6, 8))
    together = paired_ratio(num, den, offset=0.1, threshold=0.05)
    assert together.low.shape == (4, 6)
    alone = paired_ratio(num[2, 3], den[2, 3], offset=0.1, threshold=0.05)
    for field in ("value", "low", "high", "p_value", "probability", "difference_sd"):
        assert getattr(together, field)[2, 3] == pytest.approx(float(getattr(alone, field)))


@pytest.mark.parametrize("paired", [True, False])
@pytest.mark.parametrize("p_f", [30.0, 20.0, 24.0])
def test_no_spread_is_no_evidence(paired: bool, p_f: float) -> None:
    r = spi.robustness([25.0] * 5, [p_f] * 5, n=25, m=1, paired=paired)
    assert r.value == pytest.approx(p_f / 25 - 1 + 1 / 25)
    assert (r.low, r.high) == (None, None)
    assert (r.verdict, r.probability, r.p_value) == ("inconclusive", 0.5, 1.0)
    assert r.flags == ("degenerate",)
    assert r.difference_sd == 0.0


def test_two_seeds_give_no_verdict() -> None:
    # The only verdict under Holm of a study of the paper with two seeds came from this.
    assert spi.fault_tolerance([40, 40], [39, 39], [38, 38]).verdict == "inconclusive"
    # A spread that is next to nothing: -3 twice, beside P_o of 40 and 41.
    nearly = spi.robustness([40, 41], [37, 38], n=25, m=1)
    assert (nearly.verdict, nearly.p_value) == ("inconclusive", 1.0)
    assert nearly.flags == ("too_few_seeds",)


def test_rounding_is_not_spread() -> None:
    # P_F = 18/25 P_o in every seed: R = 0 up to rounding, not a hair above it with certainty.
    r = spi.robustness([25, 50, 75, 150], [18, 36, 54, 108], n=25, m=7)
    assert r.flags == ("degenerate",)
    assert r.verdict == "inconclusive"


def test_unclear_denominator_gives_no_interval_but_a_verdict() -> None:
    # P_o so scattered that 0 is within reach, P_F above it in every seed all the same.
    p_o = np.array([1.0, 0.0, 30.0, 2.0, 0.0])
    s = spi.relative_change(p_o, p_o + np.array([5.0, 6.0, 5.0, 4.0, 5.0]))
    assert (s.low, s.high) == (-math.inf, math.inf)
    assert s.flags == ("assumes_normal", "unbounded")
    assert s.verdict == "supported"
