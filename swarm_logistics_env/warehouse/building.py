"""Bodies and shapes of a world, made and freed by compiled code.

A world of 10,000 robots has 44,000 of them, and they are made anew now and then.
"""

from __future__ import annotations

import math

from swarm_logistics_env.kernels import kernel

from . import engine as whom
from .engine import collide_with
from .native import call_at, made_at
from .packing import unpacked_at
from .structs import NOBODY, STORED, Engine, Items, Numbers, Parameters, Robots, World

_SLOP = 0.001  # [m]; the engine's default 0.1 lets robots of this size pass through each other
_BIAS = 1e-4  # share of an overlap that is left after a second; the engine's default: 0.0018
_WALL = 0.5  # [m], half the thickness of a wall
N_WALLS = 4


@kernel
def build(address: int) -> None:
    """Make everything of the world at `address` and note it in its engine's arrays."""
    world = unpacked_at(World, address)
    engine, call = world.engine, world.engine.functions
    space = made_at(call.new_space, ())
    engine.space[0] = space
    call_at(call.set_slop, (space, _SLOP))
    call_at(call.set_bias, (space, _BIAS))
    static = made_at(call.static_body, (space,))
    build_solids(engine, static, world.parameters, world.obstacles)
    build_robots(engine, world.parameters, world.robots)
    build_items(engine, static, world.parameters, world.items)
    whom.read(engine, engine.bodies)


@kernel
def build_solids(engine: Engine, static: int, parameters: Parameters, obstacles: Numbers) -> None:
    """Make walls and obstacles."""
    call, space = engine.functions, engine.space[0]
    width, height = parameters.warehouse_width, parameters.warehouse_height
    corner_x = (-_WALL, width + _WALL, width + _WALL, -_WALL)
    corner_y = (-_WALL, -_WALL, height + _WALL, height + _WALL)
    for side in range(N_WALLS):
        one, other = side, (side + 1) % N_WALLS
        ends = ((corner_x[one], corner_y[one]), (corner_x[other], corner_y[other]))
        engine.solid_shapes[side] = made_at(call.new_segment, (static, ends[0], ends[1], _WALL))
    for obstacle in range(len(obstacles)):
        engine.solid_shapes[N_WALLS + obstacle] = new_circle(
            engine, static, parameters.obstacle_radius,
            obstacles[obstacle, 0], obstacles[obstacle, 1],
        )  # fmt: skip
    for shape in engine.solid_shapes:
        collide_with(engine, shape, whom.SOLID_THING)
        made_at(call.add_shape, (space, shape))


@kernel
def build_robots(engine: Engine, parameters: Parameters, robots: Robots) -> None:
    """Make the robots' bodies, which no contact turns, and their shapes."""
    call, space, n = engine.functions, engine.space[0], len(robots.item)
    for robot in range(n):
        body = made_at(call.new_body, (parameters.robot_mass, math.inf))
        place = (robots.position[robot, 0], robots.position[robot, 1])
        call_at(call.set_position, (body, place))
        velocity = (robots.velocity[robot, 0], robots.velocity[robot, 1])
        call_at(call.set_velocity, (body, velocity))
        shape = new_circle(engine, body, parameters.robot_radius, 0.0, 0.0)
        met = whom.EMPTY_ROBOT if robots.item[robot] == NOBODY else whom.LADEN_ROBOT
        collide_with(engine, shape, met if robots.present[robot] else whom.NO_ONE)
        engine.robot_bodies[robot], engine.robot_shapes[robot] = body, shape
    # A batch reads and writes bodies in the order in which they were added.
    for body in engine.robot_bodies:
        made_at(call.add_body, (space, body))
    for shape in engine.robot_shapes:
        made_at(call.add_shape, (space, shape))


@kernel
def build_items(engine: Engine, static: int, parameters: Parameters, items: Items) -> None:
    """Make the items' shapes, on the static body and moved by their offset.

    So there is no body to integrate or to read.
    """
    for item in range(len(items.status)):
        x, y = items.position[item, 0], items.position[item, 1]
        shape = new_circle(engine, static, parameters.item_radius, x, y)
        is_solid = items.status[item] == STORED and items.covered[item] == 0
        collide_with(engine, shape, whom.FREE_ITEM if is_solid else whom.NO_ONE)
        made_at(engine.functions.add_shape, (engine.space[0], shape))
        engine.item_shapes[item] = shape


@kernel
def new_circle(engine: Engine, body: int, radius: float, x: float, y: float) -> int:
    """Return the address of a new disc around (x, y) from its body."""
    return made_at(engine.functions.new_circle, (body, radius, (x, y)))


@kernel
def free(address: int) -> None:
    """Free everything that `build` made for the engine at `address`."""
    engine = unpacked_at(Engine, address)
    call = engine.functions
    call_at(call.free_space, (engine.space[0],))
    for shapes in (engine.robot_shapes, engine.item_shapes, engine.solid_shapes):
        for shape in shapes:
            call_at(call.free_shape, (shape,))
    for body in engine.robot_bodies:
        call_at(call.free_body, (body,))
