"""Commands by number, and in the frame of each robot's motion."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import Fault, Scenario
from swarm_logistics_env.adapters import CentralEnv
from swarm_logistics_env.core.errors import CommandError, SetupError
from swarm_logistics_env.core.streams import row_keys
from swarm_logistics_env.world import motion
from swarm_logistics_env.world.motion.actions import ACTIONS
from swarm_logistics_env.world.motion.network_inputs import INPUTS
from swarm_logistics_env.wrappers import (
    DiscreteActions,
    MotionFrame,
    ParameterChange,
    SwarmSize,
    Wrapper,
)
from tests.wrappers.conftest import small

NUMBERS = {name: number for number, name in enumerate(ACTIONS)}


def test_each_number_is_the_command_of_its_name_without_a_message() -> None:
    plain = small(n_robots=13, message_size=2)
    numbers = DiscreteActions(small(n_robots=13, message_size=2))
    np.testing.assert_array_equal(numbers.reset_arrays(0), plain.reset_arrays(0))
    rng = np.random.default_rng(0)
    for _ in range(40):
        drawn = rng.integers(13, size=13)
        commands = [[*list(ACTIONS.values())[number], 0.0, 0.0] for number in drawn]
        np.testing.assert_equal(numbers.step_arrays(drawn), plain.step_arrays(commands))


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


@pytest.mark.parametrize(
    ("form", "action", "reason"),
    [
        (DiscreteActions, [0, 1, 2, 13], "robot_3 = 13: should be a whole number from 0 to 12"),
        (DiscreteActions, [0.5, 1, 2, 3], "robot_0 = 0.5"),
        (DiscreteActions, np.zeros((4, 4)), r"of shape \(4, 4\)"),
        (MotionFrame, np.zeros((4, 4)), r"of shape \(4, 4\)"),
        (MotionFrame, np.full((4, 3), np.nan), "should be finite"),
    ],
)
def test_what_is_no_action_is_refused_before_anything_moves(
    form: Callable[[Any], Any], action: Any, reason: str
) -> None:
    env = form(small(n_robots=4))
    env.reset(seed=0)
    with pytest.raises(CommandError, match=reason):
        env.step_arrays(action)
    with pytest.raises(CommandError):
        env.step(dict(zip(env.agents, action)))
    assert env.warehouse.state.step == 0


@pytest.mark.parametrize(
    ("form", "message"),
    [
        (DiscreteActions, r"whose commands are Discrete\(13\): should be around vectors"),
        (MotionFrame, r"should be around .*, as DiscreteActions\(MotionFrame\(env\)\)"),
        (CentralEnv, r"commands are Discrete\(13\), should be a Box"),
    ],
)
def test_what_numbers_cannot_be_wrapped_in_is_refused(form: Any, message: str) -> None:
    with pytest.raises(SetupError, match=message):
        form(DiscreteActions(small()))


def test_numbers_around_the_frame_of_motion_are_directions_in_it() -> None:
    numbers, outputs = DiscreteActions(MotionFrame(small())), MotionFrame(small())
    assert numbers.actions == tuple(name for name in ACTIONS if not name.startswith("turn"))
    np.testing.assert_array_equal(numbers.reset_arrays(0), outputs.reset_arrays(0))
    rng = np.random.default_rng(0)
    for _ in range(40):
        drawn = rng.integers(11, size=6)
        rows = [ACTIONS[numbers.actions[number]] for number in drawn]
        wanted = [(along, aside, gripper) for along, aside, _, gripper in rows]
        np.testing.assert_equal(numbers.step_arrays(drawn), outputs.step_arrays(wanted))


def test_masks_name_the_actions_that_change_something() -> None:
    faults = [Fault("removed", (2,), onset=0.25)]
    env = DiscreteActions(small(n_robots=3, drive="differential", faults=faults))
    _, infos = env.reset(seed=0)
    aside = [name for name, command in ACTIONS.items() if command[1]]
    assert not env.action_masks()[:, [NUMBERS[name] for name in aside]].any()
    assert env.action_masks().sum() == 3 * (len(ACTIONS) - len(aside))
    env.step(dict(zip(env.agents, [NUMBERS["hold"], NUMBERS["open"], NUMBERS["stay"]])))
    _, _, _, _, infos = env.step(dict.fromkeys(env.agents, NUMBERS["forward"]))
    legal = env.action_masks()[:, [NUMBERS["hold"], NUMBERS["open"]]]
    assert legal.tolist() == [[False, True], [True, False], [True, True]]
    np.testing.assert_array_equal(infos["robot_0"]["action_mask"], env.action_masks()[0])
    env.step(dict.fromkeys(env.agents, NUMBERS["forward"]))
    present = env.warehouse.state.robot_present
    assert env.action_masks()[~present].sum() == env.action_masks()[~present, 0].sum() == 1


def test_inputs_stay_within_bounds_that_are_finite_in_every_declared_world() -> None:
    env = ParameterChange(MotionFrame(small()), "handling_time", [0.0, 4.0])
    space = env.observation_space("robot_0")
    assert np.isfinite([space.low, space.high]).all()
    assert space.high[INPUTS.index("handling_time")] == pytest.approx(2.0, rel=1e-4)
    with pytest.raises(SetupError, match=r"handling_time = 5.0, .* declared by env"):
        MotionFrame(small()).reset(options={"scenario": {"handling_time": 5.0}})
    rows, _ = MotionFrame(small()).reset(options={"scenario": {"n_items": 5}})
    assert len(rows) == 6


def test_the_slowest_to_gather_speed_bounds_the_time_to_top_speed() -> None:
    kinds = "porter:3 max_acceleration=0.5, runner:1 max_speed=1.5 max_acceleration=3.0"
    high = MotionFrame(small(robot_kinds=kinds, max_speed=1.0)).observation_space("robot_0").high
    assert high[INPUTS.index("time_to_top_speed")] == pytest.approx(1.0 / 0.5, rel=1e-4)


def test_it_reads_and_commands_as_the_frame_of_the_shipped_networks_does() -> None:
    fields = {"n_robots": 4, "faults": [Fault("removed", 2, onset=0.5)], "duration": 1.0}
    env, inner = MotionFrame(small(**fields)), small(**fields)
    frame = motion.MotionView(Scenario())
    rng = np.random.default_rng(0)
    for seed in (3, 4):
        read, rows = env.reset_arrays(seed), inner.reset_arrays(seed)
        frame.begin(row_keys(seed, "motion frame", 4))
        while env.agents:
            present = inner.warehouse.state.robot_present
            np.testing.assert_array_equal(read[present], frame.read(rows)[present])
            assert not read[~present].any()
            outputs = rng.uniform(-1.0, 1.0, (4, 3))
            rows, *expected = inner.step_arrays(frame.command(outputs))
            read, *rest = env.step_arrays(outputs)
            np.testing.assert_equal(rest, expected)
        assert present.sum() == 2


def test_outputs_of_which_any_is_not_finite_are_refused_by_their_name() -> None:
    env = MotionFrame(small(n_robots=2))
    env.reset_arrays(0)
    with pytest.raises(CommandError, match=r"(?s)outputs = .*nan.*: should be finite"):
        env.step_arrays([[0.5, 0.0, 1.0], [0.5, np.nan, 1.0]])


@pytest.mark.parametrize("form", [DiscreteActions, MotionFrame])
def test_stable_baselines3_takes_either_for_every_row(form: Any) -> None:
    pytest.importorskip("stable_baselines3")
    from swarm_logistics_env.adapters import SwarmVecEnv

    env = SwarmVecEnv(make_env=lambda _: form(SwarmSize(small(duration=2.0), [2, 4])), n_worlds=2)
    env.reset()
    for _ in range(25):  # beyond the end of an episode
        rows, *_ = env.step(np.array([env.action_space.sample() for _ in range(8)]))
    assert rows.shape == (8, *env.observation_space.shape)
    assert np.isfinite(rows).all()


def test_the_motion_frame_steers_the_bodies_that_robots_have_in_the_episode() -> None:
    changed = MotionFrame(ParameterChange(small(), "drive", "differential"))
    always = MotionFrame(small(drive="differential"))
    rng = np.random.default_rng(0)
    np.testing.assert_array_equal(changed.reset_arrays(0), always.reset_arrays(0))
    for _ in range(10):
        outputs = rng.uniform(-1.0, 1.0, (6, 3))
        np.testing.assert_equal(changed.step_arrays(outputs), always.step_arrays(outputs))


class Numbered(Wrapper):
    """Tells each robot its number."""

    @property
    def robot_info(self) -> dict[str, NDArray[Any]]:
        return {"number": np.arange(self.n_rows)}


def test_masks_stand_beside_what_other_wrappers_tell_a_robot() -> None:
    _, infos = DiscreteActions(Numbered(small(n_robots=3))).reset(seed=0)
    for number, info in enumerate(infos.values()):
        assert info["number"] == number
        assert info["action_mask"].shape == (len(ACTIONS),)
