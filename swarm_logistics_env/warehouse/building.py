"""Bodies, shapes and joints of a world, made and freed by compiled code.

A world of 10,000 robots has 64,000 of them, and they are made anew now and then.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.kernels import kernel
from swarm_logistics_env.warehouse import engine as at
from swarm_logistics_env.warehouse.engine import collide_with
from swarm_logistics_env.warehouse.native import call_at, made_at
from swarm_logistics_env.warehouse.state import NOBODY, STORED

_SLOP = 0.001  # [m]; the engine's default 0.1 lets robots of this size pass through each other
_WALL = 0.5  # [m], half the thickness of a wall


def table_length(n_robots: int, n_items: int, n_obstacles: int) -> int:
    """Return how long the table of such a world is."""
    # Robots: a shape, two bodies and a joint each; four walls.
    return at.SHAPES + 4 * n_robots + n_items + 4 + n_obstacles


@kernel
def build(
    engine: NDArray[np.int64],
    width: float,
    height: float,
    robot_mass: float,
    drive_force: float,
    robot_radius: float,
    item_radius: float,
    obstacle_radius: float,
    position: NDArray[np.float64],
    velocity: NDArray[np.float64],
    present: NDArray[np.bool_],
    robot_item: NDArray[np.int64],
    item_position: NDArray[np.float64],
    item_status: NDArray[np.int64],
    item_covered: NDArray[np.int64],
    obstacle_position: NDArray[np.float64],
) -> None:
    """Make everything and note it in the table, whose functions and filters are given.

    After the shapes of robots and items: bodies of robots, controls, joints, walls, obstacles.
    """
    space = made_at(engine[at.NEW_SPACE], ())
    engine[at.SPACE] = space
    call_at(engine[at.SET_SLOP], (space, _SLOP))
    static = made_at(engine[at.STATIC_BODY], (space,))
    n, n_items = len(position), len(item_position)
    items = at.SHAPES + n
    bodies, controls, joints = items + n_items, items + n_items + n, items + n_items + 2 * n
    walls = joints + n
    corner_x = (-_WALL, width + _WALL, width + _WALL, -_WALL)
    corner_y = (-_WALL, -_WALL, height + _WALL, height + _WALL)
    for side in range(4):
        one, other = side, (side + 1) % 4
        ends = ((corner_x[one], corner_y[one]), (corner_x[other], corner_y[other]))
        engine[walls + side] = made_at(engine[at.NEW_SEGMENT], (static, ends[0], ends[1], _WALL))
    for obstacle in range(len(obstacle_position)):
        engine[walls + 4 + obstacle] = new_circle(
            engine, static, obstacle_radius, obstacle_position[obstacle]
        )
    for solid in range(walls, walls + 4 + len(obstacle_position)):
        collide_with(engine, engine[solid], engine[at.SOLID])
        made_at(engine[at.ADD_SHAPE], (space, engine[solid]))

    for robot in range(n):
        body = made_at(engine[at.NEW_BODY], (robot_mass, math.inf))
        control = made_at(engine[at.NEW_CONTROL], ())
        call_at(engine[at.SET_POSITION], (body, (position[robot, 0], position[robot, 1])))
        call_at(engine[at.SET_VELOCITY], (body, (velocity[robot, 0], velocity[robot, 1])))
        shape = new_circle(engine, body, robot_radius, np.zeros(2))
        met = engine[at.EMPTY_ROBOT] if robot_item[robot] == NOBODY else engine[at.LADEN_ROBOT]
        collide_with(engine, shape, met if present[robot] else engine[at.NO_ONE])
        joint = made_at(engine[at.NEW_JOINT], (body, control, (0.0, 0.0), (0.0, 0.0)))
        call_at(engine[at.SET_BIAS], (joint, 0.0))
        call_at(engine[at.SET_FORCE], (joint, drive_force))
        engine[at.SHAPES + robot], engine[joints + robot] = shape, joint
        engine[bodies + robot], engine[controls + robot] = body, control
    # A batch reads and writes bodies in the order in which they were added.
    for body in range(bodies, joints):
        made_at(engine[at.ADD_BODY], (space, engine[body]))
    for robot in range(n):
        made_at(engine[at.ADD_SHAPE], (space, engine[at.SHAPES + robot]))
    for joint in range(joints, walls):
        made_at(engine[at.ADD_JOINT], (space, engine[joint]))

    # On the static body, moved by their offset: no body to integrate or to read.
    for item in range(n_items):
        shape = new_circle(engine, static, item_radius, item_position[item])
        is_solid = item_status[item] == STORED and item_covered[item] == 0
        collide_with(engine, shape, engine[at.FREE_ITEM] if is_solid else engine[at.NO_ONE])
        made_at(engine[at.ADD_SHAPE], (space, shape))
        engine[items + item] = shape


@kernel
def new_circle(
    engine: NDArray[np.int64], body: int, radius: float, offset: NDArray[np.float64]
) -> int:
    """Return the address of a new disc around `offset` (2,) from its body."""
    return made_at(engine[at.NEW_CIRCLE], (body, radius, (offset[0], offset[1])))


@kernel
def free(engine: NDArray[np.int64], n_robots: int, n_items: int) -> None:
    """Free everything that `build` made."""
    call_at(engine[at.FREE_SPACE], (engine[at.SPACE],))
    bodies = at.SHAPES + n_robots + n_items
    joints, walls = bodies + 2 * n_robots, bodies + 3 * n_robots
    for joint in range(joints, walls):
        call_at(engine[at.FREE_JOINT], (engine[joint],))
    for shape in range(at.SHAPES, bodies):
        call_at(engine[at.FREE_SHAPE], (engine[shape],))
    for shape in range(walls, len(engine)):
        call_at(engine[at.FREE_SHAPE], (engine[shape],))
    for body in range(bodies, joints):
        call_at(engine[at.FREE_BODY], (engine[body],))
