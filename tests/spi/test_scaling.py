from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.spi import IndicatorError
from swarm_logistics_env.spi.scaling_laws import (
    CURVES,
    Law,
    peak_of,
    shapes_with_peak_at,
    sharpness_of,
)

SIZES = np.array([5, 10, 20, 30, 40, 50, 60, 100, 150])
TABLE_I = np.array([9, 18, 29, 33, 45, 56, 65, 74, 69])


def test_golden_values_of_table_1_weighted() -> None:
    usl = spi.fit_scaling(SIZES, TABLE_I, law="usl")
    assert usl.weighting == "1/P"
    assert usl.peak is not None
    g, a, b = usl.parameters.values()
    assert (round(g, 3), round(a, 5), round(b, 7)) == (1.613, 0.00636, 6.46e-5)
    assert round(usl.peak, 1) == 124.0
    exponential = spi.fit_scaling(SIZES, TABLE_I, law="power_exponential")
    assert exponential.peak is not None
    k, p, q = exponential.parameters.values()
    assert (round(k, 3), round(p, 3), round(q, 5)) == (1.937, 0.950, 0.00769)
    assert round(exponential.peak, 1) == 123.6


def test_golden_values_of_table_1_unweighted() -> None:
    peaks = {
        law: spi.fit_scaling(SIZES, TABLE_I, law=law, weighting="none").peak
        for law in ("usl", "power_exponential")
    }
    assert peaks["usl"] == pytest.approx(108.3, abs=0.05)
    assert peaks["power_exponential"] == pytest.approx(113.8, abs=0.05)


@pytest.mark.parametrize("law", ["usl", "power_exponential"])
@pytest.mark.parametrize("weighting", ["1/P", "none"])
def test_no_other_parameters_fit_better(law: Law, weighting: Any) -> None:
    fit = spi.fit_scaling(SIZES, TABLE_I, law=law, weighting=weighting)
    weights = 1 / TABLE_I if weighting == "1/P" else np.ones(9)

    def residual_sum(predicted: np.ndarray) -> float:
        return float((weights * (TABLE_I - predicted) ** 2).sum())

    assert fit.residual_sum == pytest.approx(residual_sum(fit.predict(SIZES)))
    x, y, z = fit.parameters.values()
    for factor in (0.999, 1.001):
        for x2, y2, z2 in ((x * factor, y, z), (x, y * factor, z), (x, y, z * factor)):
            if law == "usl":
                moved = x2 * SIZES / (1 + y2 * (SIZES - 1) + z2 * SIZES * (SIZES - 1))
            else:
                moved = x2 * SIZES**y2 * np.exp(-z2 * SIZES)
            assert residual_sum(moved) > fit.residual_sum


@pytest.mark.parametrize(
    ("law", "truth", "peak"),
    [
        ("usl", (2.0, 0.02, 1e-4), math.sqrt(0.98 / 1e-4)),
        ("power_exponential", (1.5, 1.0, 0.01), 100.0),
    ],
)
def test_an_exact_law_is_recovered(law: Law, truth: tuple[float, ...], peak: float) -> None:
    n = SIZES.astype(float)
    x, y, z = truth
    p = (
        x * n / (1 + y * (n - 1) + z * n * (n - 1))
        if law == "usl"
        else x * n**y * np.exp(-z * n)
    )  # fmt: skip
    fit = spi.fit_scaling(n, p, law=law)
    assert tuple(fit.parameters.values()) == pytest.approx(truth, rel=1e-5)
    assert list(fit.parameters) == (["g", "a", "b"] if law == "usl" else ["k", "p", "q"])
    assert fit.peak == pytest.approx(peak, rel=1e-5)
    assert (fit.peak_low, fit.peak_high) == pytest.approx((peak, peak), rel=1e-3)
    better, _ = spi.compare_scaling(n, p)
    assert better.law == law


@pytest.mark.parametrize(
    ("law", "parameters"),
    [("usl", [3.0, 0.02, 1e-3]), ("power_exponential", [1.2, 0.95, 0.0077])],
)
def test_a_curve_is_made_again_from_its_peak_and_sharpness(
    law: Law, parameters: list[float]
) -> None:
    fitted, n = np.array(parameters), SIZES.astype(np.float64)
    peak = peak_of(law, fitted)
    assert peak is not None
    sharpness = np.array([sharpness_of(law, fitted, peak)])
    factor = CURVES[law](fitted, n) / shapes_with_peak_at(law, peak, sharpness, n)[0]
    np.testing.assert_allclose(factor, factor[0], rtol=1e-9)


def test_the_interval_of_the_peak_covers() -> None:
    rng = np.random.default_rng(9)
    truth = 1.94 * SIZES**0.95 * np.exp(-0.0077 * SIZES)
    peak, held = 0.95 / 0.0077, 0
    for _ in range(150):
        noisy = np.maximum(1.0, truth + rng.normal(0, 0.4 * np.sqrt(truth)))
        fit = spi.fit_scaling(SIZES, noisy, law="power_exponential")
        assert fit.peak_low is not None
        assert fit.peak_high is not None
        assert fit.peak is not None
        assert fit.peak_low < fit.peak < fit.peak_high
        held += fit.peak_low <= peak <= fit.peak_high
    assert 0.89 <= held / 150 <= 0.99


