from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.spi import IndicatorError

P = [30.0, 40.0, 35.0, 38.0]
LESS = [28.0, 33.0, 35.0, 30.0]

INDICATORS: dict[str, Callable[..., spi.Estimate]] = {
    "S": lambda a, b, **more: spi.scalability(a, b, n=10, m=5, **more),
    "FT": lambda a, b, p_s=LESS, **more: spi.fault_tolerance(a, b, p_s, **more),
    "R": lambda a, b, **more: spi.robustness(a, b, n=25, m=2, **more),
    "A": lambda a, b, **more: spi.adaptability(a, b, x_o=10, x_new=15, **more),
    "change": spi.relative_change,
}
over_indicators = pytest.mark.parametrize("name", INDICATORS)


def test_values_are_ratios_of_means() -> None:
    p_o, p_f, p_s = [10.0, 30.0], [20.0, 12.0], [8.0, 18.0]
    assert spi.scalability(p_o, p_f, n=10, m=5).value == pytest.approx((32 - 40) / 40 * 2)
    assert spi.fault_tolerance(p_o, p_f, p_s).value == pytest.approx((32 - 26) / 40)
    assert spi.robustness(p_o, p_f, n=25, m=5).value == pytest.approx((32 - 40) / 40 + 0.2)
    assert spi.adaptability(p_o, p_f, x_o=4, x_new=5).value == pytest.approx(-0.2 / 0.25 + 1)
    assert spi.relative_change(p_o, p_f).value == pytest.approx(-0.2)


def test_adaptability_uses_the_size_of_the_change_only() -> None:
    up = spi.adaptability(P, LESS, x_o=10, x_new=15)
    down = spi.adaptability(P, LESS, x_o=10, x_new=5)
    negative = spi.adaptability(P, LESS, x_o=-10, x_new=-15)
    assert up.value < 1
    assert (up.value, up.low, up.high) == (down.value, down.low, down.high)
    assert up == negative


@over_indicators
def test_one_seed_gives_the_value_and_nothing_else(name: str) -> None:
    estimate = INDICATORS[name]([39], [35], **({"p_s": [30]} if name == "FT" else {}))
    assert estimate.verdict == "inconclusive"
    assert (estimate.low, estimate.high, estimate.p_value, estimate.probability) == (None,) * 4
    assert (estimate.difference_sd, estimate.degrees_of_freedom) == (None, None)
    assert estimate.pairing_correlation is None
    assert estimate.n_seeds == 1
    assert estimate.flags == ("single_seed",)
    assert estimate.threshold == 0.0
    assert estimate.mean_denominator == 39


def test_an_estimate_describes_its_input() -> None:
    r = spi.robustness(P, LESS, n=25, m=2, threshold=0.1, confidence=0.9)
    assert (r.indicator, r.threshold, r.confidence, r.n_seeds, r.paired) == ("R", 0.1, 0.9, 4, True)
    assert r.pairing_correlation == pytest.approx(np.corrcoef(P, LESS)[0, 1])
    assert r.mean_denominator == np.mean(P)
    d = np.array(LESS) - P - (0.1 - 2 / 25) * np.array(P)
    assert r.difference_sd == pytest.approx(d.std(ddof=1))
    assert r.degrees_of_freedom == 3
    ft = spi.fault_tolerance(P, LESS, P[::-1])
    assert ft.pairing_correlation == pytest.approx(np.corrcoef(LESS, P[::-1])[0, 1])


BAD_SAMPLES: list[tuple[Any, str]] = [
    ([], "is empty"),
    ([[1.0, 2.0]], r"shape \(1, 2\)"),
    ([3.0, float("nan"), 1.0, 1.0], r"\[1\] = nan: should be finite"),
    ([float("inf"), 3.0, 1.0, 1.0], r"\[0\] = inf: should be finite"),
    ([3.0, 1.0, -2.0, 1.0], r"\[2\] = -2: should not be negative"),
    (["many", 1, 2, 3], "should be an array of numbers"),
]


