"""DotBots in their makers' simulator: their firmware drives them, their messages tell their poses.

It is stepped in this process, without its clock. It has no walls, so a fence of software stops
robots at those of the warehouse. Its frame has y down, millimetres, and headings that are 0 along y
and grow clockwise; a robot's pose is that of its axle.
"""

from __future__ import annotations

import contextlib
import io

import numpy as np
from dotbot.dotbot_simulator import (
    SIMULATOR_STEP_DELTA_T,
    DotBotSimulatorCommunicationInterface,
    InitStateToml,
    SimulatedDotBotSettings,
)
from dotbot.kinematics import TRACK_EFFECTIVE_MM
from dotbot.protocol import AXLE_UNKNOWN, DIRECTION_NONE, PayloadCommandWheelVelocity
from dotbot.sim.collisions import BODY_CENTRE_AHEAD_MM, BODY_RADIUS_MM
from dotbot_utils.protocol import Frame, Header, Packet
from numpy.typing import NDArray

from swarm_logistics_env.core.errors import BodiesError
from swarm_logistics_env.core.streams import generator
from swarm_logistics_env.world.scenario import Scenario

from .bodies import Orders, Placement, Poses
from .pose_guard import PoseGuard

# The upper end of the 1 to 2 mm that the firmware's makers measured (DotBot-libs,
# drv/pose_estimator.h); it is of each of the lighthouses' fixes, which the firmware filters.
_FIX_NOISE = 2.0  # [mm]
_PACKET_LOSS = 0.05  # of commands and of messages; chosen
# The firmware sends its pose every second interval: 10 times a second.
_SEND_INTERVAL = 50_000  # [us]
_FASTEST_WHEEL = 0.7  # [m/s] at full power, `dotbot.sim.plant`
_TRACK = TRACK_EFFECTIVE_MM / 1000.0
_AHEAD = BODY_CENTRE_AHEAD_MM / 1000.0  # [m] of the axle, the body's centre
_RADIUS = BODY_RADIUS_MM / 1000.0
_MARGIN = 1.0  # [m] around the warehouse in the simulator's frame, whose numbers are not negative
_LARGEST = 60.0  # [m]; an axle's position has 16 bits
# From the walls to a body's centre [m]: its radius, and what it swings by as it turns on its axle.
_FENCE = _RADIUS + _AHEAD
_FENCE_LAG = 0.2  # [s]: a pose is up to 0.1 s old, and a wheel takes as long to its speed
# A robot that is driven slower may stand: its wheels turn in pulses below 15 mm/s.
_LEAST_SPEED = 0.03  # [m/s]
_LEAST_TURN_RATE = 0.3  # [rad/s]

Numbers = NDArray[np.float64]


