"""Indicators as rewards: what an episode's rewards sum up to."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Fault, spi
from swarm_logistics_env.core.errors import SetupError
from swarm_logistics_env.wrappers import (
    Condition,
    FaultInjection,
    ParameterChange,
    RunningMeans,
    SwarmSize,
)
from swarm_logistics_env.wrappers.indicator_payments import comparison
from tests.wrappers.conftest import (
    CLOSE,
    FAULTY,
    NARROW,
    OPTIONS,
    OWN,
    REMOVED,
    TESTED,
    N,
    busy,
    delivered,
    each_indicator,
    eastward,
    play,
    rewarded,
)


@each_indicator
def test_the_return_is_the_indicator(name: str) -> None:
    tested, estimate = TESTED[name]
    env = rewarded(name, {OWN: 33, REMOVED: 21}, busy(max_robots=7))
    rewards, infos = play(env, 0, OPTIONS[tested])
    assert env.condition == tested
    p = delivered(env)
    assert p > 5
    value = estimate({OWN: 33, REMOVED: 21, tested: p}).value
    assert rewards.sum(axis=0) == pytest.approx(value, **CLOSE)
    info = infos["robot_0"]
    assert info[name] == pytest.approx(value, **CLOSE)
    assert info[f"{name}_tested"] == 1
    reference = f"{name}_P_N" if name == "S" else f"{name}_P_o"
    assert info[reference] == 33
    assert info.get("FT_P_S", 21) == 21
    # Nothing but the constant without a delivery, and it only once.
    times = {round(time / 0.1) - 1 for time in env.unwrapped.warehouse.state.delivery_times}
    assert set(np.flatnonzero(rewards[:, 0])) == times | {0}


@pytest.mark.parametrize("constant", [True, False])
def test_weights_add_up_and_the_constant_can_be_left_out(constant: bool) -> None:
    weights = {"R": 2.0, "FT": 1.0, "P": 0.5}
    env = rewarded(weights, {OWN: 33.0, REMOVED: 21.0}, constant=constant)
    rewards, infos = play(env, 0, OPTIONS[FAULTY])
    p, info = delivered(env), infos["robot_0"]
    r, ft = p / 33 - 1 + 2 / N, (p - 21) / 33
    left_out = 0.0 if constant else 2 * (-1 + 2 / N) - 21 / 33
    assert rewards.sum(axis=0) == pytest.approx(2 * r + ft + 0.5 * p - left_out, **CLOSE)
    assert [info["R"], info["FT"]] == pytest.approx([r, ft])
    assert (info["n_robots"], info["n_failed"], info["n_removed"]) == (N, 2, 0)


def test_without_what_an_indicator_is_about_numbers_pay_nothing() -> None:
    env = rewarded({"R": 1.0, "S": 1.0, "A": 1.0}, 33.0)
    for condition in (OWN, REMOVED):
        rewards, infos = play(env, 0, OPTIONS[condition])
        assert delivered(env) > 5
        assert not rewards.any()
        info = next(iter(infos.values()))
        assert not any(info[name] or info[f"{name}_tested"] for name in ("R", "S", "A"))
    env.reset(seed=0, options=OPTIONS[FAULTY])
    assert (env.measured.mean(OWN) or 0) > 5
    assert env.measured.count(OWN) == 1


STACKS: dict[str, Callable[[Any], Any]] = {
    "faults": lambda env: FaultInjection(env, "FM4", robots=1, onset=[0.0, 3.0]),
    "size": lambda env: SwarmSize(env, [5, 6], leave=[(1, 5.0)]),
    "change": lambda env: ParameterChange(env, "delivery_width", [1.0, 3.0]),
    "reward": lambda env: rewarded(
        {"R": 1.0, "FT": 0.5, "S": 0.25, "A": 2.0, "P": 0.01}, RunningMeans(), env
    ),
}


def test_the_order_of_wrappers_does_not_matter() -> None:
    first: list[Any] = []
    for order in list(itertools.permutations(STACKS))[::3]:
        env = functools.reduce(lambda env, name: STACKS[name](env), order, busy(duration=2.0))
        played: list[Any] = []
        for seed in range(3):
            rewards, infos = play(env, seed)
            assert env.condition.n_failed == env.condition.n_removed == 1
            assert all(info[f"{name}_tested"] for info in infos.values() for name in "RSA")
            played.append((rewards, infos, env.condition))
        first = first or played
        np.testing.assert_equal(played, first)


def test_a_change_in_mid_run_makes_the_return_the_adaptability() -> None:
    stack = ParameterChange(rewarded("A", 33.0), "delivery_width", 1.5, at=6.0)
    rewards, _ = play(stack, 0)
    value = spi.adaptability([33], [delivered(stack)], x_o=2.0, x_new=1.5).value
    assert rewards.sum(axis=0) == pytest.approx(value, **CLOSE)
    assert not rewards[:59].any()


@pytest.mark.unmeasured
@pytest.mark.parametrize(("onset", "role"), [(0.0, "searching"), (4.0, "shuffling")])
@pytest.mark.parametrize(("mode", "lost"), [("motor_slow", "n_failed"), ("removed", "n_removed")])
def test_faults_by_role_count_as_the_robots_that_they_strike(
    onset: float, role: str, mode: str, lost: str
) -> None:
    """Whom a role strikes may be among those that the seed chooses, or not."""
    counted = set()
    for seed in range(6):
        # In an episode that is over before it begins, a role strikes whom nothing else does.
        faults = [Fault(mode, 1), Fault(mode, 1, onset=onset, role=role)]
        env = rewarded({"P": 1.0}, 33.0)
        play(env, seed, {"faults": faults})
        world = env.unwrapped.warehouse
        counted.add(m := len(world.struck_robots))
        removed, failed = Condition(N, n_removed=m), Condition(N, ("motor_slow",), n_failed=m)
        assert env.condition == (removed if mode == "removed" else failed)
        env.reset(seed=seed, options={"faults": [faults[0], Fault(mode, 1, 99.0, role="carrier")]})
        assert getattr(env.condition, lost) == 2
    assert 2 in counted


def test_a_fault_by_role_that_strikes_in_mid_run_makes_the_return_the_robustness() -> None:
    faults = [Fault("motor_slow", 1), Fault("motor_slow", 2, onset=4.0, role="searching")]
    counted = set()
    for seed in range(6):
        env = rewarded("R", 33.0)
        rewards, _ = play(env, seed, {"faults": faults})
        m = len(env.unwrapped.warehouse.struck_robots)
        value = spi.robustness([33], [delivered(env)], n=N, m=m).value
        assert rewards.sum(axis=0) == pytest.approx(value, **CLOSE)
        counted.add(m)
    assert counted == {2, 3}


# Of a swarm in which a robot is missing anyway: what is tested, and the indicator of it.
WITHOUT_ONE: dict[str, tuple[Condition, Any, Callable[[int], float]]] = {
    "R": (
        Condition(N, ("dead",), n_failed=2, n_removed=1),
        {"faults": [Fault("removed", (3,)), Fault("dead", (0, 1))]},
        lambda p: p / 30 - 1 + 2 / N,
    ),
    "FT": (
        Condition(N, ("dead",), n_failed=2, n_removed=1),
        {"faults": [Fault("removed", (3,)), Fault("dead", (0, 1))]},
        lambda p: (p - 12) / 30,
    ),
    "S": (
        Condition(N + 2, n_removed=1),
        {"faults": [Fault("removed", (3,))], "scenario": {"n_robots": N + 2}},
        lambda p: (p / 30 - 1) / (2 / N),
    ),
    "A": (
        Condition(N, n_removed=1, changes=(("delivery_width", 1.5),)),
        {"faults": [Fault("removed", (3,))], "scenario": {"delivery_width": 1.5}},
        lambda p: (p / 30 - 1) / 0.25 + 1,
    ),
}


@pytest.mark.unmeasured
@pytest.mark.parametrize("credit", ["team", "deliverer"])
@each_indicator
def test_the_same_robots_are_removed_in_the_references(name: str, credit: Any) -> None:
    tested, options, value = WITHOUT_ONE[name]
    references = {Condition(N, n_removed=1): 30, Condition(N, n_removed=3): 12}
    env = rewarded(name, references, busy(max_robots=N + 2), credit=credit)
    rewards, infos = play(env, 0, options)
    assert env.condition == tested
    info = next(iter(infos.values()))
    assert (info["n_failed"], info["n_removed"]) == (tested.n_failed, 1)
    assert info["FT_P_S" if name == "FT" else "S_P_N" if name == "S" else f"{name}_P_o"] == (
        12 if name == "FT" else 30
    )
    expected = value(delivered(env))
    assert info[name] == pytest.approx(expected, **CLOSE)
    assert not rewards[:, 3].any()  # who is not there is paid nothing
    if credit == "team":
        paid = np.delete(rewards.sum(axis=0), 3)
        assert paid == pytest.approx([expected] * len(paid), **CLOSE)
    else:
        assert rewards.sum() == pytest.approx(expected, **CLOSE)
    for reference in references:
        env.condition = reference
        assert env.payments_of(reference)[name].share == 0.0


def test_where_the_deliverer_is_paid_all_returns_sum_up_to_the_indicator() -> None:
    env = rewarded("R", 33.0, credit="deliverer")
    rewards, _ = play(env, 0, OPTIONS[FAULTY])
    value = spi.robustness([33], [delivered(env)], n=N, m=2).value
    assert rewards.sum() == pytest.approx(value, **CLOSE)
    assert rewards[0] == pytest.approx([(-1 + 2 / N) / N] * N)


@pytest.mark.parametrize(("credit", "term"), [("team", "delivery"), ("deliverer", "own_delivery")])
def test_a_delivery_is_paid_as_the_environment_pays_it(credit: Any, term: str) -> None:
    """P at reference 1 is the environment's own reward, in the step of a removal too."""
    plain = busy(rewards={term: 1.0})
    play(plain, 3)
    first = plain.warehouse.state.delivery_times[0]
    options = {"faults": [Fault("removed", 2, onset=first)]}
    expected, _ = play(plain, 3, options)
    assert expected.any()
    assert play(rewarded("P", 1.0, credit=credit), 3, options)[0] == pytest.approx(expected)


