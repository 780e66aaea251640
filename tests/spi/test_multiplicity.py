from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm_logistics_env import spi
from swarm_logistics_env.spi import IndicatorError


def test_holm_by_hand() -> None:
    # sorted .005 .01 .03 .04 times 4 3 2 1 = .02 .03 .06 .04, made monotone: .02 .03 .06 .06
    assert spi.holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert spi.holm([0.6, 0.5]) == pytest.approx([1.0, 1.0])
    assert spi.holm([0.2]) == pytest.approx([0.2])
    assert spi.holm([]).size == 0


@given(st.lists(st.floats(0, 1), min_size=1, max_size=20))
def test_holm_never_helps_and_is_never_worse_than_bonferroni(p: list[float]) -> None:
    adjusted = spi.holm(p)
    assert (adjusted >= np.array(p)).all()
    assert (adjusted <= np.minimum(1.0, np.array(p) * len(p) + 1e-15)).all()


@pytest.mark.parametrize("p", [[0.5, 1.1], [-0.1], [float("nan")], [[0.1, 0.2]], ["small"]])
def test_holm_names_what_is_no_p(p: Any) -> None:
    with pytest.raises(IndicatorError, match="p_values"):
        spi.holm(p)


def estimate(p_value: float | None, probability: float | None = None) -> spi.Estimate:
    blank = spi.robustness([39], [35], n=25, m=1)
    return dataclasses.replace(blank, p_value=p_value, probability=probability)


def test_adjusted_verdicts_keep_their_direction() -> None:
    family = [estimate(0.001, 0.9995), estimate(0.02, 0.01), estimate(0.03, 0.985)]
    assert spi.adjust(family) == ("supported", "refuted", "supported")
    assert spi.adjust([*family, estimate(0.9, 0.55)]) == (
        "supported", "inconclusive", "inconclusive", "inconclusive",
    )  # fmt: skip


def test_an_untested_member_counts_in_the_family() -> None:
    assert spi.adjust([estimate(0.04, 0.98)]) == ("supported",)
    assert spi.adjust([estimate(0.04, 0.98), estimate(None)]) == ("inconclusive", "inconclusive")


def test_one_family_has_one_confidence() -> None:
    other = dataclasses.replace(estimate(0.01, 0.99), confidence=0.9)
    with pytest.raises(IndicatorError, match="confidence"):
        spi.adjust([estimate(0.01, 0.99), other])
    assert spi.adjust([]) == ()


def test_identical_runs_stand_outside_the_family() -> None:
    p_o = np.array([40.0, 38, 41, 39, 42])
    close = spi.robustness(p_o, p_o + np.array([0, 1, -1, 1, 0]), n=25, m=1)
    same = spi.robustness(p_o, p_o, n=25, m=1, identical=True)
    assert spi.adjusted_p_values([same, close, same]) == (None, close.p_value, None)
    assert spi.adjust([same, close])[0] == "inconclusive"


def test_linear_looks_spend_alpha_in_proportion_to_the_seeds() -> None:
    from scipy.special import ndtr

    looks = (5, 12, 20)
    steps = np.random.default_rng(7).normal(size=(100_000, 20)).cumsum(axis=1)
    p = 2 * ndtr(-np.abs(steps[:, [look - 1 for look in looks]] / np.sqrt(looks)))
    alphas = spi.look_alphas(looks, spending="linear")
    crossed = np.logical_or.accumulate(p < np.array(alphas), axis=1).mean(axis=0)
    # Alpha is spent in proportion to the seeds.
    assert crossed == pytest.approx(0.05 * np.array(looks) / 20, abs=0.002)
    assert (p < 0.05).any(axis=1).mean() > 0.1
    assert alphas[0] == pytest.approx(0.05 * 5 / 20)
    assert spi.look_alphas((20,), alpha=0.1) == pytest.approx((0.1,))
