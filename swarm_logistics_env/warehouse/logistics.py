"""Pick up, carry, drop, deliver, next request, and the timers: the rules of the warehouse.

Kernels change the state's arrays and list what the physics must know as events
(kind, robot, item), so that they know no engine.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.kernels import kernel
from swarm_logistics_env.warehouse.grid import cell_along
from swarm_logistics_env.warehouse.state import CARRIED, DELIVERED, NOBODY, STORED

LIFTED, PUT_DOWN = 0, 1
_HOLD, _OPEN = 0.5, -0.5


@kernel
def carry_along(
    position: NDArray[np.float64],
    present: NDArray[np.bool_],
    delivery_edge: float,
    robot_item: NDArray[np.int64],
    item_position: NDArray[np.float64],
    in_delivery: NDArray[np.bool_],
) -> None:
    """Bring carried items to where their carriers are and note who is in the delivery area."""
    for robot in range(position.shape[0]):
        in_delivery[robot] = present[robot] and position[robot, 0] >= delivery_edge
        item = robot_item[robot]
        if item != NOBODY:
            item_position[item, 0] = position[robot, 0]
            item_position[item, 1] = position[robot, 1]


@kernel
def open_grippers(
    gripper: NDArray[np.float64],
    able: NDArray[np.bool_],
    in_delivery: NDArray[np.bool_],
    requested: int,
    robot_item: NDArray[np.int64],
    memory: NDArray[np.int64],
    item_status: NDArray[np.int64],
    item_carrier: NDArray[np.int64],
    item_covered: NDArray[np.int64],
    events: NDArray[np.int64],
) -> int:
    """Put down what robots let go of, covered; returns the number of events written.

    The requested item is let go of anywhere, another one only outside the delivery area.
    """
    n_events = 0
    for robot in range(gripper.shape[0]):
        item = robot_item[robot]
        if item == NOBODY or not able[robot] or gripper[robot] >= _OPEN:
            continue
        if in_delivery[robot] and item != requested:
            continue
        for place in range(memory.shape[1] - 1, 0, -1):
            memory[robot, place] = memory[robot, place - 1]
        if memory.shape[1] > 0:
            memory[robot, 0] = item
        robot_item[robot] = NOBODY
        item_status[item] = STORED
        item_carrier[item] = NOBODY
        item_covered[item] = 1
        events[n_events, 0] = PUT_DOWN
        events[n_events, 1] = robot
        events[n_events, 2] = item
        n_events += 1
    return n_events


@kernel
def wanted_item(
    robot: int,
    position: NDArray[np.float64],
    memory: NDArray[np.int64],
    requested: int,
    pickup_range: float,
    item_position: NDArray[np.float64],
    item_status: NDArray[np.int64],
    cell: float,
    size: NDArray[np.int64],
    start: NDArray[np.int64],
    members: NDArray[np.int64],
) -> tuple[int, float]:
    """Return the item that `robot` would lift now, or NOBODY, and the square of its distance.

    The requested item in reach comes first, else the nearest in reach that is not in its memory.
    """
    x, y = position[robot, 0], position[robot, 1]
    best, best_square = NOBODY, pickup_range * pickup_range
    left = cell_along(x - pickup_range, cell, size[0])
    right = cell_along(x + pickup_range, cell, size[0])
    for row in range(
        cell_along(y - pickup_range, cell, size[1]),
        cell_along(y + pickup_range, cell, size[1]) + 1,
    ):
        for index in range(start[row * size[0] + left], start[row * size[0] + right + 1]):
            item = members[index]
            if item_status[item] != STORED:
                continue
            dx, dy = item_position[item, 0] - x, item_position[item, 1] - y
            square = dx * dx + dy * dy
            if square > pickup_range * pickup_range:
                continue
            if item == requested:
                return item, square
            if square > best_square or (square == best_square and best != NOBODY):
                continue
            remembered = False
            for place in range(memory.shape[1]):
                remembered = remembered or memory[robot, place] == item
            if not remembered:
                best, best_square = item, square
    return best, best_square


@kernel
def close_grippers(
    gripper: NDArray[np.float64],
    able: NDArray[np.bool_],
    position: NDArray[np.float64],
    requested: int,
    pickup_range: float,
    robot_item: NDArray[np.int64],
    memory: NDArray[np.int64],
    item_position: NDArray[np.float64],
    item_status: NDArray[np.int64],
    item_carrier: NDArray[np.int64],
    item_covered: NDArray[np.int64],
    claim: NDArray[np.int64],
    claim_square: NDArray[np.float64],
    cell: float,
    size: NDArray[np.int64],
    start: NDArray[np.int64],
    members: NDArray[np.int64],
    events: NDArray[np.int64],
    n_events: int,
) -> int:
    """Lift what empty robots hold on to; returns the number of events so far.

    Where several want the same item the nearest able one gets it, and the others choose again.
    `claim` (I,) and `claim_square` (I,) are working space, all NOBODY before and after.
    """
    while True:
        n_before = n_events
        for robot in range(gripper.shape[0]):
            if robot_item[robot] != NOBODY or not able[robot] or gripper[robot] <= _HOLD:
                continue
            item, square = wanted_item(
                robot, position, memory, requested, pickup_range,
                item_position, item_status, cell, size, start, members,
            )  # fmt: skip
            if item != NOBODY and (claim[item] == NOBODY or square < claim_square[item]):
                claim[item] = robot
                claim_square[item] = square
        for item in range(claim.shape[0]):
            robot = claim[item]
            if robot == NOBODY:
                continue
            claim[item] = NOBODY
            robot_item[robot] = item
            item_status[item] = CARRIED
            item_carrier[item] = robot
            item_covered[item] = 0
            item_position[item, 0] = position[robot, 0]
            item_position[item, 1] = position[robot, 1]
            events[n_events, 0] = LIFTED
            events[n_events, 1] = robot
            events[n_events, 2] = item
            n_events += 1
        if n_events == n_before:
            return n_events


@kernel
def deliver(
    requested: int,
    in_delivery: NDArray[np.bool_],
    delivers: NDArray[np.bool_],
    robot_item: NDArray[np.int64],
    memory: NDArray[np.int64],
    item_status: NDArray[np.int64],
    item_carrier: NDArray[np.int64],
) -> int:
    """Deliver the requested item if its carrier can; returns that robot, or NOBODY.

    Delivery clears every robot's memory.
    """
    if requested == NOBODY:
        return NOBODY
    robot = item_carrier[requested]
    if robot == NOBODY or not in_delivery[robot] or not delivers[robot]:
        return NOBODY
    robot_item[robot] = NOBODY
    item_status[requested] = DELIVERED
    item_carrier[requested] = NOBODY
    memory[:, :] = NOBODY
    return int(robot)


@kernel
def run_timers(
    step: int,
    period: float,
    limit: float,
    gossip: bool,
    in_delivery: NDArray[np.bool_],
    present: NDArray[np.bool_],
    honest: NDArray[np.bool_],
    heard: NDArray[np.float64],
    last_in_delivery: NDArray[np.int64],
    timer: NDArray[np.float64],
    told: NDArray[np.float64],
) -> None:
    """Advance every robot's timer and what it tells (NaN: silent), both (N,) [s].

    Counted in steps, so that rounding never adds up. With gossip a robot tells the lowest of its
    own timer and of what it heard one period ago, aged. One that is not honest tells 0.
    """
    for robot in range(timer.shape[0]):
        if in_delivery[robot]:
            last_in_delivery[robot] = step
        timer[robot] = math.nan
        if present[robot] and last_in_delivery[robot] >= 0:
            elapsed = (step - last_in_delivery[robot]) * period
            if elapsed < limit - 1e-9:
                timer[robot] = elapsed
        value = timer[robot]
        if gossip and present[robot] and heard[robot] + period < limit - 1e-9:
            value = (
                heard[robot] + period if math.isnan(value) else min(value, heard[robot] + period)
            )
        told[robot] = value
        if present[robot] and not honest[robot]:
            told[robot] = 0.0
