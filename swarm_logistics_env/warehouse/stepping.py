"""A control step in one compiled call, bodies' motion and all, without the interpreter's lock."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.kernels import inlined_kernel, kernel
from swarm_logistics_env.warehouse.engine import advance, follow
from swarm_logistics_env.warehouse.grid import fill
from swarm_logistics_env.warehouse.item_collisions import mask_below_lifters, unmask_left
from swarm_logistics_env.warehouse.kinematics import drive, refused_command
from swarm_logistics_env.warehouse.logistics import (
    carry_along,
    close_grippers,
    deliver,
    open_grippers,
)
from swarm_logistics_env.warehouse.packing import unpacked_at
from swarm_logistics_env.warehouse.radio import run_timers, send_messages
from swarm_logistics_env.warehouse.ranger_faults import fail_rangers
from swarm_logistics_env.warehouse.sensing import sense
from swarm_logistics_env.warehouse.sensor_noise import disturb
from swarm_logistics_env.warehouse.structs import (
    NOBODY,
    STORED,
    NumberRows,
    World,
)


class StepResult(NamedTuple):
    """What a control step has to tell beside the state."""

    refused: int  # place, row by row, of the command that is not finite; NOBODY: step taken
    n_delivered: int  # deliveries in this step, by `Claims.delivered_by`
    is_paused: bool  # nothing was sensed yet, as faults begin or end now: `perceive` does it
    is_room: bool  # whether all items that came back to the storage found room


@kernel
def perceive(address: int, rows: NDArray[np.float32]) -> None:
    """Run the timers and fill the observation rows (N, D) of the world at `address`."""
    world = unpacked_at(World, address)
    robots, items, progress = world.robots, world.items, world.progress
    step = progress.step[0]
    run_timers(robots, world.able, world.parameters, step)
    fill(world.robot_grid, robots.position, robots.present)
    fill(world.item_grid, items.position, items.status == STORED)
    n_anchored = sense(world, step, rows)
    disturb(robots, world.able, world.parameters, step, rows)
    fail_rangers(robots, world.able, world.parameters, rows)
    progress.anchoring_seconds[0] += n_anchored * world.parameters.control_period


@kernel
def step(address: int, commands: NumberRows, rows: NDArray[np.float32]) -> StepResult:
    """Take a control step in the world at `address` and fill the observation rows (N, D).

    If a command is refused, the world is as it was.
    """
    world = unpacked_at(World, address)
    progress, parameters = world.progress, world.parameters
    refused = refused_command(commands, world.robots, world.able)
    if refused != NOBODY:
        return StepResult(refused, 0, False, True)
    progress.step[0] += 1
    progress.time[0] = progress.step[0] * parameters.control_period
    move(world, commands)
    send_messages(commands, world.robots, world.able, progress.step[0])
    n_delivered, is_room = handle_items(world, commands)
    is_paused = progress.step[0] == progress.pause_step[0]
    if not is_paused:
        perceive(address, rows)
    return StepResult(NOBODY, n_delivered, is_paused, is_room)


@inlined_kernel
def move(world: World, commands: NumberRows) -> None:
    """Turn and move the robots as commanded and as far as bodies let them."""
    robots, engine, parameters = world.robots, world.engine, world.parameters
    drive(commands, robots, world.able, parameters, engine.wanted_velocity)
    reach = parameters.robot_radius + parameters.item_radius
    unmask_left(engine, reach, robots, world.items, world.robot_grid, world.item_grid)
    advance(engine, parameters, int(np.count_nonzero(robots.contact)))
    bodies = engine.bodies.numbers
    for robot in range(len(robots.item)):
        is_there = 1.0 if robots.present[robot] else 0.0
        for axis in range(2):
            robots.position[robot, axis] = bodies[robot, axis] * is_there
            robots.velocity[robot, axis] = bodies[robot, 2 + axis] * is_there


@inlined_kernel
def handle_items(world: World, commands: NumberRows) -> tuple[int, bool]:
    """Carry along, let go, lift and deliver; returns how many, and whether there was room."""
    robots, able, items, parameters = world.robots, world.able, world.items, world.parameters
    events, requested = world.claims.events, world.progress.requested[0]
    carry_along(robots, items, parameters.storage_width)
    n_events = open_grippers(commands, robots, able, items, requested, events)
    n_events = close_grippers(world, commands, requested, n_events)
    reach = parameters.robot_radius + parameters.item_radius
    mask_below_lifters(world.engine, events, n_events, reach, robots, items, world.item_grid)
    n_events, n_delivered, is_room = deliver(world, n_events)
    follow(world.engine, events, n_events, items.position)
    return n_delivered, is_room
