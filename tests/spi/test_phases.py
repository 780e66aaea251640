"""Two phases and the critical size, on runs whose phases are known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from swarm_logistics_env import spi
from verification.phase_errors import ONE_PHASE, SIZES, coverage, share_named


# `python -m verification.phase_errors` draws 4,000 sets of each.
@pytest.mark.parametrize("n", [12, 30, 128])
@pytest.mark.parametrize("kind", ONE_PHASE)
def test_one_phase_is_seldom_taken_for_two(kind: str, n: int) -> None:
    # 5 % are allowed; more than 8 % come by chance in .5 % of tests.
    assert share_named(ONE_PHASE[kind], n, sets=400) <= 0.08


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


@pytest.mark.parametrize("runs", [[1.0] * 30, [0.0] * 30, [3.0, 9.0] * 4, [0.0] * 29 + [5.0]])
def test_what_cannot_show_two_phases_shows_one(runs: list[float]) -> None:
    assert spi.two_phases(runs) == spi.Phases(1.0, None)


def test_the_planted_critical_size_is_covered() -> None:
    # 1,000 studies there.
    named_share, covered = coverage(60, 8.0, studies=100)
    assert named_share > 0.85
    assert covered >= 0.86  # .95 are expected; less than .86 by chance in .1 % of tests


def test_no_size_with_two_phases_tells_no_collapse() -> None:
    rng = np.random.default_rng(2)
    assert spi.collapsed_runs({n: rng.poisson(4 * n, 40) for n in SIZES}) is None


def test_the_critical_size_lies_where_half_collapse() -> None:
    size = spi.critical_size([10, 20, 40], [0, 15, 30], [30, 30, 30])
    assert size.value == pytest.approx(20.0, rel=0.02)
    assert size.low is not None
    assert size.high is not None
    assert 10.0 < size.low < 20.0 < size.high < 40.0
    # Where no size is beyond it, nothing bounds it from above.
    assert spi.critical_size([10, 20], [0, 3], [30, 30]).high == math.inf
    for counts in ([0, 0], [30, 30]):
        with pytest.raises(spi.IndicatorError, match="should be some of the runs, not all"):
            spi.critical_size([10, 20], counts, [30, 30])
