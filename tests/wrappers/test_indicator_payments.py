"""What an episode is paid for an indicator: with running means, and as a reference itself."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from swarm_logistics_env.core.errors import SetupError
from swarm_logistics_env.wrappers import Condition, RunningMeans
from swarm_logistics_env.wrappers.indicator_payments import GivenPerformances
from tests.wrappers.conftest import (
    CLOSE,
    FAULTY,
    LARGER,
    NARROW,
    OPTIONS,
    OWN,
    REMOVED,
    TESTED,
    N,
    delivered,
    each_indicator,
    eastward,
    play,
    rewarded,
)


def filled(performances: dict[Condition, int]) -> RunningMeans:
    means = RunningMeans()
    for condition, items in performances.items():
        means.add(condition, items)
    return means


def test_a_number_of_one_condition_is_none_of_another_unless_it_stands_for_all() -> None:
    for_all = GivenPerformances({OWN: 33.0}, whatever_changes=True)
    assert (for_all.performance(OWN), for_all.performance(NARROW)) == (33.0, 33.0)
    with pytest.raises(SetupError, match="references should have the performance of"):
        GivenPerformances({OWN: 33.0}).performance(NARROW)


def test_means_at_the_start_hold_for_the_whole_episode() -> None:
    means = filled({OWN: 33, FAULTY: 20})
    env = rewarded("R", means)
    env.reset_arrays(0, OPTIONS[FAULTY])
    payments = env.payments
    for _ in range(40):
        env.step_arrays(eastward(env))
        means.add(OWN, 5)  # as another environment does that shares them
        assert env.payments == payments


@pytest.mark.unmeasured
def test_running_means_are_those_of_the_episodes_that_ended() -> None:
    means = RunningMeans(window=2)
    env = rewarded({"R": 1.0, "FT": 1.0}, means)
    plays: dict[Condition, list[int]] = {OWN: [], FAULTY: [], REMOVED: []}
    for seed in range(4):
        for condition in plays:
            env.reset(seed=99, options=OPTIONS[FAULTY])  # is cut short, so counts for nothing
            env.step_arrays(np.zeros((N, 4)))
            play(env, seed, OPTIONS[condition])
            assert env.condition == condition
            plays[condition].append(delivered(env))
    env.reset(seed=0)
    assert {c: means.count(c) for c in means.conditions} == dict.fromkeys(plays, 4)
    assert {c: means.mean(c) for c in means.conditions} == pytest.approx(
        {condition: np.mean(counts[-2:]) for condition, counts in plays.items()}
    )


@each_indicator
def test_reference_episodes_are_paid_the_derivative(name: str) -> None:
    tested, estimate = TESTED[name]
    played = {OWN: 30, REMOVED: 25, tested: 20}
    env = rewarded(name, filled(played))
    h = 1e-4
    for condition, value in played.items():
        up, down = (float(estimate({**played, condition: value + e}).value) for e in (h, -h))
        paid = env.payments_of(condition)[name]
        assert paid.share == pytest.approx((up - down) / (2 * h), rel=1e-6)
        value_of_tested = float(estimate({**played}).value) if condition == tested else 0.0
        assert paid.share * value + paid.constant == pytest.approx(value_of_tested, **CLOSE)


def test_a_reference_episode_stands_for_as_many_as_it_serves() -> None:
    means = filled({OWN: 30, FAULTY: 20, REMOVED: 25})
    env = rewarded({"R": 1.0, "FT": 1.0}, means)
    means.add(FAULTY, 20)
    assert env.payments_of(OWN)["R"].share == pytest.approx(-2 * 20 / 30**2)
    means.add(OWN, 30)
    means.add(Condition(N, ("FM1",), n_failed=1), 10)
    assert env.payments_of(OWN)["R"].share == pytest.approx(-(2 * 20 + 10) / 2 / 30**2)
    # An environment of another size does not take part in what this one's S is about.
    env = rewarded("S", filled({OWN: 30, LARGER: 40, Condition(2): 11}))
    assert env.payments_of(OWN)["S"].share == pytest.approx(-(N / 3) * 40 / 30**2)


@pytest.mark.parametrize("window", [0, 1.5, True])
def test_a_window_is_a_whole_number_of_episodes(window: Any) -> None:
    with pytest.raises(SetupError, match=f"window = {window}: should be a whole number"):
        RunningMeans(window=window)


@pytest.mark.parametrize("least", [0.0, -1, np.inf, np.nan, "8"])
def test_what_a_divisor_is_at_least_is_a_positive_number_of_items(least: Any) -> None:
    with pytest.raises(SetupError, match=f"least = {least!r}: should be a positive number of ite"):
        RunningMeans(least=least)


def test_means_that_are_not_there_yet_or_too_small() -> None:
    env = rewarded({"R": 1.0, "FT": 1.0}, RunningMeans(least=8.0))
    assert env.payments_of(FAULTY)["R"].share == 1 / 8
    assert env.payments_of(FAULTY)["FT"].constant == 0
    assert env.payments_of(OWN)["R"].share == 0
    env = rewarded({"R": 1.0, "FT": 1.0}, filled({OWN: 0, FAULTY: 3}))
    assert env.payments_of(FAULTY)["R"].share == 1
    assert env.payments_of(OWN)["R"].share == 0  # a mean below `least` moves nothing
