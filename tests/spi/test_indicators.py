"""The indicators: their values, among them the paper's, what an estimate says, what is refused."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.spi import IndicatorError
from swarm_logistics_env.spi.definitions import DEFINITIONS, Change
from swarm_logistics_env.studies import Study

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


def test_values_are_ratios_of_means_also_by_the_table_of_indicators() -> None:
    p_o, p_f, p_s = [10.0, 30.0], [20.0, 12.0], [8.0, 18.0]
    values = {
        "S": spi.scalability(p_o, p_f, n=10, m=5).value,
        "FT": spi.fault_tolerance(p_o, p_f, p_s).value,
        "R": spi.robustness(p_o, p_f, n=20, m=5).value,
        "A": spi.adaptability(p_o, p_f, x_o=4, x_new=5).value,
        "change": spi.relative_change(p_o, p_f).value,
    }
    expected = {"S": -0.2 * 2, "FT": 6 / 40, "R": -0.2 + 0.25, "A": -0.2 / 0.25 + 1, "change": -0.2}
    assert values == pytest.approx(expected)
    changes = {
        "size": (10, 15, 10),
        "fault": (0, 5, 20),
        "parameter": (4, 5, 9),
        "policy": (0,) * 3,
    }
    for symbol, row in DEFINITIONS.items():
        samples = dict(zip(row.performances, (p_o, p_f, p_s)))
        found = row.function(**samples, **row.arguments(Change(*changes[row.compares])))
        assert (found.indicator, found.value) == (symbol, values[symbol])
    assert DEFINITIONS["FT"].references == ("P_o", "P_S")
    assert DEFINITIONS["S"].references == ("P_N",)


def test_an_indicator_that_no_row_defines_is_refused(small: dict[str, Any]) -> None:
    with pytest.raises(StudyError, match="no indicator 'FR'"):
        Study(**small, indicators=["FR"])


def test_every_public_name_is_documented_and_a_removed_one_says_what_to_use() -> None:
    for name in {*spi.__all__} - {"Spending", "Verdict"}:
        assert getattr(spi, name).__doc__, name
    with pytest.raises(ImportError, match=r"removed in 0\.3\.0: use spi\.repair_times"):
        from swarm_logistics_env.spi import self_repair  # type: ignore[attr-defined]  # noqa: F401


# The paper's tables I to III: N to P, and of the failure modes P_F at m = 1, 2, 3.
TABLE_I = {5: 9, 10: 18, 20: 29, 30: 33, 40: 45, 50: 56, 60: 65, 100: 74, 150: 69}
S = [1.000, 0.611, 0.276, 1.091, 0.978, 0.804, 0.208, -0.135]
P_O, P_S = 39, [39, 35, 36]


def test_scalability_of_table_1() -> None:
    found = [
        spi.scalability([p], [p_more], n=n, m=more - n).value
        for (n, p), (more, p_more) in pairwise(TABLE_I.items())
    ]
    assert [round(s, 3) for s in found] == S
    # Claims follow from strict inequalities: S = 1 at 5 -> 10 is not superlinear.
    assert [n for n, s in zip(TABLE_I, found) if s > 1] == [30]


@pytest.mark.parametrize(
    ("p_f", "ft", "r"),
    [
        ([41, 38, 35], [0.051, 0.077, -0.026], [0.091, 0.054, 0.017]),
        ([40, 41, 35], [0.026, 0.154, -0.026], [0.066, 0.131, 0.017]),
        ([40, 41, 40], [0.026, 0.154, 0.103], [0.066, 0.131, 0.146]),
        ([39, 15, 12], [0.0, -0.513, -0.615], [0.040, -0.535, -0.572]),
    ],
)
def test_fault_tolerance_and_robustness_of_table_2(
    p_f: list[int], ft: list[float], r: list[float]
) -> None:
    for m, p, p_s, asked_ft, asked_r in zip((1, 2, 3), p_f, P_S, ft, r):
        found = spi.fault_tolerance([P_O], [p], [p_s], n=25, m=m).value
        assert round(found, 3) == asked_ft
        assert (found > 0) == (asked_ft > 0)  # FT = 0 of FM4 at m = 1 is not tolerant
        assert round(spi.robustness([P_O], [p], n=25, m=m).value, 3) == asked_r


@pytest.mark.parametrize(
    ("x_o", "x_new", "p_o", "p_new", "expected"),
    [
        (0.5, 1.0, 47, 41, 0.872),
        (0.5, 1.5, 47, 21, 0.723),
        (5.0, 15.0, 47, 21, 0.723),  # widths may be multiples or metres: A is a ratio in x
        (0.5, 2.0, 47, 8, 0.723),
        (0.2, 0.15, 41, 37, 0.610),
        (0.2, 0.10, 41, 26, 0.268),
        (0.2, 0.05, 41, 16, 0.187),
        (60, 70, 44, 31, -0.773),
    ],
)
def test_adaptability_of_table_3(
    x_o: float, x_new: float, p_o: int, p_new: int, expected: float
) -> None:
    assert round(spi.adaptability([p_o], [p_new], x_o=x_o, x_new=x_new).value, 3) == expected


def test_adaptability_uses_the_size_of_the_change_only() -> None:
    up, down, negative = (
        spi.adaptability(P, LESS, x_o=x_o, x_new=x_new)
        for x_o, x_new in ((10, 15), (10, 5), (-10, -15))
    )
    assert up.value < 1
    assert (up.value, up.low, up.high) == (down.value, down.low, down.high)
    assert up == negative


@over_indicators
def test_one_seed_gives_the_value_and_nothing_else(name: str) -> None:
    found = INDICATORS[name]([39], [35], **({"p_s": [30]} if name == "FT" else {}))
    assert (found.verdict, found.flags) == ("inconclusive", ("single_seed",))
    assert (found.n_seeds, found.threshold, found.mean_denominator) == (1, 0.0, 39)
    nothing = ("low", "high", "p_value", "probability", "difference_sd", "degrees_of_freedom")
    assert {getattr(found, field) for field in (*nothing, "pairing_correlation")} == {None}


def test_an_estimate_describes_its_input() -> None:
    r = spi.robustness(P, LESS, n=25, m=2, threshold=0.1, confidence=0.9)
    assert (r.indicator, r.threshold, r.confidence, r.n_seeds, r.paired) == ("R", 0.1, 0.9, 4, True)
    assert r.pairing_correlation == pytest.approx(np.corrcoef(P, LESS)[0, 1])
    assert (r.mean_denominator, r.degrees_of_freedom) == (35.75, 3)
    d = np.array(LESS) - P - (0.1 - 2 / 25) * np.array(P)
    assert r.difference_sd == pytest.approx(d.std(ddof=1))
    ft = spi.fault_tolerance(P, LESS, P[::-1])
    assert ft.pairing_correlation == pytest.approx(np.corrcoef(LESS, P[::-1])[0, 1])


@over_indicators
@pytest.mark.parametrize(
    ("bad", "message"),
    [
        ([], "is empty"),
        ([[1.0, 2.0]], r"shape \(1, 2\)"),
        ([3.0, float("nan"), 1.0, 1.0], r"\[1\] = nan: should be finite"),
        ([float("inf"), 3.0, 1.0, 1.0], r"\[0\] = inf: should be finite"),
        ([3.0, 1.0, -2.0, 1.0], r"\[2\] = -2: should not be negative"),
        (["many", 1, 2, 3], "should be an array of numbers"),
    ],
)
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
    undefined: list[tuple[Any, dict[str, Any], str]] = [
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
        (spi.robustness, {"n": 25, "m": 0}, "m = 0: should be at least 1"),
        (spi.scalability, {"n": 25, "m": 0}, "m = 0: should be at least 1"),
        (spi.scalability, {"n": 0, "m": 1}, "n = 0: should be at least 1"),
        (spi.scalability, {"n": 25, "m": 1.5}, "m = 1.5: should be a whole number"),
    ]
    for indicator, arguments, message in undefined:
        with pytest.raises(IndicatorError, match=message):
            indicator(P, P, **arguments)
    assert spi.robustness(P, P, n=25, m=25).value == 1.0
    assert spi.fault_tolerance(P, P, P, n=25, m=24).value == 0


def waits(n: int) -> np.ndarray:
    """Return exponential differences, whose g is nearly 2, far beyond chance; 25 g^2 is 90."""
    return np.log((np.arange(n) + 0.5) / n)


@pytest.mark.parametrize(
    ("difference", "skewed"),
    [
        # g = 1.341 and 1.439; the standard error of ten is .687 (Cramer), and Cochran's limit .632.
        ([-1, 1, -1, 1, -1, 1, -1, 1, 0, 4.1], False),
        ([-1, 1, -1, 1, -1, 1, -1, 1, 0, 4.3], True),
        (waits(60), True),
        (waits(200), False),
    ],
)
def test_differences_are_skewed_beyond_chance_and_beyond_cochrans_rule(
    difference: Any, skewed: bool
) -> None:
    p_o = np.full(len(difference), 40.0)
    assert ("skewed" in spi.robustness(p_o, p_o + difference, n=25, m=1).flags) == skewed


MANY = np.array([59.9, 60.0, 59.8, 60.0, 59.8])
HALF = np.array([30.0, 28, 33, 31, 29])
FEWER = np.array([40.0, 40.3, 39.7, 40.1, 39.9])
GREATER = np.array([47.1, 46.9, 47.0, 47.2, 46.8])


@pytest.mark.parametrize(
    ("name", "samples", "threshold", "saturated", "verdict"),
    [
        ("R", (MANY, HALF), 0, ("p_o",), "refuted"),  # the true P_o is larger still
        ("R", (MANY, HALF), 0, ("p_f",), "inconclusive"),  # the true P_F may be as large as P_o
        ("R", (HALF, MANY), 0, ("p_f",), "supported"),
        ("R", (HALF, MANY), 0, ("p_o",), "inconclusive"),
        ("R", (HALF, MANY), 0, ("p_o", "p_f"), "inconclusive"),
        ("R", (MANY, HALF), 0, ("p_o", "p_f"), "inconclusive"),
        # Of a true P_o of 80 the loss is but .086; of a larger P_S it is larger still.
        ("FT", (MANY, FEWER, GREATER), -0.1, ("p_o",), "inconclusive"),
        ("FT", (MANY, FEWER, GREATER), -0.1, ("p_s",), "refuted"),
        ("FT", (MANY, FEWER, GREATER), -0.1, ("p_f",), "inconclusive"),
        # The sign of FT does not depend on P_o.
        ("FT", (MANY, FEWER, GREATER), 0.0, ("p_o",), "refuted"),
        ("FT", (MANY, GREATER, FEWER), 0.0, ("p_o",), "supported"),
        ("FT", (MANY, GREATER, FEWER), 0.1, ("p_o",), "inconclusive"),
        ("FT", (MANY, FEWER, GREATER), 0.1, ("p_o",), "refuted"),
        ("FT", (MANY, GREATER, FEWER), -0.1, ("p_o",), "supported"),
        # x trebles, so that A = (P_new/P_o - 1)/2 + 1 is above 0 whatever P_o is.
        ("A", (MANY, FEWER), 0.0, ("p_o",), "supported"),
        ("A", (FEWER, MANY), 1.0, ("p_o",), "inconclusive"),
    ],
)
def test_a_cap_blocks_the_side_on_which_it_can_move_the_indicator(
    name: str, samples: Any, threshold: float, saturated: tuple[str, ...], verdict: str
) -> None:
    x: dict[str, float] = {"x_new": 30} if name == "A" else {}
    found = INDICATORS[name](*samples, threshold=threshold, saturated=saturated, **x)
    assert (found.verdict, *spi.adjust([found])) == (verdict, verdict)
    assert ("capped" in found.flags, found.p_value == 1.0) == ((verdict == "inconclusive",) * 2)


def test_the_same_runs_have_an_exact_value_that_is_no_evidence() -> None:
    r = spi.robustness(MANY, MANY, n=25, m=2, identical=True)
    assert (r.value, r.low, r.high) == (0.08, 0.08, 0.08)
    assert (r.verdict, r.answer, r.p_value) == ("inconclusive", "supported", None)
    assert r.flags == ("identical",)
    assert spi.relative_change(MANY, MANY, identical=True).answer == "refuted"  # 0 is not above 0
    assert spi.relative_change(MANY, MANY, identical=True, threshold=-0.1).answer == "supported"
    with pytest.raises(IndicatorError, match="identical = True, but p_f and p_o differ"):
        spi.robustness(MANY, HALF, n=25, m=2, identical=True)
