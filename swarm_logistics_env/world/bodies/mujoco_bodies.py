"""Robots on wheels, or on a driven planar joint, in MuJoCo.

A differential robot is a chassis with two driven wheels and two casters that slide: it slips where
friction gives way. Its motors turn it first, and drive it by the torque that is left. A holonomic
one slides on a plane, pushed and turned by forces, as no wheels of that kind are modelled. All
outlines are spheres at one height, which meet as discs do, so wheels are as large on all robots.
Items are no bodies here: one that is carried adds its mass to its robot, and robots drive through
free ones.
"""

from __future__ import annotations

import math
import os
from xml.etree import ElementTree as Xml

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.core.errors import BodiesError
from swarm_logistics_env.world.scenario import Scenario, of_first_robots

from .bodies import Orders, Placement, Poses

try:
    import mujoco
except Exception:
    # It refuses a MUJOCO_GL that this machine cannot draw with, and nothing is drawn here.
    drawing = os.environ.get("MUJOCO_GL")
    if drawing is None:
        raise
    os.environ["MUJOCO_GL"] = "disable"
    try:
        import mujoco
    finally:
        os.environ["MUJOCO_GL"] = drawing

_TIMESTEP = 0.005  # [s] at most
_ITEM_MASS = 0.3  # of a robot's mass, that a carried item adds
_WHEEL_MASS = 0.1  # of a robot's mass, in each wheel
_WHEEL_FRICTION = 0.9  # rubber on a floor
# [m/s2] that motors give at most, less than rubber holds, as wheels that spin do not steer.
_STRONGEST = 5.0
_OUTLINE_FRICTION = 0.2  # robots on each other and on walls
# Inertia that a motor adds to its wheel, of a ring of the robot's mass; without, it is unstable.
_ARMATURE = 0.1
_ANSWER = 0.05  # [s] in which a wheel comes near its wanted speed
_TRACK = 1.4  # of a robot's radius, between its wheels
_WALL = 0.05  # [m] half the thickness of a wall
# Categories of geoms: outlines meet each other, wheels and casters the floor alone.
_OUTLINE = 1
_FLOOR = 2

Numbers = NDArray[np.float64]


