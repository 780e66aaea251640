"""The time that handling takes: a robot stands for `handling_time` before what it does to an item.

It lifts, puts down or delivers once the time is over, if it is able to then; else it has stood in
vain. Until then nothing has changed: the item that it lifts lies where it was, but nobody else can
lift it, and it carries what it puts down. With `dock_capacity` a delivery begins, and so is
counted, at least 1 / dock_capacity seconds after the one before, the oldest request first; robots
that wait for it drive as commanded.
"""

from __future__ import annotations

import math

from swarm_logistics_env.kernels import inlined_kernel, kernel

from .structs import NOBODY, World

# Columns of `Robots.handling`, and the kinds that the first one holds.
KIND, ITEM, LAST_STEP = range(3)
IDLE, LIFTING, PUTTING_DOWN, DELIVERING = range(4)
_GRACE = 1e-6  # [s]; times are sums of periods


@inlined_kernel
def gripper_of(world: World, robot: int, command: float) -> float:
    """Return the gripper's command, or what it does by itself while a robot handles an item."""
    kind = world.robots.handling[robot, KIND]
    if kind == IDLE:
        return command
    return 1.0 if kind == LIFTING else (-1.0 if kind == PUTTING_DOWN else 0.0)


@inlined_kernel
def is_done(world: World, robot: int, kind: int, item: int) -> bool:
    """Return whether a robot has done this to an item; let it begin if it is idle."""
    if world.parameters.handling_steps == 0:
        return True
    handling, step = world.robots.handling, world.progress.step[0]
    if handling[robot, KIND] == IDLE:
        handling[robot, KIND] = kind
        handling[robot, ITEM] = item
        handling[robot, LAST_STEP] = step + world.parameters.handling_steps
    is_same = handling[robot, KIND] == kind and handling[robot, ITEM] == item
    return bool(is_same and step >= handling[robot, LAST_STEP])


@inlined_kernel
def may_deliver(world: World, robot: int) -> bool:
    """Return whether a robot delivers already, or may begin; the dock is taken then."""
    progress, parameters = world.progress, world.parameters
    if parameters.dock_period == 0.0 or world.robots.handling[robot, KIND] != IDLE:
        return True
    if progress.time[0] < progress.dock_free[0] - _GRACE:
        return False
    progress.dock_free[0] = progress.time[0] + parameters.dock_period
    return True


@kernel
def is_being_lifted(world: World, item: int) -> bool:
    """Return whether a robot is about to lift an item."""
    if world.parameters.handling_steps == 0:
        return False
    handling, found = world.robots.handling, False
    for robot in range(len(handling)):
        found |= handling[robot, KIND] == LIFTING and handling[robot, ITEM] == item
    return found


@kernel
def item_lifted(world: World, robot: int) -> tuple[int, float]:
    """Return the item that a robot has lifted now, or NOBODY, and the square of its distance.

    It lifts nothing if it was shoved out of its reach.
    """
    item = world.robots.handling[robot, ITEM]
    dx = world.items.position[item, 0] - world.robots.position[robot, 0]
    dy = world.items.position[item, 1] - world.robots.position[robot, 1]
    square = dx * dx + dy * dy
    is_over = world.progress.step[0] >= world.robots.handling[robot, LAST_STEP]
    if is_over and square <= world.parameters.pickup_range**2:
        return item, square
    return NOBODY, math.inf


@kernel
def end_handling(world: World) -> None:
    """Let robots go on whose time is over."""
    if world.parameters.handling_steps == 0:
        return
    handling = world.robots.handling
    for robot in range(len(handling)):
        if handling[robot, LAST_STEP] <= world.progress.step[0]:
            handling[robot, KIND] = IDLE
