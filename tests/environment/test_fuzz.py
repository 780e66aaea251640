"""Whatever comes in at the public surface: it runs, or one of the package's errors says why not."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarm_logistics_env import Fault, Scenario
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.errors import SetupError, SwarmLogisticsError
from swarm_logistics_env.warehouse.failure_modes import FAILURE_MODES
from swarm_logistics_env.wrappers import FaultInjection, ParameterChange, SwarmSize

SMALL = Scenario(n_robots=3, n_items=4, warehouse_width=4.0, warehouse_height=3.0, duration=1.0)
STEPS = 3
FEWER = settings(max_examples=settings().max_examples // 2)

pytestmark = pytest.mark.filterwarnings("ignore:reset option:UserWarning")

odd_numbers = st.sampled_from([math.nan, math.inf, -math.inf, -1, 0, -0.0, 1e-300, 1e308, 2**63])
junk = (
    odd_numbers
    | st.sampled_from([None, True, "", "abc", "1", b"x", (), [], {}, [1, 2], {"a": 1}, 1j, object])
    | st.floats(-10, 10)
    | st.integers(-5, 20)
)
# Sizes of what is built stay small where they are valid: this looks for errors, not for patience.
sensible: dict[str, st.SearchStrategy[Any]] = {
    "n_robots": st.integers(1, 8),
    "n_items": st.integers(1, 12),
    "warehouse_width": st.floats(0.5, 8.0),
    "warehouse_height": st.floats(0.2, 8.0),
    "delivery_width": st.floats(0.01, 4.0),
    "duration": st.floats(0.05, 2.0),
    "restock": st.booleans(),
    "n_obstacles": st.integers(0, 3),
    "robot_radius": st.floats(0.05, 0.3),
    "item_radius": st.floats(0.01, 0.3),
    "robot_mass": st.floats(1e-3, 1e3),
    "max_speed": st.floats(0.01, 5.0),
    "max_acceleration": st.floats(0.01, 1e4),
    "max_turn_rate": st.floats(0.01, 100.0),
    "ranger_range": st.floats(0.05, 20.0),
    "view_range": st.floats(0.01, 20.0),
    "radio_range": st.floats(0.01, 20.0),
    "pickup_range": st.floats(0.01, 2.0),
    "drive": st.sampled_from(["holonomic", "differential"]),
    "relay": st.sampled_from(["none", "gossip"]),
    "speed_mix": st.lists(st.floats(0.1, 1.0), min_size=1, max_size=3),
    "sensing_mix": st.lists(st.floats(0.1, 1.0), min_size=1, max_size=3),
    "memory_size": st.integers(0, 3),
    "timer_limit": st.floats(0.01, 100.0),
    "ranger_noise": st.floats(0.0, 5.0),
    "position_noise": st.floats(0.0, 5.0),
    "sensor_dropout": st.floats(0.0, 1.0),
    "radio_loss": st.floats(0.0, 1.0),
    "message_size": st.integers(0, 3),
    "control_period": st.sampled_from([0.02, 0.1, 0.2]),
}
fields = st.dictionaries(st.sampled_from(sorted(sensible)), st.none(), max_size=5).flatmap(
    lambda chosen: st.fixed_dictionaries({name: sensible[name] for name in chosen})
)
spoiled = st.tuples(
    fields,
    st.dictionaries(st.sampled_from([*sorted(Scenario.model_fields), "n_robot"]), junk, max_size=1),
).map(lambda pair: {**pair[0], **pair[1]})
faults = st.builds(
    Fault,
    st.sampled_from(sorted(FAILURE_MODES)),
    st.integers(1, 3) | st.lists(st.integers(0, 4), min_size=1, max_size=2, unique=True),
    onset=st.floats(0.0, 0.4),
)
commands = st.lists(st.floats(-2, 2) | odd_numbers, min_size=4, max_size=4)
odd_commands = (
    commands.map(lambda row: np.array(row, dtype=np.float64))
    | commands.map(lambda row: np.array(row, dtype=object))
    | st.lists(st.integers(-1, 1), max_size=6).map(np.array)
    | st.sampled_from(
        [
            np.zeros((4, 1)),
            np.zeros((0,)),
            np.array(["a"] * 4),
            np.zeros(4, np.complex128),
            np.zeros(4, np.bool_),
            [[1, 2], [3]],
            [None] * 4,
            np.array(["NaT"] * 4, "datetime64[s]"),
        ]
    )
    | junk
)


def play(env: Any, draw: Any = None, **reset: Any) -> None:
    """Reset and step, with drawn commands if `draw` is given; nothing seen may be NaN."""
    observations, _ = env.reset(**reset)
    for _ in range(STEPS):
        check(env, observations)
        if not env.agents:
            return
        width = env.action_space(env.agents[0]).shape
        actions: Any = {agent: np.full(width, 0.7) for agent in env.agents}
        if draw is not None:
            actions.update(draw(st.dictionaries(st.sampled_from(env.agents), commands)))
        observations = env.step(actions)[0]
    check(env, observations)


def check(env: Any, observations: dict[str, Any]) -> None:
    for agent, row in observations.items():
        assert env.observation_space(agent).contains(row), row
    assert env.state_space.contains(env.state())


@FEWER
@given(spoiled)
def test_any_scenario_runs_or_is_refused(given_fields: dict[str, Any]) -> None:
    try:
        play(SwarmLogisticsEnv(SMALL, **given_fields), seed=0)
    except SwarmLogisticsError as error:
        assert_says_why(error)


@given(
    st.fixed_dictionaries(
        {},
        optional={
            "seed": st.integers(-(2**70), 2**70) | junk,
            "options": st.fixed_dictionaries(
                {},
                optional={
                    "scenario": spoiled | junk,
                    "faults": st.lists(faults | junk, max_size=3) | junk,
                    "fault": junk,
                },
            )
            | st.dictionaries(junk.filter(lambda key: not isinstance(key, list | dict)), junk)
            | junk,
        },
    )
)
def test_any_reset_runs_or_is_refused(arguments: dict[str, Any]) -> None:
    env = SwarmLogisticsEnv(SMALL)
    try:
        play(env, **arguments)
    except SwarmLogisticsError as error:
        assert_says_why(error)
        play(env, seed=0)  # and is as good as new


@FEWER
@given(st.data())
def test_any_command_is_taken_or_refused(data: st.DataObject) -> None:
    env = SwarmLogisticsEnv(SMALL, faults=data.draw(st.lists(faults, max_size=2).filter(possible)))
    try:
        observations, _ = env.reset(seed=data.draw(st.integers(0, 5)))
    except SetupError as error:  # they remove everybody at 0 s
        assert_says_why(error)
        return
    for _ in range(STEPS):
        if not env.agents:
            break
        actions: Any = {agent: np.full(4, 0.7) for agent in env.agents}
        actions.update(data.draw(st.dictionaries(st.sampled_from(env.agents), odd_commands)))
        for stranger in data.draw(st.lists(st.sampled_from(["robot_9", "", "x", 3, None]))):
            actions[stranger] = np.zeros(4)
        for missing in data.draw(st.lists(st.sampled_from(env.agents), max_size=1)):
            del actions[missing]
        step = env.warehouse.state.step
        try:
            observations = env.step(actions)[0]
        except SwarmLogisticsError as error:
            assert_says_why(error)
            assert env.warehouse.state.step == step
        check(env, observations)


@given(
    st.sampled_from(["faults", "size", "change"]),
    st.sampled_from([*sorted(Scenario.model_fields), *FAILURE_MODES, "abc"]) | junk,
    st.lists(junk, max_size=3) | junk,
    junk,
)
def test_any_wrapper_runs_or_is_refused(kind: str, name: Any, values: Any, time: Any) -> None:
    env = SwarmLogisticsEnv(SMALL)
    wrapped: Any
    try:
        if kind == "faults":
            wrapped = FaultInjection(env, name, values, onset=time)
        elif kind == "size":
            wrapped = SwarmSize(env, values, leave=[(1, time)])
        else:
            wrapped = ParameterChange(env, name, values, at=time)
        play(wrapped, seed=0)
    except SwarmLogisticsError as error:
        assert_says_why(error)


@given(faults=st.lists(st.tuples(st.sampled_from([*FAILURE_MODES, "FM9"]), junk, junk, junk, junk)))
def test_any_fault_runs_or_is_refused(faults: list[tuple[Any, ...]]) -> None:
    try:
        play(SwarmLogisticsEnv(SMALL, faults=[Fault(*fault) for fault in faults]), seed=0)
    except SwarmLogisticsError as error:
        assert_says_why(error)


def assert_says_why(error: SwarmLogisticsError) -> None:
    assert len(str(error)) > 20


def possible(drawn: list[Fault]) -> bool:
    """Whether these robots are there."""
    return all(
        max(fault.robots) < SMALL.n_robots for fault in drawn if isinstance(fault.robots, tuple)
    )
