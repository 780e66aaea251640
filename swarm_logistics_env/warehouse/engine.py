"""What the physics engine does within a control step, called by address from compiled code.

`physics` fills in the addresses, `building` makes the bodies and shapes.
"""

from __future__ import annotations

import math

from swarm_logistics_env.kernels import kernel

from .native import call_at, store_at
from .structs import Batch, Engine, Integers, Numbers, Parameters

_ROBOT, _SOLID, _ITEM = 1, 2, 4  # categories of shapes
_MASK = 32  # bits of the categories in a filter's second word, below those of its mask

# A filter says what a shape collides with: its own categories, and a mask of the others'.
NO_ONE = 0
EMPTY_ROBOT = _ROBOT | (_ROBOT | _SOLID) << _MASK
LADEN_ROBOT = _ROBOT | (_ROBOT | _SOLID | _ITEM) << _MASK
FREE_ITEM = _ITEM | _ROBOT << _MASK
SOLID_THING = _SOLID | _ROBOT << _MASK

# Kinds of events: what happened to (robot, item) that changes whom they collide with.
LIFTED, PUT_DOWN, DELIVERED_IT, CAME_BACK = 0, 1, 2, 3

# The contact solver iterates more if more touch. With 16 a jam of 150 in a corner stands
# 10 mm inside itself, with 50 now and then 7 mm, with 80 always 1 mm; always 80 costs a swarm of
# 25 an eighth of its step.
_FEWEST_ITERATIONS, _MOST_ITERATIONS, _TOUCHING_PER_ITERATION = 16, 80, 2


@kernel
def advance(engine: Engine, parameters: Parameters, n_touching: int) -> None:
    """Take the substeps of a control step, and read where the bodies are then and how fast.

    Before each, every drive pushes with the force that brings its robot to the wanted velocity
    within the substep, or with its greatest force. So many robots touch something as it begins.
    """
    iterations = min(_FEWEST_ITERATIONS + n_touching // _TOUCHING_PER_ITERATION, _MOST_ITERATIONS)
    call_at(engine.functions.set_iterations, (engine.space[0], iterations))
    period = parameters.physics_period
    greatest = parameters.max_acceleration * period
    for _ in range(parameters.n_substeps):
        read(engine, engine.velocities)
        push(engine, greatest, parameters.robot_mass / period)
        call_at(engine.functions.step, (engine.space[0], period))
    read(engine, engine.bodies)


@kernel
def push(engine: Engine, greatest: float, mass_per_period: float) -> None:
    """Give every robot the force that changes its velocity as wanted, by `greatest` [m/s] at most.

    `mass_per_period` [kg/s] makes a force of a change of velocity.
    """
    velocities, forces = engine.velocities.numbers, engine.forces.numbers
    for robot in range(len(engine.wanted_velocity)):
        change_x = engine.wanted_velocity[robot, 0] - velocities[robot, 0]
        change_y = engine.wanted_velocity[robot, 1] - velocities[robot, 1]
        change = math.sqrt(change_x * change_x + change_y * change_y)
        share = mass_per_period * (1.0 if change <= greatest else greatest / change)
        forces[robot, 0], forces[robot, 1] = share * change_x, share * change_y
    call = engine.functions
    store_at(engine.forces.count_address, 0)
    call_at(call.each_body, (engine.space[0], call.write_body, engine.forces.address))


@kernel
def read(engine: Engine, batch: Batch) -> None:
    """Fill a batch with what it holds of the bodies."""
    store_at(batch.count_address, 0)
    call = engine.functions
    call_at(call.each_body, (engine.space[0], call.read_body, batch.address))


@kernel
def follow(engine: Engine, events: Integers, n_events: int, item_position: Numbers) -> None:
    """Let bodies collide as they must after these events (kind, robot, item)."""
    for event in range(n_events):
        kind, robot, item = events[event, 0], events[event, 1], events[event, 2]
        if kind == LIFTED:
            collide_with(engine, engine.item_shapes[item], NO_ONE)
            collide_with(engine, engine.robot_shapes[robot], LADEN_ROBOT)
        if kind in (PUT_DOWN, DELIVERED_IT):
            collide_with(engine, engine.robot_shapes[robot], EMPTY_ROBOT)
        if kind in (PUT_DOWN, CAME_BACK):
            move(engine, engine.item_shapes[item], item_position[item, 0], item_position[item, 1])


@kernel
def move(engine: Engine, item_shape: int, x: float, y: float) -> None:
    """Move an item to (x, y) [m]; who collides with it stays as it is."""
    call_at(engine.functions.set_offset, (item_shape, (x, y)))
    call_at(engine.functions.reindex, (engine.space[0], item_shape))


@kernel
def collide_with(engine: Engine, shape: int, whom: int) -> None:
    """Give a shape a filter, of no group."""
    call_at(engine.functions.set_filter, (shape, (0, whom)))
