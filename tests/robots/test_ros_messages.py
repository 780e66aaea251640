"""Messages of ROS 2, there and back, with stand-ins for its types: the gate has none."""

from __future__ import annotations

import math
import sys
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import Scenario
from swarm_logistics_env.core.errors import RobotError
from swarm_logistics_env.robots import ros_messages
from swarm_logistics_env.robots.ros_messages import beams_of
from swarm_logistics_env.world.observations import columns, n_columns

BODY = Scenario(max_speed=0.5, max_turn_rate=2.0, speed_mix=(1.0, 0.5), ranger_range=3.0)


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


def test_stamps_tell_their_period_whatever_its_length() -> None:
    for length in (0.1, 0.03, 0.07 / 3):
        body = Scenario(control_period=length, physics_period=length / 7)
        for period in (0, 1, 17, 50_000):
            nanoseconds = round(period * length * 1e9)
            stamp = SimpleNamespace(sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)
            assert ros_messages.period_of(stamp, body) == period


class _Message(SimpleNamespace):
    """Takes any field; the header and what a twist holds are there from the start."""

    FLOAT32 = 7

    def __init__(self, **fields: Any) -> None:
        twist = SimpleNamespace(linear=SimpleNamespace(), angular=SimpleNamespace())
        super().__init__(header=SimpleNamespace(), twist=twist, angle_min=0.0, **fields)


@pytest.fixture
def types_of_messages(monkeypatch: pytest.MonkeyPatch) -> None:
    for package in ("builtin_interfaces", "geometry_msgs", "sensor_msgs"):
        module: Any = ModuleType(f"{package}.msg")
        for name in ("Time", "TwistStamped", "LaserScan", "PointField", "PointCloud2"):
            setattr(module, name, _Message)
        module.JointState = _Message
        monkeypatch.setitem(sys.modules, package, ModuleType(package))
        monkeypatch.setitem(sys.modules, f"{package}.msg", module)
    monkeypatch.setattr(ros_messages, "_fields", ros_messages._fields.__wrapped__)


def row() -> NDArray[np.float32]:
    numbers = np.random.default_rng(1).uniform(0.1, 0.9, n_columns(BODY)).astype(np.float32)
    walls = next(column for column in columns(BODY) if column.name == "range_walls")
    numbers[walls.columns] = np.linspace(0.2, 3.0, 16)
    return numbers


@pytest.mark.usefixtures("types_of_messages")
def test_a_row_comes_back_from_its_messages() -> None:
    stamp = ros_messages.stamp_of(25, BODY)
    assert (stamp.sec, stamp.nanosec) == divmod(round(25 * BODY.control_period * 1e9), 10**9)
    assert ros_messages.period_of(stamp, BODY) == 25
    scan = ros_messages.scan_of(row(), BODY, stamp)
    assert scan.ranges[-1] == np.inf  # nothing within its reach
    assert scan.range_max == 3.0
    assert scan.scan_time == BODY.control_period
    assert scan.angle_max == pytest.approx(15 / 16 * 2 * np.pi)
    assert scan.header.stamp is stamp
    senses = ros_messages.senses_of(row(), BODY, stamp)
    assert len(senses.data) == senses.point_step == senses.row_step == 4 * (n_columns(BODY) - 16)
    assert (senses.width, senses.height, senses.is_dense) == (1, 1, True)
    np.testing.assert_array_equal(ros_messages.row_of(scan, senses, BODY), row())


@pytest.mark.usefixtures("types_of_messages")
def test_senses_that_lack_an_input_or_its_numbers_are_refused() -> None:
    scan = ros_messages.scan_of(row(), BODY, None)
    senses = ros_messages.senses_of(row(), BODY, None)
    first, *other_fields = senses.fields
    senses.fields = [SimpleNamespace(name="extra", offset=0, count=1), *other_fields]
    with pytest.raises(RobotError, match=f"senses: lacks {first.name}"):
        ros_messages.row_of(scan, senses, BODY)
    without = ros_messages.row_of(scan, senses, BODY, {first.name})
    column = next(column for column in columns(BODY) if column.name == first.name)
    assert not without[column.columns].any()
    short = _Message(name=first.name, offset=first.offset, count=first.count + 1)
    senses.fields = [short, *other_fields]
    with pytest.raises(RobotError, match=f"{first.name} has {first.count + 1} numbers, should"):
        ros_messages.row_of(scan, senses, BODY)


@pytest.mark.usefixtures("types_of_messages")
def test_a_command_comes_back_from_its_messages() -> None:
    for number, speed in ((0, 0.5), (1, 0.25), (2, 0.5)):
        twist, gripper = ros_messages.messages_of([0.5, -1.0, 0.25, 1.0], BODY, number, "now")
        assert twist.twist.linear.x == 0.5 * speed
        assert twist.twist.linear.y == -speed
        assert twist.twist.angular.z == 0.25 * 2.0 * speed / 0.5
        assert gripper.name == ["gripper"]
        assert twist.header.stamp == gripper.header.stamp == "now"
        command = ros_messages.command_of(twist, gripper, BODY, number)
        assert command == [0.5, -1.0, 0.25, 1.0]
