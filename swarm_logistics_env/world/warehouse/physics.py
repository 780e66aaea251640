"""Rigid bodies in pymunk: the only file that imports it.

Each robot is a disc that no contact turns (infinite moment), driven by a force of at most its mass
times its acceleration, see `push`. So contacts win where they should: writing a robot's velocity
instead would discard the contact solution and let robots sink into each other. Compiled code makes
and frees the bodies, as a world of 10,000 robots has 44,000 of them, and calls the engine by
address within a control step.
"""

from __future__ import annotations

import math
from typing import Any
from weakref import finalize

import numpy as np
from numpy.typing import NDArray
from pymunk._chipmunk_cffi import ffi, lib  # its functions' addresses have no public name

from swarm_logistics_env.compiler.addresses import call_at, made_at, pointer_at, unpacked_at
from swarm_logistics_env.compiler.kernels import carray, engine_kernel
from swarm_logistics_env.compiler.packing import packed
from swarm_logistics_env.core.errors import SetupError
from swarm_logistics_env.world.scenario import Scenario

from .structs import (
    NOBODY,
    STORED,
    BodyWords,
    EngineArrays,
    Functions,
    Numbers,
    World,
)

_ROBOT = 1  # categories of shapes
_SOLID = 2
_ITEM = 4
_MASK = 32  # bits of the categories in a filter's second word, below those of its mask

# A filter says what a shape collides with: its own categories, and a mask of the others'.
NO_ONE = 0
EMPTY_ROBOT = _ROBOT | (_ROBOT | _SOLID) << _MASK
LADEN_ROBOT = _ROBOT | (_ROBOT | _SOLID | _ITEM) << _MASK
FREE_ITEM = _ITEM | _ROBOT << _MASK
SOLID_THING = _SOLID | _ROBOT << _MASK

# The contact solver iterates more if more touch. With 16 a jam of 150 in a corner stands
# 10 mm inside itself, with 50 now and then 7 mm, with 80 always 1 mm; always 80 costs a swarm of
# 25 an eighth of its step.
_FEWEST_ITERATIONS = 16
_MOST_ITERATIONS = 80
_TOUCHING_PER_ITERATION = 2