def test_higher_confidence_widens_the_interval_of_the_peak() -> None:
    narrow = spi.fit_scaling(SIZES, TABLE_I, law="power_exponential", confidence=0.8)
    wide = spi.fit_scaling(SIZES, TABLE_I, law="power_exponential", confidence=0.95)
    assert None not in (wide.peak_low, narrow.peak_low, wide.peak_high, narrow.peak_high)
    assert wide.peak_low < narrow.peak_low < narrow.peak_high < wide.peak_high  # type: ignore[operator]


def test_table_1_sets_the_usl_no_upper_limit() -> None:
    # One size beyond the peak, within noise of the one before: the data cannot exclude saturation.
    fit = spi.fit_scaling(SIZES, TABLE_I, law="usl")
    assert fit.peak_low == pytest.approx(89.9, abs=0.5)
    assert fit.peak_high == math.inf


def test_where_no_size_is_excluded_the_limits_are_0_and_infinity() -> None:
    fit = spi.fit_scaling(SIZES, TABLE_I, law="usl", confidence=1 - 1e-7)
    assert (fit.peak_low, fit.peak_high) == (0.0, math.inf)


@pytest.mark.parametrize(
    ("sizes", "p"),
    [
        # N* a hair above one robot, P nearly the same at every size, and a fit that has a pole
        ([1, 2, 4, 8, 16], [9.999964, 9.091765, 6.897275, 4.49474, 2.623088]),
        (
            SIZES.tolist(),
            [40.0008, 40.0006, 39.9999, 40.001, 40.0012, 39.9997, 40.0001, 39.9985, 39.9993],
        ),
        ([1, 2, 4, 8, 16], [7.0, 98.0, 6.0, 4.0, 47.0]),
    ],
)
def test_the_interval_of_an_odd_peak_holds_it(sizes: list[int], p: list[float]) -> None:
    fit = spi.fit_scaling(sizes, p, law="usl")
    assert fit.peak is not None
    assert fit.peak_low is not None
    assert fit.peak_high is not None
    assert 0.0 <= fit.peak_low <= fit.peak <= fit.peak_high


@pytest.mark.parametrize(
    ("law", "p"),
    [
        ("usl", 2 * SIZES / (1 + 0.05 * (SIZES - 1) - 1e-4 * SIZES * (SIZES - 1))),
        ("power_exponential", 2 * SIZES**0.8 * np.exp(1e-3 * SIZES)),
        ("power_exponential", 60 * SIZES**-0.5 * np.exp(-1e-3 * SIZES)),
    ],
)
def test_growth_or_fall_without_end_has_no_peak(law: Law, p: np.ndarray) -> None:
    fit = spi.fit_scaling(SIZES, p, law=law)
    assert (fit.peak, fit.peak_low, fit.peak_high) == (None, None, None)


def test_aicc_by_hand_and_its_order() -> None:
    first, second = spi.compare_scaling(SIZES, TABLE_I)
    for fit in (first, second):
        assert fit.aicc == pytest.approx(9 * math.log(fit.residual_sum / 9) + 8 + 2 * 4 * 5 / 4)
    assert first.law == "power_exponential"
    assert first.aicc is not None
    assert second.aicc is not None
    assert first.aicc < second.aicc
    assert spi.fit_scaling(SIZES[:5], TABLE_I[:5]).aicc is None


def test_a_size_that_delivers_nothing_is_fitted_unweighted_only() -> None:
    p = np.array([0, 3, 8, 14, 18])
    with pytest.raises(IndicatorError, match='p holds 0 under weighting "1/P"'):
        spi.fit_scaling(SIZES[:5], p)
    for law in ("usl", "power_exponential"):
        fit = spi.fit_scaling(SIZES[:5], p, law=law, weighting="none")
        assert fit.residual_sum < 20


@pytest.mark.parametrize(
    ("sizes", "p", "options", "message"),
    [
        ([5, 10, 20, 30], [1, 2, 3], {}, "4 sizes, 3 performances"),
        ([5, 10, 20], [1, 2, 3], {}, "3 sizes: should be at least 4"),
        ([5, 5, 10, 20], [1, 2, 3, 4], {}, "each once"),
        ([0, 5, 10, 20], [1, 2, 3, 4], {}, "should be positive"),
        ([5, 10, 20, 30], [1, 2, -3, 4], {}, r"p\[2\] = -3"),
        ([5, 10, 20, 30], [0, 0, 0, 0], {"weighting": "none"}, "p = 0 at every size"),
        ([5, 10, 20, 30], [1, 2, 3, 4], {"weighting": "P"}, "weighting = 'P'"),
        ([5, 10, 20, 30], [1, 2, 3, 4], {"law": "linear"}, "law = 'linear'"),
        ([5, 10, 20, 30], [1, 2, 3, 4], {"confidence": 2}, "confidence = 2"),
    ],
)
def test_what_cannot_be_fitted_is_named(
    sizes: list[int], p: list[int], options: dict[str, Any], message: str
) -> None:
    with pytest.raises(IndicatorError, match=message):
        spi.fit_scaling(sizes, p, **options)
