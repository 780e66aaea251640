"""Rigid bodies in pymunk: the only file that imports it.

Each robot is a disc that cannot be turned by contacts (infinite moment), tied by a pivot joint to
a kinematic control body whose velocity is the command. The joint's greatest force is the drive's
(mass x acceleration), so contacts win where they should: writing a robot's velocity instead would
discard the contact solution and let robots sink into each other.
"""

from __future__ import annotations

import sys
from importlib.metadata import version
from typing import Any

import numpy as np
import pymunk
from numpy.typing import NDArray
from pymunk._chipmunk_cffi import ffi, lib  # its functions' addresses have no public name
from pymunk.batch import BodyFields

from swarm_logistics_env.errors import SetupError
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.warehouse import engine as at
from swarm_logistics_env.warehouse.state import NOBODY, STORED, WarehouseState

_FUNCTIONS = {
    at.STEP: "cpSpaceStep",
    at.SET_ITERATIONS: "cpSpaceSetIterations",
    at.EACH_BODY: "cpSpaceEachBody",
    at.READ_BODY: "pmSpaceBodyGetIteratorFuncBatched",
    at.WRITE_BODY: "pmSpaceBodySetIteratorFuncBatched",
    at.SET_FILTER: "cpShapeSetFilter",
    at.SET_OFFSET: "cpCircleShapeSetOffset",
    at.REINDEX: "cpSpaceReindexShape",
}
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
        self._space = pymunk.Space(threaded=False)
        self._space.collision_slop = _SLOP
        self._add_solids(scenario, state.obstacle_position)
        self._robots = self._add_robots(scenario, state)
        self._items = self._add_items(scenario, state)
        # A batch call reads and writes every body, in order of insertion: N robots, N controls, and
        # the static body last.
        self._read = _Batch(2 * n + 1, 4, BodyFields.POSITION | BodyFields.VELOCITY)
        self._written = _Batch(2 * n + 1, 2, BodyFields.VELOCITY)
        self.bodies = self._read.numbers  # x, y [m], and velocity [m/s], as read
        self.velocities = self._written.numbers  # [m/s], to be written
        self.engine = self._table()
        at.read_bodies(self.engine)

    def put_down(self, robot: int, item: int, x: float, y: float) -> None:
        """Make `item` an obstacle at (x, y) [m] for the laden and `robot` an unladen one."""
        self.take_away(robot)
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

    def _table(self) -> NDArray[np.int64]:
        shapes = [*self._robots, *self._items]
        table = np.zeros(at.SHAPES + len(shapes), np.int64)
        for row, address in _FUNCTION_ADDRESSES.items():
            table[row] = address
        table[at.SPACE] = _address(self._space._space)
        table[at.READ_BATCH], table[at.READ_COUNT] = self._read.address, self._read.count_address
        table[at.WRITE_BATCH] = self._written.address
        table[at.WRITE_COUNT] = self._written.count_address
        for row, met in (
            (at.NO_ONE, _NOTHING),
            (at.EMPTY_ROBOT, _EMPTY_ROBOT),
            (at.LADEN_ROBOT, _LADEN_ROBOT),
            (at.FREE_ITEM, _FREE_ITEM),
        ):
            table[row] = met.categories | met.mask << 32
        table[at.SHAPES :] = [_address(shape._shape) for shape in shapes]
        return table

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


class _Batch:
    """Numbers of all bodies, (rows, columns), that one call of the engine reads or writes."""

    def __init__(self, rows: int, columns: int, fields: BodyFields) -> None:
        # The engine trusts the memory it is given. One number to spare: it replaces, with memory of
        # its own, a buffer that what it reads would fill.
        memory = np.zeros(rows * columns + 1)
        self.numbers = memory[:-1].reshape(rows, columns)
        # All kept, because what a structure of cffi points to lives no longer for it.
        self._memory = ffi.from_buffer("double[]", memory)
        self._buffer = ffi.new("pmFloatArray *")
        self._buffer.arr, self._buffer.max = self._memory, len(memory)
        self._batch = ffi.new("pmBatchedData *")
        self._batch.floatArray, self._batch.fields = self._buffer, fields.value
        self.address = _address(self._batch)
        self.count_address = _address(ffi.addressof(self._buffer, "num"))


def _address(thing: Any) -> int:
    return int(ffi.cast("intptr_t", thing))


def _function_addresses() -> dict[int, int]:
    """Return where the functions that kernels call are, by their row in the table.

    Raises:
        SetupError: kernels cannot call this pymunk, or any C function on this machine.
    """
    if sys.maxsize < 2**32 or sys.byteorder != "little":
        raise SetupError("this machine's words: should be of 64 bits, lowest byte first")
    try:
        return {row: _address(ffi.addressof(lib, name)) for row, name in _FUNCTIONS.items()}
    except AttributeError as error:
        # Not pymunk.version, which pymunk 7.0 gives as that of something else.
        raise SetupError(f"pymunk {version('pymunk')} lacks a function: {error}") from None


_FUNCTION_ADDRESSES = _function_addresses()