class MujocoBodies:
    """Bodies in MuJoCo; equal seeds give equal bits on one machine."""

    def place(self, placement: Placement) -> None:
        """Build the model and put the robots where they begin, at rest.

        Raises:
            BodiesError: MuJoCo cannot build it.
        """
        scenario = placement.scenario
        self._scenario = scenario
        self._n_substeps = math.ceil(scenario.control_period / _TIMESTEP - 1e-9)
        self._timestep = scenario.control_period / self._n_substeps
        model = _model(placement, self._timestep)
        try:
            self._model = mujoco.MjModel.from_xml_string(Xml.tostring(model, encoding="unicode"))
        except ValueError as error:
            raise BodiesError(f"MuJoCo cannot build this scenario: {error}") from error
        self._data = mujoco.MjData(self._model)
        names = [f"robot {robot}" for robot in range(scenario.n_robots)]
        self._chassis = np.array([self._model.body(name).id for name in names])
        joints = self._model.body_jntadr[self._chassis]
        self._positions = self._model.jnt_qposadr[joints]  # the first of each robot's in qpos
        self._velocities = self._model.jnt_dofadr[joints]  # and in qvel
        wheels = self._model.actuator_trnid[:, 0].reshape(-1, 2)
        self._wheels = self._model.jnt_dofadr[wheels]  # left and right, in qvel, of who has some
        slides = scenario.of_robots("drive") == "holonomic"
        self._sliding = np.flatnonzero(slides)  # robots
        self._wheeled = np.flatnonzero(~slides)
        self._limits = scenario.of_robots("max_acceleration")  # [m/s2]
        self._tracks = _TRACK * scenario.of_robots("robot_radius")[self._wheeled]  # [m]
        self._masses = self._model.body_mass[self._chassis].copy()
        self._is_present = np.ones(scenario.n_robots, np.bool_)
        self._put(placement)
        mujoco.mj_forward(self._model, self._data)

    def move(self, orders: Orders) -> Poses:
        """Drive for a control period.

        Raises:
            BodiesError: the simulation became unstable.
        """
        for robot in np.flatnonzero(self._is_present & ~orders.present).tolist():
            self._take_out(robot)
        self._is_present = orders.present
        self._model.body_mass[self._chassis] = self._masses * (1.0 + _ITEM_MASS * orders.laden)
        for _ in range(self._n_substeps):
            if len(self._sliding):
                self._push(orders)
            if len(self._wheeled):
                self._turn_wheels(orders)
            mujoco.mj_step(self._model, self._data)
        if any(warning.number for warning in self._data.warning):
            raise BodiesError(
                f"MuJoCo became unstable after {self._data.time:.1f} s: should have a smaller "
                "max_acceleration, max_speed or max_turn_rate"
            )
        return self._poses()

    def _put(self, placement: Placement) -> None:
        half = placement.heading / 2.0
        height = _wheel_radius(self._scenario)
        for robot, first in enumerate(self._positions.tolist()):
            self._data.qpos[first : first + 2] = placement.position[robot]
            if robot in self._sliding:
                self._data.qpos[first + 2] = placement.heading[robot]
            else:
                quaternion = math.cos(half[robot]), 0.0, 0.0, math.sin(half[robot])
                self._data.qpos[first + 2 : first + 7] = height, *quaternion

    def _push(self, orders: Orders) -> None:
        """Push and turn robots towards what they want, by their greatest acceleration at most."""
        data = self._data
        robots = self._sliding
        first = self._velocities[robots]
        heading = data.qpos[self._positions[robots] + 2]
        forward, left, turn_rate = orders.motion[robots].T
        wanted = np.column_stack(
            [
                np.cos(heading) * forward - np.sin(heading) * left,
                np.sin(heading) * forward + np.cos(heading) * left,
            ]
        )
        change = wanted - data.qvel[first[:, None] + np.arange(2)]
        acceleration = change / self._timestep
        size = np.linalg.norm(acceleration, axis=1, keepdims=True)
        limit = self._limits[robots, None]
        acceleration *= np.minimum(1.0, limit / np.maximum(size, 1e-12))
        mass = self._model.body_mass[self._chassis[robots]]
        inertia = self._model.body_inertia[self._chassis[robots], 2]
        turn = (turn_rate - data.qvel[first + 2]) / _ANSWER
        data.qfrc_applied[first] = mass * acceleration[:, 0]
        data.qfrc_applied[first + 1] = mass * acceleration[:, 1]
        data.qfrc_applied[first + 2] = inertia * turn

    def _turn_wheels(self, orders: Orders) -> None:
        """Give the motors speeds within their torque: for turning first, for driving what is left.

        With both wheels at their limit, a robot that presses on a wall could not turn.
        """
        radius = _wheel_radius(self._scenario)
        wheels = self._data.qvel[self._wheels]  # left and right [rad/s]
        left, right = wheels.T
        motion = orders.motion[self._wheeled]
        forward = motion[:, 0] / radius - (right + left) / 2.0
        turning = 0.5 * self._tracks * motion[:, 2] / radius - (right - left) / 2.0
        greatest = np.minimum(self._limits[self._wheeled], _STRONGEST)
        limit = _ANSWER * greatest / radius  # what takes all the torque
        turning = np.clip(turning, -limit, limit)
        left_over = limit - np.abs(turning)
        forward = np.clip(forward, -left_over, left_over)
        change = np.column_stack([forward - turning, forward + turning])
        self._data.ctrl[:] = (wheels + change).ravel()

    def _poses(self) -> Poses:
        data = self._data
        position = data.qpos[self._positions[:, None] + np.arange(2)]
        velocity = data.qvel[self._velocities[:, None] + np.arange(2)]
        heading = data.qpos[self._positions + 2]  # of who slides
        w, x, y, z = data.qpos[self._positions[self._wheeled, None] + np.arange(3, 7)].T
        sine, cosine = 2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)
        # Numpy's last bit depends on the processor.
        heading[self._wheeled] = [*map(math.atan2, sine.tolist(), cosine.tolist())]
        return Poses(position, heading, velocity, np.zeros(len(position), np.bool_))

    def _take_out(self, robot: int) -> None:
        """Let nobody touch a robot any more; it stands where it was."""
        geoms = self._model.geom_bodyid == self._chassis[robot]
        is_outline = geoms & (self._model.geom_contype == _OUTLINE)
        self._model.geom_contype[is_outline] = 0
        self._model.geom_conaffinity[is_outline] = 0


def _wheel_radius(scenario: Scenario) -> float:
    """Return that of every wheel [m], which fits the smallest robots."""
    return 0.25 * float(min(scenario.of_kinds("robot_radius")))


def _model(placement: Placement, timestep: float) -> Xml.Element:
    root = Xml.Element("mujoco")
    Xml.SubElement(
        root, "option", timestep=str(timestep), integrator="implicitfast", cone="elliptic",
        impratio="5",
    )  # fmt: skip
    world = Xml.SubElement(root, "worldbody")
    _add_geom(world, "plane", _FLOOR, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), _WHEEL_FRICTION)
    _add_solids(world, placement)
    actuators = Xml.SubElement(root, "actuator")
    scenario = placement.scenario
    wheel_radius = _wheel_radius(scenario)
    of_robots = of_first_robots(scenario)
    for robot in range(scenario.n_robots):
        name = f"robot {robot}"
        body = Xml.SubElement(world, "body", name=name)
        of_robot = of_robots[robot % len(of_robots)]
        if of_robot.is_holonomic:
            _add_sliding(body, of_robot, wheel_radius)
        else:
            _add_wheeled(body, actuators, of_robot, name, wheel_radius)
    return root