@over_indicators
@pytest.mark.parametrize(("bad", "message"), BAD_SAMPLES)
def test_bad_samples_are_named(name: str, bad: Any, message: str) -> None:
    with pytest.raises(IndicatorError, match=r"^p_(o|n)\b.*" + message):
        INDICATORS[name](bad, P)
    with pytest.raises(IndicatorError, match=r"^p_(f|nm|new)\b.*" + message):
        INDICATORS[name](P, bad)
    with pytest.raises(IndicatorError, match=r"^p_s\b.*" + message):
        spi.fault_tolerance(P, P, bad)


@over_indicators
def test_unequal_seed_sets_or_nothing_delivered_in_the_reference_are_errors(name: str) -> None:
    for paired in (True, False):
        with pytest.raises(IndicatorError, match=r"mean of p_(o|n) = 0"):
            INDICATORS[name]([0.0] * 4, P, paired=paired)
    with pytest.raises(IndicatorError, match=r"unequal seed sets .*paired=False"):
        INDICATORS[name](P[:3], P)
    assert INDICATORS[name](P[:3], P, paired=False).n_seeds == 3


def test_arguments_that_cannot_be_are_named() -> None:
    nan = float("nan")
    undefined: list[tuple[Callable[..., Any], dict[str, Any], str]] = [
        (spi.adaptability, {"x_o": 0.0, "x_new": 1.0}, "x_o = 0"),
        (spi.adaptability, {"x_o": 2.0, "x_new": 2.0}, "x_new = 2 = x_o"),
        (spi.adaptability, {"x_o": nan, "x_new": 1.0}, "x_o = nan: should be finite"),
        (spi.adaptability, {"x_o": 1.0, "x_new": nan}, "x_new = nan: should be finite"),
        (spi.adaptability, {"x_o": "1", "x_new": 2.0}, "x_o = '1': should be a number"),
        (spi.relative_change, {"threshold": nan}, "threshold = nan"),
        *((spi.relative_change, {"confidence": c}, "confidence") for c in (0.0, 1.0, "0.95", None)),
        (spi.robustness, {"n": 25, "m": 26}, "m = 26: should be at most n = 25"),
        *((spi.fault_tolerance, {"p_s": P, "n": 25, "m": m}, f"m = {m}") for m in (0, 25)),
        (spi.fault_tolerance, {"p_s": P, "n": 25}, "together"),
        (spi.fault_tolerance, {"p_s": P, "saturated": ["x"]}, "should be among p_f, p_s, p_o"),
    ]
    for indicator in (spi.scalability, spi.robustness):
        undefined += [
            (indicator, {"n": 25, "m": 0}, "m = 0: should be at least 1"),
            (indicator, {"n": 0, "m": 1}, "n = 0: should be at least 1"),
            (indicator, {"n": 25, "m": 1.5}, "m = 1.5: should be a whole number"),
        ]
    for indicator, arguments, message in undefined:
        with pytest.raises(IndicatorError, match=message):
            indicator(P, P, **arguments)
    assert spi.robustness(P, P, n=25, m=25).value == 1.0
    assert spi.fault_tolerance(P, P, P, n=25, m=24).value == 0


@pytest.mark.parametrize(("outlier", "skewed"), [(4.1, False), (4.3, True)])
def test_ten_differences_are_skewed_beyond_twice_the_standard_error_of_g(
    outlier: float, skewed: bool
) -> None:
    # g = 1.341 and 1.439; the standard error of ten is .687 (Cramer), and Cochran's limit .632.
    p_o = np.full(10, 40.0)
    p_f = p_o + np.array([-1, 1, -1, 1, -1, 1, -1, 1, 0, outlier])
    assert ("skewed" in spi.robustness(p_o, p_f, n=25, m=1).flags) == skewed


@pytest.mark.parametrize(("n", "skewed"), [(60, True), (200, False)])
def test_many_seeds_make_up_for_skewness(n: int, skewed: bool) -> None:
    # g of exponential differences is nearly 2, far beyond chance; 25 g^2 is about 90.
    waits = -np.log((np.arange(n) + 0.5) / n)
    found = spi.robustness(np.full(n, 40.0), 40.0 - waits, n=25, m=1)
    assert ("skewed" in found.flags) == skewed


