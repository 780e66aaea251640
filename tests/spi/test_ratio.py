"""Intervals and tests of a ratio of means: against SciPy's, by resamples, and what has neither."""

from __future__ import annotations

import math
import tracemalloc
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.stats import ttest_1samp, ttest_ind, ttest_rel

from swarm_logistics_env import spi
from swarm_logistics_env.spi import ratio
from swarm_logistics_env.spi.ratio import critical_value, paired_ratio, resampled_pivots
from verification.verdict_errors import wrong_verdicts

P_O = np.array([35.0, 41, 38, 29, 44, 36, 40])
P_F = np.array([33.0, 36, 39, 25, 40, 36, 35])
FEWER_F = P_F[:5]  # of a sample that shares no seeds
rng = np.random.default_rng(2)
TWELVE = rng.poisson(39, 12).astype(float)
TWELVE_F = np.round(TWELVE * 0.9 + rng.normal(0, 2, 12))
RESIDUAL = TWELVE_F - TWELVE_F.mean() / TWELVE.mean() * TWELVE


@pytest.mark.parametrize("confidence", [0.8, 0.95, 0.99])
def test_tests_at_the_limits_have_one_minus_confidence_as_p(confidence: float) -> None:
    test = paired_ratio(P_F - P_O, P_O, offset=0.08, confidence=confidence)
    for limit in (float(test.low), float(test.high)):
        d = (P_F - P_O) - (limit - 0.08) * P_O
        assert ttest_1samp(d, 0.0).pvalue == pytest.approx(1 - confidence, rel=1e-9)
    found: Any = spi.relative_change(P_O, FEWER_F, confidence=confidence, paired=False)
    assert found.low < found.value < found.high
    for limit in (found.low, found.high):
        p = ttest_ind(FEWER_F, P_O * (1 + limit), equal_var=False).pvalue
        assert p == pytest.approx(1 - confidence, rel=1e-6)


@pytest.mark.parametrize("threshold", [-0.3, -0.2, 0.0, 1.0])
def test_verdict_is_the_paired_t_test_or_welchs(threshold: float) -> None:
    r = spi.robustness(P_O, P_F, n=25, m=2, threshold=threshold)
    scaled = P_O * (1 + threshold - 2 / 25)
    assert r.p_value == pytest.approx(ttest_rel(P_F, scaled).pvalue, rel=1e-9)
    one_sided = ttest_rel(P_F, scaled, alternative="greater").pvalue
    assert r.probability == pytest.approx(1 - one_sided, rel=1e-9)
    r = spi.robustness(P_O, FEWER_F, n=25, m=2, threshold=threshold, paired=False)
    reference = ttest_ind(FEWER_F, scaled, equal_var=False)
    assert r.p_value == pytest.approx(reference.pvalue, rel=1e-9)
    assert r.degrees_of_freedom == pytest.approx(reference.df)


counts = st.integers(0, 60)


@given(
    pairs=st.lists(st.tuples(counts, counts), min_size=2, max_size=12),
    threshold=st.floats(-1.0, 2.0),
    m=st.integers(1, 25),
)
def test_verdict_and_interval_agree(pairs: list[tuple[int, int]], threshold: float, m: int) -> None:
    p_o, p_f = (np.array(side, dtype=float) for side in zip(*pairs, strict=True))
    assume(p_o.any())
    for paired in (True, False):
        r: Any = spi.robustness(p_o, p_f, n=25, m=m, threshold=threshold, paired=paired)
        without = {"unbounded", "degenerate", "too_few_seeds", "hidden_stalls", "cannot_fail"}
        if not without.isdisjoint(r.flags):
            continue
        assert r.low <= r.value <= r.high
        assert min(r.probability, 1 - r.probability) == pytest.approx(r.p_value / 2, abs=1e-12)
        assume(abs(r.p_value - 0.05) > 1e-6)
        # Two seeds may give Welch's test a p that is not monotone in theta.
        if not paired and len(pairs) < 3:
            continue
        expected = {(True, False): "supported", (False, True): "refuted"}
        by_interval = (r.low > threshold, r.high < threshold)
        assert r.verdict == expected.get(by_interval, "open")


@pytest.mark.parametrize(
    ("p_o", "p_f", "asked", "flags"),
    [
        ([25] * 5, [30] * 5, {}, ("degenerate",)),
        ([25] * 5, [20] * 5, {"paired": False}, ("degenerate",)),
        # The only verdict under Holm of a study of the paper with two seeds came from this.
        ([40, 40], [39, 39], {}, ("too_few_seeds", "degenerate")),
        # A spread that is next to nothing: -3 twice, beside P_o of 40 and 41.
        ([40, 41], [37, 38], {}, ("too_few_seeds",)),
        # P_F = 18/25 P_o in every seed: R = 0 up to rounding, not a hair above it with certainty.
        ([25, 50, 75, 150], [18, 36, 54, 108], {}, ("degenerate",)),
    ],
)
def test_no_spread_two_seeds_and_rounding_errors_are_no_evidence(
    p_o: list[float], p_f: list[float], asked: dict[str, Any], flags: tuple[str, ...]
) -> None:
    r = spi.robustness(p_o, p_f, n=25, m=7, **asked)
    assert (r.verdict, r.probability, r.p_value) == ("open", 0.5, 1.0)
    assert r.flags == flags
    assert ((r.low, r.high) == (None, None)) == ("degenerate" in flags)