def _add_solids(world: Xml.Element, placement: Placement) -> None:
    """Add walls, racks and obstacles."""
    scenario = placement.scenario
    width = scenario.warehouse_width
    height = scenario.warehouse_height
    boxes = [
        (-2.0 * _WALL, 0.0, 0.0, height),
        (width, 0.0, width + 2.0 * _WALL, height),
        (0.0, -2.0 * _WALL, width, 0.0),
        (0.0, height, width, height + 2.0 * _WALL),
        *placement.boxes.tolist(),
    ]
    level = _wheel_radius(scenario)  # of all outlines' centres
    for low_x, low_y, high_x, high_y in boxes:
        centre = ((low_x + high_x) / 2.0, (low_y + high_y) / 2.0, level)
        half = ((high_x - low_x) / 2.0, (high_y - low_y) / 2.0, scenario.robot_radius)
        _add_geom(world, "box", _OUTLINE, centre, half, _OUTLINE_FRICTION)
    for x, y in placement.obstacles.tolist():
        size = (scenario.obstacle_radius,)
        _add_geom(world, "sphere", _OUTLINE, (x, y, level), size, _OUTLINE_FRICTION)


def _add_sliding(body: Xml.Element, scenario: Scenario, level: float) -> None:
    """Add a disc that slides along x and y, `level` [m] above the floor, and turns."""
    for kind, axis in (("slide", "1 0 0"), ("slide", "0 1 0"), ("hinge", "0 0 1")):
        Xml.SubElement(body, "joint", type=kind, axis=axis)
    centre = (0.0, 0.0, level)
    size = (scenario.robot_radius,)
    _add_geom(body, "sphere", _OUTLINE, centre, size, _OUTLINE_FRICTION, scenario.robot_mass)


def _add_wheeled(
    body: Xml.Element, actuators: Xml.Element, scenario: Scenario, name: str, wheel_radius: float
) -> None:
    """Add a chassis, two wheels with a motor each, and two casters without friction.

    All robots of `scenario` are as that one.
    """
    radius = scenario.robot_radius
    mass = scenario.robot_mass
    Xml.SubElement(body, "freejoint")
    chassis_mass = mass * (1.0 - 2.0 * _WHEEL_MASS)
    centre = (0.0, 0.0, 0.0)
    _add_geom(body, "sphere", _OUTLINE, centre, (radius,), _OUTLINE_FRICTION, chassis_mass)
    for offset in (-0.7 * radius, 0.7 * radius):
        size = (0.9 * wheel_radius,)
        _add_geom(
            body, "sphere", _FLOOR, (offset, 0.0, -0.08 * wheel_radius), size, 0.0, 1e-3 * mass
        )
    # Both wheels together give the robot its greatest acceleration, as long as they do not slip.
    inertia = (0.5 + _ARMATURE) * mass * wheel_radius**2  # that each motor moves
    greatest = min(scenario.max_acceleration, _STRONGEST)  # [m/s2]
    torque = inertia * greatest / wheel_radius
    gain = inertia / _ANSWER
    for side, left in (("left", 1.0), ("right", -1.0)):
        wheel = Xml.SubElement(body, "body", pos=f"0 {left * _TRACK * radius / 2.0} 0")
        joint = f"{name} {side}"
        armature = str(_ARMATURE * mass * wheel_radius**2)
        Xml.SubElement(
            wheel, "joint", name=joint, type="hinge", axis="0 1 0", armature=armature
        )  # fmt: skip
        size = (wheel_radius,)
        _add_geom(wheel, "sphere", _FLOOR, centre, size, _WHEEL_FRICTION, _WHEEL_MASS * mass)
        limits = f"{-torque} {torque}"
        Xml.SubElement(actuators, "velocity", joint=joint, kv=str(gain), forcerange=limits)


def _add_geom(
    parent: Xml.Element,
    shape: str,
    category: int,
    centre: tuple[float, ...],
    size: tuple[float, ...],
    friction: float,
    mass: float | None = None,
) -> None:
    """Add a geom; without a mass it never moves."""
    attributes = {
        "type": shape,
        "pos": " ".join(map(str, centre)),
        "size": " ".join(map(str, size)),
        "contype": str(category),
        "conaffinity": str(category),
        "friction": f"{friction} 0.005 0.0001",
        # Of two that touch, the friction of the one that slips more easily counts.
        "priority": str(int(friction < _WHEEL_FRICTION)),
    }
    if mass is not None:
        attributes["mass"] = str(mass)
    Xml.SubElement(parent, "geom", attributes)
