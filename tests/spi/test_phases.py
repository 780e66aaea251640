"""Two phases and the critical size, on runs whose phases are known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from swarm_logistics_env import spi
from verification.phase_errors import CHOSEN, HELD_OUT, SIZES, Growth, coverage, share_named

# Those that come nearest to the level, and those that exceeded it before ties were spread.
WORST = (
    "Poisson 0.4",
    "Poisson 1 in tens",
    "Binomial(10, .9)",
    "80 % zero, else Poisson 2",
    "50 % zero, else flat",
    "6 maps, spread 10, scatter 1",
    "100 - Exp(15)",
    "60 % zero, else flat",
    "mean 3, most zero",
    "mostly capped shares",
)


# `python -m verification.phase_errors` draws 400 sets of each, of all generators.
@pytest.mark.parametrize("kind", WORST)
def test_one_phase_is_seldom_taken_for_two(kind: str) -> None:
    draw = {**CHOSEN, **HELD_OUT}[kind]
    # 5 % are allowed; more than 12 % come by chance in .1 % of tests.
    assert share_named(draw, 20, sets=100) <= 0.12


def test_two_phases_are_named_with_the_p_between_them() -> None:
    rng = np.random.default_rng(0)
    half = np.concatenate([rng.poisson(20, 30), rng.poisson(60, 30)])
    phases = spi.two_phases(half)
    assert phases.boundary is not None
    assert half[:30].max() < phases.boundary < half[30:].min()
    assert phases.share_low == 0.5
    few = np.concatenate([rng.uniform(10, 40, 12), rng.normal(80, 2, 116)])
    phases = spi.two_phases(few)
    assert phases.boundary is not None
    assert 40 < phases.boundary < 76
    assert phases.p_value < 1e-3


@pytest.mark.parametrize(
    ("runs", "p_value", "boundary", "share_low"),
    [
        ([*range(10, 20), *range(40, 50)], 2 / 2_001, 29.5, 0.5),
        ([*range(10, 20), *[40, 41] * 5], 2 / 2_001, 29.3, 0.5),
        ([80 - 0.1 * k for k in range(40)] + [20, 21, 22, 90], 0.276143, None, 0.0),
        (
            [80 - 0.1 * k for k in range(40)] + [20, 21, 22, 23, 24, 25, 90],
            0.00487566,
            72.4625,
            6 / 47,
        ),
        ([38, 40, 41, 41, 42, 43, 44, 44, 45, 46, 47, 48, 50, 52, 55], 1.0, None, 0.0),
    ],
)
def test_six_low_runs_of_47_are_a_phase_and_three_of_44_are_chance(
    runs: list[float], p_value: float, boundary: float | None, share_low: float
) -> None:
    phases = spi.two_phases(runs)
    assert phases.p_value == pytest.approx(p_value, rel=1e-3)
    assert phases.boundary == pytest.approx(boundary)
    assert phases.share_low == pytest.approx(share_low)
    assert not phases.untestable


def test_a_phase_that_lost_less_than_a_quarter_has_not_collapsed() -> None:
    rng = np.random.default_rng(0)
    slower = np.concatenate([rng.normal(80, 2, 30), rng.normal(100, 2, 30)])
    assert spi.two_phases(slower) == spi.Phases(1.0, None)


@pytest.mark.parametrize(
    ("runs", "reason"),
    [
        ([1.0] * 30, "fewer than 10 runs lie below the largest P"),
        ([3.0, 9.0] * 4, "fewer than 10 runs lie below the largest P"),
        ([*range(10)], "fewer than 10 runs lie below the largest P"),
        ([0.0] * 29 + [5.0], "counts are too small"),
        ([0.0] * 36 + [1.0] * 17 + [2.0] * 7, "counts are too small"),
        ([0.0] * 36 + [0.1] * 17 + [0.1 + 0.2] * 3 + [0.3] * 4, "counts are too small"),
    ],
)
def test_what_cannot_show_two_phases_is_untestable_and_says_why(
    runs: list[float], reason: str
) -> None:
    phases = spi.two_phases(runs)
    assert (phases.p_value, phases.boundary) == (1.0, None)
    assert phases.untestable.startswith(reason)
    assert spi.collapsed_runs({25: runs}) is None
    assert not spi.two_phases([*range(11)]).untestable


def test_the_planted_critical_size_is_covered() -> None:
    # 30 studies of each there.
    shares = coverage(60, Growth(8.0), studies=12)
    assert shares.named > 0.8
    assert shares.missed <= 0.17


def test_a_share_that_levels_off_gives_no_interval() -> None:
    assert coverage(60, Growth(8.0, ceiling=0.7), studies=5).with_interval == 0.0


def test_no_size_with_two_phases_tells_no_collapse() -> None:
    rng = np.random.default_rng(2)
    assert spi.collapsed_runs({n: rng.poisson(4 * n, 40) for n in SIZES}) is None


def test_the_clearest_size_tells_which_runs_of_the_others_collapsed() -> None:
    """P grows in proportion to N; who has less than two thirds of its size's good P collapsed."""
    rng = np.random.default_rng(0)

    def runs(n_good: int, good: float, n_low: int, low: float) -> np.ndarray:
        return np.concatenate([rng.normal(good, 0.5, n_good), rng.normal(low, 0.5, n_low)])

    by_size = {
        10: np.append(runs(36, 30.0, 3, 17.0), 22.0),
        20: runs(20, 60.0, 20, 20.0),
        40: np.append(runs(10, 120.0, 29, 77.0), 83.0),
    }
    assert spi.collapsed_runs(by_size) == {10: 3, 20: 20, 40: 29}


