"""Rigid bodies in pymunk: the only file that imports it.

Each robot is a disc that no contact turns (infinite moment), driven by a force of at most its mass
times its acceleration, see `engine.push`. So contacts win where they should: writing a robot's
velocity instead would discard the contact solution and let robots sink into each other.
"""

from __future__ import annotations

import sys
from importlib.metadata import version
from typing import Any
from weakref import finalize

import numpy as np
from numpy.typing import NDArray
from pymunk._chipmunk_cffi import ffi, lib  # its functions' addresses have no public name
from pymunk.batch import BodyFields

from swarm_logistics_env.errors import SetupError
from swarm_logistics_env.scenario import Scenario

from .building import N_WALLS, build, free
from .engine import EMPTY_ROBOT, NO_ONE, collide_with, move
from .packing import hints, packed
from .structs import Batch, Engine, Functions


class Physics:
    """The bodies of one world: robots that move, items, obstacles and walls that do not.

    Unladen robots drive under free items, laden ones collide with them. A robot that is taken out
    stays as a ghost that touches nothing, so that rows keep their robots. Nothing is made until
    `begin`; what the engine remembers of contacts is not part of a world's state.

    Attributes:
        engine: what compiled code knows of it.
    """

    def __init__(self, scenario: Scenario) -> None:
        n = scenario.n_robots
        # A batch call reads and writes every body: of N robots, and the static one.
        state = _Memory(n + 1, 4, BodyFields.POSITION | BodyFields.VELOCITY)
        velocities = _Memory(n + 1, 2, BodyFields.VELOCITY)
        forces = _Memory(n + 1, 2, BodyFields.FORCE)
        self._kept = state, velocities, forces
        self.engine = Engine(
            functions=_FUNCTION_ADDRESSES,
            space=np.zeros(1, np.int64),
            robot_bodies=np.zeros(n, np.int64),
            robot_shapes=np.zeros(n, np.int64),
            item_shapes=np.zeros(scenario.n_items, np.int64),
            solid_shapes=np.zeros(N_WALLS + scenario.n_obstacles, np.int64),
            bodies=state.batch,
            velocities=velocities.batch,
            forces=forces.batch,
            wanted_velocity=np.zeros((n, 2)),
        )

    def begin(self, world: NDArray[np.int64]) -> None:
        """Make the bodies of a world, given by its words, as its arrays have them now."""
        build(world.ctypes.data)
        # This is left out at the end of the process, which frees everything anyway.
        finalize(self, _free, packed(self.engine), self.engine, self._kept).atexit = False

    def release(self, robot: int, item: int, x: float, y: float) -> None:
        """Put `item` to (x, y) [m], masked, and make `robot` an unladen one."""
        engine = self.engine
        collide_with(engine, int(engine.robot_shapes[robot]), EMPTY_ROBOT)
        move(engine, int(engine.item_shapes[item]), x, y)

    def remove(self, robot: int) -> None:
        """Take `robot` out of everybody's way, for good."""
        collide_with(self.engine, int(self.engine.robot_shapes[robot]), NO_ONE)


def _free(engine: NDArray[np.int64], *kept: object) -> None:
    free(engine.ctypes.data)


class _Memory:
    """The memory of a batch, (rows, columns)."""

    def __init__(self, rows: int, columns: int, fields: BodyFields) -> None:
        # The engine trusts the memory it is given. One number to spare: it replaces, with memory of
        # its own, a buffer that what it reads would fill.
        memory = np.zeros(rows * columns + 1)
        # All kept, because what a structure of cffi points to lives no longer for it.
        self._memory = ffi.from_buffer("double[]", memory)
        self._buffer = ffi.new("pmFloatArray *")
        self._buffer.arr, self._buffer.max = self._memory, len(memory)
        self._data = ffi.new("pmBatchedData *")
        self._data.floatArray, self._data.fields = self._buffer, fields.value
        self.batch = Batch(
            address=_address(self._data),
            count_address=_address(ffi.addressof(self._buffer, "num")),
            numbers=memory[:-1].reshape(rows, columns),
        )


def _address(thing: Any) -> int:
    return int(ffi.cast("intptr_t", thing))


def _function_addresses() -> Functions:
    """Return the addresses of pymunk's C functions, by which kernels call them.

    Raises:
        SetupError: this pymunk lacks one of them, or this machine's words are not of 64 bits with
            the lowest byte first, as kernels need them.
    """
    if sys.maxsize < 2**32 or sys.byteorder != "little":
        raise SetupError("this machine's words: should be of 64 bits, lowest byte first")
    try:
        names = [kind.__metadata__[0] for kind in hints(Functions).values()]
        return Functions(*(_address(ffi.addressof(lib, name)) for name in names))
    except AttributeError as error:
        # pymunk.version is not used, because in pymunk 7.0 it is the version of something else.
        raise SetupError(f"pymunk {version('pymunk')} lacks a function: {error}") from None


_FUNCTION_ADDRESSES = _function_addresses()
