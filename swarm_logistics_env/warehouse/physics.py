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
from weakref import finalize

import numpy as np
import pymunk
from numpy.typing import NDArray
from pymunk._chipmunk_cffi import ffi, lib  # its functions' addresses have no public name
from pymunk.batch import BodyFields

from swarm_logistics_env.errors import SetupError
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.warehouse import engine as at
from swarm_logistics_env.warehouse.building import build, free, table_length
from swarm_logistics_env.warehouse.state import WarehouseState

_FUNCTIONS = {
    at.STEP: "cpSpaceStep",
    at.SET_ITERATIONS: "cpSpaceSetIterations",
    at.EACH_BODY: "cpSpaceEachBody",
    at.READ_BODY: "pmSpaceBodyGetIteratorFuncBatched",
    at.WRITE_BODY: "pmSpaceBodySetIteratorFuncBatched",
    at.SET_FILTER: "cpShapeSetFilter",
    at.SET_OFFSET: "cpCircleShapeSetOffset",
    at.REINDEX: "cpSpaceReindexShape",
    at.NEW_SPACE: "cpSpaceNew",
    at.STATIC_BODY: "cpSpaceGetStaticBody",
    at.SET_SLOP: "cpSpaceSetCollisionSlop",
    at.NEW_BODY: "cpBodyNew",
    at.NEW_CONTROL: "cpBodyNewKinematic",
    at.SET_POSITION: "cpBodySetPosition",
    at.SET_VELOCITY: "cpBodySetVelocity",
    at.NEW_CIRCLE: "cpCircleShapeNew",
    at.NEW_SEGMENT: "cpSegmentShapeNew",
    at.NEW_JOINT: "cpPivotJointNew2",
    at.SET_BIAS: "cpConstraintSetMaxBias",
    at.SET_FORCE: "cpConstraintSetMaxForce",
    at.ADD_BODY: "cpSpaceAddBody",
    at.ADD_SHAPE: "cpSpaceAddShape",
    at.ADD_JOINT: "cpSpaceAddConstraint",
    at.FREE_SPACE: "cpSpaceFree",
    at.FREE_BODY: "cpBodyFree",
    at.FREE_SHAPE: "cpShapeFree",
    at.FREE_JOINT: "cpConstraintFree",
}
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
        # A batch call reads and writes every body: N robots, N controls, and room for a static one.
        self._read = _Batch(2 * n + 1, 4, BodyFields.POSITION | BodyFields.VELOCITY)
        self._written = _Batch(2 * n + 1, 2, BodyFields.VELOCITY)
        self.bodies = self._read.numbers  # x, y [m], and velocity [m/s], as read
        self.velocities = self._written.numbers  # [m/s], to be written
        self._n_robots = n
        self.engine = self._blank_table(scenario)
        build(
            self.engine, scenario.warehouse_width, scenario.warehouse_height, scenario.robot_mass,
            scenario.robot_mass * scenario.max_acceleration, scenario.robot_radius,
            scenario.item_radius, scenario.obstacle_radius, state.robot_position,
            state.robot_velocity, state.robot_present, state.robot_item, state.item_position,
            state.item_status, state.item_covered, state.obstacle_position,
        )  # fmt: skip
        # Not at the end of the process, which frees everything anyway.
        finalize(self, free, self.engine, n, scenario.n_items).atexit = False
        at.read_bodies(self.engine)

    def put_down(self, robot: int, item: int, x: float, y: float) -> None:
        """Put `item` to (x, y) [m], covered, and make `robot` an unladen one."""
        self.take_away(robot)
        self.place(item, x, y)

    def take_away(self, robot: int) -> None:
        """Make `robot` unladen; what it carried is gone."""
        self._let_collide(robot, at.EMPTY_ROBOT)

    def place(self, item: int, x: float, y: float) -> None:
        """Put `item`, which is no obstacle, to (x, y) [m], covered."""
        at.move(self.engine, int(self.engine[at.SHAPES + self._n_robots + item]), x, y)

    def remove(self, robot: int) -> None:
        """Take `robot` out of everybody's way, for good."""
        self._let_collide(robot, at.NO_ONE)

    def _let_collide(self, robot: int, met: int) -> None:
        at.collide_with(self.engine, int(self.engine[at.SHAPES + robot]), int(self.engine[met]))

    def _blank_table(self, scenario: Scenario) -> NDArray[np.int64]:
        length = table_length(scenario.n_robots, scenario.n_items, scenario.n_obstacles)
        table = np.zeros(length, np.int64)
        for row, address in _FUNCTION_ADDRESSES.items():
            table[row] = address
        table[at.READ_BATCH], table[at.READ_COUNT] = self._read.address, self._read.count_address
        table[at.WRITE_BATCH] = self._written.address
        table[at.WRITE_COUNT] = self._written.count_address
        for row, met in (
            (at.NO_ONE, _NOTHING),
            (at.EMPTY_ROBOT, _EMPTY_ROBOT),
            (at.LADEN_ROBOT, _LADEN_ROBOT),
            (at.FREE_ITEM, _FREE_ITEM),
            (at.SOLID, _SOLID_THING),
        ):
            table[row] = met.categories | met.mask << 32
        return table


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
