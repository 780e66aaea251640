"""Commands by number."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gymnasium.spaces import Discrete

from swarm_logistics_env.adapters import CentralEnv
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.errors import CommandError, SetupError
from swarm_logistics_env.wrappers import (
    DiscreteActions,
)
from swarm_logistics_env.wrappers.action_forms import ACTIONS

NUMBERS = {name: number for number, name in enumerate(ACTIONS)}


def small(**fields: Any) -> SwarmLogisticsEnv:
    return SwarmLogisticsEnv(**{"n_robots": 4, "n_items": 8, "duration": 4.0, **fields})


def test_each_number_is_the_command_of_its_name() -> None:
    numbers, plain = DiscreteActions(small(n_robots=13)), small(n_robots=13)
    np.testing.assert_array_equal(numbers.reset_arrays(0), plain.reset_arrays(0))
    rng = np.random.default_rng(0)
    for _ in range(40):
        drawn = rng.integers(13, size=13)
        commands = np.array([list(ACTIONS.values())[number] for number in drawn])
        for part, wanted in zip(numbers.step_arrays(drawn), plain.step_arrays(commands)):
            np.testing.assert_array_equal(part, wanted)


def test_a_robot_fetches_an_item_by_numbers_alone() -> None:
    env = DiscreteActions(small(n_robots=1, n_items=1, pickup_range=14.0, duration=60.0))
    env.reset(seed=0)
    state = env.warehouse.state
    env.step({"robot_0": NUMBERS["hold"]})
    env.step({"robot_0": NUMBERS["stay"]})
    assert state.robot_item[0] == 0  # the gripper stays closed
    total = 0.0
    while env.agents:
        # East is where items are delivered; the nearest of the eight directions leads there.
        eighth = round(-float(state.robot_heading[0]) / (np.pi / 4)) % 8
        _, rewards, *_ = env.step({"robot_0": NUMBERS["forward"] + eighth})
        total += rewards["robot_0"]
    assert total == 1.0


def test_message_numbers_are_zeros() -> None:
    env = DiscreteActions(small(message_size=2))
    assert env.action_spaces["robot_3"] == Discrete(13)
    env.reset(seed=0)
    env.step(dict.fromkeys(env.agents, np.int64(3)))
    assert not env.warehouse.state.robot_message.any()


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ([0, 1, 2, 13], "action of robot_3 = 13: should be a whole number from 0 to 12"),
        ([0, -1, 2, 3], "action of robot_1 = -1"),
        ([0.5, 1, 2, 3], "action of robot_0 = 0.5"),
        ([np.nan, 1, 2, 3], "action of robot_0 = nan"),
        (np.zeros((4, 4)), r"actions of shape \(4, 4\) .* should be \(4,\) numbers"),
        (["a", "b", "c", "d"], "numbers"),
    ],
)
def test_what_is_no_action_is_refused(given: Any, said: str) -> None:
    env = DiscreteActions(small())
    env.reset(seed=0)
    with pytest.raises(CommandError, match=said):
        env.step_arrays(given)
    with pytest.raises(CommandError):
        env.step(dict(zip(env.agents, given)))
    assert env.warehouse.state.step == 0


def test_numbers_of_numbers_and_central_control_by_numbers_are_refused() -> None:
    env = DiscreteActions(small())
    with pytest.raises(SetupError, match=r"commands are Discrete\(13\), should be a Box"):
        DiscreteActions(env)
    with pytest.raises(SetupError, match="put no DiscreteActions inside of CentralEnv"):
        CentralEnv(env)
    with pytest.raises(SetupError, match="before"):
        env.step_arrays([0] * 4)


def test_stable_baselines3_takes_numbers_for_every_row() -> None:
    pytest.importorskip("stable_baselines3")
    from swarm_logistics_env.adapters import SwarmVecEnv

    env = SwarmVecEnv(make_env=lambda _: DiscreteActions(small()), n_worlds=2, threads=2, seed=0)
    assert env.action_space == Discrete(13)
    env.reset()
    for _ in range(45):  # beyond the end of an episode
        rows, *_ = env.step(np.arange(8))
    assert np.isfinite(rows).all()
    env.close()
