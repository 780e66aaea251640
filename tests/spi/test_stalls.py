"""Stalled runs: their share, and verdicts that hold their level where none was seen."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.spi import IndicatorError
from swarm_logistics_env.studies.specification import looks_up_to
from verification.verdict_errors import share_equivalent, wrong_verdicts

rng = np.random.default_rng(2)
STEADY = rng.normal(300.0, 6.0, 20).round()
FAULTY = (STEADY * 0.97 + rng.normal(0.0, 3.0, 20)).round()


def test_a_run_below_a_quarter_of_the_median_stalled() -> None:
    assert spi.share_stalled([40, 41, 39, 9]) == 0.25
    assert spi.share_stalled([40, 40, 40, 10]) == 0.0
    # Where most runs deliver nothing, none is an exception.
    assert spi.share_stalled([0, 0, 0, 40]) == 0.0
    assert spi.share_stalled(np.random.default_rng(0).poisson(39, 10_000)) == 0.0
    with pytest.raises(IndicatorError, match="p is empty"):
        spi.share_stalled([])


def test_a_small_effect_waits_for_the_seeds_that_would_show_a_stall() -> None:
    few: Any = spi.robustness(STEADY, FAULTY, n=25, m=2)
    assert few.low > 0.0
    assert (few.verdict, "hidden_stalls" in few.flags) == ("inconclusive", True)
    needed = spi.seeds_against_stalls(few) or 0
    # Of so many seeds, none stalls in 2 % of studies if the share takes R down to 0.
    share = few.value * few.mean_denominator / FAULTY.mean()
    assert (1 - share) ** needed < 0.02 < (1 - share) ** (needed - 1)
    times = -(-2 * needed // 20)
    many = spi.robustness(np.tile(STEADY, times), np.tile(FAULTY, times), n=25, m=2)
    assert (many.verdict, many.flags) == ("supported", ())
    assert spi.seeds_against_stalls(many) is None


def test_clear_effects_keep_their_verdicts_and_so_do_those_that_a_stall_would_add_to() -> None:
    assert spi.robustness(STEADY, STEADY[::-1] * 0.4, n=25, m=2).verdict == "refuted"
    assert spi.scalability(STEADY, STEADY[::-1] * 1.8, n=25, m=25).verdict == "supported"
    # P_F could only be lower still; P_o would have to fall by a third.
    assert spi.relative_change(STEADY, FAULTY - 100.0).verdict == "refuted"
    assert spi.relative_change(STEADY, FAULTY).verdict == "inconclusive"
    # Where a run stalled, the spread tells.
    r = spi.robustness(STEADY, np.where(np.arange(20) == 3, 2.0, FAULTY), n=25, m=2)
    assert (r.at_stake[0], r.verdict, "hidden_stalls" in r.flags) == (0.0, "inconclusive", False)


# `python -m verification.verdict_errors` simulates 3,000 studies of each.
@pytest.mark.parametrize(("stalled", "n"), [("3% stall", 30), ("5% stall", 20), ("10% stall", 10)])
def test_verdicts_hold_their_level_though_some_runs_stall(stalled: str, n: int) -> None:
    wrong = wrong_verdicts(stalled, [n], 600)
    assert max(wrong.above, wrong.below) <= 0.06
    assert share_equivalent(stalled, n, -0.1, 600) <= 0.06


def test_without_the_hidden_stalls_they_would_not() -> None:
    assert wrong_verdicts("5% stall", [20], 600, only_seen=True).above > 0.12
    assert share_equivalent("5% stall", 20, -0.1, 600, only_seen=True) > 0.12
    # Looks until it is clear hold their level too.
    assert wrong_verdicts("5% stall", looks_up_to(60), 600).above <= 0.06
