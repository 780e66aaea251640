"""Commands by number, and in the frame of each robot's motion."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from gymnasium.spaces import Discrete

from swarm_logistics_env import Fault, Scenario, motion
from swarm_logistics_env.adapters import CentralEnv
from swarm_logistics_env.errors import CommandError, SetupError
from swarm_logistics_env.motion.frame import INPUTS
from swarm_logistics_env.streams import row_keys
from swarm_logistics_env.wrappers import (
    DiscreteActions,
    FaultInjection,
    FixedAgents,
    MotionFrame,
    SwarmSize,
)
from swarm_logistics_env.wrappers.action_forms import ACTIONS
from tests.wrappers.conftest import small

NUMBERS = {name: number for number, name in enumerate(ACTIONS)}


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
    ("form", "given", "said"),
    [
        (DiscreteActions, [0, 1, 2, 13], "robot_3 = 13: should be a whole number from 0 to 12"),
        (DiscreteActions, [0, -1, 2, 3], "action of robot_1 = -1"),
        (DiscreteActions, [0.5, 1, 2, 3], "action of robot_0 = 0.5"),
        (DiscreteActions, [np.nan, 1, 2, 3], "action of robot_0 = nan"),
        (DiscreteActions, np.zeros((4, 4)), r"of shape \(4, 4\) .* should be \(4,\) numbers"),
        (MotionFrame, np.zeros((4, 4)), r"should be \(4, 3\) finite numbers, along, aside"),
        (MotionFrame, np.full((4, 3), np.nan), r"should be \(4, 3\) finite numbers"),
    ],
)
def test_what_is_no_action_is_refused_before_anything_moves(
    form: Callable[[Any], Any], given: Any, said: str
) -> None:
    env = form(small(n_robots=4))
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
        env.step_arrays([0] * 6)


def test_it_reads_and_commands_as_the_frame_of_the_shipped_networks_does() -> None:
    fields = {"n_robots": 4, "faults": [Fault("removed", 2, onset=0.5)], "duration": 1.0}
    env, inner = MotionFrame(small(**fields)), small(**fields)
    frame = motion.MotionFrame(Scenario())
    rng = np.random.default_rng(0)
    for seed in (3, 4):
        read, rows = env.reset_arrays(seed), inner.reset_arrays(seed)
        frame.begin(row_keys(seed, "motion frame", 4))
        while env.agents:
            there = inner.warehouse.state.robot_present
            np.testing.assert_array_equal(read[there], frame.read(rows)[there])
            assert not read[~there].any()
            outputs = rng.uniform(-1.0, 1.0, (4, 3))
            rows, *others = inner.step_arrays(frame.command(outputs))
            read, *rest = env.step_arrays(outputs)
            np.testing.assert_equal(rest, others)
        assert there.sum() == 2


def test_who_does_not_listen_reads_no_timer() -> None:
    rows = MotionFrame(small(n_robots=20), listens=False).reset_arrays(0)
    assert rows.shape == (20, len(INPUTS))
    assert not rows[:, motion.frame.LEAD].any()


def in_motion(world: int) -> Any:
    return FixedAgents(MotionFrame(SwarmSize(FaultInjection(small(duration=2.0), "FM1"), [2, 4])))


@pytest.mark.parametrize(
    ("make_env", "actions"),
    [
        (lambda world: DiscreteActions(small(n_robots=4, duration=2.0)), np.arange(8)),
        (in_motion, np.full((8, 3), 0.3)),
    ],
)
def test_stable_baselines3_takes_either_for_every_row(make_env: Any, actions: Any) -> None:
    pytest.importorskip("stable_baselines3")
    from swarm_logistics_env.adapters import SwarmVecEnv

    env = SwarmVecEnv(make_env=make_env, n_worlds=2, threads=2, seed=0)
    assert env.action_space == make_env(0).action_space("robot_0")
    assert env.reset().shape == (8, *env.observation_space.shape)
    for _ in range(25):  # beyond the end of an episode
        rows, *_ = env.step(actions)
    assert np.isfinite(rows).all()
    env.close()
