"""A swarm over ROS 2: `make ros` makes an environment in which these tests run."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Scenario, Warehouse, policies
from swarm_logistics_env.core.errors import RobotError
from swarm_logistics_env.robots import ros_messages, ros_world
from swarm_logistics_env.robots.middleware import Middleware, OverMiddleware
from swarm_logistics_env.robots.ros_robot import RobotNode
from swarm_logistics_env.robots.ros_world import WorldNode, executor_of_ros, play_swarm
from swarm_logistics_env.views.cli import app

pytest.importorskip("rclpy", reason="ROS 2 is not here: make ros")
# What ROS 2 imports imports `sre_parse`.
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")

SWARM = Scenario(
    n_robots=4, n_items=8, warehouse_width=5.0, warehouse_height=4.0, duration=10.0,
    speed_mix=(1.0, 0.7), max_turn_rate=3.14, drive="differential",
)  # fmt: skip
SEED = 3


@pytest.fixture
def executor(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    monkeypatch.setenv("ROS_DOMAIN_ID", "84")
    with executor_of_ros() as executor:
        yield executor


@pytest.mark.parametrize("settings", [{}, {"loss": 0.2, "delay": 0.05, "jitter": 0.1}])
def test_a_run_over_ros_is_the_run_without_it_to_the_bit(
    executor: Any, settings: dict[str, Any]
) -> None:
    world = WorldNode(SWARM, SEED, ["dead:1@5"], Middleware(**settings), patience=30.0)
    play_swarm(policies.load("homing"), world, SEED, executor)
    over_middleware = OverMiddleware("homing", **settings)
    over_middleware.configure(SWARM)
    over_middleware.reset(SWARM.n_robots, SEED)
    without_ros = Warehouse(SWARM)
    rows = without_ros.reset(SEED, ["dead:1@5"])
    starts = without_ros.state.robot_position.copy()
    while not without_ros.is_over_time:
        rows = without_ros.step(over_middleware.act(rows))
    assert world.n_late == 0
    places = world.world.state.robot_position
    np.testing.assert_array_equal(places, without_ros.state.robot_position)
    assert np.hypot(*(places - starts).T).max() > 0.5


class Listener:
    """Hears what a robot's node tells its motors, and sends it rows."""

    def __init__(self, executor: Any, robot: RobotNode) -> None:
        from geometry_msgs.msg import TwistStamped
        from rclpy.node import Node
        from sensor_msgs.msg import LaserScan, PointCloud2

        self.node = Node("listener")
        self.speeds: list[float] = []
        self._executor = executor
        self._scans = self.node.create_publisher(LaserScan, "/robot_0/scan", 10)
        self._senses = self.node.create_publisher(PointCloud2, "/robot_0/senses", 10)
        self._subscription = self.node.create_subscription(
            TwistStamped, "/robot_0/cmd_vel", self._take, 10
        )
        for node in (self.node, robot.node):
            executor.add_node(node)
        while not (self._scans.get_subscription_count() and self._senses.get_subscription_count()):
            executor.spin_once(timeout_sec=0.01)

    def send(self, row: Any, period: int) -> None:
        stamp = ros_messages.stamp_of(period, SWARM)
        self._senses.publish(ros_messages.senses_of(row, SWARM, stamp))
        self._scans.publish(ros_messages.scan_of(row, SWARM, stamp))

    def wait_for(self, n_commands: int) -> list[float]:
        end = time.monotonic() + 20.0
        while len(self.speeds) < n_commands and time.monotonic() < end:
            self._executor.spin_once(timeout_sec=0.05)
        return self.speeds[:n_commands]

    def _take(self, twist: Any) -> None:
        velocity = twist.twist
        self.speeds.append(abs(velocity.linear.x) + abs(velocity.angular.z))


@pytest.mark.parametrize("faults", [(), ("dead:4",)])
def test_a_robot_stands_when_its_row_is_late_or_when_it_is_dead(
    executor: Any, faults: tuple[str, ...]
) -> None:
    row = Warehouse(SWARM).reset(SEED)[0]
    policy = policies.load("homing")
    robot = RobotNode(policy, SWARM, 0, SEED, faults=faults, stop_after=1)
    listener = Listener(executor, robot)
    assert not robot.stop_if_late()  # nobody steered it yet
    unreadable = row.copy()
    unreadable[0] = np.nan
    listener.send(unreadable, period=0)
    listener.send(row, period=1)
    decided, stopped = listener.wait_for(2)
    assert (decided > 0.0) == (not faults)
    assert stopped == 0.0
    assert robot.stop_if_late()
    robot.stand()
    assert listener.wait_for(3)[2] == 0.0


def test_a_robot_may_leave_out_what_its_policy_ignores() -> None:
    stamp = ros_messages.stamp_of(0, SWARM)
    row = Warehouse(SWARM).reset(SEED)[0]
    scan = ros_messages.scan_of(row, SWARM, stamp)
    senses = ros_messages.senses_of(row, SWARM, stamp)
    np.testing.assert_array_equal(ros_messages.row_of(scan, senses, SWARM), row)
    senses.fields = senses.fields[::-1]
    np.testing.assert_array_equal(ros_messages.row_of(scan, senses, SWARM), row)
    senses.fields = [field for field in senses.fields if field.name != "contact"]
    np.testing.assert_array_equal(ros_messages.row_of(scan, senses, SWARM, {"contact"}), row)
    with pytest.raises(RobotError, match="senses: lacks contact"):
        ros_messages.row_of(scan, senses, SWARM)


def test_a_world_says_who_does_not_come(executor: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ros_world, "_MEETING_TIME", 0.2)
    with pytest.raises(RobotError, match="robots 0, 1, 2, 3: should be there"):
        ros_world.play_world(WorldNode(SWARM, SEED), executor)


def test_who_does_not_answer_is_waited_for_once(executor: Any) -> None:
    world = WorldNode(SWARM, SEED, patience=0.01)
    executor.add_node(world.node)
    for _ in range(3):
        world.step(executor)
    assert world.n_late == SWARM.n_robots


def test_a_command_launches_world_and_robots(capfd: pytest.CaptureFixture[str]) -> None:
    command = ["ros", "homing", "--set", "n_robots=3", "--set", "duration=1", "--patience", "30"]
    assert app.run([*command, "--loss", "0.1"]) == 0
    assert capfd.readouterr().out == (
        "P = 0 items delivered in 1 s by 3 robots with homing over ROS 2, seed 0\n"
    )
    assert app.run([*command, "--only", "3"]) == 2
    assert "--only 3: should be world, or a robot from 0 to 2" in capfd.readouterr().err
