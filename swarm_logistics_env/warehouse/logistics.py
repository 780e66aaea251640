"""The rules of the warehouse: from commands to motion, to loads, deliveries and the next request.

Kernels change the world's arrays and list what the physics must know as events
(kind, robot, item), so that they call no engine.
"""

from __future__ import annotations

import math

from swarm_logistics_env.kernels import inlined_kernel, kernel

from .grid import look_around
from .layout import draw_order, place_restocked
from .physics import CAME_BACK, DELIVERED_IT, LIFTED, PUT_DOWN
from .structs import (
    CARRIED,
    DELIVERED,
    NOBODY,
    STORED,
    Capabilities,
    Integers,
    Numbers,
    Parameters,
    Robots,
    World,
)

FORWARD, LEFT, TURN, GRIPPER, MESSAGE = range(5)  # columns of a command row; messages are the rest


@kernel
def first_not_finite(commands: Numbers) -> int:
    """Return the first row of commands (N, C) that is not finite; NOBODY if all are."""
    for row in range(len(commands)):
        for column in range(commands.shape[1]):
            if not math.isfinite(commands[row, column]):
                return row
    return NOBODY


@kernel
def refused_command(commands: Numbers, robots: Robots, able: Capabilities) -> int:
    """Return the place, row by row, of the first command that is not finite; NOBODY if all are.

    Rows of robots that ignore their commands may hold anything.
    """
    n_columns = commands.shape[1]
    for robot in range(len(commands)):
        if robots.present[robot] and able.obeys[robot]:
            for column in range(n_columns):
                if not math.isfinite(commands[robot, column]):
                    return int(robot * n_columns + column)
    return NOBODY


@kernel
def drive(
    commands: Numbers,
    robots: Robots,
    able: Capabilities,
    parameters: Parameters,
    wanted_velocity: Numbers,
) -> None:
    """Turn the robots and fill their wanted velocities (N, 2) [m/s] for one control period.

    Commands beyond [-1, 1] are cut, and the speed to the top speed whatever the direction. A robot
    turns as commanded and by its heading drift, unless its motor is dead, and drives along its mean
    direction; one that is not holonomic ignores `left`. Rows of robots that ignore their commands
    are ignored.
    """
    for robot in range(len(commands)):
        wanted_velocity[robot, 0] = 0.0
        wanted_velocity[robot, 1] = 0.0
        if not (robots.present[robot] and able.obeys[robot]):
            continue
        forward = min(max(commands[robot, FORWARD], -1.0), 1.0)
        left = min(max(commands[robot, LEFT], -1.0), 1.0) if parameters.is_holonomic else 0.0
        norm = math.sqrt(forward * forward + left * left)
        speed = able.max_speed[robot] / max(norm, 1.0)
        turn, most = min(max(commands[robot, TURN], -1.0), 1.0), able.max_turn_rate[robot]
        drift = robots.heading_drift[robot] if most > 0.0 else 0.0
        angle = (turn * most + drift) * parameters.control_period
        heading = robots.heading[robot]
        cosine, sine = math.cos(heading + 0.5 * angle), math.sin(heading + 0.5 * angle)
        wanted_velocity[robot, 0] = speed * (forward * cosine - left * sine)
        wanted_velocity[robot, 1] = speed * (forward * sine + left * cosine)
        if angle != 0.0:
            turned = heading + angle
            robots.heading[robot] = turned - 2.0 * math.pi * round(turned / (2.0 * math.pi))


_HOLD, _OPEN = 0.5, -0.5


@inlined_kernel
def note_event(events: Integers, n_events: int, kind: int, robot: int, item: int) -> int:
    """Write an event; returns the number of events so far."""
    events[n_events, 0] = kind
    events[n_events, 1] = robot
    events[n_events, 2] = item
    return n_events + 1


@kernel
def carry_along(world: World) -> None:
    """Bring carried items to where their carriers are and note who is in the delivery area."""
    robots, items = world.robots, world.items
    for robot in range(len(robots.item)):
        x = robots.position[robot, 0]
        robots.in_delivery[robot] = robots.present[robot] and x >= world.parameters.storage_width
        item = robots.item[robot]
        if item != NOBODY:
            items.position[item, 0] = x
            items.position[item, 1] = robots.position[robot, 1]


@kernel
def open_grippers(world: World, commands: Numbers) -> int:
    """Put down what robots let go of, covered; returns the number of events written.

    The requested item is let go of anywhere, another one only outside the delivery area.
    """
    robots, able, items, n_events = world.robots, world.able, world.items, 0
    requested = world.progress.requested[0]
    for robot in range(len(commands)):
        item = robots.item[robot]
        is_able = robots.present[robot] and able.obeys[robot]
        if item == NOBODY or not is_able or commands[robot, GRIPPER] >= _OPEN:
            continue
        if robots.in_delivery[robot] and item != requested:
            continue
        if robots.in_delivery[robot] and not able.releases_inside[robot]:
            continue
        remember(robots.memory, robot, item)
        robots.item[robot] = NOBODY
        items.status[item] = STORED
        items.carrier[item] = NOBODY
        items.covered[item] = 1
        n_events = note_event(world.claims.events, n_events, PUT_DOWN, robot, item)
    return n_events


