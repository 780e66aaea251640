"""How many seeds a plan names, and what so many seeds then find."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2, nct, t

from swarm_logistics_env import spi
from swarm_logistics_env.spi.ratio import RAISED, log_ratio, statistic
from verification.generators import MODELS, STALLS
from verification.verdict_errors import judged

rng = np.random.default_rng(11)
P_O = rng.poisson(39, 10)
# That hides no stalls: what they add to a plan is tested below.
PLAIN: dict[str, Any] = {"hidden": (None, None)}
PILOT: Any = dataclasses.replace(spi.robustness(P_O, rng.poisson(36, 10), n=25, m=2), **PLAIN)


def planned_spread(pilot: Any) -> float:
    """60 % upper confidence limit of the pilot's spread, of the logarithm."""
    df = pilot.degrees_of_freedom
    return float(pilot.log_sd * math.sqrt(df / chi2.ppf(0.4, df)))


def share_supported(effect: float, n: int) -> float:
    """Share of simulated studies of n seeds, with the planned spread, that find the effect."""
    performance = PILOT.base + (effect - PILOT.threshold) * PILOT.mean_denominator
    loc = float(log_ratio(np.asarray(performance), np.asarray(PILOT.base)))
    draws = np.random.default_rng(1).normal(loc, planned_spread(PILOT), (20_000, n))
    s = draws.std(axis=1, ddof=1) / math.sqrt(n)
    return float(np.mean(t.sf(statistic(draws.mean(axis=1), s), n - 1) < 0.025))


@pytest.mark.parametrize("effect", [0.08, 0.146, 0.6])
def test_planned_seeds_reach_80_percent_and_one_fewer_does_not(effect: float) -> None:
    n = spi.seeds_for_power(PILOT, effect) or 0
    assert share_supported(effect, n) > 0.79
    assert n == 10 or share_supported(effect, n - 1) < 0.81
    moved = dataclasses.replace(PILOT, threshold=1.0)  # effects are counted from the threshold
    assert spi.seeds_for_power(moved, 1.0 + effect) == n


def test_equivalence_is_planned_for_both_of_its_tests() -> None:
    p_o = np.full(10, 40.0)
    result = spi.equivalence(p_o, p_o + np.array([3, -2, 1, 4, -5, 2, 0, -3, 1, -1]))
    # Both reject with .8 at least where each does with .9.
    counts = [spi.seeds_for_power(test, 0.0, power=0.9) for test in (result.above, result.below)]
    n = spi.seeds_for_equivalence(result, power=0.8) or 0
    assert min(n or 10**6 for n in counts) <= n <= max(n or 10**6 for n in counts)


def test_minimum_detectable_effect_is_found_in_80_percent() -> None:
    effect = spi.minimum_detectable_effect(PILOT) or 0.0
    assert share_supported(effect, 10) == pytest.approx(0.8, abs=0.01)
    assert spi.seeds_for_power(PILOT, 1.001 * effect) == 10
    # The logarithm of a loss is larger than that of an equal gain.
    loss, gain = (spi.lower_decile_of_power(PILOT, side * effect, 10) or 0.0 for side in (-1, 1))
    assert loss > gain > 0.0


def test_no_effect_is_detectable_where_one_side_delivered_nothing() -> None:
    estimate = spi.fault_tolerance([0, 1], [0, 1], [0, 0])
    assert estimate.base == 0.0
    assert spi.minimum_detectable_effect(estimate) is None


def test_textbook_sample_sizes() -> None:
    # d = 0.5, two-sided .05, power .8: 34 pairs (Cohen 1988; G*Power).
    # Large samples: (1.960 + 0.842)^2 / d^2 pairs.
    def pilot_with(sd: float) -> Any:
        sd *= math.log1p(0.01) / 0.01 / (1.0 + 2.0 * RAISED)  # of the logarithm of raised means
        small = dataclasses.replace(PILOT, base=1.0, mean_denominator=1.0)
        return dataclasses.replace(small, log_sd=sd * PILOT.log_sd / planned_spread(PILOT))

    assert spi.seeds_for_power(pilot_with(0.02), 0.01) == 34
    assert spi.seeds_for_power(pilot_with(1.0), 0.01) == pytest.approx(78_489, rel=0.01)


