"""What needs no ROS of its messages: beams of any lidar, and the way of commands and back."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from swarm_logistics_env import Scenario
from swarm_logistics_env.core.errors import RobotError
from swarm_logistics_env.robots import ros_messages
from swarm_logistics_env.robots.ros_messages import beams_of


def test_a_lidar_of_any_resolution_gives_the_beams_that_look_as_those_of_a_row() -> None:
    degrees = np.arange(-180, 180)
    beams = beams_of(np.abs(degrees) / 90.0, -math.pi, math.radians(1.0), reach=1.5)
    assert beams.dtype == np.float32
    # 22.5 degrees lie between two beams, so either will do; beyond the reach it meets nothing.
    np.testing.assert_allclose(beams[:4], [0.0, 0.25, 0.5, 0.75], atol=0.006)
    np.testing.assert_allclose(beams[6:11], 1.5)
    np.testing.assert_allclose(beams[-3:], [0.75, 0.5, 0.25], atol=0.006)
    nothing_and_too_near = [math.inf, -math.inf] * 8
    assert beams_of(nothing_and_too_near, 0.0, math.tau / 16, 2.0).tolist() == [2.0, 0.0] * 8


@pytest.mark.parametrize(("n_beams", "degrees"), [(180, 202.5), (0, 0)])
def test_a_lidar_that_does_not_look_all_around_is_refused(n_beams: int, degrees: float) -> None:
    with pytest.raises(RobotError, match=f"scan: has no beam at {degrees:g} degrees"):
        beams_of(np.ones(n_beams), 0.0, math.radians(1.0), reach=2.0)


def test_senses_of_another_length_are_refused() -> None:
    timer = SimpleNamespace(name="timer", offset=0, count=2)
    senses = SimpleNamespace(data=[0] * 8, fields=[timer])
    with pytest.raises(RobotError, match="senses: timer has 2 numbers, should have 1"):
        ros_messages.row_of(None, senses, Scenario())


def test_stamps_tell_their_period_whatever_its_length() -> None:
    for length in (0.1, 0.03, 0.07 / 3):
        body = Scenario(control_period=length, physics_period=length / 7)
        for period in (0, 1, 17, 50_000):
            nanoseconds = round(period * length * 1e9)
            stamp = SimpleNamespace(sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)
            assert ros_messages.period_of(stamp, body) == period
