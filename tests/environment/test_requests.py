"""What callers hand to an environment is read alike everywhere, or refused by its name."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Fault, Scenario
from swarm_logistics_env.core.errors import CommandError, SetupError
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.environment.requests import (
    check_somebody_is_there,
    checked_count,
    checked_options,
    faults_among,
    gather_commands,
    numbers_of,
    scenario_fields,
)
from swarm_logistics_env.world.warehouse.faults import GRACE

FOUR = ["robot_0", "robot_1", "robot_2", "robot_3"]


@pytest.mark.parametrize("number", [2, np.int64(7), np.uint8(2)])
def test_a_whole_number_from_the_least_on_is_a_count(number: Any) -> None:
    count = checked_count("n", number, 2)
    assert (count, type(count)) == (number, int)


@pytest.mark.parametrize("number", [1, -3, 2.0, True, "2", None, [2]])
def test_what_is_no_count_is_refused(number: Any) -> None:
    with pytest.raises(SetupError, match=r"^n = .*: should be a whole number of at least 2$"):
        checked_count("n", number, 2)
    with pytest.raises(SetupError, match=r"^n = True: should be a whole number of at least 1$"):
        checked_count("n", True)


def test_numbers_of_any_real_type_are_read_in_their_shape() -> None:
    for kind in (np.float32, np.int8, np.uint16, np.bool_):
        assert numbers_of(np.ones((2, 3), kind), "rows", (2, 3)).dtype == kind
    assert numbers_of([1, 2], "rows", (2,)).tolist() == [1, 2]
    for wrong in (np.ones(3), np.ones((2, 1)), 1.0, [1j, 2], ["1", "2"], [None, 1.0]):
        with pytest.raises(CommandError, match=r"^rows of shape .*: should be \(2,\) numbers$"):
            numbers_of(wrong, "rows", (2,))  # type: ignore[arg-type]


def test_commands_are_rows_in_the_order_of_the_agents() -> None:
    actions: dict[str, Any] = {name: [10 * k, 10 * k + 1] for k, name in enumerate(FOUR)}
    rows = gather_commands(actions, [FOUR[3], FOUR[1]], FOUR, (2,))
    assert rows.tolist() == [[30.0, 31.0], [10.0, 11.0]]
    assert rows.dtype == np.float64
    numbers = gather_commands({"robot_2": np.int64(5), "robot_0": 3}, FOUR[:3:2], FOUR, ())
    assert numbers.tolist() == [3.0, 5.0]


@pytest.mark.parametrize(
    ("actions", "message"),
    [
        ({"robot_0": 1}, "no command for 'robot_1': should be one for every agent"),
        (dict.fromkeys(FOUR[:3], 1) | {"b": 1, "a": 2}, "a command for 'a', who is not there"),
        (dict.fromkeys(FOUR[:3], 1) | {7: 1, "x": 2}, "a command for '7', who .* 4 possible"),
        ({"robot_0": 1, "robot_1": [2], "robot_2": 3}, r"'robot_1' of shape \(1,\): should be \("),
        ({"robot_0": 1, "robot_1": 1j, "robot_2": 3}, "commands should be numbers: "),
    ],
)
def test_the_first_command_that_cannot_be_is_named(actions: dict[Any, Any], message: str) -> None:
    with pytest.raises(CommandError, match=f"^(command of )?{message}"):
        gather_commands(actions, FOUR[:3], FOUR, ())


def test_options_are_a_copy_and_what_is_none_of_them_is_refused() -> None:
    options = {"scenario": {"n_robots": 3}, "seeds": 3}
    assert checked_options(None) == {}
    assert checked_options(options) == options
    assert checked_options(options) is not options
    assert scenario_fields(options) == {"n_robots": 3}
    assert scenario_fields(options) is not options["scenario"]
    assert scenario_fields({}) == {}
    for wrong in (3, {3: 4}, {"n_robots": 3, None: 4}):
        with pytest.raises(SetupError, match=r'^options\["scenario"\] = .*: should be a dict of f'):
            scenario_fields({"scenario": wrong})
    for name in ("fault", "Scenarios", "duration"):
        with pytest.raises(SetupError, match=f"^there is no reset option '{name}': should be"):
            checked_options({name: 1})
    default = (Fault("FM1"),)
    assert faults_among({}, default) == default
    assert faults_among({"faults": []}, default) == ()
    assert faults_among({"faults": ["FM2"]}, default) == (Fault("FM2"),)


@pytest.mark.parametrize(
    ("faults", "is_refused"),
    [
        ([Fault("removed", (0, 1)), Fault("removed", (1, 2))], True),
        ([Fault("removed", 3, onset=GRACE)], True),
        ([Fault("removed", 3, onset=2.0 * GRACE)], False),
        ([Fault("removed", 2)], False),
        ([Fault("removed", 2), Fault("away", 3, duration=1.0)], False),
        ([Fault("dead", 3)], False),
        ([], False),
    ],
)
def test_an_episode_begins_with_a_robot_or_not_at_all(
    faults: list[Fault], is_refused: bool
) -> None:
    if is_refused:
        with pytest.raises(SetupError, match=r"^faults remove all 3 robots at 0 s: should leave"):
            check_somebody_is_there(faults, 0, Scenario(n_robots=3))
    else:
        check_somebody_is_there(faults, 0, Scenario(n_robots=3))


def test_an_environment_shows_its_scenario_and_its_spaces() -> None:
    env = SwarmLogisticsEnv(n_robots=3, control_period=0.2, max_robots=5, message_size=1)
    assert repr(env) == "SwarmLogisticsEnv(n_robots=3, message_size=1, control_period=0.2)"
    assert env._repr_html_() == (
        f"<b>{env!r}</b><br>5 robots; observations (149,), actions Box(-1.0, 1.0, (5,), float32)"
    )
    assert env.metadata == {**SwarmLogisticsEnv.metadata, "render_fps": 5.0}
    assert SwarmLogisticsEnv.metadata["render_fps"] == 10
    assert (env.scenarios, len(env.declared_scenarios)) == ((env.scenario,), 2)