@pytest.mark.parametrize(
    ("pilot", "effect", "reason"),
    [
        (PILOT, 0.0, "lies at the threshold"),
        (PILOT, 1e-6, "more than 1,000,000 seeds"),
        (spi.robustness([39], [38], n=25, m=1), 0.1, "one seed"),
        (spi.robustness([39, 39], [38, 38], n=25, m=1), 0.1, "no spread"),
        (spi.robustness([39], [39], n=25, m=1, identical=True), 0.1, "the same runs"),
    ],
)
def test_no_number_comes_with_a_reason(pilot: spi.Estimate, effect: float, reason: str) -> None:
    assert spi.seeds_for_power(pilot, effect) is None
    assert spi.lower_decile_of_power(pilot, effect, 20) is None
    assert reason in (spi.no_plan_because(pilot, effect) or "")


def test_what_cannot_be_is_named() -> None:
    with pytest.raises(spi.IndicatorError, match=r"power = 0\.02"):
        spi.minimum_detectable_effect(PILOT, power=0.02)
    with pytest.raises(spi.IndicatorError, match="effect = nan"):
        spi.seeds_for_power(PILOT, float("nan"))
    with pytest.raises(spi.IndicatorError, match="n_seeds = 1"):
        spi.lower_decile_of_power(PILOT, 0.1, 1)


@pytest.mark.daily
@pytest.mark.parametrize("n_pilot", [5, 10, 20])
def test_a_promised_power_of_80_percent_is_kept_on_average(n_pilot: int) -> None:
    mean, sd, effect = 40.0, 6.0, 0.08
    draws = np.random.default_rng(n_pilot).normal(0.0, sd, (150, n_pilot))
    achieved, least = [], list[float]()
    for difference in draws:
        pilot = spi.relative_change(np.full(n_pilot, mean), mean + difference)
        pilot = dataclasses.replace(pilot, **PLAIN)
        n = spi.seeds_for_power(pilot, effect) or 0
        by_log = math.log1p(effect) * mean / sd * math.sqrt(n)
        achieved.append(nct.sf(t.ppf(0.975, n - 1), n - 1, by_log))
        least.append(spi.lower_decile_of_power(pilot, effect, n) or 0.0)
    assert 0.76 < np.mean(achieved) < 0.86
    assert np.median(least) == pytest.approx(np.quantile(achieved, 0.1), abs=0.06)


def test_a_plan_counts_what_stalls_may_hide() -> None:
    p_o = 300.0 + np.tile([-15.0, 15.0], 50)
    pilot = spi.robustness(p_o, p_o[::-1] - 5.0, n=25, m=2)
    sure = dataclasses.replace(pilot, **PLAIN)
    assert (spi.seeds_for_power(pilot, 0.08) or 0) > 2 * (spi.seeds_for_power(sure, 0.08) or 0)
    effect = spi.minimum_detectable_effect(pilot) or 0.0
    assert effect > (spi.minimum_detectable_effect(sure) or 0.0)
    assert spi.seeds_for_power(pilot, -0.5) == 10  # a loss of half needs few all the same


@pytest.mark.parametrize(("model", "distance"), [("geometric", -0.1), ("0% stall", 0.1)])
def test_plans_from_large_pilots_have_the_promised_power(model: str, distance: float) -> None:
    draw, mean_o, mean_f = {**MODELS, **STALLS}[model]
    rng, truth = np.random.default_rng(0), mean_f / mean_o - 1
    threshold = truth - distance
    shares = []
    for _ in range(8):
        pilot = spi.relative_change(*draw(rng, (1_000,), mean_f), threshold=threshold)
        n = spi.seeds_for_power(pilot, truth) or 0
        test = judged(*draw(rng, (25, n), mean_f), threshold)
        is_right = (test.mean_difference > 0.0) == (distance > 0.0)
        shares.append(((test.p_value < 0.05) & is_right).mean())
    assert 0.7 < np.mean(shares) < 0.9
