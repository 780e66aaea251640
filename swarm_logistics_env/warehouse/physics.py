"""Rigid bodies in pymunk: the only file that imports it.

Each robot is a disc that cannot be turned by contacts (infinite moment), tied by a pivot joint to
a kinematic control body whose velocity is the command. The joint's greatest force is the drive's
(mass x acceleration), so contacts win where they should: writing a robot's velocity instead would
discard the contact solution and let robots sink into each other.
"""

from __future__ import annotations

import numpy as np
import pymunk
from numpy.typing import NDArray
from pymunk import batch

from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.warehouse.state import NOBODY, STORED, WarehouseState

# Of the contact solver: few for robots that meet, many for a pile. With 4, a pile of 150 in a
# corner stands 50 mm inside itself for good; with 16 always, a step costs a fifth more.
_FEWEST_ITERATIONS, _MOST_ITERATIONS, _TOUCHING_PER_ITERATION = 4, 16, 8
_SLOP = 0.001  # [m]; pymunk's default 0.1 lets robots of this size pass through each other
_WALL = 0.5  # [m], half the thickness of a wall
_ROBOT, _SOLID, _ITEM = 1, 2, 4

_NOTHING = pymunk.ShapeFilter(categories=0, mask=0)
_EMPTY_ROBOT = pymunk.ShapeFilter(categories=_ROBOT, mask=_ROBOT | _SOLID)
_LADEN_ROBOT = pymunk.ShapeFilter(categories=_ROBOT, mask=_ROBOT | _SOLID | _ITEM)
_SOLID_THING = pymunk.ShapeFilter(categories=_SOLID, mask=_ROBOT)
_FREE_ITEM = pymunk.ShapeFilter(categories=_ITEM, mask=_ROBOT)


class Physics:
    """The bodies of one world: robots that move, items, obstacles and walls that do not.

    Unladen robots drive under free items, laden ones collide with them. A robot that is taken out
    stays as a ghost that touches nothing, so that rows keep their robots. Built from a state alone:
    what the engine remembers of contacts is not part of it.
    """

    def __init__(self, scenario: Scenario, state: WarehouseState) -> None:
        n = state.n_robots
        self._substeps = scenario.n_substeps
        self._period = scenario.physics_period
        self._space = pymunk.Space(threaded=False)
        self._space.collision_slop = _SLOP
        self._add_solids(scenario, state.obstacle_position)
        self._robots = self._add_robots(scenario, state)
        self._items = self._add_items(scenario, state)
        # A batch call reads and writes every body, in order of insertion: N robots, N controls, and
        # the static body last.
        self.bodies, self._reader = _buffer(2 * n + 1, 4)  # x, y [m], and velocity [m/s], as read
        self.velocities, self._writer = _buffer(2 * n + 1, 2)  # [m/s], to be written
        self._fetch()

    def advance(self, n_touching: int) -> None:
        """Move everything by one control period, as `velocities` say, and fill `bodies`.

        `n_touching` robots touch something now, which says how hard the contacts are to solve.

        Rows 0 to N-1 of `velocities` have to be those just read, rows N to 2N-1 the wanted ones.
        """
        self._space.iterations = min(
            _FEWEST_ITERATIONS + n_touching // _TOUCHING_PER_ITERATION, _MOST_ITERATIONS
        )
        batch.set_space_bodies(self._space, batch.BodyFields.VELOCITY, self._writer)
        step, period = self._space.step, self._period
        for _ in range(self._substeps):
            step(period)
        self._fetch()

    def lift(self, robot: int, item: int) -> None:
        """Make `item` no obstacle and `robot` one that free items stop."""
        self._items[item].filter = _NOTHING
        self._robots[robot].filter = _LADEN_ROBOT

    def put_down(self, robot: int, item: int, x: float, y: float) -> None:
        """Make `item` an obstacle at (x, y) [m] for the laden and `robot` an unladen one."""
        self._robots[robot].filter = _EMPTY_ROBOT
        self.place(item, x, y)

    def take_away(self, robot: int) -> None:
        """Make `robot` unladen; what it carried is gone."""
        self._robots[robot].filter = _EMPTY_ROBOT

    def place(self, item: int, x: float, y: float) -> None:
        """Make `item` an obstacle at (x, y) [m] for the laden."""
        shape = self._items[item]
        shape.unsafe_set_offset((x, y))
        shape.filter = _FREE_ITEM
        self._space.reindex_shape(shape)

    def remove(self, robot: int) -> None:
        """Take `robot` out of everybody's way, for good."""
        self._robots[robot].filter = _NOTHING

    def _fetch(self) -> None:
        self._reader.clear()
        batch.get_space_bodies(
            self._space, batch.BodyFields.POSITION | batch.BodyFields.VELOCITY, self._reader
        )

    def _add_solids(self, scenario: Scenario, obstacles: NDArray[np.float64]) -> None:
        body = self._space.static_body
        left, bottom = -_WALL, -_WALL
        right, top = scenario.warehouse_width + _WALL, scenario.warehouse_height + _WALL
        corners = [(left, bottom), (right, bottom), (right, top), (left, top)]
        solids: list[pymunk.Shape] = [
            pymunk.Segment(body, corners[side], corners[(side + 1) % 4], _WALL) for side in range(4)
        ]
        solids += [
            pymunk.Circle(body, scenario.obstacle_radius, (float(x), float(y)))
            for x, y in obstacles
        ]
        for solid in solids:
            solid.filter = _SOLID_THING
        self._space.add(*solids)

    def _add_robots(self, scenario: Scenario, state: WarehouseState) -> list[pymunk.Circle]:
        shapes, controls, joints = [], [], []
        for robot in range(state.n_robots):
            body = pymunk.Body(scenario.robot_mass, float("inf"))
            body.position = tuple(state.robot_position[robot].tolist())
            body.velocity = tuple(state.robot_velocity[robot].tolist())
            shape = pymunk.Circle(body, scenario.robot_radius)
            is_laden = state.robot_item[robot] != NOBODY
            shape.filter = _LADEN_ROBOT if is_laden else _EMPTY_ROBOT
            if not state.robot_present[robot]:
                shape.filter = _NOTHING
            control = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
            joint = pymunk.PivotJoint(body, control, (0.0, 0.0), (0.0, 0.0))
            joint.max_bias = 0.0
            joint.max_force = scenario.robot_mass * scenario.max_acceleration
            shapes.append(shape)
            controls.append(control)
            joints.append(joint)
        self._space.add(*(shape.body for shape in shapes if shape.body), *controls)
        self._space.add(*shapes, *joints)
        return shapes

    def _add_items(self, scenario: Scenario, state: WarehouseState) -> list[pymunk.Circle]:
        # All on the static body, moved by their offset: no body to integrate or to read.
        shapes = [
            pymunk.Circle(self._space.static_body, scenario.item_radius, (float(x), float(y)))
            for x, y in state.item_position
        ]
        for shape, status in zip(shapes, state.item_status, strict=True):
            shape.filter = _FREE_ITEM if status == STORED else _NOTHING
        self._space.add(*shapes)
        return shapes


def _buffer(rows: int, columns: int) -> tuple[NDArray[np.float64], batch.Buffer]:
    # pymunk trusts the memory it is given. One number to spare: it replaces, with memory of its
    # own, a buffer that what it reads would fill.
    memory = np.zeros(rows * columns + 1)
    buffer = batch.Buffer()
    buffer.set_float_buf(memory)
    return memory[:-1].reshape(rows, columns), buffer
