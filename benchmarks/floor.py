"""The floor: the fastest loop over pymunk that replays an episode; no sensing, no logistics.

Same robots, walls and items, same substeps, slop 0.001, memory that is used again. Before each
substep the velocities are read in one batch and the clipped forces of the drives written in
another, all by address from one compiled call; 16 iterations.
"""

from typing import Any, NamedTuple

import numpy as np
import pymunk
from numpy.typing import NDArray
from pymunk import batch
from pymunk._chipmunk_cffi import ffi, lib  # its functions' addresses have no public name

from swarm_logistics_env import Scenario, Warehouse, policies
from swarm_logistics_env.kernels import kernel
from swarm_logistics_env.policies.policy import start
from swarm_logistics_env.warehouse.packing import call_at

Numbers = NDArray[np.float64]
Counts = NDArray[np.int32]


class Recording(NamedTuple):
    """Swarm D-T from seed 0: what it commanded and how fast that made the robots want to go."""

    scenario: Scenario
    commands: Numbers  # (T, N, 4)
    wanted_velocity: Numbers  # (T, N, 2) [m/s], world frame
    start: Numbers  # (N, 2) [m]
    items: Numbers  # (I, 2) [m]


def record(scenario: Scenario, n_steps: int) -> Recording:
    """Play Swarm D-T for `n_steps` control steps."""
    world, policy = Warehouse(scenario), policies.load("swarm-dt")
    observations = world.reset(seed=0)
    start(policy, scenario, seed=0)
    starts, items = world.state.robot_position.copy(), world.state.item_position.copy()
    commands = np.zeros((n_steps, scenario.n_robots, 4))
    wanted = np.zeros((n_steps, scenario.n_robots, 2))
    for step in range(n_steps):
        commands[step] = policy.act(observations)
        before = world.state.robot_heading.copy()
        observations = world.step(commands[step])
        wanted[step] = _wanted(commands[step], before, world)
    return Recording(scenario, commands, wanted, starts, items)


def _wanted(commands: Numbers, before: Numbers, world: Warehouse) -> Numbers:
    """Return the wanted velocities (N, 2) [m/s]; who turns drives along its mean direction."""
    turned = np.remainder(world.state.robot_heading - before + np.pi, 2.0 * np.pi) - np.pi
    middle = before + 0.5 * turned
    forward, left = commands[:, 0], commands[:, 1]
    speed = world.scenario.max_speed / np.maximum(np.hypot(forward, left), 1.0)
    along = forward * np.cos(middle) - left * np.sin(middle)
    across = forward * np.sin(middle) + left * np.cos(middle)
    return np.asarray(speed[:, None] * np.stack([along, across], axis=1))


def space_of(recording: Recording) -> pymunk.Space:
    """Return a space with the walls, the items and the unladen robots of a recording."""
    scenario = recording.scenario
    space = pymunk.Space()
    space.iterations, space.collision_slop = 16, 0.001
    width, height = scenario.warehouse_width, scenario.warehouse_height
    right, top = width + 0.5, height + 0.5
    corners = [(-0.5, -0.5), (right, -0.5), (right, top), (-0.5, top)]
    for side in range(4):
        space.add(pymunk.Segment(space.static_body, corners[side - 1], corners[side], 0.5))
    for x, y in recording.items.tolist():
        item = pymunk.Circle(space.static_body, scenario.item_radius, (x, y))
        item.filter = pymunk.ShapeFilter(categories=4)
        space.add(item)
    for x, y in recording.start.tolist():
        robot = pymunk.Body(scenario.robot_mass, float("inf"))
        robot.position = (x, y)
        shape = pymunk.Circle(robot, scenario.robot_radius)
        shape.filter = pymunk.ShapeFilter(categories=1, mask=1 | 2)
        space.add(robot, shape)
    return space


class _Batch:
    """Numbers of all bodies, (rows, columns), and where the engine finds and counts them."""

    def __init__(self, rows: int, columns: int, fields: batch.BodyFields) -> None:
        memory = np.zeros(rows * columns + 1)  # pymunk wants one number to spare
        self.numbers = memory[:-1].reshape(rows, columns)
        self._memory = ffi.from_buffer("double[]", memory)
        self._buffer = ffi.new("pmFloatArray *")
        self._buffer.arr, self._buffer.max = self._memory, len(memory)
        self._data = ffi.new("pmBatchedData *")
        self._data.floatArray, self._data.fields = self._buffer, fields.value
        filled = np.frombuffer(ffi.buffer(ffi.addressof(self._buffer, "num")), np.int32)
        self.where = (_address(self._data), filled)


class ForceFloor:
    """A space that replays the wanted velocities of a recording, driven by forces.

    `state` is (N + 1, 4): x, y [m] and velocity [m/s] of every body.
    """

    def __init__(self, recording: Recording) -> None:
        scenario, fields = recording.scenario, batch.BodyFields
        n = scenario.n_robots
        self._wanted = np.ascontiguousarray(recording.wanted_velocity)
        self._space = space_of(recording)
        self._state = _Batch(n + 1, 4, fields.POSITION | fields.VELOCITY)
        self._velocity = _Batch(n + 1, 2, fields.VELOCITY)
        self._force = _Batch(n + 1, 2, fields.FORCE)
        names = (
            "cpSpaceStep", "cpSpaceEachBody", "pmSpaceBodyGetIteratorFuncBatched",
            "pmSpaceBodySetIteratorFuncBatched",
        )  # fmt: skip
        self._functions = tuple(_address(ffi.addressof(lib, name)) for name in names)
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
    functions: tuple[int, ...],
    wanted: Numbers,
    drive: tuple[float, float, float, int],
    velocity: Numbers,
    force: Numbers,
    batches: tuple[tuple[int, Counts], tuple[int, Counts], tuple[int, Counts]],
) -> None:
    step, each_body, read, write = functions
    acceleration, mass, period, n_substeps = drive
    greatest = acceleration * period
    (velocities, n_velocities), (forces, n_forces), (state, n_state) = batches
    for _ in range(n_substeps):
        n_velocities[0] = 0
        call_at(each_body, (space, read, velocities))
        for robot in range(len(wanted)):
            x = wanted[robot, 0] - velocity[robot, 0]
            y = wanted[robot, 1] - velocity[robot, 1]
            change = np.sqrt(x * x + y * y)
            share = mass / period * (1.0 if change <= greatest else greatest / change)
            force[robot, 0], force[robot, 1] = share * x, share * y
        n_forces[0] = 0
        call_at(each_body, (space, write, forces))
        call_at(step, (space, period))
    n_state[0] = 0
    call_at(each_body, (space, read, state))


def _address(thing: Any) -> int:
    return int(ffi.cast("intptr_t", thing))
