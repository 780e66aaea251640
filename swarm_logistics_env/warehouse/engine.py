"""What the physics engine does within a control step, called by address from compiled code.

`physics` builds the bodies and fills the table that these kernels read: addresses of the engine's
functions and of its things, and what else it wants to be told.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.kernels import kernel
from swarm_logistics_env.warehouse.logistics import LIFTED
from swarm_logistics_env.warehouse.native import call_at, store_at

# Rows of the table. Of the functions that a step calls, and of those that make and free things:
(
    STEP, SET_ITERATIONS, EACH_BODY, READ_BODY, WRITE_BODY, SET_FILTER, SET_OFFSET, REINDEX,
    NEW_SPACE, STATIC_BODY, SET_SLOP, NEW_BODY, NEW_CONTROL, SET_POSITION, SET_VELOCITY, NEW_CIRCLE,
    NEW_SEGMENT, NEW_JOINT, SET_BIAS, SET_FORCE, ADD_BODY, ADD_SHAPE, ADD_JOINT,
    FREE_SPACE, FREE_BODY, FREE_SHAPE, FREE_JOINT,
    # of the space, of the batches that are read and written, and of how far each is filled:
    SPACE, READ_BATCH, WRITE_BATCH, READ_COUNT, WRITE_COUNT,
    # what a filter says of whom a shape collides with (the two masks of a cpShapeFilter),
    NO_ONE, EMPTY_ROBOT, LADEN_ROBOT, FREE_ITEM, SOLID,
    # and from here on the address of every robot's shape, then of every item's, then of the rest.
    SHAPES,
) = range(38)  # fmt: skip

# Of the contact solver: few for robots that meet, many for a pile. With 4, a pile of 150 in a
# corner stands 50 mm inside itself for good; with 16 always, a step costs a fifth more.
_FEWEST_ITERATIONS, _MOST_ITERATIONS, _PILED_PER_ITERATION = 4, 16, 8


@kernel
def advance(engine: NDArray[np.int64], pile: int, n_substeps: int, period: float) -> None:
    """Write the bodies' velocities, take `n_substeps` of `period` [s], read the bodies.

    The largest `pile` has so many robots now, which says how hard the contacts are to solve.
    """
    iterations = min(_FEWEST_ITERATIONS + pile // _PILED_PER_ITERATION, _MOST_ITERATIONS)
    space = engine[SPACE]
    call_at(engine[SET_ITERATIONS], (space, iterations))
    store_at(engine[WRITE_COUNT], 0)
    call_at(engine[EACH_BODY], (space, engine[WRITE_BODY], engine[WRITE_BATCH]))
    for _ in range(n_substeps):
        call_at(engine[STEP], (space, period))
    read_bodies(engine)


@kernel
def read_bodies(engine: NDArray[np.int64]) -> None:
    """Fill the batch that is read with where the bodies are and how fast."""
    store_at(engine[READ_COUNT], 0)
    call_at(engine[EACH_BODY], (engine[SPACE], engine[READ_BODY], engine[READ_BATCH]))


@kernel
def follow(
    engine: NDArray[np.int64],
    events: NDArray[np.int64],
    n_events: int,
    n_robots: int,
    item_position: NDArray[np.float64],
) -> None:
    """Let bodies collide as they must after these events (kind, robot, item)."""
    for event in range(n_events):
        kind, item = events[event, 0], events[event, 2]
        robot_shape = engine[SHAPES + events[event, 1]]
        item_shape = engine[SHAPES + n_robots + item]
        if kind == LIFTED:
            collide_with(engine, item_shape, engine[NO_ONE])
            collide_with(engine, robot_shape, engine[LADEN_ROBOT])
        else:
            collide_with(engine, robot_shape, engine[EMPTY_ROBOT])
            move(engine, item_shape, item_position[item, 0], item_position[item, 1])


@kernel
def move(engine: NDArray[np.int64], item_shape: int, x: float, y: float) -> None:
    """Move an item to (x, y) [m]; who collides with it stays as it is."""
    call_at(engine[SET_OFFSET], (item_shape, (x, y)))
    call_at(engine[REINDEX], (engine[SPACE], item_shape))


@kernel
def collide_with(engine: NDArray[np.int64], shape: int, masks: int) -> None:
    """Give a shape a filter, of no group."""
    call_at(engine[SET_FILTER], (shape, (np.int64(0), masks)))