@engine_kernel
def advance(world: World) -> None:
    """Take the substeps of a control step, and read where the bodies are then and how fast.

    Before each, every drive pushes with the force that brings its robot to the wanted velocity
    within the substep, or with its greatest force.
    """
    engine = world.engine
    parameters = world.parameters
    n_touching = 0
    for touches in world.robots.contact:
        n_touching += int(touches)
    iterations = min(_FEWEST_ITERATIONS + n_touching // _TOUCHING_PER_ITERATION, _MOST_ITERATIONS)
    call_at(engine.functions.cpSpaceSetIterations, (engine.space[0], iterations))
    period = parameters.physics_period
    for _ in range(parameters.n_substeps):
        push(engine, world.able.max_acceleration, period, world.robots.mass)
        call_at(engine.functions.cpSpaceStep, (engine.space[0], period))
    read(engine)


@engine_kernel
def push(engine: EngineArrays, most: Numbers, period: float, mass: Numbers) -> None:
    """Give every robot the force that changes its velocity as wanted, as far as it can.

    Args:
        most: acceleration of each robot (N,) [m/s2].
        period: of a substep [s].
        mass: of each robot (N,) [kg].
    """
    at = engine.body_words
    for robot in range(len(engine.wanted_velocity)):
        body = words_of(engine, robot)
        change_x = engine.wanted_velocity[robot, 0] - body[at.velocity]
        change_y = engine.wanted_velocity[robot, 1] - body[at.velocity + 1]
        change = math.sqrt(change_x * change_x + change_y * change_y)
        greatest = most[robot] * period
        # Mass per period makes a force of a change of velocity.
        share = mass[robot] / period * (1.0 if change <= greatest else greatest / change)
        body[at.force] = share * change_x
        body[at.force + 1] = share * change_y


@engine_kernel
def read(engine: EngineArrays) -> None:
    """Note where the bodies are and how fast."""
    at = engine.body_words
    bodies = engine.bodies
    for robot in range(len(bodies)):
        body = words_of(engine, robot)
        for axis in range(2):
            bodies[robot, axis] = body[at.position + axis]
            bodies[robot, 2 + axis] = body[at.velocity + axis]


@engine_kernel
def words_of(engine: EngineArrays, robot: int) -> Numbers:
    """Return the numbers (N_WORDS,) of a robot's body, where the engine has them."""
    words: Numbers = carray(pointer_at(engine.robot_bodies[robot]), N_WORDS, np.float64)
    return words


@engine_kernel
def put_item(engine: EngineArrays, item: int, position: Numbers) -> None:
    """Move an item to its position, of those of all [m]; who collides with it stays as it is."""
    shape = engine.item_shapes[item]
    call_at(
        engine.functions.cpCircleShapeSetOffset, (shape, (position[item, 0], position[item, 1]))
    )
    call_at(engine.functions.cpSpaceReindexShape, (engine.space[0], shape))


@engine_kernel
def collide_with(engine: EngineArrays, shape: int, categories: int) -> None:
    """Give a shape a filter, of no group."""
    call_at(engine.functions.cpShapeSetFilter, (shape, (0, categories)))


N_WORDS = 16  # of a body that are looked at: up to its force, which pointers follow
SLOP = 0.001  # [m]; the engine's default 0.1 lets robots of this size pass through each other
_BIAS = 1e-4  # share of an overlap that is left after a second; the engine's default: 0.0018
_WALL = 0.5  # [m], half the thickness of a wall
N_WALLS = 4
N_CORNERS = 4


@engine_kernel
def build(address: int) -> None:
    """Make everything of the world at `address` and note it in its engine's arrays."""
    world = unpacked_at(World, address)
    engine = world.engine
    call = world.engine.functions
    space = made_at(call.cpSpaceNew, ())
    engine.space[0] = space
    call_at(call.cpSpaceSetCollisionSlop, (space, SLOP))
    call_at(call.cpSpaceSetCollisionBias, (space, _BIAS))
    static = made_at(call.cpSpaceGetStaticBody, (space,))
    build_solids(world, static)
    build_robots(world)
    build_items(world, static)
    read(engine)


@engine_kernel
def build_solids(world: World, static: int) -> None:
    """Make walls, obstacles and racks."""
    engine = world.engine
    parameters = world.parameters
    obstacles = world.obstacles
    call = engine.functions
    width = parameters.warehouse_width
    height = parameters.warehouse_height
    corner_x = (-_WALL, width + _WALL, width + _WALL, -_WALL)
    corner_y = (-_WALL, -_WALL, height + _WALL, height + _WALL)
    for side in range(N_WALLS):
        corner = side
        next_corner = (side + 1) % N_WALLS
        ends = (
            (corner_x[corner], corner_y[corner]),
            (corner_x[next_corner], corner_y[next_corner]),
        )
        engine.solid_shapes[side] = made_at(
            call.cpSegmentShapeNew, (static, ends[0], ends[1], _WALL)
        )
    for obstacle in range(len(obstacles)):
        centre = (obstacles[obstacle, 0], obstacles[obstacle, 1])
        shape = made_at(call.cpCircleShapeNew, (static, parameters.obstacle_radius, centre))
        engine.solid_shapes[N_WALLS + obstacle] = shape
    corners = world.floor.corners
    for box in range(len(corners) // N_CORNERS):
        first = corners[N_CORNERS * box :]
        shape = made_at(call.cpPolyShapeNewRaw, (static, N_CORNERS, first.ctypes.data, 0.0))
        engine.solid_shapes[N_WALLS + len(obstacles) + box] = shape
    for shape in engine.solid_shapes:
        collide_with(engine, shape, SOLID_THING)
        made_at(call.cpSpaceAddShape, (engine.space[0], shape))


@engine_kernel
def build_robots(world: World) -> None:
    """Make the robots' bodies, which no contact turns, and their shapes."""
    engine = world.engine
    robots = world.robots
    call = engine.functions
    space = engine.space[0]
    for robot in range(len(robots.item)):
        body = made_at(call.cpBodyNew, (robots.mass[robot], math.inf))
        position = (engine.robot_places[robot, 0], engine.robot_places[robot, 1])
        call_at(call.cpBodySetPosition, (body, position))
        velocity = (robots.velocity[robot, 0], robots.velocity[robot, 1])
        call_at(call.cpBodySetVelocity, (body, velocity))
        shape = made_at(call.cpCircleShapeNew, (body, robots.radius[robot], (0.0, 0.0)))
        kind = EMPTY_ROBOT if robots.item[robot] == NOBODY else LADEN_ROBOT
        collide_with(engine, shape, kind if robots.present[robot] else NO_ONE)
        engine.robot_bodies[robot] = body
        engine.robot_shapes[robot] = shape
        made_at(call.cpSpaceAddBody, (space, body))
        made_at(call.cpSpaceAddShape, (space, shape))


@engine_kernel
def build_items(world: World, static: int) -> None:
    """Make the items' shapes, on the static body and moved by their offset.

    So there is no body to integrate or to read.
    """
    engine = world.engine
    items = world.items
    call = world.engine.functions
    for item in range(len(items.status)):
        centre = (items.position[item, 0], items.position[item, 1])
        shape = made_at(call.cpCircleShapeNew, (static, world.parameters.item_radius, centre))
        is_solid = items.status[item] == STORED and items.covered[item] == 0
        collide_with(engine, shape, FREE_ITEM if is_solid else NO_ONE)
        made_at(call.cpSpaceAddShape, (engine.space[0], shape))
        engine.item_shapes[item] = shape


@engine_kernel
def free(address: int) -> None:
    """Free everything that `build` made for the engine at `address`."""
    engine = unpacked_at(EngineArrays, address)
    call = engine.functions
    call_at(call.cpSpaceFree, (engine.space[0],))
    for shapes in (engine.robot_shapes, engine.item_shapes, engine.solid_shapes):
        for shape in shapes:
            call_at(call.cpShapeFree, (shape,))
    for body in engine.robot_bodies:
        call_at(call.cpBodyFree, (body,))


class Physics:
    """The bodies of one world: robots that move, items, obstacles and walls that do not.

    Unladen robots drive under free items, laden ones collide with them. A robot that is taken out
    stays as a ghost that touches nothing, so that rows keep their robots. Nothing is made until
    `begin`; what the engine remembers of contacts is not part of a world's state. Where a ghost
    stands is, as it decides in which order the engine finds the contacts of others.

    Args:
        scenario: the conditions of the episode.
        robot_places: (N, 2) [m] where the robots' bodies are made, also those of ghosts.
        n_boxes: rectangles of solid cells that the floor has.

    Attributes:
        n_boxes: as given.
        engine: what compiled code knows of it.
        words: the engine, `packed`.
    """

    def __init__(self, scenario: Scenario, robot_places: Numbers, n_boxes: int) -> None:
        n = scenario.n_robots
        self.engine = EngineArrays(
            functions=_FUNCTION_ADDRESSES,
            space=np.zeros(1, np.int64),
            robot_places=robot_places,
            robot_bodies=np.zeros(n, np.int64),
            robot_shapes=np.zeros(n, np.int64),
            item_shapes=np.zeros(scenario.n_items, np.int64),
            solid_shapes=np.zeros(N_WALLS + scenario.n_obstacles + n_boxes, np.int64),
            body_words=_BODY_WORDS,
            bodies=np.zeros((n, 4)),
            wanted_velocity=np.zeros((n, 2)),
        )
        self.n_boxes = n_boxes
        self.words = packed(self.engine)

    def begin(self, address: int) -> None:
        """Make the bodies of the world at `address` as its arrays have them now."""
        build(address)
        # This is left out at the end of the process, which frees everything anyway.
        finalize(self, _free, self.words, self.engine).atexit = False


def _free(engine: NDArray[np.int64], _: EngineArrays) -> None:
    free(engine.ctypes.data)


def _body_words() -> BodyWords:
    """Return which words of a body hold its numbers: it sets marks with the engine and looks.

    Reading and writing them there costs less than the engine's calls.

    Raises:
        SetupError: the marks are not among the first words of a body.
    """
    body = lib.cpBodyNew(1.0, 1.0)
    numbers = np.frombuffer(ffi.buffer(body, 8 * N_WORDS))
    words: list[int] = []
    for put in (lib.cpBodySetPosition, lib.cpBodySetVelocity, lib.cpBodySetForce):
        mark = (1.0 + len(words), -0.5)
        put(body, {"x": mark[0], "y": mark[1]})
        at = np.flatnonzero((numbers[:-1] == mark[0]) & (numbers[1:] == mark[1]))
        if len(at) != 1:
            raise SetupError("pymunk keeps numbers of bodies elsewhere: should be pymunk 7")
        words.append(at.item())
    lib.cpBodyFree(body)
    return BodyWords(*words)


def _address(thing: Any) -> int:
    return int(ffi.cast("intptr_t", thing))


# A pymunk that lacks one raises an AttributeError that names it.
_FUNCTION_ADDRESSES = Functions(*(_address(ffi.addressof(lib, name)) for name in Functions._fields))
_BODY_WORDS = _body_words()