@inlined_kernel
def remember(memory: Integers, robot: int, item: int) -> None:
    """Put `item` in front of a robot's memory, which forgets its oldest."""
    for place in range(memory.shape[1] - 1, 0, -1):
        memory[robot, place] = memory[robot, place - 1]
    if memory.shape[1] > 0:
        memory[robot, 0] = item


@inlined_kernel
def is_remembered(memory: Integers, robot: int, item: int) -> bool:
    """Return whether `item` is in a robot's memory."""
    found = False
    for place in range(memory.shape[1]):
        found |= memory[robot, place] == item
    return found


@kernel
def wanted_item(world: World, robot: int) -> tuple[int, float]:
    """Return the item that `robot` would lift now, or NOBODY, and the square of its distance.

    The requested item in reach comes first, else the nearest that is not in its memory.
    """
    robots, grid, nearby = world.robots, world.item_grid, world.nearby
    x, y = robots.position[robot, 0], robots.position[robot, 1]
    n_found = look_around(grid, x, y, world.parameters.pickup_range, NOBODY, nearby)
    best, best_square = NOBODY, math.inf
    for index in range(n_found):
        item, square = grid.members[nearby.place[index]], nearby.square[index]
        if world.items.status[item] != STORED:
            continue
        if item == world.progress.requested[0]:
            return item, square
        if square < best_square and not is_remembered(robots.memory, robot, item):
            best, best_square = item, square
    return best, best_square


@kernel
def close_grippers(world: World, commands: Numbers, n_events: int) -> int:
    """Lift what empty robots hold on to; returns the number of events so far.

    If several want the same item, the nearest able one gets it, and the others choose again.
    """
    robots, able, items, claims = world.robots, world.able, world.items, world.claims
    while True:
        n_before = n_events
        for robot in range(len(commands)):
            is_able = robots.present[robot] and able.obeys[robot] and able.lifts[robot]
            is_free = robots.item[robot] == NOBODY
            if not is_free or not is_able or commands[robot, GRIPPER] <= _HOLD:
                continue
            item, square = wanted_item(world, robot)
            if item != NOBODY and (claims.robot[item] == NOBODY or square < claims.square[item]):
                claims.robot[item] = robot
                claims.square[item] = square
        for item in range(len(claims.robot)):
            robot = claims.robot[item]
            if robot == NOBODY:
                continue
            claims.robot[item] = NOBODY
            robots.item[robot] = item
            items.status[item] = CARRIED
            items.carrier[item] = robot
            items.covered[item] = 0
            items.position[item, 0] = robots.position[robot, 0]
            items.position[item, 1] = robots.position[robot, 1]
            n_events = note_event(claims.events, n_events, LIFTED, robot, item)
        if n_events == n_before:
            return n_events


@kernel
def deliver(world: World, n_events: int) -> tuple[int, int, bool]:
    """Deliver the requested item if its carrier can, then the next one, and so on.

    A delivery clears every robot's memory; with `restock` the item comes back to the storage.

    Returns:
        The number of events so far, of deliveries, and whether all that came back found room.
    """
    robots, items, progress = world.robots, world.items, world.progress
    n_delivered, is_room = 0, True
    while progress.requested[0] != NOBODY:
        item = progress.requested[0]
        robot = items.carrier[item]
        if robot == NOBODY or not robots.in_delivery[robot] or not world.able.delivers[robot]:
            break
        robots.item[robot] = NOBODY
        for other in range(len(robots.memory)):
            for place in range(robots.memory.shape[1]):
                robots.memory[other, place] = NOBODY
        items.status[item] = DELIVERED
        items.carrier[item] = NOBODY
        world.claims.delivered_by[n_delivered] = robot
        n_delivered += 1
        progress.n_delivered[0] += 1
        n_events = note_event(world.claims.events, n_events, DELIVERED_IT, robot, item)
        if world.parameters.restock:
            if place_restocked(world, item):
                items.status[item] = STORED
                items.covered[item] = 1
                n_events = note_event(world.claims.events, n_events, CAME_BACK, robot, item)
            else:
                is_room = False
        ask_for_next(world)
    return n_events, n_delivered, is_room


@kernel
def ask_for_next(world: World) -> None:
    """Ask for the next item in the order of requests that has not left for good."""
    items, progress = world.items, world.progress
    progress.requested[0] = NOBODY
    n_left = 0
    for item in range(len(items.status)):
        n_left += int(items.status[item] != DELIVERED)
    while n_left > 0 and progress.requested[0] == NOBODY:
        progress.n_asked[0] += 1
        cycle, place = divmod(progress.n_asked[0], len(items.order))
        if place == 0:
            draw_order(items.request_key, cycle, items.order)
        if items.status[items.order[place]] != DELIVERED:
            progress.requested[0] = items.order[place]