P_O = np.array([60.0, 60, 58, 60, 59])
HALF = np.array([30.0, 28, 33, 31, 29])


@pytest.mark.parametrize(
    ("p_o", "p_f", "saturated", "verdict"),
    [
        (P_O, HALF, ("p_o",), "refuted"),  # the true P_o is larger still
        (P_O, HALF, ("p_f",), "inconclusive"),  # the true P_F may be as large as P_o
        (HALF, P_O, ("p_f",), "supported"),
        (HALF, P_O, ("p_o",), "inconclusive"),
        (HALF, P_O, ("p_o", "p_f"), "inconclusive"),
        (P_O, HALF, ("p_o", "p_f"), "inconclusive"),
    ],
)
def test_a_capped_p_blocks_the_side_it_leans_to(
    p_o: np.ndarray, p_f: np.ndarray, saturated: tuple[str, ...], verdict: str
) -> None:
    r = spi.robustness(p_o, p_f, n=25, m=2, saturated=saturated)
    assert r.verdict == verdict
    if verdict == "inconclusive":
        assert r.p_value == 1.0
        assert "capped" in r.flags
        assert spi.adjust([r]) == ("inconclusive",)


NEAR_CAP = np.array([59.9, 60.0, 59.8, 60.0, 59.8])
FEWER = np.array([40.0, 40.3, 39.7, 40.1, 39.9])
GREATER = np.array([47.1, 46.9, 47.0, 47.2, 46.8])


@pytest.mark.parametrize(
    ("p_f", "p_s", "threshold", "saturated", "verdict"),
    [
        (FEWER, GREATER, -0.1, "p_o", "inconclusive"),  # of a true P_o of 80 the loss is but .086
        (FEWER, GREATER, -0.1, "p_s", "refuted"),  # of a larger P_S the loss is larger still
        (FEWER, GREATER, -0.1, "p_f", "inconclusive"),
        (FEWER, GREATER, 0.0, "p_o", "refuted"),  # the sign of FT does not depend on P_o
        (GREATER, FEWER, 0.0, "p_o", "supported"),
        (GREATER, FEWER, 0.1, "p_o", "inconclusive"),
        (FEWER, GREATER, 0.1, "p_o", "refuted"),
        (GREATER, FEWER, -0.1, "p_o", "supported"),
    ],
)
def test_a_cap_blocks_the_side_on_which_it_can_move_the_indicator(
    p_f: np.ndarray, p_s: np.ndarray, threshold: float, saturated: str, verdict: str
) -> None:
    ft = spi.fault_tolerance(NEAR_CAP, p_f, p_s, threshold=threshold, saturated=[saturated])
    assert ft.verdict == verdict
    assert ("capped" in ft.flags) == (verdict == "inconclusive")


def test_a_capped_reference_of_a_large_change_of_a_parameter_blocks_no_gain() -> None:
    # x trebles, so that A = (P_new/P_o - 1)/2 + 1 is above 0 whatever P_o is.
    asked: dict[str, Any] = {"x_o": 5.0, "x_new": 15.0, "saturated": ["p_o"]}
    assert spi.adaptability(NEAR_CAP, FEWER, **asked).verdict == "supported"
    assert spi.adaptability(FEWER, NEAR_CAP, threshold=1.0, **asked).flags == ("capped",)


def test_the_same_runs_have_an_exact_value_that_is_no_evidence() -> None:
    r = spi.robustness(P_O, P_O, n=25, m=2, identical=True)
    assert (r.value, r.low, r.high) == (0.08, 0.08, 0.08)
    assert (r.verdict, r.answer, r.p_value) == ("inconclusive", "supported", None)
    assert r.flags == ("identical",)
    assert spi.relative_change(P_O, P_O, identical=True).answer == "refuted"  # 0 is not above 0
    assert spi.relative_change(P_O, P_O, identical=True, threshold=-0.1).answer == "supported"
    with pytest.raises(IndicatorError, match="identical = True, but p_f and p_o differ"):
        spi.robustness(P_O, HALF, n=25, m=2, identical=True)