def test_the_environments_own_reward_can_be_kept_for_shaping() -> None:
    rewards, _ = play(busy(rewards={"contact": -1.0}), 0)
    assert rewards.any()
    shaped, _ = play(rewarded("R", 33.0, busy(rewards={"contact": -1.0}), own_reward=0.1), 0)
    np.testing.assert_allclose(shaped, 0.1 * rewards)


CHANGED = ParameterChange(busy(), "max_speed", 1.0)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"weights": "Q"}, "no indicator 'Q' is paid; known: A, FT, P, R, S"),
        ({"weights": {}}, "at least one indicator"),
        ({"weights": {"R": np.nan}}, r"weights\['R'\] = nan"),
        ({"credit": "robot"}, "credit = 'robot'"),
        ({"references": 0}, "P_o = 0"),
        ({"references": -1.0}, "= -1.0: should be a number of items"),
        ({"references": {"P_o": 3}}, "key 'P_o' should be a Condition"),
        ({"env": SwarmSize(busy(), [2, 6]), "weights": "S"}, "S from N = 4 to 2"),
        ({"env": ParameterChange(busy(), "n_obstacles", 1), "weights": "A"}, "n_obstacles from 0"),
        ({"env": ParameterChange(busy(), "restock", False), "weights": "A"}, "that is a number"),
        ({"env": ParameterChange(CHANGED, "n_items", 9), "weights": "A"}, "in max_speed, n_items"),
        ({"env": CHANGED, "weights": "A", "references": {}}, r"performance of Condition\(n_rob"),
    ],
)
def test_wrong_arguments_are_refused(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(SetupError, match=message):
        rewarded(**{"weights": "R", "references": 33.0, **arguments})


def test_what_cannot_be_judged_is_refused_at_the_reset() -> None:
    env = rewarded("FT", 33.0)
    with pytest.raises(SetupError, match="n_removed=2"):
        env.reset_arrays(0, OPTIONS[FAULTY])
    with pytest.raises(SetupError, match="4 of 4 robots faulty"):
        env.payments_of(Condition(4, ("FM1",), n_failed=4))
    with pytest.raises(SetupError, match="no indicator 'K' is paid; known: A, FT, P, R, S"):
        comparison("K", FAULTY, env.unwrapped.scenario)
    with pytest.raises(SetupError, match="n_removed = -1"):
        Condition(4, n_removed=-1)
    for halves in ({"modes": ("FM1",)}, {"n_failed": 1}):
        with pytest.raises(SetupError, match=r"modes = .*, n_failed = \d: should both be given"):
            Condition(4, **halves)
    with pytest.raises(SetupError, match="window = 0"):
        RunningMeans(window=0)


ONE_GONE = Condition(N, n_removed=1)
SICK = Condition(N, ("FM1",), n_failed=1)


@pytest.mark.parametrize(
    ("name", "tested", "references", "share", "constant"),
    [
        ("R", Condition(N, ("FM1",), 1, n_removed=1), {ONE_GONE: 30}, 1 / 30, 1 / N - 1),
        (
            "FT", Condition(N, ("FM1",), 1, n_removed=1), {ONE_GONE: 30, REMOVED: 21},
            1 / 30, -21 / 30,
        ),
        ("S", Condition(N + 2, n_removed=1), {ONE_GONE: 30}, N / 2 / 30, -N / 2),
        ("A", Condition(N, ("FM1",), 1, changes=NARROW.changes), {SICK: 20}, 4 / 20, 1 - 4),
    ],
)  # fmt: skip
def test_an_indicator_is_relative_to_what_it_does_not_vary(
    name: str, tested: Condition, references: Any, share: float, constant: float
) -> None:
    env = rewarded(name, {OWN: 99.0, REMOVED: 99.0, **references})
    paid = env.payments_of(tested)[name]
    assert (paid.share, paid.constant) == pytest.approx((share, constant))


def test_where_robots_are_gone_the_rest_shares_the_constant() -> None:
    env = rewarded("R", {OWN: 40.0, ONE_GONE: 33.0}, credit="deliverer")
    rewards, _ = play(env, 0, {"faults": [Fault("motor_slow", (0,)), Fault("removed", (1,))]})
    value = spi.robustness([33], [delivered(env)], n=N, m=1).value
    assert rewards.sum() == pytest.approx(value, **CLOSE)
    assert not rewards[:, 1].any()


def test_an_episode_that_is_cut_short_counts_for_nothing_whatever_it_delivered() -> None:
    env = rewarded({"R": 1.0}, 33.0)
    env.reset(seed=0)
    while not delivered(env):
        env.step_arrays(eastward(env))
    env.reset(seed=0)
    assert env.measured.conditions == ()