def test_without_a_smaller_size_larger_ones_should_deliver_as_much_as_the_clearest() -> None:
    rng = np.random.default_rng(0)
    clearest = np.concatenate([rng.normal(60.0, 0.5, 20), rng.normal(20.0, 0.5, 20)])
    larger = np.concatenate([rng.normal(62.0, 3.0, 36), [38.0, 39.0, 41.0, 42.0]])
    assert spi.collapsed_runs({10: clearest, 20: larger}) == {10: 20, 20: 2}


def test_the_critical_size_lies_where_half_collapse() -> None:
    size = spi.critical_size([10, 14, 20, 28, 40], [0, 0, 15, 30, 30], [30] * 5)
    assert size.value == pytest.approx(20.0, rel=0.03)
    assert size.low is not None
    assert size.high is not None
    assert (size.low, size.high) == pytest.approx((17.34, 22.91), abs=0.02)
    six = spi.critical_size([10, 14, 20, 28, 40, 60], [0, 1, 3, 20, 29, 30], [30] * 6, 0.8)
    assert six == pytest.approx((25.83881, 22.77087, 29.38953), rel=1e-5)
    # Half may never collapse where the share rises as slowly as this, or sizes are so few.
    scattered = spi.critical_size([10, 14, 20, 28, 40], [3, 12, 9, 25, 28], [30] * 5)
    assert scattered == pytest.approx((24.04182, 0.0, math.inf), rel=1e-5)
    assert spi.critical_size([10, 20, 40], [1, 15, 29], [30] * 3)[1:] == (0.0, math.inf)
    # Where few of the runs collapse at every size, nothing bounds it.
    assert spi.critical_size([10, 20], [0, 3], [30, 30])[1:] == (0.0, math.inf)
    assert spi.critical_size([10, 20], [0, 1], [30, 30])[1:] == (0.0, math.inf)
    for counts in ([0, 0], [30, 30], [15]):
        with pytest.raises(spi.IndicatorError, match="should be some of the runs, not all"):
            spi.critical_size([10, 20][: len(counts)], counts, [30, 30][: len(counts)])
