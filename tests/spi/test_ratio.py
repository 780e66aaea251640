"""Intervals and tests of a ratio of means: levels, power, and what has neither."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.stats import t, ttest_ind, ttest_rel

from swarm_logistics_env import spi
from swarm_logistics_env.spi.hidden import stalls
from swarm_logistics_env.spi.ratio import RAISED, Design, Term, ratio_test
from verification.verdict_errors import share_supported, wrong_verdicts

pytestmark = pytest.mark.unmeasured

P_O = np.array([35.0, 41, 38, 29, 44, 36, 40])
P_F = np.array([33.0, 36, 39, 25, 40, 36, 35])
FEWER_F = P_F[:5]  # of a sample that shares no seeds


def change(p_o: Any, p_new: Any, *, threshold: float = 0.0) -> Any:
    terms = [Term(p_new, 1.0, 0.0), Term(p_o, -1.0, 1.0)]
    hidden = [stalls(term.sample) for term in terms]
    return ratio_test(terms, Design(), hidden, offset=0.0, threshold=threshold, confidence=0.95)


@pytest.mark.parametrize("paired", [True, False])
@pytest.mark.parametrize("confidence", [0.8, 0.95, 0.99])
def test_tests_at_the_limits_have_one_minus_confidence_as_p(
    confidence: float, paired: bool
) -> None:
    p_f = P_F if paired else FEWER_F
    estimate: Any = spi.relative_change(P_O, p_f, confidence=confidence, paired=paired)
    assert estimate.low < estimate.value < estimate.high
    for limit, word in ((estimate.low, "supported"), (estimate.high, "refuted")):
        # Just outside it is decided, where nothing is hidden; just inside it is open.
        for farther, decided in ((-1e-6, word == "supported"), (1e-6, word == "refuted")):
            at = spi.relative_change(
                P_O, p_f, threshold=limit + farther, confidence=confidence, paired=paired
            )
            assert (at.verdict == word or "hidden_stalls" in at.flags) == decided


@pytest.mark.parametrize("threshold", [-0.12, -0.02, 0.05])
def test_statistic_is_students_of_the_logarithm_of_raised_means(threshold: float) -> None:
    less = P_O * (1 + threshold)
    raised = RAISED * (P_F.mean() + less.mean())
    in_units = [p / (p.mean() + raised) for p in (P_F, less)]
    s = np.std(in_units[0] - in_units[1], ddof=1) / math.sqrt(7)
    logarithm = abs(math.log((P_F.mean() + raised) / (less.mean() + raised)))
    test = change(P_O, P_F, threshold=threshold)
    assert test.p_seen == pytest.approx(
        2 * t.sf((logarithm - s**2 / 2) / (s * (1 + 4 * s**2)), 6), rel=1e-9
    )
    # Of runs that scatter little it is the t test of the differences.
    near = 400.0 + P_O - P_O.mean(), 400.0 + P_F - P_F.mean() - 1.5
    assert change(*near).p_seen == pytest.approx(ttest_rel(*near).pvalue, rel=0.02)
    fewer: Any = spi.relative_change(near[0], near[1][:5], paired=False)
    reference = ttest_ind(near[0], near[1][:5], equal_var=False)
    assert fewer.degrees_of_freedom == pytest.approx(reference.df, rel=0.01)


counts = st.integers(0, 60)


@pytest.mark.daily
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
        without = {"unbounded", "degenerate", "too_few_seeds", "hidden_stalls"}
        # Five seeds or fewer that scatter as widely as they may give a p that is not monotone.
        is_wide = r.log_sd is None or r.log_sd > 0.7 * math.sqrt(len(pairs))
        if r.untestable or is_wide or not without.isdisjoint(r.flags):
            continue
        assert r.low <= r.value <= r.high
        assert min(r.probability, 1 - r.probability) == pytest.approx(r.p_value / 2, abs=1e-12)
        assume(abs(r.p_value - 0.05) > 1e-6)
        expected = {(True, False): "supported", (False, True): "refuted"}
        by_interval = (r.low > threshold, r.high < threshold)
        assert r.verdict == expected.get(by_interval, "open")


@pytest.mark.parametrize(
    ("p_o", "p_f", "options", "flags"),
    [
        ([25] * 5, [30] * 5, {}, ("degenerate",)),
        ([25] * 5, [20] * 5, {"paired": False}, ("degenerate",)),
        # The only verdict under Holm of a study of the paper with two seeds came from this.
        ([40, 40], [39, 39], {}, ("too_few_seeds", "degenerate")),
        # A spread that is next to nothing: -3 twice, beside P_o of 40 and 41.
        ([40, 41], [37, 38], {}, ("too_few_seeds",)),
        # P_F = 18/25 P_o in every seed: R = 0 up to rounding, not a hair above it with certainty.
        ([25, 50, 75, 100], [18, 36, 54, 72], {}, ("degenerate",)),
        ([25.1, 50.3, 74.9, 100.7], [18.072, 36.216, 53.928, 72.504], {}, ("degenerate",)),
    ],
)
def test_no_spread_two_seeds_and_rounding_errors_are_no_evidence(
    p_o: list[float], p_f: list[float], options: dict[str, Any], flags: tuple[str, ...]
) -> None:
    r = spi.robustness(p_o, p_f, n=25, m=7, **options)
    assert (r.verdict, r.probability, r.p_value) == ("open", 0.5, 1.0)
    assert r.flags == flags
    assert ((r.low, r.high) == (None, None)) == ("degenerate" in flags)


def test_unclear_denominator_gives_no_interval() -> None:
    p_new = np.array([5.0, 6.0, 5.0, 4.0, 5.0])
    for paired in (True, False):
        estimate = spi.relative_change([0.0, 0.0, 30.0, 0.0, 0.0], p_new, paired=paired)
        assert (estimate.low, estimate.high) == (-math.inf, math.inf)
        assert estimate.flags == ("reference_near_0", "unbounded")
        assert (estimate.verdict, estimate.p_value, estimate.untestable) == ("open", None, True)


def test_where_next_to_nothing_is_delivered_it_is_refuted() -> None:
    for few in ([0.0] * 6, [0.0, 0, 1, 0, 0, 0], [2.0, 0, 1, 0, 3, 0]):
        r: Any = spi.robustness([40.0, 41, 38, 45, 36, 40], few, n=25, m=2)
        assert r.verdict == "refuted"
        assert r.low >= 2 / 25 - 1.0 - 1e-9  # as no P is below 0


def test_the_two_sides_mirror_each_other() -> None:
    # Gains by a factor weigh as losses by it.
    gain, loss = (change(*pair, threshold=0.0) for pair in ((P_O, P_F + 20), (P_F + 20, P_O)))
    assert gain.p_value == pytest.approx(float(loss.p_value))
    assert 1 + gain.low == pytest.approx(1 / (1 + float(loss.high)), rel=1e-3)


def test_many_studies_at_once_are_each_of_them() -> None:
    drawn = np.random.default_rng(0).poisson(30.0, (2, 4, 8)) * 1.0
    together = change(*drawn, threshold=-0.1)
    for study in range(4):
        alone = change(*drawn[:, study], threshold=-0.1)
        assert [float(x) for x in alone] == pytest.approx([float(x[study]) for x in together])


@pytest.mark.parametrize("paired", [True, False])
@pytest.mark.parametrize(("n", "most"), [(3, 0.055), (5, 0.05), (6, 0.05), (10, 0.04), (20, 0.04)])
@pytest.mark.parametrize(
    "model", ["poisson", "overdispersed", "unshared", "geometric", "5% stall", "5% stall, P 39"]
)
def test_wrong_verdicts_are_bounded_on_either_side(
    model: str, n: int, most: float, paired: bool
) -> None:
    # 3 % at ten seeds and 4 % below, and three standard errors of so many studies.
    wrong = wrong_verdicts(model, [n], 2_000, paired=paired)
    assert max(wrong.above, wrong.below) <= most


def test_the_test_of_runs_seen_is_not_too_careful() -> None:
    for n in (5, 10, 30):
        wrong = wrong_verdicts("poisson", [n], 4_000, only_seen=True)
        assert 0.035 < wrong.share < 0.06


@pytest.mark.parametrize("paired", [True, False])
def test_more_seeds_find_more(paired: bool) -> None:
    power = [share_supported(400, 0.08, n, 600, paired=paired) for n in (6, 10, 20, 30)]
    assert power == sorted(power)
    assert power[0] > 0.1
    assert power[-1] > 0.85
    assert share_supported(400, 0.12, 6, 600, paired=paired) > 0.5


@pytest.mark.parametrize("model", ["poisson", "four pairs in five equal", "half deliver all items"])
@pytest.mark.parametrize("n", [3, 10])
def test_of_two_that_deliver_as_much_none_is_said_to_deliver_more(model: str, n: int) -> None:
    assert wrong_verdicts(model, [n], studies=1_000, is_equal=True).share < 0.05
