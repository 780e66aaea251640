"""Faults injected into an environment, and parameters that change."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Fault, Scenario
from swarm_logistics_env.errors import FaultError, ScenarioError, SetupError, SwarmLogisticsError
from swarm_logistics_env.scenario import CHANGES_DURING_RUN
from swarm_logistics_env.warehouse.faults import failed_robots
from swarm_logistics_env.wrappers import FaultInjection, ParameterChange, SwarmSize
from tests.wrappers.conftest import small


def test_it_does_what_the_same_fault_does_in_the_environment() -> None:
    injected = FaultInjection(small(), "motor_slow", robots=2, onset=1.0, duration=2.0, factor=0.1)
    built_in = small(faults=[Fault("motor_slow", 2, onset=1.0, duration=2.0, factor=0.1)])
    commands = np.tile([1.0, 0.0, 0.1, 1.0], (6, 1))
    for seed in (3, None):
        np.testing.assert_array_equal(injected.reset_arrays(seed), built_in.reset_arrays(seed))
        for _ in range(50):
            for mine, theirs in zip(injected.step_arrays(commands), built_in.step_arrays(commands)):
                np.testing.assert_array_equal(mine, theirs)
        assert injected.failed_robots == built_in.warehouse.struck_robots
        assert len(injected.failed_robots) == 2


def test_listed_onsets_are_drawn_by_the_seed_and_all_occur() -> None:
    env = FaultInjection(small(), "FM1", onset=[1.0, 2.0, 30.0])
    drawn = [env.reset(seed=seed) and env.injected[0].onset for seed in (*range(20), 0, 1, 2)]
    assert drawn[20:] == drawn[:3]
    assert set(drawn) == {1.0, 2.0, 30.0}
    never = FaultInjection(small(), "FM1", onset=lambda rng: [])
    never.reset(seed=0)
    assert len(never.injected) == len(never.failed_robots) == 0
    wrong = FaultInjection(small(), "FM1", onset=lambda rng: -3.0)
    with pytest.raises(FaultError, match=r"Fault.onset = -3.0"):
        wrong.reset(seed=0)


def test_each_further_onset_takes_more_of_the_same_nested_order() -> None:
    env = FaultInjection(small(), "motor_slow", robots=2, onset=lambda rng: [9.0, 3.0, 5.0, 7.0])
    env.reset(seed=1)
    assert [fault.onset for fault in env.injected] == [3.0, 5.0, 7.0]
    groups = [set(fault.robots) for fault in env.injected]  # type: ignore[arg-type]
    assert [len(group) for group in groups] == [2, 2, 2]
    for count in (1, 2, 3):
        first = set(failed_robots(Fault("FM1", 2 * count), 1, 6).tolist())
        assert set().union(*groups[:count]) == first
    assert env.failed_robots == tuple(range(6))


@pytest.mark.parametrize(
    ("duration", "found"), [(2.0, [(10.0, 3.0), (20.0, 2.0)]), (None, [(10.0, None)])]
)
def test_named_robots_fail_anew_at_each_onset_and_not_twice_at_once(
    duration: float | None, found: list[Any]
) -> None:
    env = FaultInjection(small(), "motor_slow", (1, 4), lambda rng: [10.0, 11.0, 20.0], duration)
    env.reset(seed=0)
    assert [(fault.onset, fault.duration) for fault in env.injected] == found
    assert {fault.robots for fault in env.injected} == {(1, 4)}


def test_faults_of_the_environment_of_wrappers_and_of_the_reset_add_up() -> None:
    env = FaultInjection(small(faults=[Fault("FM1", (0,))]), "FM2", robots=(1,))
    env = FaultInjection(env, "FM3", robots=(1, 2))
    env.reset(seed=0)
    assert env.warehouse.state.failure_modes[:4] == (("FM1",), ("FM3", "FM2"), ("FM3",), ())
    _, infos = env.reset(seed=0, options={"faults": [Fault("FM4", (3,))]})
    assert env.warehouse.state.failure_modes[:4] == ((), ("FM3", "FM2"), ("FM3",), ("FM4",))
    assert [infos[f"robot_{row}"]["failed"] for row in range(4)] == [0, 1, 1, 1]
    assert env.failed_robots == (1, 2)
    assert env.env.failed_robots == (1,)


def test_stacked_wrappers_draw_for_themselves_and_pairs_of_modes_alike() -> None:
    def injected(env: Any, mode: str) -> FaultInjection:
        return FaultInjection(env, mode, onset=lambda rng: rng.uniform(0.0, 60.0))

    inner = injected(small(), "FM1")
    outer, other = injected(inner, "FM1"), injected(small(), "FM4")
    outer.reset(seed=0)
    other.reset(seed=0)
    assert outer.injected[0].onset != inner.injected[0].onset
    assert other.injected[0].onset == inner.injected[0].onset


Make = Callable[[], Any]


def fault(mode: str = "FM1", **arguments: Any) -> Make:
    return lambda: FaultInjection(small(), mode, **arguments)


def change(*arguments: Any, **options: Any) -> Make:
    return lambda: ParameterChange(small(), *arguments, **options)


@pytest.mark.parametrize(
    ("make", "error", "complaint"),
    [
        (fault("FM5"), FaultError, "no failure mode 'FM5'; did you mean"),
        (fault(robots=7), FaultError, "Fault.robots = 7: should be at most n_robots = 6"),
        (fault(robots=(6,)), FaultError, "robots are numbered 0 to 5"),
        (fault(onset=[0.0, -1.0]), FaultError, "Fault.onset = -1.0: should be greater than or"),
        (fault(onset=float("nan")), FaultError, "Fault.onset = nan"),
        (fault(onset=[]), FaultError, "should list at least one time"),
        (fault(onset="soon"), FaultError, "Fault.onset = 'soon': should be a time"),
        (fault(duration=0.0), FaultError, "Fault.duration = 0.0"),
        (fault(factor=0.5), FaultError, "FM1 takes no factor"),
        (
            lambda: FaultInjection(3, "FM1"),  # type: ignore[arg-type]
            SetupError,
            "env = 3: should be a SwarmLogisticsEnv",
        ),
        # A swarm too small for the fault, in either order.
        (
            lambda: FaultInjection(SwarmSize(small(), [2, 6]), "FM1", robots=3),
            FaultError,
            "should be at most n_robots = 2",
        ),
        (lambda: SwarmSize(fault(robots=3)(), [2, 6]), FaultError, "at most n_robots = 2"),
        (
            lambda: fault(robots=3)().reset(options={"scenario": {"n_robots": 2}}),
            FaultError,
            "at most n_robots = 2",
        ),
        (change("delivery_widht", 1.0), ScenarioError, "did you mean 'delivery_width'"),
        (change("drop_rate", 1.0), ScenarioError, r"policies.load\(.., drop_rate=..\)"),
        (change("delivery_width", [1.0, 10.0]), ScenarioError, "delivery_width = 10.0 m leaves no"),
        (change("delivery_width", []), SetupError, "should list at least one"),
        (change("delivery_width", lambda rng: 1.0), SetupError, "within = None: should be"),
        (change("message_size", 2), SetupError, "message_size = 2: should be"),
        *(
            (change("max_speed", 1.0, at=at), ScenarioError, "should be a time of at least 0 s")
            for at in (-1.0, float("nan"), "soon", [1.0, -2.0])
        ),
        (  # before the run
            lambda: change("delivery_width", 5.0, at=1.0)().reset(
                options={"scenario": {"warehouse_width": 4.0}}
            ),
            ScenarioError,
            "leaves no storage",
        ),
        # Values that cannot go together, in either order.
        (
            lambda: SwarmSize(change("warehouse_width", [3.0, 10.0])(), [5, 150]),
            ScenarioError,
            "do not fit",
        ),
        (
            lambda: ParameterChange(SwarmSize(small(), [5, 150]), "warehouse_width", [3.0, 10.0]),
            ScenarioError,
            "do not fit",
        ),
    ],
)
def test_what_cannot_be_is_refused_at_once(
    make: Make, error: type[Exception], complaint: str
) -> None:
    with pytest.raises(error, match=complaint):
        make()


def test_what_no_episode_is_played_in_is_not_refused() -> None:
    narrow = small(warehouse_width=3.0)  # 150 robots would not fit in
    SwarmSize(ParameterChange(narrow, "warehouse_width", 10.0), [5, 150]).reset(seed=0)


@pytest.mark.parametrize("options", [{"faults": [3]}, {"scenario": 3}, {"scenario": {3: 4}}, 5])
def test_options_of_the_wrong_type_are_refused(options: Any) -> None:
    for env in (small(), FaultInjection(small(), "FM1"), SwarmSize(small(), 6)):
        with pytest.raises(SwarmLogisticsError, match="options"):
            env.reset(options=options)


# A value other than the default for each parameter that can change in mid-run.
OTHER: dict[str, Any] = {
    "delivery_width": 1.0, "duration": 3.0, "restock": True, "max_speed": 3.0, "max_turn_rate": 3.0,
    "ranger_range": 3.0, "view_range": 5.0, "radio_range": 6.0, "pickup_range": 0.5,
    "timer_limit": 20.0, "relay": "gossip", "drive": "differential", "speed_mix": (1.0, 0.5),
    "sensing_mix": (0.5,), "ranger_noise": 0.1, "position_noise": 0.1, "sensor_dropout": 0.2,
    "radio_loss": 0.2, "demand": "zipf", "dock_capacity": 0.5,
}  # fmt: skip


@pytest.mark.parametrize("name", sorted(CHANGES_DURING_RUN))
def test_in_mid_run_it_is_a_change_of_the_warehouse_at_that_time(name: str) -> None:
    wrapped, plain = ParameterChange(small(), name, OTHER[name], at=1.0), small()
    plain.declare_spaces(plain.scenario.replace(**{name: OTHER[name]}))
    rng = np.random.default_rng(0)
    np.testing.assert_array_equal(wrapped.reset_arrays(3), plain.reset_arrays(3))
    for step in range(29):
        if step == 10:
            assert getattr(wrapped.warehouse.scenario, name) == getattr(plain.scenario, name)
            plain.warehouse.change(**{name: OTHER[name]})
        commands = rng.uniform(-1, 1, (6, 4))
        mine, theirs = wrapped.step_arrays(commands), plain.step_arrays(commands)
        np.testing.assert_equal(mine, theirs)
        assert all(wrapped.observation_space("robot_0").contains(row) for row in mine[0])
        assert wrapped.state_space.contains(wrapped.state())
    assert getattr(wrapped.warehouse.scenario, name) == OTHER[name]
    wrapped.reset_arrays(3)
    assert getattr(wrapped.warehouse.scenario, name) == getattr(plain.scenario, name)


def test_before_the_change_nothing_differs_and_a_change_to_the_same_is_none() -> None:
    plain, same = small(), ParameterChange(small(), "max_speed", 2.0, at=1.0)
    later = ParameterChange(small(), "max_speed", 1.0, at=4.0)
    later, speeds = ParameterChange(later, "max_speed", 1.5, at=5.0), []
    rng = np.random.default_rng(1)
    for env in (plain, same, later):
        env.reset_arrays(0)
    for step in range(59):
        commands = rng.uniform(-1, 1, (6, 4))
        rows, unchanged, changed = (env.step_arrays(commands)[0] for env in (plain, same, later))
        np.testing.assert_array_equal(rows, unchanged)
        assert np.array_equal(rows, changed) == (step < 40)
        speeds.append(later.warehouse.scenario.max_speed)
    assert speeds == [2.0] * 40 + [1.0] * 10 + [1.5] * 9


def test_per_episode_it_is_the_scenario_with_the_drawn_value() -> None:
    env = ParameterChange(small(), "n_items", [5, 20])
    seen = set()
    for seed in range(8):
        rows = env.reset_arrays(seed)
        seen.add(env.value)
        assert env.time is None
        np.testing.assert_array_equal(rows, small(n_items=env.value).reset_arrays(seed))
        assert env.state_space.contains(env.state())
    assert seen == {5, 20}


def test_values_and_times_may_be_drawn_from_distributions() -> None:
    env = ParameterChange(
        small(),
        "radio_range",
        lambda rng: rng.uniform(1.0, 3.0),
        at=lambda rng: rng.uniform(2.0, 5.0),
        within=(1.0, 3.0),
        at_within=(2.0, 5.0),
    )
    drawn = np.array([env.reset(seed=seed) and (env.value, env.time) for seed in range(5)])
    assert len(np.unique(drawn)) == 10
    assert ((drawn >= [1.0, 2.0]) & (drawn <= [3.0, 5.0])).all()


def test_options_come_first_for_episodes_and_never_get_lost() -> None:
    env = ParameterChange(ParameterChange(small(), "n_items", [5]), "delivery_width", [1.0])
    env.reset(seed=0, options={"scenario": {"n_items": 7}})
    scenario = env.warehouse.scenario
    assert (scenario.n_items, scenario.delivery_width, scenario.n_robots) == (7, 1.0, 6)
    assert env.env.value == 7


def test_what_cannot_change_in_mid_run_says_that_it_can_per_episode() -> None:
    values = {"warehouse_width": 12.0, "n_items": 9, "n_robots": 7, "control_period": 0.2}
    for name, value in values.items():
        assert name in Scenario.model_fields.keys() - CHANGES_DURING_RUN
        with pytest.raises(ScenarioError, match=f"{name} cannot change during a run: should be"):
            ParameterChange(small(), name, value, at=1.0)
        env = ParameterChange(small(), name, value)
        env.reset(seed=0)
        assert getattr(env.warehouse.scenario, name) == value
