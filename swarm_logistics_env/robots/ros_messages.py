"""Rows and commands of a robot as messages of ROS 2, and back.

`scan` (sensor_msgs/LaserScan) holds the beams to walls, infinite where they meet nothing. `senses`
(sensor_msgs/PointCloud2) holds the other inputs of the contract: one point, and a field of float32
numbers for each input, by its name. `cmd_vel` (geometry_msgs/TwistStamped) is the velocity, and
`gripper` (sensor_msgs/JointState) the gripper's command as the position of a joint, above 0.5 to
hold and below -0.5 to let go. A command has the stamp of the scan that it answers.
"""

from __future__ import annotations

import functools
import math
from array import array
from collections.abc import Set
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swarm_logistics_env.core.errors import RobotError, how_to_install
from swarm_logistics_env.world.observations import N_BEAMS, Column, columns, n_columns
from swarm_logistics_env.world.scenario import Scenario

SCAN, SENSES, CMD_VEL, GRIPPER = "scan", "senses", "cmd_vel", "gripper"  # topics of a robot
_SCANNED = "range_walls"  # the input that the scan tells
_BEAM_ANGLE = math.tau / N_BEAMS
_FLOAT32 = 4  # [bytes]
_NANOSECONDS = 1_000_000_000


def load_rclpy() -> Any:
    """Return the module `rclpy`.

    Raises:
        RobotError: ROS 2 is not here.
    """
    try:
        import rclpy
    except ImportError as error:
        raise RobotError(
            f"ROS 2 is missing ({error}): source an installed one, or on Linux x86-64 "
            f"{how_to_install('ros')}"
        ) from error
    return rclpy


def stamp_of(period: int, body: Scenario) -> Any:
    """Return the time at which a control period begins, from 0 on, as builtin_interfaces/Time."""
    from builtin_interfaces.msg import Time

    seconds, nanoseconds = divmod(round(period * body.control_period * _NANOSECONDS), _NANOSECONDS)
    return Time(sec=seconds, nanosec=nanoseconds)


def seconds_of(stamp: Any) -> float:
    """Return a builtin_interfaces/Time in seconds."""
    return float(stamp.sec + stamp.nanosec / _NANOSECONDS)


def period_of(stamp: Any, body: Scenario) -> int:
    """Return the control period that begins at a time."""
    return round(seconds_of(stamp) / body.control_period)


@functools.cache
def _inputs(body: Scenario) -> dict[str, Column]:
    return {column.name: column for column in columns(body)}


def scan_of(row: NDArray[np.float32], body: Scenario, stamp: Any) -> Any:
    """Return the beams to walls of a row (D,) as sensor_msgs/LaserScan."""
    from sensor_msgs.msg import LaserScan

    beams = row[_inputs(body)[_SCANNED].columns]
    ranges = np.where(beams < np.float32(body.ranger_range), beams, np.float32(np.inf))
    scan = LaserScan(
        angle_max=_BEAM_ANGLE * (N_BEAMS - 1),
        angle_increment=_BEAM_ANGLE,
        scan_time=body.control_period,
        range_max=body.ranger_range,
        ranges=array("f", ranges.tobytes()),
    )
    scan.header.stamp = stamp
    return scan


@functools.cache
def _fields(body: Scenario) -> list[Any]:
    """Return the fields of `senses` as sensor_msgs/PointField."""
    from sensor_msgs.msg import PointField

    fields = []
    offset = 0
    for name, column in _inputs(body).items():
        if name != _SCANNED:
            count = len(range(n_columns(body))[column.columns])
            fields.append(
                PointField(name=name, offset=offset, datatype=PointField.FLOAT32, count=count)
            )
            offset += count * _FLOAT32
    return fields


def senses_of(row: NDArray[np.float32], body: Scenario, stamp: Any) -> Any:
    """Return the other inputs of a row (D,) as sensor_msgs/PointCloud2."""
    from sensor_msgs.msg import PointCloud2

    parts = [row[part.columns] for name, part in _inputs(body).items() if name != _SCANNED]
    data = array("B", np.concatenate(parts).tobytes())
    senses = PointCloud2(
        height=1,
        width=1,
        fields=_fields(body),
        point_step=len(data),
        row_step=len(data),
        data=data,
        is_dense=True,
    )
    senses.header.stamp = stamp
    return senses


