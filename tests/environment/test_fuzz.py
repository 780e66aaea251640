"""Whatever comes in at the public surface: it runs, or one of the package's errors says why not."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarm_logistics_env import Fault, Scenario
from swarm_logistics_env.core.errors import SwarmLogisticsError
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.world.warehouse.failure_modes import FAILURE_MODES
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
_OF_KIND: dict[st.SearchStrategy[Any], str] = {
    st.integers(1, 8): "n_robots n_items",
    st.integers(0, 3): "n_obstacles memory_size message_size",
    st.booleans(): "restock",
    st.floats(0.01, 8.0): "warehouse_width warehouse_height delivery_width max_speed pickup_range "
    "ranger_range view_range radio_range timer_limit",
    st.floats(0.05, 2.0): "duration robot_mass max_acceleration max_turn_rate request_timeout "
    "order_cycle order_due",
    st.floats(0.1, 20.0): "order_rate",
    st.floats(0.01, 0.3): "robot_radius item_radius",
    st.floats(0.0, 1.0): "ranger_noise position_noise sensor_dropout radio_loss request_loss "
    "request_delay",
    st.lists(st.floats(0.1, 1.0), min_size=1, max_size=3): "speed_mix sensing_mix",
    st.sampled_from(["holonomic", "differential"]): "drive",
    st.sampled_from(["none", "gossip"]): "relay",
    st.sampled_from(["", "plain, scout:2 max_speed=0.1 lifts=false"]): "robot_kinds",
    st.sampled_from(["next", "poisson", "bursts", "day", "time,item/0,1/0.2,A"]): "orders",
    st.sampled_from(["oldest", "urgent", "all"]): "announced",
    st.sampled_from([0.02, 0.1, 0.2]): "control_period",
}
sensible = {name: kind for kind, names in _OF_KIND.items() for name in names.split()}
fields = st.dictionaries(st.sampled_from(sorted(sensible)), st.none(), max_size=5).flatmap(
    lambda chosen: st.fixed_dictionaries({name: sensible[name] for name in chosen})
)
spoiled = st.tuples(
    fields,
    st.dictionaries(st.sampled_from([*sorted(Scenario.model_fields), "n_robot"]), junk, max_size=1),
).map(lambda pair: {**pair[0], **pair[1]})
faults = st.builds(
    Fault,
    st.sampled_from(
        sorted(FAILURE_MODES.keys() - {"away", "cell_fades"})
    ),  # which need a duration, a battery
    st.integers(1, 3) | st.lists(st.integers(0, 4), min_size=1, max_size=2, unique=True),
    onset=st.floats(0.0, 0.4),
)
odd_rows: list[Any] = [np.zeros((4, 1)), np.array(["a"] * 4), np.zeros(4, complex), [[1, 2], [3]]]
odd_commands = (
    st.lists(st.floats(-2, 2) | odd_numbers, min_size=4, max_size=4).map(np.array)
    | st.lists(st.integers(-1, 1), max_size=6).map(np.array)
    | st.sampled_from(odd_rows)
    | junk
)


@contextlib.contextmanager
def refused_in_a_sentence_or_not() -> Iterator[None]:
    refusal = "none, for it runs as it is"
    try:
        yield
    except SwarmLogisticsError as error:
        refusal = str(error)
    assert len(refusal) > 20


def play(env: Any, **reset: Any) -> None:
    observations, _ = env.reset(**reset)
    check(env, observations)
    for _ in range(STEPS):
        if env.agents:
            width = env.action_space(env.agents[0]).shape
            observations = env.step({agent: np.full(width, 0.7) for agent in env.agents})[0]
            check(env, observations)


def check(env: Any, observations: dict[str, Any]) -> None:
    """Nothing seen may be NaN or out of its space."""
    for agent, row in observations.items():
        assert env.observation_space(agent).contains(row), row
    assert env.state_space.contains(env.state())


@FEWER
@given(spoiled)
def test_any_scenario_runs_or_is_refused(given_fields: dict[str, Any]) -> None:
    with refused_in_a_sentence_or_not():
        play(SwarmLogisticsEnv(SMALL, **given_fields), seed=0)


some_faults = st.lists(faults | junk, max_size=3)
odd_options = st.fixed_dictionaries(
    {}, optional={"scenario": spoiled | junk, "faults": some_faults | junk, "fault": junk}
)
junk_options = st.dictionaries(junk.filter(lambda key: not isinstance(key, list | dict)), junk)


@given(st.integers(-(2**70), 2**70) | junk, odd_options | junk_options | junk, st.booleans())
def test_any_reset_runs_or_is_refused(seed: Any, options: Any, is_wrapped: bool) -> None:
    env: Any = SwarmLogisticsEnv(SMALL)
    env = FaultInjection(SwarmSize(env, 3), "FM1") if is_wrapped else env
    with refused_in_a_sentence_or_not():
        play(env, seed=seed, options=options)
    play(env, seed=0)  # and is as good as new


@FEWER
@given(st.data())
def test_any_command_is_taken_or_refused(data: st.DataObject) -> None:
    env, observations = SwarmLogisticsEnv(SMALL), dict[str, Any]()
    with refused_in_a_sentence_or_not():  # they may remove everybody at 0 s
        options = {"faults": data.draw(st.lists(faults, max_size=2))}
        observations, _ = env.reset(data.draw(st.integers(0, 5)), options)
    for _ in range(STEPS):
        if not env.agents:
            break
        actions: Any = {agent: np.full(4, 0.7) for agent in env.agents}
        actions.update(data.draw(st.dictionaries(st.sampled_from(env.agents), odd_commands)))
        for stranger in data.draw(st.lists(st.sampled_from(["robot_9", "", "x", 3, None]))):
            actions[stranger] = np.zeros(4)
        for missing in data.draw(st.lists(st.sampled_from(env.agents), max_size=1)):
            del actions[missing]
        step, taken = env.warehouse.state.step, False
        with refused_in_a_sentence_or_not():
            observations, taken = env.step(actions)[0], True
        assert env.warehouse.state.step == step + taken
        check(env, observations)


@given(
    st.sampled_from([FaultInjection, ParameterChange]),
    st.sampled_from([*sorted(Scenario.model_fields), *FAILURE_MODES, "abc"]) | junk,
    st.lists(junk, max_size=3) | junk,
    junk,
)
def test_any_fault_and_change_runs_or_is_refused(
    kind: Any, name: Any, values: Any, time: Any
) -> None:
    when = {"onset" if kind is FaultInjection else "at": time}
    with refused_in_a_sentence_or_not():
        play(kind(SwarmLogisticsEnv(SMALL), name, values, **when), seed=0)
