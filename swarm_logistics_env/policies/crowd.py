"""How a controller that sees everything moves robots which have no request: compiled loops."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.compiler.kernels import kernel
from swarm_logistics_env.world.warehouse.state import NOBODY, STORED

Numbers = NDArray[np.float64]

PERSONAL_SPACE = 0.6  # [m] between centres, which waiting robots try to keep
AT_GOAL = 0.1  # [m]


@kernel
def drift(
    position: Numbers,
    present: NDArray[np.bool_],
    goals: Numbers,
    waits_under: NDArray[np.int64],
    worker: int,
    stride: float,
    braking_distance: float,
) -> Numbers:
    """Return velocities (N, 2), in top speeds, of robots on their way to where they wait.

    Args:
        position, goals: (N, 2) [m].
        present: (N,).
        waits_under: the item of each robot (N,), or `NOBODY`.
        worker: to whom all give way; `NOBODY`: to none.
        stride: how far a robot drives in a control period [m].
        braking_distance: in which it stops from top speed [m].
    """
    n_robots = len(position)
    velocity = np.empty((n_robots, 2))
    for robot in range(n_robots):
        x, y = position[robot]
        shove_x = 0.0
        shove_y = 0.0
        for other in range(n_robots):
            from_x = x - position[other, 0]
            from_y = y - position[other, 1]
            distance = math.sqrt(from_x * from_x + from_y * from_y)
            if other == robot or not present[other] or distance >= PERSONAL_SPACE:
                continue
            push = (1.0 - distance / PERSONAL_SPACE) / max(distance, 1e-6)
            if other == worker:
                push *= 3.0
            shove_x += push * from_x
            shove_y += push * from_y
        to_x = goals[robot, 0] - x
        to_y = goals[robot, 1] - y
        is_at_goal = math.sqrt(to_x * to_x + to_y * to_y) < AT_GOAL
        # A robot that waits under an item blocks nobody whom the item does not block as well.
        if is_at_goal and waits_under[robot] != NOBODY:
            shove_x = 0.0
            shove_y = 0.0
        velocity_x, velocity_y = approach(to_x, to_y, stride, braking_distance)
        # Pass on the right, so that two who meet get past each other.
        velocity_x += shove_x + 0.5 * shove_y
        velocity_y += shove_y + 0.5 * -shove_x
        velocity[robot, 0], velocity[robot, 1] = at_most_1(velocity_x, velocity_y)
    return velocity


@kernel
def distances(position: Numbers, goal: Numbers) -> Numbers:
    """Return how far each position (N, 2) is from a goal (2,), (N,)."""
    away = np.empty(len(position))
    for robot in range(len(position)):
        away[robot] = distance_to(goal[0], goal[1], position[robot])
    return away


@kernel
def commands_of(velocity: Numbers, cosine: Numbers, sine: Numbers, gripper: Numbers) -> Numbers:
    """Return the commands (N, 4), without turns, that drive robots so in the arena's frame.

    Args:
        velocity: (N, 2), in top speeds.
        cosine, sine: of the robots' headings (N,).
        gripper: their last column (N,).
    """
    commands = np.empty((len(velocity), 4))
    for robot in range(len(velocity)):
        x, y = velocity[robot]
        commands[robot, 0] = cosine[robot] * x + sine[robot] * y
        commands[robot, 1] = cosine[robot] * y - sine[robot] * x
        commands[robot, 2], commands[robot, 3] = 0.0, gripper[robot]
    return commands


@kernel
def approach(
    to_x: float, to_y: float, stride: float, braking_distance: float
) -> tuple[float, float]:
    """Return the velocity, in top speeds, of a robot that comes to a stand `to_x`, `to_y` [m] away.

    Args:
        stride: how far it drives in a control period [m].
        braking_distance: in which it stops from top speed [m].
    """
    distance = math.sqrt(to_x * to_x + to_y * to_y)
    scale = 1.0 / max(stride, distance)
    if distance < braking_distance:
        scale = min(scale, 1.0 / math.sqrt(max(distance, 1e-6) * braking_distance))
    return scale * to_x, scale * to_y


@kernel
def at_most_1(x: float, y: float) -> tuple[float, float]:
    """Return a vector, shortened to the length 1 if it is longer."""
    length = max(math.sqrt(x * x + y * y), 1.0)
    return x / length, y / length


@kernel
def share_items(
    position: Numbers,
    item_position: Numbers,
    item_status: NDArray[np.int64],
    requested: int,
    waits: NDArray[np.bool_],
    waits_under: NDArray[np.int64],
    goals: Numbers,
) -> None:
    """Give every robot that waits an item to wait under, as lonely and as near as there is.

    Who has one keeps it as long as it is free.

    Args:
        position: of robots (N, 2) [m]; item_position: (M, 2) [m].
        item_status: of each item (M,); they wait under `STORED` ones.
        requested: the item that is asked for, under which nobody waits; `NOBODY`: none.
        waits: which robots wait (N,).
        waits_under: the item of each robot so far (N,), or `NOBODY`; changed.
        goals: (N, 2) [m]; of who has an item, filled with where it lies.
    """
    is_free = item_status == STORED
    if requested != NOBODY:
        is_free[requested] = False
    is_taken = np.zeros(len(is_free), np.bool_)
    for robot in range(len(position)):
        item = waits_under[robot]
        if item != NOBODY and not (waits[robot] and is_free[item]):
            waits_under[robot] = NOBODY
        elif item != NOBODY:
            is_taken[item] = True
    for robot in range(len(position)):
        item = waits_under[robot]
        if item == NOBODY and waits[robot]:
            item = loneliest(position[robot], item_position, is_free, is_taken)
        if item != NOBODY:
            waits_under[robot] = item
            is_taken[item] = True
            goals[robot] = item_position[item]


@kernel
def loneliest(
    position: Numbers,
    item_position: Numbers,
    is_free: NDArray[np.bool_],
    is_taken: NDArray[np.bool_],
) -> int:
    """Return the free item farthest from taken ones, less half its distance from a position.

    The nearest one if none is taken; `NOBODY` if none is free.
    """
    best = NOBODY
    most = -np.inf
    any_taken = is_taken.any()
    for item in range(len(is_free)):
        if not is_free[item] or is_taken[item]:
            continue
        x, y = item_position[item]
        gap = np.inf if any_taken else 0.0
        for other in range(len(is_taken)):
            if is_taken[other]:
                gap = min(gap, distance_to(x, y, item_position[other]))
        distance = distance_to(x, y, position)
        worth = gap - 0.5 * distance if any_taken else -distance
        if worth > most:
            best = item
            most = worth
    return best


@kernel
def distance_to(x: float, y: float, position: Numbers) -> float:
    """Return how far (x, y) is from a position (2,)."""
    away_x = x - position[0]
    away_y = y - position[1]
    return math.sqrt(away_x * away_x + away_y * away_y)