class DotbotsBodies:
    """DotBots in their simulator; equal seeds give equal bits on one machine."""

    def place(self, placement: Placement) -> None:
        """Put the robots where they begin, at rest, each with a pose that it knows.

        Raises:
            BodiesError: the scenario has what DotBots have not.
        """
        scenario = placement.scenario
        _check(placement)
        self._size = np.array([scenario.warehouse_width, scenario.warehouse_height])
        self._period = scenario.control_period
        self._n_ticks = round(self._period / SIMULATOR_STEP_DELTA_T)
        self._packets = generator(placement.seed, "dotbots packets")
        self._messages: list[Frame] = []
        axles, directions = self._to_frame(placement.position, placement.heading)
        robots = [
            SimulatedDotBotSettings(
                address=f"DB{robot:014X}",
                pos_x=round(axles[robot, 0]),
                pos_y=round(axles[robot, 1]),
                direction=round(directions[robot]),
                lh2_noise_mm=_FIX_NOISE,
            )
            for robot in range(scenario.n_robots)
        ]
        with contextlib.redirect_stdout(io.StringIO()):  # it prints that it has begun
            self._simulator = DotBotSimulatorCommunicationInterface(
                self._receive, InitStateToml(dotbots=robots)
            )
        self._simulator.plant.rng = generator(placement.seed, "dotbots fixes")
        for robot in range(scenario.n_robots):
            self._simulator.core.set_min_tx_interval(robot, _SEND_INTERVAL)
        self._addresses = [int(address, 16) for address in self._simulator.addresses]
        self._robots = {address: robot for robot, address in enumerate(self._addresses)}
        self._is_present = np.ones(scenario.n_robots, np.bool_)
        self._guard = PoseGuard(
            placement.position, placement.heading, self._period, scenario.highest_speed
        )

    def move(self, orders: Orders) -> Poses:
        """Send each robot its wheels' speeds, and take what it reports in a control period."""
        for robot in np.flatnonzero(self._is_present & ~orders.present).tolist():
            # Far from the others, as the simulator cannot take one out.
            self._simulator.dotbots[robot].kidnap(-1000.0 * (robot + 1), 0.0, 0.0)
        self._is_present = orders.present
        share = self._guard.speed_share * orders.present
        speed = share * self._fenced(orders.motion[:, 0])
        turn_rate = share * orders.motion[:, 2]
        self._send(speed, turn_rate)
        self._messages.clear()
        for _ in range(self._n_ticks):
            self._simulator.step()
        is_driven = (np.abs(speed) > _LEAST_SPEED) | (np.abs(turn_rate) > _LEAST_TURN_RATE)
        self._guard.update(*self._reported(), is_driven)
        guard = self._guard
        return Poses(
            guard.position.copy(), guard.heading.copy(), guard.velocity.copy(), guard.lost.copy()
        )

    def _fenced(self, speed: Numbers) -> Numbers:
        """Return speeds forward, 0 of a robot that would leave the warehouse."""
        guard = self._guard
        lookahead = self._period + _FENCE_LAG + guard.age
        direction = np.column_stack([np.cos(guard.heading), np.sin(guard.heading)])
        displacement = (lookahead * speed)[:, None] * direction
        end = guard.position + displacement
        leaves_low = (end < _FENCE) & (displacement < 0.0)
        leaves_high = (end > self._size - _FENCE) & (displacement > 0.0)
        return np.where((leaves_low | leaves_high).any(axis=1), 0.0, speed)

    def _send(self, speed: Numbers, turn_rate: Numbers) -> None:
        turning = 0.5 * _TRACK * turn_rate
        wheels = np.rint(1000.0 * np.column_stack([speed - turning, speed + turning])).astype(int)
        is_sent = self._packets.random(len(wheels)) >= _PACKET_LOSS
        for robot in np.flatnonzero(is_sent).tolist():
            left, right = wheels[robot].tolist()
            command = PayloadCommandWheelVelocity(left_mm_s=left, right_mm_s=right)
            header = Header(destination=self._addresses[robot], source=0)
            self._simulator.write(header.to_bytes() + Packet.from_payload(command).to_bytes())

    def _receive(self, frame: Frame) -> None:
        if self._packets.random() >= _PACKET_LOSS:
            self._messages.append(frame)

    def _reported(self) -> tuple[Numbers, Numbers, NDArray[np.bool_]]:
        """Return positions and headings, nan where none, and who was heard."""
        n_robots = len(self._addresses)
        axles = np.full((n_robots, 2), np.nan)
        directions = np.full(n_robots, np.nan)
        is_heard = np.zeros(n_robots, np.bool_)
        for frame in self._messages:
            robot = self._robots[int(frame.header.source)]
            pose = frame.packet.payload
            is_heard[robot] = True
            if pose.direction != DIRECTION_NONE and AXLE_UNKNOWN not in (pose.axle_x, pose.axle_y):
                axles[robot], directions[robot] = (pose.axle_x, pose.axle_y), pose.direction
        heading = -0.5 * np.pi - np.radians(directions)
        axle = np.column_stack([axles[:, 0], 1000.0 * self._height_in_frame - axles[:, 1]])
        forward = np.column_stack([np.cos(heading), np.sin(heading)])
        return axle / 1000.0 - _MARGIN + _AHEAD * forward, heading, is_heard

    def _to_frame(self, position: Numbers, heading: Numbers) -> tuple[Numbers, Numbers]:
        """Return axles [mm] and headings [degrees] in the simulator's frame."""
        forward = np.column_stack([np.cos(heading), np.sin(heading)])
        x, y = (position - _AHEAD * forward + _MARGIN).T
        axles = 1000.0 * np.column_stack([x, self._height_in_frame - y])
        return axles, np.remainder(-90.0 - np.degrees(heading) + 180.0, 360.0) - 180.0

    @property
    def _height_in_frame(self) -> float:
        return float(self._size[1] + 2.0 * _MARGIN)


def _check(placement: Placement) -> None:
    scenario = placement.scenario
    if "holonomic" in scenario.of_kinds("drive"):
        raise BodiesError("drive = 'holonomic': DotBots have two wheels, so should be differential")
    if len(placement.boxes) or len(placement.obstacles):
        name = f"floor = {scenario.floor!r}" if len(placement.boxes) else "n_obstacles"
        raise BodiesError(
            f"{name}: the DotBots' simulator has no racks or obstacles, so should be an empty room"
        )
    for radius in scenario.of_kinds("robot_radius"):
        if abs(radius - _RADIUS) > 1e-9:
            raise BodiesError(f"robot_radius = {radius} m: DotBots have {_RADIUS} m")
    size = max(scenario.warehouse_width, scenario.warehouse_height)
    if size > _LARGEST:
        raise BodiesError(f"a warehouse of {size} m: for DotBots should be at most {_LARGEST} m")
    _check_motion(scenario)


def _check_motion(scenario: Scenario) -> None:
    ticks = scenario.control_period / SIMULATOR_STEP_DELTA_T
    if abs(ticks - round(ticks)) > 1e-6:
        raise BodiesError(
            f"control_period = {scenario.control_period} s: for DotBots should be a multiple of "
            f"{SIMULATOR_STEP_DELTA_T} s, as their firmware steps"
        )
    speeds = scenario.of_kinds("max_speed")
    turn_rates = scenario.of_kinds("max_turn_rate")
    wheels = [
        speed + 0.5 * _TRACK * turn_rate
        for speed, turn_rate in zip(speeds, turn_rates, strict=True)
    ]
    wheel = max(wheels)
    if wheel > _FASTEST_WHEEL:
        fastest = wheels.index(wheel)
        raise BodiesError(
            f"max_speed = {speeds[fastest]} m/s with max_turn_rate = {turn_rates[fastest]} "
            f"rad/s: a DotBot's wheel would run at {wheel:.2f} m/s; should be at most "
            f"{_FASTEST_WHEEL} m/s, as in the preset dotbots"
        )
