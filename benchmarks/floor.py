"""The floors: the fastest loops over pymunk that move the same bodies; no sensing, no logistics.

Same robots, walls and items, same substeps, slop 0.001, memory that is used again.

* `ForceFloor`: before each substep the velocities are read in one batch and the clipped forces of
  the drives written in another, all by address from one compiled call; 16 iterations.
* `JointFloor`: pivot joints to kinematic bodies, driven from Python with one batch write and one
  batch read per control step; 4 iterations.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pymunk
from numpy.typing import NDArray
from pymunk import batch
from pymunk._chipmunk_cffi import ffi, lib  # its functions' addresses have no public name

from benchmarks.recording import Recording
from swarm_logistics_env.kernels import kernel
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.warehouse.packing import call_at, store_at


def space_of(recording: Recording, iterations: int) -> pymunk.Space:
    """Return a space with the walls and items of a recording."""
    scenario = recording.scenario
    space = pymunk.Space()
    space.iterations, space.collision_slop = iterations, 0.001
    width, height = scenario.warehouse_width, scenario.warehouse_height
    corners = [(-0.5, -0.5), (width + 0.5, -0.5), (width + 0.5, height + 0.5)]
    corners.append((-0.5, height + 0.5))
    for side in range(4):
        space.add(pymunk.Segment(space.static_body, corners[side - 1], corners[side], 0.5))
    for x, y in recording.items.tolist():
        item = pymunk.Circle(space.static_body, scenario.item_radius, (x, y))
        item.filter = pymunk.ShapeFilter(categories=4)
        space.add(item)
    return space


def robots_in(
    space: pymunk.Space, scenario: Scenario, places: NDArray[np.float64]
) -> list[pymunk.Body]:
    """Put unladen robots at `places` (N, 2) [m]."""
    unladen = pymunk.ShapeFilter(categories=1, mask=1 | 2)
    robots = []
    for x, y in places.tolist():
        robot = pymunk.Body(scenario.robot_mass, float("inf"))
        robot.position = (x, y)
        shape = pymunk.Circle(robot, scenario.robot_radius)
        shape.filter = unladen
        space.add(robot, shape)
        robots.append(robot)
    return robots


class _Batch:
    """Numbers of all bodies, (rows, columns), and where the engine finds them."""

    def __init__(self, rows: int, columns: int, fields: batch.BodyFields) -> None:
        memory = np.zeros(rows * columns + 1)  # pymunk wants one number to spare
        self.numbers = memory[:-1].reshape(rows, columns)
        self._memory = ffi.from_buffer("double[]", memory)
        self._buffer = ffi.new("pmFloatArray *")
        self._buffer.arr, self._buffer.max = self._memory, len(memory)
        self._data = ffi.new("pmBatchedData *")
        self._data.floatArray, self._data.fields = self._buffer, fields.value
        self.where = (_address(self._data), _address(ffi.addressof(self._buffer, "num")))


class ForceFloor:
    """A space that replays the wanted velocities of a recording, driven by forces.

    Attributes:
        state: (N + 1, 4) x, y [m] and velocity [m/s] of every body.
    """

    def __init__(self, recording: Recording) -> None:
        scenario = recording.scenario
        n = scenario.n_robots
        fields = batch.BodyFields
        self._wanted = np.ascontiguousarray(recording.wanted_velocity)
        self._space = space_of(recording, iterations=16)
        robots_in(self._space, scenario, recording.start)
        self._state = _Batch(n + 1, 4, fields.POSITION | fields.VELOCITY)
        self._velocity = _Batch(n + 1, 2, fields.VELOCITY)
        self._force = _Batch(n + 1, 2, fields.FORCE)
        self._functions = (
            _function("cpSpaceStep"),
            _function("cpSpaceEachBody"),
            _function("pmSpaceBodyGetIteratorFuncBatched"),
            _function("pmSpaceBodySetIteratorFuncBatched"),
        )
        self.state = self._state.numbers
        self._drive = (
            scenario.max_acceleration, scenario.robot_mass, scenario.physics_period,
            scenario.n_substeps,
        )  # fmt: skip

    def step(self, index: int) -> None:
        """Take control step `index` of the recording."""
        _drive_by_force(
            _address(self._space._space), self._functions, self._wanted[index], self._drive,
            self._velocity.numbers, self._force.numbers,
            (self._velocity.where, self._force.where, self._state.where),
        )  # fmt: skip


@kernel
def _drive_by_force(
    space: int,
    functions: tuple[int, int, int, int],
    wanted: NDArray[np.float64],
    drive: tuple[float, float, float, int],
    velocity: NDArray[np.float64],
    force: NDArray[np.float64],
    batches: tuple[tuple[int, int], tuple[int, int], tuple[int, int]],
) -> None:
    step, each_body, read, write = functions
    acceleration, mass, period, n_substeps = drive
    greatest = acceleration * period
    (velocities, n_velocities), (forces, n_forces), (state, n_state) = batches
    for _ in range(n_substeps):
        store_at(n_velocities, 0)
        call_at(each_body, (space, read, velocities))
        for robot in range(len(wanted)):
            x = wanted[robot, 0] - velocity[robot, 0]
            y = wanted[robot, 1] - velocity[robot, 1]
            change = np.sqrt(x * x + y * y)
            share = mass / period * (1.0 if change <= greatest else greatest / change)
            force[robot, 0], force[robot, 1] = share * x, share * y
        store_at(n_forces, 0)
        call_at(each_body, (space, write, forces))
        call_at(step, (space, period))
    store_at(n_state, 0)
    call_at(each_body, (space, read, state))


def _function(name: str) -> int:
    return _address(ffi.addressof(lib, name))


def _address(thing: Any) -> int:
    return int(ffi.cast("intptr_t", thing))


class JointFloor:
    """A space that replays the wanted velocities of a recording, driven by joints.

    Attributes:
        state: (2 N + 1, 4) x, y [m] and velocity [m/s] of every body.
    """

    def __init__(self, recording: Recording) -> None:
        scenario = recording.scenario
        n = scenario.n_robots
        self._wanted = np.ascontiguousarray(recording.wanted_velocity)
        self._substeps, self._period = scenario.n_substeps, scenario.physics_period
        self._space = space = space_of(recording, iterations=4)
        robots = robots_in(space, scenario, recording.start)
        controls = [pymunk.Body(body_type=pymunk.Body.KINEMATIC) for _ in robots]
        space.add(*controls)
        for robot, control in zip(robots, controls, strict=True):
            joint = pymunk.PivotJoint(robot, control, (0.0, 0.0), (0.0, 0.0))
            joint.max_bias = 0.0
            joint.max_force = scenario.robot_mass * scenario.max_acceleration
            space.add(joint)
        # The static body is read too, and pymunk wants one number to spare.
        self._read, self._written = np.zeros((2 * n + 1) * 4 + 1), np.zeros((2 * n + 1) * 2 + 1)
        self.state = self._read[:-1].reshape(-1, 4)
        self._velocity = self._written[:-1].reshape(-1, 2)
        self._reader, self._writer = batch.Buffer(), batch.Buffer()
        self._reader.set_float_buf(self._read)
        self._writer.set_float_buf(self._written)
        self._n = n

    def step(self, index: int) -> None:
        """Take control step `index` of the recording."""
        n, space = self._n, self._space
        self._velocity[:n] = self.state[:n, 2:4]
        self._velocity[n : 2 * n] = self._wanted[index]
        batch.set_space_bodies(space, batch.BodyFields.VELOCITY, self._writer)
        for _ in range(self._substeps):
            space.step(self._period)
        self._reader.clear()
        batch.get_space_bodies(
            space, batch.BodyFields.POSITION | batch.BodyFields.VELOCITY, self._reader
        )
