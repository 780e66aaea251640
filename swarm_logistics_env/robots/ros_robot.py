"""One robot as a node of ROS 2: its senses in, its velocity and its gripper's command out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from swarm_logistics_env.core.errors import SwarmLogisticsError
from swarm_logistics_env.policies.row_policy import Robot, check_row_policy, refuse_messages
from swarm_logistics_env.robots import ros_messages
from swarm_logistics_env.robots.fault_layer import FaultLayer
from swarm_logistics_env.robots.middleware import RobotOverMiddleware
from swarm_logistics_env.robots.ros_messages import load_rclpy
from swarm_logistics_env.world.observations import n_columns
from swarm_logistics_env.world.scenario import Scenario
from swarm_logistics_env.world.warehouse.commands import MESSAGE
from swarm_logistics_env.world.warehouse.faults import FaultLike


class RobotNode:
    """The node `/robot_3/robot`: it subscribes to `scan` and `senses`, see `ros_messages`.

    Once both have come, with stamps less than half a control period apart, it decides, and
    publishes `gripper` and `cmd_vel`. Where it could not decide for `stop_after` control periods of
    its clock, it tells the robot to stand, once a period.

    Args:
        policy: as `policies.load` returns it; it has to decide from rows alone.
        body: a scenario, see `Robot`; its control period is the robot's.
        number: of the robot in its swarm, from 0 on; its topics begin with it.
        seed: of the swarm, or of the trial.
        faults: with which the robot fails, by a `FaultLayer`, from its first row on; where the
            world lets robots fail, none.
        stop_after: control periods.
        is_alone: its clock says when a row is late, and senders need not be reliable, as drivers
            are not; else a simulated world stops robots itself, in its own time, and is reliable.

    Attributes:
        node: the node of rclpy, for an executor.

    Raises:
        FaultError: a fault cannot be.
        PolicyError: the policy does not decide from rows alone.
        RobotError: ROS 2 is not here.
    """

    def __init__(
        self,
        policy: object,
        body: Scenario,
        number: int,
        seed: int,
        *,
        faults: Sequence[FaultLike] = (),
        stop_after: int = 5,
        is_alone: bool = True,
    ) -> None:
        load_rclpy()
        from geometry_msgs.msg import TwistStamped
        from rclpy.node import Node
        from rclpy.qos import QoSProfile, qos_profile_sensor_data
        from sensor_msgs.msg import JointState, LaserScan, PointCloud2

        # Another one decides first, so that kernels are compiled before a row comes.
        Robot(policy, body, body.control_period, seed, number).step(np.zeros(n_columns(body)))
        robot = Robot(policy, body, body.control_period, seed, number)
        self._robot = RobotOverMiddleware(robot, stop_after)
        self._ignores = check_row_policy(policy).ignores
        refuse_messages(policy, "ROS 2")
        self._body = body.of_robot(number)
        self._number = number
        self._layer = FaultLayer(faults, body, number, seed) if faults else None
        self._patience = stop_after * body.control_period
        self._scan: Any = None
        self._senses: Any = None
        self._first_stamp: Any = None
        self._last_stamp: Any = None
        self._is_late = False
        self.node = Node("robot", namespace=f"robot_{number}", start_parameter_services=False)
        self._clock = self.node.get_clock()
        self._decided_at = self._clock.now()
        quality = qos_profile_sensor_data if is_alone else QoSProfile(depth=10)
        self._twists = self.node.create_publisher(TwistStamped, ros_messages.CMD_VEL, 10)
        self._grippers = self.node.create_publisher(JointState, ros_messages.GRIPPER, 10)
        self._subscriptions = (
            self.node.create_subscription(LaserScan, ros_messages.SCAN, self._take_scan, quality),
            self.node.create_subscription(
                PointCloud2, ros_messages.SENSES, self._take_senses, quality
            ),
        )
        if is_alone:
            self._timer = self.node.create_timer(body.control_period, self.stop_if_late)

    def stop_if_late(self) -> bool:
        """Tell the robot to stand if its row is late, and return whether it is."""
        waited = (self._clock.now() - self._decided_at).nanoseconds / 1e9
        # Before the first row nothing moves, and nobody knows the time of the senses.
        if self._last_stamp is None or waited <= self._patience:
            return False
        if not self._is_late:
            self.node.get_logger().warning(f"no row for {waited:.2f} s: the robot stands")
        self._is_late = True
        self.stand()
        return True

    def stand(self) -> None:
        """Tell the robot to stand; its gripper stays as it is."""
        self._publish(np.zeros(MESSAGE), self._last_stamp or self._clock.now().to_msg())

    def _take_scan(self, scan: Any) -> None:
        self._scan = scan
        self._decide_if_complete()

    def _take_senses(self, senses: Any) -> None:
        self._senses = senses
        self._decide_if_complete()

    def _decide_if_complete(self) -> None:
        if self._scan is None or self._senses is None:
            return
        stamp = self._scan.header.stamp
        stamps = (stamp, self._senses.header.stamp)
        scanned_at, sensed_at = map(ros_messages.seconds_of, stamps)
        if abs(scanned_at - sensed_at) > 0.5 * self._body.control_period:
            return
        try:
            row = ros_messages.row_of(self._scan, self._senses, self._body, self._ignores)
            command = self._decision(row, stamp)
        except SwarmLogisticsError as error:  # as if no row had come
            self.node.get_logger().error(str(error))
            return
        finally:
            self._scan = None
            self._senses = None
        self._last_stamp = stamp
        self._is_late = False
        self._decided_at = self._clock.now()
        self._publish(command, stamp)

    def _decision(self, row: ArrayLike, stamp: Any) -> ArrayLike:
        now = ros_messages.seconds_of(stamp)
        elapsed = now - ros_messages.seconds_of(self._last_stamp or stamp)
        n_periods = round(elapsed / self._body.control_period)
        if self._layer is None:
            return self._robot.step(row, n_periods)
        self._first_stamp = self._first_stamp or stamp
        time = now - ros_messages.seconds_of(self._first_stamp)
        sensed = self._layer.sensed(row, time)
        return self._layer.driven(self._robot.step(sensed, n_periods), sensed, time)

    def _publish(self, command: ArrayLike, stamp: Any) -> None:
        twist, gripper = ros_messages.messages_of(command, self._body, self._number, stamp)
        self._grippers.publish(gripper)
        self._twists.publish(twist)
