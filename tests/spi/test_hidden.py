"""Runs that stall and trainings that collapse: what is seen of them, and what may be hidden."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.stats import beta

from swarm_logistics_env import spi
from swarm_logistics_env.spi.hidden import (
    STALL_SHARE,
    collapsed,
    hidden_of,
    remainder_and_chance,
    stalls,
)
from swarm_logistics_env.study.questions.specification import looks_up_to
from verification.verdict_errors import over_trainings, share_equivalent, wrong_verdicts

rng = np.random.default_rng(2)
STEADY = rng.normal(300.0, 6.0, 20).round()
FAULTY = (STEADY * 0.965 + rng.normal(0.0, 3.0, 20)).round()
TRAINED_O = np.asarray(rng.poisson(300.0, (20, 6)), np.float64)
TRAINED_F = np.asarray(rng.poisson(300.0 * (1.3 - 3 / 25), (20, 6)), np.float64)


def test_a_run_below_a_quarter_of_the_median_stalled() -> None:
    assert spi.share_stalled([40, 41, 39, 9]) == 0.25
    assert spi.share_stalled([40, 40, 40, 10]) == 0.0
    # Where most runs deliver nothing, none is an exception.
    assert spi.share_stalled([0, 0, 0, 40]) == 0.0


def test_what_may_be_hidden_is_what_was_not_seen() -> None:
    none_seen = stalls(np.full(20, 40.0))
    assert (float(none_seen.seen), none_seen.of, none_seen.most) == (0.0, 20, STALL_SHARE)
    remainder, chance = remainder_and_chance(0.05, none_seen)
    assert (float(remainder), float(chance)) == pytest.approx((0.95, 1.25 * 0.95**20))
    # One of ten stalled: the assumed share is in the mean already.
    _, chance = remainder_and_chance(0.05, stalls(np.array([2.0, *[40.0] * 9])))
    assert chance == 0.0


def test_a_small_effect_waits_for_the_seeds_that_would_show_a_stall() -> None:
    few: Any = spi.robustness(STEADY[:6], FAULTY[:6], n=25, m=2)
    assert few.low > 0.0
    assert (few.verdict, "hidden_stalls" in few.flags) == ("open", True)
    p_values = f"p = {few.p_seen:.3g}, {few.p_value:.3g} with what these runs may hide"
    assert str(few).endswith(f"above 0: open (6 paired seeds, {p_values})")
    needed = spi.seeds_against_stalls(few) or 0
    assert needed > 6
    times = -(-needed // 6)
    many = spi.robustness(np.tile(STEADY[:6], times), np.tile(FAULTY[:6], times), n=25, m=2)
    assert (many.verdict, many.flags) == ("supported", ())
    assert spi.seeds_against_stalls(many) is None


def test_clear_effects_keep_their_verdicts_and_so_do_those_that_a_stall_would_add_to() -> None:
    assert spi.robustness(STEADY, STEADY[::-1] * 0.4, n=25, m=2).verdict == "refuted"
    # P_F could only be lower still; P_o would have to fall by a third.
    assert spi.relative_change(STEADY, FAULTY - 100.0).verdict == "refuted"
    # Where a run stalled, the spread tells.
    r = spi.robustness(STEADY, np.where(np.arange(20) == 3, 2.0, FAULTY), n=25, m=2)
    assert (r.verdict, "hidden_stalls" in r.flags) == ("open", False)


# `python -m verification.verdict_errors` simulates 2,000 studies of each.
@pytest.mark.parametrize("paired", [True, False])
@pytest.mark.parametrize("stalled", ["5% stall", "5% stall, P 39"])
def test_equivalence_holds_its_level_though_some_runs_stall(stalled: str, paired: bool) -> None:
    for n in (6, 10, 20):
        assert share_equivalent(stalled, n, -0.1, 800, paired=paired) <= 0.06
    # Of the runs seen alone they would err.
    assert share_equivalent("5% stall", 20, -0.1, 800, only_seen=True) > 0.2


@pytest.mark.parametrize("stalled", ["3% stall", "5% stall", "5% stall, P 39"])
def test_studies_until_clear_hold_their_level_though_some_runs_stall(stalled: str) -> None:
    wrong = wrong_verdicts(stalled, looks_up_to(60), 1_000)
    assert max(wrong.above, wrong.below) <= 0.035


@pytest.mark.parametrize(("k", "n", "upper"), [(0, 3, 0.63), (0, 5, 0.45), (0, 10, 0.26)])
def test_the_share_that_collapses_has_an_exact_limit(k: int, n: int, upper: float) -> None:
    none_collapsed = collapsed(np.full((n, 2), 40.0), np.full((n, 2), 40.0))
    assert none_collapsed[:2] == (k, n)
    assert none_collapsed.upper == pytest.approx(upper, abs=0.005)
    some = collapsed(np.array([[1.0]] + [[40.0]] * 9), np.full((10, 1), 40.0))
    assert some.upper == pytest.approx(beta.ppf(0.95, 2, 9))


def test_a_training_collapses_that_keeps_less_than_half_of_its_own_p() -> None:
    p_o, p_f = TRAINED_O.copy(), TRAINED_F.copy()
    p_f[3] *= 0.4
    p_o[5] *= 0.3  # one that is bad in both conditions did not collapse under the fault
    p_f[5] *= 0.3
    r = spi.robustness(p_o, p_f, n=25, m=3)
    assert r.collapsed == spi.Collapsed(1, 20, float(beta.ppf(0.95, 2, 19)))
    assert "1 of 20 collapsed, at most 22 %" in str(r)
    assert spi.robustness(p_o[0], p_f[0], n=25, m=3).collapsed is None
    # Where all do, none stands out, and all are counted.
    assert spi.robustness(p_o, 0.1 * p_f, n=25, m=3).collapsed == spi.Collapsed(20, 20, 1.0)


def test_of_many_studies_each_has_its_own_median_of_what_trainings_keep() -> None:
    shares = np.array([[0.9, 0.9, 0.9, 0.3], [0.4, 0.4, 0.4, 0.1], [0.9, 0.5, 0.46, 0.44]])
    p_o = np.full((3, 4, 2), 40.0)
    of_all = hidden_of([shares[..., None] * p_o, p_o], trainings=True)[0]
    assert of_all is not None
    assert (of_all.seen.tolist(), of_all.of, of_all.most) == ([1.0, 1.0, 0.0], 4, 1.0)
    p_o[0, 0] = 0.0  # which counts as one that keeps all
    (of_first, _) = hidden_of([shares[:1, :, None] * 40.0 + p_o[:1] * 0.0, p_o[:1]], trainings=True)
    assert of_first is not None
    assert of_first.seen.tolist() == [1.0]


def test_only_of_two_recipes_the_reference_collapses_alone() -> None:
    samples = [TRAINED_F, TRAINED_O]
    assert hidden_of(samples, trainings=True)[1] is None
    assert hidden_of(samples, trainings=True, reference_too=True)[1] is not None
    # A script is the same beside every training: it does not collapse.
    script = np.tile(TRAINED_O[0], (20, 1))
    assert hidden_of([TRAINED_F, script], trainings=True, reference_too=True)[1] is None


@pytest.mark.parametrize(("k", "verdict"), [(5, "open"), (20, "supported")])
def test_few_trainings_may_hide_collapses(k: int, verdict: str) -> None:
    r: Any = spi.robustness(TRAINED_O[:k], TRAINED_F[:k], n=25, m=3)
    assert r.low > 0.2
    assert (r.verdict, "hidden_collapses" in r.flags) == (verdict, k == 5)
    needed = spi.trainings_against_collapses(r)
    assert (needed is None) == (k == 20)
    assert k == 20 or 10 < (needed or 0) < 20
    # Collapses under the fault would only make it worse.
    worse = spi.robustness(TRAINED_O[:k], TRAINED_F[:k] * 0.5, n=25, m=3)
    assert worse.verdict == "refuted"


@pytest.mark.parametrize("k", [5, 10, 20])
@pytest.mark.parametrize("world", ["1 in 5 collapses", "1 in 10 collapses", "sd .1, R sd .1"])
def test_verdicts_over_trainings_hold_their_level_and_tell(world: str, k: int) -> None:
    wrong = over_trainings(world, k, 6, 400)
    assert max(wrong.supported, wrong.refuted) <= 0.06
    if k == 20 and "collapses" not in world:
        shares = over_trainings(world, k, 6, 400, robustness=0.3, threshold=0.0)
        assert shares.supported > 0.8
