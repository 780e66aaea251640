"""The indicators: their values, what an estimate says, and what is refused."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarm_logistics_env import spi
from swarm_logistics_env.spi import IndicatorError
from swarm_logistics_env.spi.definitions import DEFINITIONS, Change

P = [30.0, 40.0, 35.0, 38.0]
LESS = [28.0, 33.0, 35.0, 30.0]

INDICATORS: dict[str, Callable[..., spi.Estimate]] = {
    "S": lambda a, b, **more: spi.scalability(a, b, n=10, m=5, **more),
    "FT": lambda a, b, p_s=LESS, **more: spi.fault_tolerance(a, b, p_s, **more),
    "R": lambda a, b, **more: spi.robustness(a, b, n=25, m=2, **more),
    "A": lambda a, b, x_new=15, **more: spi.adaptability(a, b, x_o=10, x_new=x_new, **more),
    "change": spi.relative_change,
}
over_indicators = pytest.mark.parametrize("name", INDICATORS)


# `tests/study/questions/test_plan.py` has those of the paper's tables.
def test_values_are_ratios_of_means_by_the_table_of_indicators() -> None:
    samples = [10.0, 30.0], [20.0, 12.0], [8.0, 18.0]
    expected = {
        "S": (Change(10, 15, 10), -0.2 * 2),
        "FT": (Change(0, 5, 20), 6 / 40),
        "R": (Change(0, 5, 20), -0.2 + 0.25),
        "A": (Change(4, 5, 9), -0.2 / 0.25 + 1),
        "change": (Change(0, 0, 0), -0.2),
    }
    for symbol, row in DEFINITIONS.items():
        change, value = expected[symbol]
        estimate = row.function(**dict(zip(row.performances, samples)), **row.arguments(change))
        assert estimate.indicator == symbol
        assert estimate.value == pytest.approx(value)


def test_adaptability_uses_the_size_of_the_change_only() -> None:
    up, down = (INDICATORS["A"](P, LESS, x_new=x_new) for x_new in (15, 5))
    assert up.value < 1
    assert up == down


@over_indicators
def test_one_seed_gives_the_value_and_nothing_else(name: str) -> None:
    estimate = INDICATORS[name]([39], [35], **({"p_s": [30]} if name == "FT" else {}))
    assert (estimate.verdict, estimate.flags) == ("open", ("single_seed",))
    assert (estimate.n_seeds, estimate.threshold, estimate.mean_denominator) == (1, 0.0, 39)
    assert {estimate.low, estimate.high, estimate.p_value, estimate.probability} == {None}
    assert {estimate.log_sd, estimate.degrees_of_freedom, estimate.pairing_correlation} == {None}


@over_indicators
def test_bad_samples_are_named(name: str) -> None:
    bad: Any
    for bad, message in (
        ([], "is empty"),
        ([[1.0, 2.0]], r"shape \(1, 2\)"),
        ([3.0, float("nan"), 1.0, 1.0], r"\[1\] = nan: should be finite"),
        ([3.0, 1.0, -2.0, 1.0], r"\[2\] = -2: should be finite, not negative"),
        (["many", 1, 2, 3], "should be an array of numbers"),
    ):
        with pytest.raises(IndicatorError, match=r"^p_(o|n)\b.*" + message):
            INDICATORS[name](bad, P)
        with pytest.raises(IndicatorError, match=r"^p_(f|nm|new)\b.*" + message):
            INDICATORS[name](P, bad)
    with pytest.raises(IndicatorError, match=r"mean of p_(o|n) = 0"):
        INDICATORS[name]([0.0] * 4, P)
    with pytest.raises(IndicatorError, match=r"unequal seed sets .*paired=False"):
        INDICATORS[name](P[:3], P)
    assert INDICATORS[name](P[:3], P, paired=False).n_seeds == 3


@pytest.mark.parametrize(
    ("indicator", "arguments", "message"),
    [
        (spi.adaptability, {"x_o": 0.0, "x_new": 1.0}, "x_o = 0"),
        (spi.adaptability, {"x_o": 2.0, "x_new": 2.0}, "x_new = 2 = x_o"),
        (spi.adaptability, {"x_o": "1", "x_new": 2.0}, "x_o = '1': should be a number"),
        (spi.relative_change, {"threshold": float("nan")}, "threshold = nan"),
        (spi.relative_change, {"confidence": 1.0}, "confidence = 1"),
        (spi.robustness, {"n": 25, "m": 26}, "m = 26: should be at most n = 25"),
        (spi.robustness, {"n": 25, "m": 0}, "m = 0: should be at least 1"),
        (spi.fault_tolerance, {"p_s": P, "n": 25, "m": 25}, "m = 25"),
        (spi.fault_tolerance, {"p_s": P, "n": 25}, "together"),
        (spi.fault_tolerance, {"p_s": P, "saturated": ["x"]}, "should be among p_f, p_s, p_o"),
        (spi.scalability, {"n": 25, "m": 1.5}, "m = 1.5: should be a whole number"),
    ],
)
def test_arguments_that_cannot_be_are_named(
    indicator: Any, arguments: dict[str, Any], message: str
) -> None:
    with pytest.raises(IndicatorError, match=message):
        indicator(P, P, **arguments)


PERFORMANCES = st.lists(st.integers(0, 60), min_size=3, max_size=12)
VALUES = st.floats(0.1, 40.0) | st.sampled_from([0.1, 0.2, 0.3, 0.6, 1.0, 2.0, 4.0])


@pytest.mark.daily
@given(
    symbol=st.sampled_from([*DEFINITIONS]),
    samples=st.tuples(PERFORMANCES, PERFORMANCES, PERFORMANCES),
    n=st.integers(2, 60),
    m=st.integers(1, 90),
    values=st.tuples(VALUES, VALUES | st.just(0.0)),
    threshold=st.sampled_from([0.0, 1.0, -1.0, -0.5, -2.0]),
)
@settings(max_examples=settings().max_examples // 2)  # each estimates four times
def test_what_no_performance_can_refute_has_no_verdict_and_all_else_can_be_either(
    symbol: str, samples: tuple[list[int], ...], n: int, m: int, values: tuple[float, float],
    threshold: float,
) -> None:  # fmt: skip
    row, (x_o, x_new) = DEFINITIONS[symbol], values
    change = Change(n, n + m, n) if row.compares == "size" else Change(x_o, x_new, n)
    if row.compares == "fault":
        change = Change(0, min(m, n - row.needs_removed), n)
    elif x_o == x_new:
        return

    def judged(*performances: Any) -> spi.Estimate:
        named = dict(zip(row.performances, performances))
        return row.function(**named, **row.arguments(change), threshold=threshold, paired=False)

    p_o, p_new, p_s = samples
    estimate = judged([*p_o, 1], p_new, p_s)
    nothing, much = [0] * 4, [10**6] * 4
    least = judged([40] * 4, nothing, much).value  # the worst that can happen
    assert ("cannot_fail" in estimate.flags) == (least >= threshold - 1e-12)
    assert judged([40] * 4, much, nothing).value > threshold  # every indicator can succeed
    if "cannot_fail" in estimate.flags:
        assert estimate.untestable
        assert estimate.value >= threshold - 1e-9
        assert (estimate.verdict, estimate.p_value, estimate.probability) == ("open", None, None)
        assert f"above {threshold:g}: untestable" in str(estimate)
        assert spi.adjusted_p_values([estimate, judged([5, 6, 7], [3, 4, 9], [1, 2, 2])])[0] is None
        assert spi.minimum_detectable_effect(estimate) is spi.seeds_for_power(estimate, 9.0) is None


def test_what_cannot_fail_leaves_holms_family_to_the_others() -> None:
    clear = INDICATORS["A"]([40.0 + k % 3 for k in range(12)], [40.0 - k % 4 for k in range(12)])
    doubled = INDICATORS["A"](P * 3, LESS * 3, x_new=20)
    assert doubled.flags == ("cannot_fail",)
    assert spi.adjusted_p_values([doubled, clear, clear])[1] == 2 * (clear.p_value or 1.0)
    assert spi.adjust([doubled, clear]) == ("open", "supported")


SEVEN_IN_TEN = [3.0, 0, 1, 0, 0, 2, 0, 0, 1, 0]
ONE_OF_TWENTY = [1.0] * 19 + [2.0]
EIGHT_ALIKE = [41.0, 38, 44, 40, 39, 43, 42, 37, 40, 36]


@pytest.mark.parametrize(
    ("p_o", "p_f", "flags"),
    [
        # Seven items in ten runs, none lost: R = 2/8 was "supported" with p = 7e-11.
        (SEVEN_IN_TEN, SEVEN_IN_TEN, ("few_pairs_differ",)),
        (SEVEN_IN_TEN, [2.0, 0, 1, 0, 0, 2, 0, 0, 1, 0], ("few_pairs_differ",)),
        ([1.0] * 20, ONE_OF_TWENTY, ("few_pairs_differ",)),
        (SEVEN_IN_TEN, [2.0, 1, 0, 1, 1, 0, 1, 0, 2, 0], ("reference_near_0",)),
        # 400 items of which 100 might have been lost, and three were: that is evidence.
        (EIGHT_ALIKE, [40.0, 38, 44, 40, 39, 43, 42, 37, 40, 34], ()),
    ],
)
def test_a_handful_of_deliveries_is_untestable_and_many_equal_ones_are_evidence(
    p_o: list[float], p_f: list[float], flags: tuple[str, ...]
) -> None:
    robust = spi.robustness(p_o, p_f, n=8, m=2)
    assert robust.flags == flags
    assert robust.untestable == bool(flags)
    assert robust.verdict == ("open" if flags else "supported")
    if flags:
        assert (robust.p_value, robust.p_seen, robust.probability) == (None, None, None)
        assert "above 0: untestable" in str(robust)
        # It might have been told, so Holm counts it.
        assert spi.adjusted_p_values([robust, spi.robustness(P, LESS, n=25, m=2)])[0] == 1.0


MANY = np.array([59.9, 60.0, 59.8, 60.0, 59.8])
HALF = np.array([30.0, 28, 33, 31, 29])
FEWER = np.array([40.0, 40.3, 39.7, 40.1, 39.9])
GREATER = np.array([47.1, 46.9, 47.0, 47.2, 46.8])


@pytest.mark.parametrize(
    ("name", "samples", "threshold", "saturated", "verdict"),
    [
        ("R", (MANY, HALF), 0, ("p_o",), "refuted"),  # the true P_o is larger still
        ("R", (MANY, HALF), 0, ("p_f",), "open"),  # the true P_F may be as large as P_o
        ("R", (HALF, MANY), 0, ("p_f",), "supported"),
        # Of a larger true P_o the loss is a smaller share; of a larger P_S it is larger still.
        ("FT", (MANY, FEWER, GREATER), -0.02, ("p_o",), "open"),
        ("FT", (MANY, FEWER, GREATER), -0.02, ("p_s",), "refuted"),
        # The sign of FT does not depend on P_o.
        ("FT", (MANY, FEWER, GREATER), 0.0, ("p_o",), "refuted"),
        ("FT", (MANY, GREATER, FEWER), 0.1, ("p_o",), "open"),
        ("A", (MANY, FEWER), 0.6, ("p_new",), "supported"),
        ("A", (FEWER, MANY), 1.0, ("p_o",), "open"),
    ],
)
def test_a_cap_blocks_the_side_on_which_it_can_move_the_indicator(
    name: str, samples: Any, threshold: float, saturated: tuple[str, ...], verdict: str
) -> None:
    x: dict[str, float] = {"x_new": 30} if name == "A" else {}
    estimate = INDICATORS[name](*samples, threshold=threshold, saturated=saturated, **x)
    assert (estimate.verdict, *spi.adjust([estimate])) == (verdict, verdict)
    assert ("capped" in estimate.flags, estimate.p_value == 1.0) == ((verdict == "open",) * 2)


def test_the_same_runs_have_an_exact_value_that_is_no_evidence() -> None:
    r = spi.robustness(MANY, MANY, n=25, m=2, identical=True)
    assert (r.value, r.low, r.high) == (0.08, 0.08, 0.08)
    assert (r.verdict, r.answer, r.p_value) == ("open", "supported", None)
    assert r.flags == ("identical",)
    assert spi.relative_change(MANY, MANY, identical=True).answer == "refuted"  # 0 is not above 0
    with pytest.raises(IndicatorError, match="identical = True, but p_f and p_o differ"):
        spi.robustness(MANY, HALF, n=25, m=2, identical=True)
