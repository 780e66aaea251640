"""Faults injected into an environment, and parameters that change."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Fault
from swarm_logistics_env.core.errors import FaultError, ScenarioError, SetupError
from swarm_logistics_env.world.scenario import CHANGES_DURING_RUN
from swarm_logistics_env.world.warehouse.faults import failed_robots
from swarm_logistics_env.wrappers import FaultInjection, ParameterChange, SwarmSize
from tests.wrappers.conftest import small


def test_it_does_what_the_same_fault_does_in_the_environment() -> None:
    injected = FaultInjection(small(), "motor_slow", robots=2, onset=1.0, duration=2.0, factor=0.1)
    built_in = small(faults=[Fault("motor_slow", 2, onset=1.0, duration=2.0, factor=0.1)])
    commands = np.tile([1.0, 0.0, 0.1, 1.0], (6, 1))
    for seed in (3, None):
        np.testing.assert_array_equal(injected.reset_arrays(seed), built_in.reset_arrays(seed))
        for _ in range(50):
            np.testing.assert_equal(injected.step_arrays(commands), built_in.step_arrays(commands))
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


def test_each_further_onset_takes_more_of_the_same_nested_order() -> None:
    env = FaultInjection(small(), "motor_slow", robots=2, onset=lambda rng: [9.0, 3.0, 5.0, 7.0])
    env.reset(seed=1)
    assert [fault.onset for fault in env.injected] == [3.0, 5.0, 7.0]
    groups = [set(fault.robots) for fault in env.injected]  # type: ignore[arg-type]
    for count in (1, 2, 3):
        first = set(failed_robots(Fault("FM1", 2 * count), 1, env.warehouse.scenario).tolist())
        assert set().union(*groups[:count]) == first
    assert env.failed_robots == tuple(range(6))


def test_named_robots_fail_once_more_at_each_onset() -> None:
    env = FaultInjection(small(), "motor_slow", (1, 4), lambda rng: [20.0, 10.0], 2.0)
    env.reset(seed=0)
    assert [(fault.onset, fault.duration) for fault in env.injected] == [(10.0, 2.0), (20.0, 2.0)]
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
NARROW = {"scenario": {"warehouse_width": 4.0}}


def fault(env: Any = None, **arguments: Any) -> Make:
    return lambda: FaultInjection(env or small(), "FM1", **arguments)


def change(*arguments: Any, **options: Any) -> Make:
    return lambda: ParameterChange(small(), *arguments, **options)


@pytest.mark.parametrize(
    ("make", "error", "complaint"),
    [
        (fault(onset=[0.0, -1.0]), FaultError, "Fault.onset = -1.0"),
        (fault(onset="soon"), FaultError, "Fault.onset = 'soon'"),
        (fault(onset=[]), FaultError, r"Fault.onset = \[\]: should list at least one time"),
        (lambda: fault(onset=lambda rng: -3.0)().reset(), FaultError, "Fault.onset = -3.0"),
        (fault(env=3), SetupError, "env = 3: should be a SwarmLogisticsEnv"),
        # A swarm too small for the fault, in either order.
        (fault(robots=3, env=SwarmSize(small(), [2, 6])), FaultError, "at most n_robots = 2"),
        (lambda: SwarmSize(fault(robots=3)(), [2, 6]), FaultError, "at most n_robots = 2"),
        (change("delivery_widht", 1.0), ScenarioError, "did you mean 'delivery_width'"),
        (change("delivery_width", [1.0, 10.0]), ScenarioError, "delivery_width = 10.0 m leaves no"),
        (change("message_size", 2), SetupError, "message_size = 2: should be"),
        (change("n_items", 9, at=1.0), ScenarioError, "n_items cannot change during a run"),
        (change("max_speed", 1.0, at=[1.0, -2.0]), ScenarioError, "at = -2.0"),
        # Before the run.
        (lambda: change("delivery_width", 5.0, at=1.0)().reset(0, NARROW), ScenarioError, "leaves"),
        (lambda: SwarmSize(change("warehouse_width", 3.0)(), 150), ScenarioError, "do not fit"),
    ],
)
def test_what_cannot_be_is_refused_at_once(
    make: Make, error: type[Exception], complaint: str
) -> None:
    with pytest.raises(error, match=complaint):
        make()


# A value other than the default for each parameter that can change in mid-run.
OTHER: dict[str, Any] = {
    "delivery_width": 1.0, "duration": 3.0, "restock": True, "max_speed": 3.0, "max_turn_rate": 3.0,
    "ranger_range": 3.0, "view_range": 5.0, "radio_range": 6.0, "pickup_range": 0.5,
    "timer_limit": 20.0, "relay": "gossip", "drive": "differential", "speed_mix": (1.0, 0.5),
    "sensing_mix": (0.5,), "ranger_noise": 0.1, "position_noise": 0.1, "sensor_dropout": 0.2,
    "radio_loss": 0.2, "demand": "zipf", "dock_capacity": 0.5, "request_timeout": 0.5,
    "request_delay": 0.5, "request_loss": 0.5, "order_rate": 1.0, "order_cycle": 2.0,
    "order_due": 1.0, "charging_power": 50.0, "dead_stations": 2,
}  # fmt: skip


@pytest.mark.unmeasured
@pytest.mark.parametrize("name", sorted(CHANGES_DURING_RUN))
def test_in_mid_run_it_is_a_change_of_the_warehouse_at_that_time(name: str) -> None:
    fields = {"battery": 500.0} if name in ("charging_power", "dead_stations") else {}
    wrapped, plain = ParameterChange(small(**fields), name, OTHER[name], at=1.0), small(**fields)
    plain.declare_spaces(plain.scenario.replace(**{name: OTHER[name]}))
    rng = np.random.default_rng(0)
    np.testing.assert_array_equal(wrapped.reset_arrays(3), plain.reset_arrays(3))
    for step in range(29):
        if step == 10:
            assert getattr(wrapped.warehouse.scenario, name) == getattr(plain.scenario, name)
            plain.warehouse.change(**{name: OTHER[name]})
        commands = rng.uniform(-1, 1, (6, 4))
        step_result, expected = wrapped.step_arrays(commands), plain.step_arrays(commands)
        np.testing.assert_equal(step_result, expected)
        assert all(wrapped.observation_space("robot_0").contains(row) for row in step_result[0])
        assert wrapped.state_space.contains(wrapped.state())
    assert getattr(wrapped.warehouse.scenario, name) == OTHER[name]
    wrapped.reset_arrays(3)
    assert getattr(wrapped.warehouse.scenario, name) == getattr(plain.scenario, name)


def test_a_second_change_may_give_back_the_first_value() -> None:
    env = ParameterChange(small(), "max_speed", 1.0, at=1.0)
    env = ParameterChange(env, "max_speed", small().scenario.max_speed, at=2.0)
    env.reset_arrays(seed=0)
    speeds = []
    for _ in range(25):
        env.step_arrays(np.zeros((6, 4)))
        speeds.append(env.warehouse.scenario.max_speed)
    assert (speeds[5], speeds[15], speeds[24]) == (2.0, 1.0, 2.0)


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


def test_options_come_first_for_episodes_and_never_get_lost() -> None:
    env = ParameterChange(ParameterChange(small(), "n_items", [5]), "delivery_width", [1.0])
    env.reset(seed=0, options={"scenario": {"n_items": 7}, "faults": ["FM1:2"]})
    assert env.warehouse.faults == (Fault("FM1", 2),)
    scenario = env.warehouse.scenario
    assert (scenario.n_items, scenario.delivery_width, scenario.n_robots) == (7, 1.0, 6)
    assert env.env.value == 7


def test_the_size_of_an_episode_decides_who_of_it_fails() -> None:
    env = SwarmSize(FaultInjection(small(), "FM1", robots=2), [3, 9])
    sizes = set()
    for seed in range(12):
        env.reset_arrays(seed)
        state = env.warehouse.state
        sizes.add(state.n_robots)
        expected = failed_robots(Fault("FM1", 2), seed, env.warehouse.scenario).tolist()
        assert np.flatnonzero(state.failed).tolist() == expected
        assert env.env.failed_robots == tuple(expected)
    assert sizes == {3, 9}


def test_a_change_to_the_value_that_holds_already_changes_no_run() -> None:
    plain = small(n_robots=14, warehouse_width=2.5, warehouse_height=1.5, delivery_width=0.5)
    changed = ParameterChange(copy.deepcopy(plain), "max_speed", plain.scenario.max_speed, at=2.0)
    rng = np.random.default_rng(0)
    plain.reset_arrays(3)
    changed.reset_arrays(3)
    while plain.agents:  # they push each other, which bodies remember
        commands = rng.uniform(-1.0, 1.0, (14, 4))
        np.testing.assert_equal(changed.step_arrays(commands), plain.step_arrays(commands))
