"""Parameters of the scenario that change, per episode or in mid-run."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Scenario
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.errors import ScenarioError, SetupError
from swarm_logistics_env.scenario import CHANGES_DURING_RUN
from swarm_logistics_env.wrappers import FaultInjection, ParameterChange, SwarmSize

# A value other than the default for each parameter that can change in mid-run.
OTHER: dict[str, Any] = {
    "delivery_width": 1.0,
    "duration": 3.0,
    "restock": True,
    "max_speed": 3.0,
    "max_turn_rate": 3.0,
    "ranger_range": 3.0,
    "view_range": 5.0,
    "radio_range": 6.0,
    "pickup_range": 0.5,
    "timer_limit": 20.0,
    "relay": "gossip",
    "drive": "differential",
    "speed_mix": (1.0, 0.5),
    "sensing_mix": (0.5,),
    "ranger_noise": 0.1,
    "position_noise": 0.1,
    "sensor_dropout": 0.2,
    "radio_loss": 0.2,
}


def small(**fields: Any) -> SwarmLogisticsEnv:
    return SwarmLogisticsEnv(**{"n_robots": 6, "n_items": 8, "duration": 6.0, **fields})


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


def test_other_for_every_parameter_that_can_change() -> None:
    assert set(OTHER) == CHANGES_DURING_RUN


@pytest.mark.parametrize("name", sorted(OTHER))
def test_in_mid_run_it_is_a_change_of_the_warehouse_at_that_time(name: str) -> None:
    wrapped = ParameterChange(small(), name, OTHER[name], at=1.0)
    plain = small()
    plain.declare_spaces(plain.scenario.replace(**{name: OTHER[name]}))
    rng = np.random.default_rng(0)
    np.testing.assert_array_equal(wrapped.reset_arrays(3), plain.reset_arrays(3))
    for step in range(29):
        if step == 10:
            assert getattr(wrapped.warehouse.scenario, name) == getattr(plain.scenario, name)
            plain.warehouse.change(**{name: OTHER[name]})
        commands = rng.uniform(-1, 1, (6, 4))
        mine, theirs = wrapped.step_arrays(commands), plain.step_arrays(commands)
        for part, other in zip(mine, theirs):
            np.testing.assert_array_equal(part, other)
        assert all(wrapped.observation_space("robot_0").contains(row) for row in mine[0])
        assert wrapped.state_space.contains(wrapped.state())
    assert getattr(wrapped.warehouse.scenario, name) == OTHER[name]
    wrapped.reset_arrays(3)
    assert getattr(wrapped.warehouse.scenario, name) == getattr(plain.scenario, name)


def test_before_the_change_nothing_differs_and_a_change_to_the_same_is_none() -> None:
    plain, same = small(), ParameterChange(small(), "max_speed", 2.0, at=1.0)
    later = ParameterChange(small(), "max_speed", 1.0, at=4.0)
    rng = np.random.default_rng(1)
    for env in (plain, same, later):
        env.reset_arrays(0)
    for step in range(59):
        commands = rng.uniform(-1, 1, (6, 4))
        rows, unchanged, changed = (env.step_arrays(commands)[0] for env in (plain, same, later))
        np.testing.assert_array_equal(rows, unchanged)
        assert np.array_equal(rows, changed) == (step < 40)


def test_values_and_times_may_be_drawn_from_distributions() -> None:
    env = ParameterChange(
        small(),
        "radio_range",
        lambda rng: rng.uniform(1.0, 3.0),
        at=lambda rng: rng.uniform(2.0, 5.0),
        within=(1.0, 3.0),
        at_within=(2.0, 5.0),
    )
    drawn = set()
    for seed in range(5):
        env.reset(seed=seed)
        assert env.time is not None
        assert 1.0 <= env.value <= 3.0
        assert 2.0 <= env.time <= 5.0
        drawn.add((env.value, env.time))
    assert len(drawn) == 5


def test_options_come_first_for_episodes_and_never_get_lost() -> None:
    env = ParameterChange(ParameterChange(small(), "n_items", [5]), "delivery_width", [1.0])
    env.reset(seed=0, options={"scenario": {"n_items": 7}})
    scenario = env.warehouse.scenario
    assert (scenario.n_items, scenario.delivery_width, scenario.n_robots) == (7, 1.0, 6)
    assert env.env.value == 7


def test_several_changes_stack() -> None:
    env = ParameterChange(small(), "max_speed", 1.0, at=1.0)
    env = ParameterChange(env, "max_speed", 1.5, at=2.0)
    env.reset(seed=0)
    speeds = []
    for _ in range(30):
        env.step_arrays(np.zeros((6, 4)))
        speeds.append(env.warehouse.scenario.max_speed)
    assert speeds == [2.0] * 10 + [1.0] * 10 + [1.5] * 10


@pytest.mark.parametrize(
    ("arguments", "error", "complaint"),
    [
        (("delivery_widht", 1.0), ScenarioError, "did you mean 'delivery_width'"),
        (("drop_rate", 1.0), ScenarioError, r"policies.load\(.., drop_rate=..\)"),
        (("delivery_width", [1.0, 10.0]), ScenarioError, "delivery_width = 10.0 m leaves no"),
        (("delivery_width", []), SetupError, "should list at least one"),
        (("delivery_width", lambda rng: 1.0), SetupError, "within = None: should be"),
        (("message_size", 2), SetupError, "message_size = 2: should be"),
    ],
)
def test_wrong_arguments_are_refused_at_once(
    arguments: tuple[Any, ...], error: type[Exception], complaint: str
) -> None:
    with pytest.raises(error, match=complaint):
        ParameterChange(small(), *arguments)


def test_what_cannot_change_in_mid_run_says_that_it_can_per_episode() -> None:
    values = {"warehouse_width": 12.0, "n_items": 9, "n_robots": 7, "control_period": 0.2}
    for name, value in values.items():
        assert name in Scenario.model_fields.keys() - CHANGES_DURING_RUN
        with pytest.raises(ScenarioError, match=f"{name} cannot change during a run: should be"):
            ParameterChange(small(), name, value, at=1.0)
        env = ParameterChange(small(), name, value)
        env.reset(seed=0)
        assert getattr(env.warehouse.scenario, name) == value


@pytest.mark.parametrize("at", [-1.0, float("nan"), "soon", [1.0, -2.0]])
def test_times_that_cannot_be_are_refused(at: Any) -> None:
    with pytest.raises(ScenarioError, match="should be a time of at least 0 s"):
        ParameterChange(small(), "max_speed", 1.0, at=at)


def test_values_that_cannot_go_together_are_refused_in_either_order() -> None:
    with pytest.raises(ScenarioError, match="do not fit"):
        SwarmSize(ParameterChange(small(), "warehouse_width", [3.0, 10.0]), [5, 150])
    with pytest.raises(ScenarioError, match="do not fit"):
        ParameterChange(SwarmSize(small(), [5, 150]), "warehouse_width", [3.0, 10.0])
    # But not what no episode is played in: 150 robots would not fit into the environment's own.
    narrow = small(warehouse_width=3.0)
    SwarmSize(ParameterChange(narrow, "warehouse_width", 10.0), [5, 150]).reset(seed=0)


def test_a_change_that_an_option_makes_impossible_is_refused_before_the_run() -> None:
    env = ParameterChange(small(), "delivery_width", 5.0, at=1.0)
    with pytest.raises(ScenarioError, match="leaves no storage"):
        env.reset(options={"scenario": {"warehouse_width": 4.0}})


def test_it_keeps_the_faults_of_the_wrappers_around_it() -> None:
    env = ParameterChange(FaultInjection(small(), "FM1", (2,)), "max_speed", 1.0, at=1.0)
    env.reset_arrays(0)
    for _ in range(15):
        env.step_arrays(np.zeros((6, 4)))
    assert env.warehouse.state.failure_modes[2] == ("FM1",)
