"""What the physics engine does within a control step, called by address from compiled code.

`physics` fills in the addresses, `building` makes the bodies and shapes.
"""

from __future__ import annotations

from swarm_logistics_env.kernels import inlined_kernel
from swarm_logistics_env.warehouse.native import call_at, store_at
from swarm_logistics_env.warehouse.structs import Engine, IntegerRows, NumberRows

_ROBOT, _SOLID, _ITEM = 1, 2, 4  # categories of shapes
_MASK = 32  # bits of the categories in a filter's second word, below those of its mask

# Whom a shape collides with: its own categories, and the mask of those that it meets.
NO_ONE = 0
EMPTY_ROBOT = _ROBOT | (_ROBOT | _SOLID) << _MASK
LADEN_ROBOT = _ROBOT | (_ROBOT | _SOLID | _ITEM) << _MASK
FREE_ITEM = _ITEM | _ROBOT << _MASK
SOLID_THING = _SOLID | _ROBOT << _MASK

# Kinds of events: what happened to (robot, item) that changes whom they collide with.
LIFTED, PUT_DOWN, DELIVERED_IT, CAME_BACK = 0, 1, 2, 3

# Of the contact solver: few for robots that meet, many for a pile. With 4, a pile of 150 in a
# corner stands 50 mm inside itself for good; with 16 always, a step costs a fifth more.
_FEWEST_ITERATIONS, _MOST_ITERATIONS, _PILED_PER_ITERATION = 4, 16, 8


@inlined_kernel
def advance(engine: Engine, pile: int, n_substeps: int, period: float) -> None:
    """Write the bodies' velocities, take `n_substeps` of `period` [s], read the bodies.

    The largest `pile` has so many robots now, which says how hard the contacts are to solve.
    """
    space, call = engine.space[0], engine.functions
    iterations = min(_FEWEST_ITERATIONS + pile // _PILED_PER_ITERATION, _MOST_ITERATIONS)
    call_at(call.set_iterations, (space, iterations))
    store_at(engine.write_count, 0)
    call_at(call.each_body, (space, call.write_body, engine.write_batch))
    for _ in range(n_substeps):
        call_at(call.step, (space, period))
    read_bodies(engine)


@inlined_kernel
def read_bodies(engine: Engine) -> None:
    """Fill `engine.bodies` with where the bodies are and how fast."""
    store_at(engine.read_count, 0)
    call_at(
        engine.functions.each_body,
        (engine.space[0], engine.functions.read_body, engine.read_batch),
    )


@inlined_kernel
def follow(engine: Engine, events: IntegerRows, n_events: int, item_position: NumberRows) -> None:
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


@inlined_kernel
def move(engine: Engine, item_shape: int, x: float, y: float) -> None:
    """Move an item to (x, y) [m]; who collides with it stays as it is."""
    call_at(engine.functions.set_offset, (item_shape, (x, y)))
    call_at(engine.functions.reindex, (engine.space[0], item_shape))


@inlined_kernel
def collide_with(engine: Engine, shape: int, whom: int) -> None:
    """Give a shape a filter, of no group."""
    call_at(engine.functions.set_filter, (shape, (0, whom)))
