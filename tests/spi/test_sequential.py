from __future__ import annotations

import numpy as np
import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.spi import IndicatorError


@pytest.mark.parametrize(
    ("looks", "boundaries"),
    [
        ([20], [1.960]),
        ([10, 20], [2.963, 1.969]),
        ([5, 10, 15], [3.710, 2.511, 1.993]),
        ([5, 10, 15, 20, 25], [4.877, 3.357, 2.680, 2.290, 2.031]),
    ],
)
def test_published_boundaries(looks: list[int], boundaries: list[float]) -> None:
    """Lan and DeMets' O'Brien-Fleming type boundaries, two-sided .05 (Jennison, Turnbull 2000)."""
    from scipy.stats import norm

    assert [norm.isf(p / 2) for p in spi.look_alphas(looks)] == pytest.approx(boundaries, abs=1e-3)


def test_looks_keep_the_error_that_peeking_inflates() -> None:
    looks = (5, 12, 20)
    steps = np.random.default_rng(7).normal(size=(100_000, 20)).cumsum(axis=1)
    z = np.abs(steps[:, [look - 1 for look in looks]] / np.sqrt(looks))
    from scipy.special import ndtr

    p = 2 * ndtr(-z)
    declared = (p < np.array(spi.look_alphas(looks))).any(axis=1).mean()
    assert declared == pytest.approx(0.05, abs=0.003)
    assert (p < 0.05).any(axis=1).mean() > 0.1


def test_alphas_rise_and_the_last_is_nearly_the_whole() -> None:
    alphas = spi.look_alphas((10, 20, 40), alpha=0.1)
    assert list(alphas) == sorted(alphas)
    assert 0.09 < alphas[-1] < 0.1


def test_a_very_early_look_practically_never_stops() -> None:
    assert spi.look_alphas((1, 1_000))[0] < 1e-15


@pytest.mark.parametrize("looks", [(), (0, 10), (10, 10), (20, 10)])
def test_looks_must_rise(looks: tuple[int, ...]) -> None:
    with pytest.raises(IndicatorError, match="look"):
        spi.look_alphas(looks)


def test_alpha_out_of_range() -> None:
    with pytest.raises(IndicatorError, match="alpha = 5"):
        spi.look_alphas((10,), alpha=5)


def test_an_unknown_spending_is_refused() -> None:
    with pytest.raises(IndicatorError, match="spending = 'pocock': should be one of obrien"):
        spi.look_alphas([10, 20], spending="pocock")  # type: ignore[arg-type]
