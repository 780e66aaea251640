"""Absence: robots that are taken out of the arena, and those that come back.

A robot that comes back stands where it was taken out, as it looked then. If another robot stands
there now, it gets the nearest place with room of those on rings around, half a radius apart and up
to ten radii wide, from the +x direction to the left; no wall and no rack is between the two. If
none has room it waits, and looks again after each step. Items need no room, as an unladen robot
stands above them. It begins as at a start: it stands still, remembers no item, and was in no
delivery area.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.compiler.addresses import call_at, unpacked_at
from swarm_logistics_env.compiler.kernels import engine_kernel, kernel

from .commands import IDLE
from .floor_cells import is_in_sight, is_near_solid
from .layout import is_clear
from .logistics import put_down
from .physics import EMPTY_ROBOT, NO_ONE, SLOP, collide_with
from .state import WarehouseState
from .structs import NOBODY, World

_RINGS = 20  # around the place where it was taken out
_RINGS_PER_RADIUS = 2
_PLACES_PER_RING = 6  # times the ring's number, so that places are about equally far apart


def change_presence(
    address: int, state: WarehouseState, is_removed: NDArray[np.bool_], is_away: NDArray[np.bool_]
) -> None:
    """Take robots out of the arena and bring back those that no fault keeps out any more.

    If one of these finds no room, faults are applied again after the next step.

    Args:
        address: of the world.
        is_removed: which robots are out for good from now on (N,).
        is_away: which others are out now (N,).
    """
    for robot in np.flatnonzero((is_removed | is_away) & state.robot_present).tolist():
        remove(address, robot)
        state.robot_away[robot] = True
    state.robot_away &= ~is_removed
    # Last, so that there is room where somebody stood until now.
    for robot in np.flatnonzero(state.robot_away & ~is_away).tolist():
        if not bring_back(address, robot):
            state.progress.pause_step[0] = state.step + 1


@engine_kernel
def remove(address: int, robot: int) -> None:
    """Take a robot out of the arena of the world at `address`."""
    take_out(unpacked_at(World, address), robot)


@engine_kernel
def take_out(world: World, robot: int) -> None:
    """Take a robot out of the arena; what it carries is put down where it is."""
    robots = world.robots
    engine = world.engine
    if robots.item[robot] != NOBODY:
        put_down(world, robot)
    collide_with(engine, engine.robot_shapes[robot], NO_ONE)
    robots.left_at[robot, 0] = robots.position[robot, 0]
    robots.left_at[robot, 1] = robots.position[robot, 1]
    robots.left_at[robot, 2] = robots.heading[robot]
    robots.present[robot] = False
    robots.in_delivery[robot] = False
    robots.handling[robot, :] = IDLE
    robots.memory[robot, :] = NOBODY
    robots.position[robot, :] = 0.0
    robots.velocity[robot, :] = 0.0
    robots.heading[robot] = 0.0
    robots.turn_rate[robot] = 0.0


@engine_kernel
def bring_back(address: int, robot: int) -> bool:
    """Put a robot that is away back into the arena; returns whether there was room."""
    world = unpacked_at(World, address)
    robots = world.robots
    engine = world.engine
    x, y, is_room = free_place(world, robot)
    if not is_room:
        return False
    body = engine.robot_bodies[robot]
    call_at(engine.functions.cpBodySetPosition, (body, (x, y)))
    call_at(engine.functions.cpBodySetVelocity, (body, (0.0, 0.0)))
    collide_with(engine, engine.robot_shapes[robot], EMPTY_ROBOT)
    robots.away[robot] = False
    robots.present[robot] = True
    robots.position[robot, 0] = x
    robots.position[robot, 1] = y
    robots.heading[robot] = robots.left_at[robot, 2]
    robots.last_in_delivery[robot] = NOBODY
    robots.heard[robot] = math.nan
    robots.frozen_beams[robot, 0] = math.nan
    # Who touches it now did not run into it.
    world.contacts.position_before[robot, 0] = x
    world.contacts.position_before[robot, 1] = y
    world.contacts.velocity_before[robot, :] = 0.0
    return True


@kernel
def free_place(world: World, robot: int) -> tuple[float, float, bool]:
    """Return x and y [m] where a robot comes back, and whether there is such a place."""
    left_x = world.robots.left_at[robot, 0]
    left_y = world.robots.left_at[robot, 1]
    for ring in range(_RINGS + 1):
        distance = ring * world.robots.radius[robot] / _RINGS_PER_RADIUS
        n_places = max(_PLACES_PER_RING * ring, 1)
        for number in range(n_places):
            angle = 2.0 * math.pi * number / n_places
            x = left_x + distance * math.cos(angle)
            y = left_y + distance * math.sin(angle)
            if has_room(world, robot, x, y) and is_in_sight(world, left_x, left_y, x, y):
                return x, y, True
    return left_x, left_y, False


@kernel
def has_room(world: World, robot: int, x: float, y: float) -> bool:
    """Return whether a robot may stand at a point [m]: no robot and nothing solid is there."""
    parameters = world.parameters
    robots = world.robots
    # Bodies rest that deep in what is solid, so that one who stood at a wall may stand there again.
    radius = robots.radius[robot] - SLOP
    aside = min(x, parameters.warehouse_width - x)
    from_sides = min(aside, min(y, parameters.warehouse_height - y))
    if from_sides < radius:
        return False
    if world.floor.n_columns > 0 and is_near_solid(world.floor, x, y, radius):
        return False
    if not is_clear(x, y, world.obstacles, radius + parameters.obstacle_radius):
        return False
    is_free = True
    for other in range(len(robots.present)):
        dx = robots.position[other, 0] - x
        dy = robots.position[other, 1] - y
        apart = robots.radius[robot] + robots.radius[other]
        is_near = dx * dx + dy * dy < apart * apart
        is_free &= not (is_near and robots.present[other])
    return is_free