def row_of(scan: Any, senses: Any, body: Scenario, ignores: Set[str] = frozenset()) -> Any:
    """Return the row (D,) of a scan and the other senses; what the policy ignores may be left out.

    Raises:
        RobotError: the scan has a gap, or the other senses lack an input or its numbers.
    """
    row = np.zeros(n_columns(body), np.float32)
    inputs = _inputs(body)
    missing = inputs.keys() - ignores - {_SCANNED}
    data = np.asarray(senses.data, np.uint8).tobytes()
    for field in senses.fields:
        if field.name not in inputs:
            continue
        numbers = row[inputs[field.name].columns]  # a view
        end = field.offset + numbers.nbytes
        if field.count != len(numbers) or end > len(data):
            raise RobotError(
                f"{SENSES}: {field.name} has {field.count} numbers, should have {len(numbers)}"
            )
        numbers[:] = np.frombuffer(data[field.offset : end], np.float32)
        missing.discard(field.name)
    if missing:
        raise RobotError(f"{SENSES}: lacks {', '.join(sorted(missing))}")
    reach = body.ranger_range
    beams = beams_of(scan.ranges, scan.angle_min, scan.angle_increment, reach)
    row[inputs[_SCANNED].columns] = beams
    return row


def beams_of(
    ranges: ArrayLike, angle_min: float, angle_increment: float, reach: float
) -> NDArray[np.float32]:
    """Return of a scan the beams (16,) that look nearest to where a row's beams look [m].

    Args:
        ranges: of the scan [m]; infinite where it meets nothing.
        angle_min: the direction of the first one [rad], to the left of forward.
        angle_increment: from one to the next [rad].
        reach: a row's largest range [m].

    Raises:
        RobotError: it has no beam within half a step of where a row's beam looks.
    """
    numbers = np.asarray(ranges, np.float32)
    angles = angle_min + angle_increment * np.arange(len(numbers))
    wanted = _BEAM_ANGLE * np.arange(N_BEAMS)
    apart = np.abs(np.remainder(wanted[:, np.newaxis] - angles + np.pi, math.tau) - np.pi)
    is_blind = apart.min(axis=1, initial=np.inf) > _BEAM_ANGLE / 2.0
    if is_blind.any():
        angle = math.degrees(wanted[is_blind.argmax()])
        raise RobotError(f"{SCAN}: has no beam at {angle:g} degrees, should look all around")
    beams: NDArray[np.float32] = np.clip(numbers[apart.argmin(axis=1)], 0.0, np.float32(reach))
    return beams


def top_speed(body: Scenario, number: int) -> tuple[float, float]:
    """Return the top speed [m/s] and the top turn rate [rad/s] of the robot of that number."""
    factor = body.speed_mix[number % len(body.speed_mix)]
    return factor * body.max_speed, factor * body.max_turn_rate


def messages_of(command: ArrayLike, body: Scenario, number: int, stamp: Any) -> tuple[Any, Any]:
    """Return the TwistStamped and the JointState of a command (4,) to the robot of that number."""
    from geometry_msgs.msg import TwistStamped
    from sensor_msgs.msg import JointState

    forward, left, turn, grip = np.asarray(command, np.float32).tolist()
    speed, turn_rate = top_speed(body, number)
    twist = TwistStamped()
    twist.header.stamp = stamp
    twist.twist.linear.x = forward * speed
    twist.twist.linear.y = left * speed
    twist.twist.angular.z = turn * turn_rate
    gripper = JointState(name=[GRIPPER], position=[grip])
    gripper.header.stamp = stamp
    return twist, gripper


def command_of(twist: Any, gripper: Any, body: Scenario, number: int) -> list[float]:
    """Return the command (4,) to the robot of that number; as float32 it is what was sent."""
    speed, turn_rate = top_speed(body, number)
    velocity = twist.twist
    forward = velocity.linear.x / speed
    left = velocity.linear.y / speed
    turn = velocity.angular.z / turn_rate
    return [forward, left, turn, gripper.position[0]]