def test_unclear_denominator_gives_no_interval_but_a_verdict() -> None:
    # P_o so scattered that 0 is within reach, P_F above it in every seed all the same.
    p_o = np.array([1.0, 0.0, 30.0, 2.0, 0.0])
    s = spi.relative_change(p_o, p_o + np.array([5.0, 6.0, 5.0, 4.0, 5.0]))
    assert s.verdict == "supported"
    r = spi.robustness([0.0, 0.0, 40.0], [100.0, 101.0, 99.0], n=25, m=1, paired=False)
    for found in (s, r):
        assert (found.low, found.high) == (-math.inf, math.inf)
        assert found.flags == ("assumes_normal", "unbounded")


def test_pivots_are_students_statistic_of_resampled_seeds() -> None:
    pivots = resampled_pivots(RESIDUAL)
    again = RESIDUAL[np.random.default_rng(0).integers(12, size=(20_000, 12))]
    by_hand = np.sqrt(12) * again.mean(axis=1) / again.std(axis=1, ddof=1)
    shares = (0.025, 0.5, 0.975)
    assert np.quantile(pivots, shares) == pytest.approx(np.quantile(by_hand, shares), abs=0.12)
    # All but one seed alike: a third of the resamples are flat, beyond any finite quantile.
    assert 0.3 < np.isneginf(resampled_pivots(np.array([-1.0] * 11 + [11.0]))).mean() < 0.4
    assert critical_value(pivots, 1e-6) == math.inf  # beyond its resamples nothing is rejected


def test_from_ten_seeds_on_the_larger_p_counts() -> None:
    p_o = np.array([39.0, 41, 38, 40, 42, 37, 40, 39, 41, 38, 40, 39])
    lucky = np.array([2.0, 1, 0, 3, 1, 0, 2, 1, 0, 1, 30, 35])
    for n in (12, 9):
        r: Any = spi.robustness(p_o[:n], lucky[:n], n=25, m=2, threshold=-0.6)
        by_t = ttest_1samp((lucky - p_o * (1 - 0.6 - 0.08))[:n], 0.0).pvalue
        assert r.p_value > 1.1 * by_t if n == 12 else r.p_value == pytest.approx(by_t)
        assert ("assumes_normal" in r.flags) == (n == 9)


def test_the_two_sides_mirror_each_other() -> None:
    skewed = TWELVE * 0.9 - 4.0 + np.geomspace(0.1, 12.0, 12) - TWELVE
    one, other = (paired_ratio(side * skewed, TWELVE, threshold=side * -0.05) for side in (1, -1))
    assert one.p_value == other.p_value
    assert [float(one.low), float(one.high)] == pytest.approx([-other.high, -other.low])


@pytest.mark.parametrize(("n", "most"), [(10, 0.06), (20, 0.05), (30, 0.045)])
@pytest.mark.parametrize("model", ["poisson", "overdispersed", "geometric"])
def test_wrong_verdicts_are_bounded_on_either_side(model: str, n: int, most: float) -> None:
    wrong = wrong_verdicts(model, [n], 1_500, only_seen=True)
    assert max(wrong.above, wrong.below) <= most
    assert wrong.share > 0.02


@pytest.mark.parametrize("n", [10, 1001])
def test_resamples_in_parts_have_the_bits_of_all_at_once(
    n: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    values = np.random.default_rng(n).normal(size=n)
    at_once = np.random.Generator(np.random.Philox(key=n)).multinomial(
        n, np.full(n, 1 / n), size=ratio.RESAMPLES
    )
    for most in (0, n):
        monkeypatch.setattr(ratio, "_MOST_SEEDS_AT_ONCE", most)
        found = ratio._resampled_sums(values[:, None])
        assert found.tobytes() == (at_once.astype(np.float64) @ values[:, None]).tobytes()


def test_thousands_of_trials_fit_into_the_memory() -> None:
    n = 1100
    source = np.random.default_rng(0)
    before, after = source.poisson(30, n).astype(float), source.poisson(20, n).astype(float)
    tracemalloc.start()
    try:
        paired_ratio(after, before)
        _, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert most < 4 * ratio.RESAMPLES * n  # bytes: all resamples as floats would take eight each
