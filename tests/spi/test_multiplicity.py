"""Families of verdicts, looks at a growing study, and the fault budget."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from scipy.special import ndtr

from swarm_logistics_env import spi


def test_holm_by_hand() -> None:
    # sorted .005 .01 .03 .04 times 4 3 2 1 = .02 .03 .06 .04, made monotone: .02 .03 .06 .06
    assert spi.holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert spi.holm([0.6, 0.5]) == pytest.approx([1.0, 1.0])
    assert spi.holm([]).size == 0
    assert spi.holm([0.0, 1.0, 0.2]).tolist() == pytest.approx([0.0, 1.0, 0.4])


def estimate(p_value: float | None, probability: float | None = None, **more: Any) -> spi.Estimate:
    blank = spi.robustness([39], [35], n=25, m=1)
    return dataclasses.replace(blank, p_value=p_value, probability=probability, **more)


P_O = np.array([40.0, 38, 41, 39, 42])
ROBUST = spi.robustness(P_O, [40.0, 39, 41, 38, 42], n=25, m=2)
BROKEN = spi.robustness(P_O, [12.0, 15, 10, 11, 14], n=25, m=2)
SAME = spi.robustness(P_O, P_O, n=25, m=1, identical=True)
UNCLEAR = spi.robustness(P_O, [45.0, 20, 38, 50, 30], n=25, m=2)


def test_adjusted_verdicts_keep_their_direction_and_what_is_untested_counts() -> None:
    family = [estimate(0.001, 0.9995), estimate(0.02, 0.01), estimate(0.03, 0.985)]
    assert spi.adjust(family) == ("supported", "refuted", "supported")
    assert spi.adjust([*family, estimate(None)]) == ("supported", *["open"] * 3)


def test_a_p_of_just_the_error_decides_nothing() -> None:
    error = 1.0 - 0.95
    at_it, below_it = estimate(error, 0.9), estimate(0.99 * error, 0.9)
    assert (at_it.verdict, below_it.verdict) == ("open", "supported")


def test_identical_runs_stand_outside_the_family() -> None:
    assert spi.adjusted_p_values([SAME, ROBUST, SAME]) == (None, ROBUST.p_value, None)
    assert spi.adjust([SAME, ROBUST]) == ("open", "supported")


@pytest.mark.parametrize(
    ("by_m", "robots", "limit"),
    [
        ({1: ROBUST, 2: BROKEN, 3: ROBUST}, 1, 2),  # supported again at 3 does not count
        ({1: UNCLEAR, 2: ROBUST}, 0, 1),  # nor does a verdict that is only not refuted
        ({3: ROBUST, 1: ROBUST, 2: ROBUST}, 3, None),  # all supported: a lower bound
        ({1: ROBUST, 3: ROBUST}, 1, 2),  # untested in between
        ({1: SAME, 2: ROBUST, 3: BROKEN}, 2, 3),  # the same runs: exactly within it
    ],
)
def test_the_first_unsupported_number_ends_the_fault_budget(
    by_m: dict[int, spi.Estimate], robots: int, limit: int | None
) -> None:
    verdicts = [each.verdict for each in (ROBUST, BROKEN, UNCLEAR)]
    assert verdicts == ["supported", "refuted", "open"]
    assert spi.fault_budget(by_m) == (robots, limit)


def test_looks_keep_the_error_that_peeking_inflates() -> None:
    looks = (5, 12, 20)
    steps = np.random.default_rng(7).normal(size=(100_000, 20)).cumsum(axis=1)
    p = 2 * ndtr(-np.abs(steps[:, [look - 1 for look in looks]] / np.sqrt(looks)))
    assert (p < 0.05).any(axis=1).mean() > 0.1
    alphas = spi.look_alphas(looks)
    crossed = np.logical_or.accumulate(p < np.array(alphas), axis=1).mean(axis=0)
    # Alpha is spent in proportion to the seeds.
    assert crossed == pytest.approx(0.05 * np.array(looks) / 20, abs=0.002)
    assert alphas[0] == pytest.approx(0.05 * 5 / 20)  # nothing is spent before
    assert alphas == pytest.approx((0.0125, 0.02082155, 0.02961274), rel=1e-6)
    four = spi.look_alphas((10, 20, 40, 60), alpha=0.1)
    assert four == pytest.approx((0.1 / 6, 0.02180381, 0.04381398, 0.05895257), rel=1e-6)
    assert spi.look_alphas([20], alpha=0.1) == pytest.approx((0.1,))
    assert spi.look_alphas((1, 2), alpha=1e-30)[0] < 1e-15  # beyond the grid


@pytest.mark.parametrize(
    ("function", "argument", "words"),
    [
        (spi.holm, [0.5, 1.1], "p_values"),
        (spi.holm, [float("nan")], "p_values"),
        (spi.adjust, [estimate(0.01, 0.9), estimate(0.01, 0.9, confidence=0.9)], "confidence"),
        (spi.fault_budget, {}, "is empty"),
        (spi.fault_budget, {0: ROBUST}, "m = 0"),
        (spi.fault_budget, {1: spi.relative_change(P_O, P_O)}, "indicator at m = 1 is change"),
        (spi.holm, [[0.5]], "p_values"),
        (spi.look_alphas, (20, 10), "looks"),
        (spi.look_alphas, (20, 20), "looks"),
        (spi.look_alphas, (), "looks"),
        (spi.look_alphas, (0, 10), "look = 0: should be at least 1"),
        (lambda alpha: spi.look_alphas((10,), alpha=alpha), 5, "alpha = 5"),
    ],
)
def test_what_cannot_be_is_named(function: Any, argument: Any, words: str) -> None:
    with pytest.raises(spi.IndicatorError, match=words):
        function(argument)
