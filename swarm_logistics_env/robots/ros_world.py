"""The simulated world as a node of ROS 2, and a swarm of nodes in it."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from typing import Any

from swarm_logistics_env.core.errors import RobotError
from swarm_logistics_env.robots import ros_messages
from swarm_logistics_env.robots.middleware import Arrival, Link, Middleware
from swarm_logistics_env.robots.ros_messages import load_rclpy
from swarm_logistics_env.robots.ros_robot import RobotNode
from swarm_logistics_env.world.scenario import Scenario, of_first_robots
from swarm_logistics_env.world.warehouse import Warehouse
from swarm_logistics_env.world.warehouse.faults import FaultLike

_MEETING_TIME = 30.0  # [s] of the wall's clock, for robots to come


class WorldNode:
    """The node `/world`: it publishes rows, takes commands, and moves the world in lock-step.

    In each control period it waits until every robot to which a row was delivered has answered,
    or until its patience ends. So a run in which nobody is late can be repeated to the bit,
    however slow the machine is, with and without losses; and it is that of `OverMiddleware`.

    Args:
        scenario: of the run.
        seed: of the run.
        faults: with which the world lets robots fail.
        middleware: what happens to rows and commands, in simulated time.
        patience: how long it waits in a control period [s of the wall's clock]; a robot that is
            later goes on with its last command, and is not waited for until it answers again.

    Attributes:
        node: the node of rclpy, for an executor.
        world: the world.
        middleware: as given.
        n_late: answers that did not come in time.

    Raises:
        RobotError: ROS 2 is not here.
    """

    def __init__(
        self,
        scenario: Scenario,
        seed: int,
        faults: Sequence[FaultLike] = (),
        middleware: Middleware | None = None,
        patience: float = 1.0,
    ) -> None:
        load_rclpy()
        from geometry_msgs.msg import TwistStamped
        from rclpy.node import Node
        from sensor_msgs.msg import JointState, LaserScan, PointCloud2

        self.world = Warehouse(scenario)
        self._rows = self.world.reset(seed, faults)
        self._bodies = of_first_robots(scenario)
        self.n_late = 0
        n_robots = scenario.n_robots
        self.middleware = middleware or Middleware()
        self._link = Link(self.middleware, scenario.control_period, n_robots, seed)
        self._patience = patience
        self._awaited: dict[int, int] = {}  # by robot, the period of the row
        self._silent: set[int] = set()  # who was late, and has not answered since
        self._halves: dict[tuple[int, int], dict[str, Any]] = {}  # by robot and period
        self.node = Node("world", start_parameter_services=False)
        self._publishers: list[tuple[Any, Any]] = []  # of scans and senses, by robot
        self._subscriptions = []
        for robot in range(n_robots):
            name = f"/robot_{robot}"
            scans = self.node.create_publisher(LaserScan, f"{name}/{ros_messages.SCAN}", 10)
            senses = self.node.create_publisher(PointCloud2, f"{name}/{ros_messages.SENSES}", 10)
            self._publishers.append((scans, senses))
            for kind, topic in (
                (TwistStamped, ros_messages.CMD_VEL),
                (JointState, ros_messages.GRIPPER),
            ):
                take = partial(self._take, robot, topic)
                subscription = self.node.create_subscription(kind, f"{name}/{topic}", take, 10)
                self._subscriptions.append(subscription)

    def meet_robots(self, executor: Any) -> None:
        """Wait until every robot is there.

        Raises:
            RobotError: some do not come, or there are two of a number.
        """
        end = time.monotonic() + _MEETING_TIME
        topics = [
            f"/robot_{robot}/{ros_messages.CMD_VEL}" for robot in range(len(self._publishers))
        ]
        missing = list(range(len(topics)))
        while missing and time.monotonic() < end:
            executor.spin_once(timeout_sec=0.01)
            missing = [
                robot
                for robot in missing
                if not self.node.count_publishers(topics[robot])
                or not all(topic.get_subscription_count() for topic in self._publishers[robot])
            ]
        if missing:
            numbers = ", ".join(map(str, missing))
            raise RobotError(f"robots {numbers}: should be there within {_MEETING_TIME:g} s")
        for topic in topics:
            if self.node.count_publishers(topic) > 1:
                raise RobotError(
                    f"{topic}: comes from several nodes, should come from one: another swarm is "
                    "near, so set ROS_DOMAIN_ID to another number"
                )

    def step(self, executor: Any) -> None:
        """Take one control period."""
        arrivals = self._link.deliver(self._rows)
        for arrival in arrivals:
            self._publish(arrival)
        self._awaited = {
            arrival.robot: arrival.period
            for arrival in arrivals
            if arrival.robot not in self._silent
        }
        end = time.monotonic() + self._patience
        while self._awaited and time.monotonic() < end:
            executor.spin_once(timeout_sec=0.05)
        self.n_late += len(self._awaited)
        self._silent |= self._awaited.keys()
        self._rows = self.world.step(self._link.commands())

    def _publish(self, arrival: Arrival) -> None:
        body = self._body_of(arrival.robot)
        stamp = ros_messages.stamp_of(arrival.period, body)
        scans, senses = self._publishers[arrival.robot]
        senses.publish(ros_messages.senses_of(arrival.row, body, stamp))
        scans.publish(ros_messages.scan_of(arrival.row, body, stamp))

    def _body_of(self, robot: int) -> Scenario:
        return self._bodies[robot % len(self._bodies)]

    def _take(self, robot: int, topic: str, message: Any) -> None:
        """Take half of a command; both halves are the answer to the row of their stamp."""
        body = self._body_of(robot)
        period = ros_messages.period_of(message.header.stamp, body)
        halves = self._halves.setdefault((robot, period), {})
        halves[topic] = message
        if len(halves) < 2:
            return
        del self._halves[robot, period]
        twist = halves[ros_messages.CMD_VEL]
        gripper = halves[ros_messages.GRIPPER]
        command = ros_messages.command_of(twist, gripper, body, robot)
        self._link.answer(robot, period, command)
        self._silent.discard(robot)
        if self._awaited.get(robot) == period:
            del self._awaited[robot]


@contextmanager
def executor_of_ros() -> Iterator[Any]:
    """Begin with ROS 2, and end with it; give what runs nodes in this thread.

    Raises:
        RobotError: ROS 2 is not here.
    """
    rclpy = load_rclpy()
    from rclpy.signals import SignalHandlerOptions

    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)  # Ctrl-C is Python's
    try:
        try:
            from rclpy.experimental import EventsExecutor as Executor  # three times as fast
        except ImportError:  # an older ROS 2
            from rclpy.executors import SingleThreadedExecutor as Executor
        executor = Executor()
        try:
            yield executor
        finally:
            nodes = executor.get_nodes()
            executor.shutdown()
            for node in nodes:  # or a next swarm in this process would meet them
                node.destroy_node()
    finally:
        rclpy.try_shutdown()


def play_swarm(policy: object, world: WorldNode, seed: int, executor: Any) -> None:
    """Play an episode of a world with a node for each robot, all in this process, to its end.

    One process is enough: the world stands still while robots decide, their messages go through
    the middleware all the same, and N processes would load N times what a policy needs.
    """
    body = world.world.scenario
    for number in range(body.n_robots):
        robot = RobotNode(
            policy, body, number, seed, stop_after=world.middleware.stop_after, is_alone=False
        )
        executor.add_node(robot.node)
    play_world(world, executor)


def play_world(world: WorldNode, executor: Any) -> None:
    """Play an episode of a world whose robots are nodes, wherever they are, to its end.

    Raises:
        RobotError: some robots do not come.
    """
    executor.add_node(world.node)
    world.meet_robots(executor)
    while not (world.world.is_over_time or world.world.all_delivered):
        world.step(executor)
