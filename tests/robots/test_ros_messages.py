"""Messages of ROS 2 with stand-ins for its types, as the gate has none: `make ros` has them."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Scenario
from swarm_logistics_env.core.errors import RobotError
from swarm_logistics_env.robots import ros_messages
from swarm_logistics_env.world.observations import columns, n_columns

BODY = Scenario(max_speed=0.5, max_turn_rate=2.0, speed_mix=(1.0, 0.5), ranger_range=3.0)


class _Message(SimpleNamespace):
    """Takes any field; the header and what a twist holds are there from the start."""

    FLOAT32 = 7

    def __init__(self, **fields: Any) -> None:
        twist = SimpleNamespace(linear=SimpleNamespace(), angular=SimpleNamespace())
        super().__init__(header=SimpleNamespace(), twist=twist, angle_min=0.0, **fields)


@pytest.fixture(autouse=True)
def types_of_messages(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    for package in ("builtin_interfaces", "geometry_msgs", "sensor_msgs"):
        module: Any = ModuleType(f"{package}.msg")
        for name in ("Time", "TwistStamped", "LaserScan", "PointField", "PointCloud2"):
            setattr(module, name, _Message)
        module.JointState = _Message
        monkeypatch.setitem(sys.modules, package, ModuleType(package))
        monkeypatch.setitem(sys.modules, f"{package}.msg", module)
    ros_messages._fields.cache_clear()
    yield
    ros_messages._fields.cache_clear()


def row() -> np.ndarray[Any, np.dtype[np.float32]]:
    numbers = np.random.default_rng(1).uniform(0.1, 0.9, n_columns(BODY)).astype(np.float32)
    walls = next(column for column in columns(BODY) if column.name == "range_walls")
    numbers[walls.columns] = np.linspace(0.2, 3.0, 16)
    return numbers


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


def test_what_lacks_an_input_or_a_beam_is_refused() -> None:
    scan = ros_messages.scan_of(row(), BODY, None)
    senses = ros_messages.senses_of(row(), BODY, None)
    first, *others = senses.fields
    senses.fields = [SimpleNamespace(name="extra", offset=0, count=1), *others]
    with pytest.raises(RobotError, match=f"senses: lacks {first.name}"):
        ros_messages.row_of(scan, senses, BODY)
    without = ros_messages.row_of(scan, senses, BODY, {first.name})
    column = next(column for column in columns(BODY) if column.name == first.name)
    assert not without[column.columns].any()
    short = _Message(name=first.name, offset=first.offset, count=first.count + 1)
    senses.fields = [short, *others]
    with pytest.raises(RobotError, match=f"{first.name} has {first.count + 1} numbers, should"):
        ros_messages.row_of(scan, senses, BODY)
    with pytest.raises(RobotError, match="no beam at 180 degrees"):
        ros_messages.beams_of(np.ones(8), 0.0, np.pi / 8, 3.0)
    # Of a scan with more beams, begun behind, those that look nearest; never beyond the reach.
    angles = -np.pi + np.pi / 32 * np.arange(64)
    beams = ros_messages.beams_of(5.0 * np.abs(angles) / np.pi, -np.pi, np.pi / 32, 3.0)
    assert beams[0] == pytest.approx(0.0, abs=1e-6)
    assert beams[4] == pytest.approx(2.5)
    assert beams[8] == 3.0


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
