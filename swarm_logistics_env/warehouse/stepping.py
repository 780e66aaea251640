"""A control step in one compiled call, bodies' motion and all, without the interpreter's lock.

Its parts take whole tables of the state and hand their rows to the kernels that know the rules:
calling a kernel from Python costs as much as most of them do.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.kernels import kernel
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.warehouse import state as at
from swarm_logistics_env.warehouse.covering import cover, uncover
from swarm_logistics_env.warehouse.disturbance import disturb
from swarm_logistics_env.warehouse.driving import drive
from swarm_logistics_env.warehouse.engine import advance, follow
from swarm_logistics_env.warehouse.grid import fill
from swarm_logistics_env.warehouse.logistics import (
    carry_along,
    close_grippers,
    deliver,
    open_grippers,
    run_timers,
)
from swarm_logistics_env.warehouse.piles import largest
from swarm_logistics_env.warehouse.sensing import sense
from swarm_logistics_env.warehouse.tables import (
    count_row_in,
    counts_in,
    flags_in,
    keys_in,
    number_row_in,
    numbers_in,
)

# Rows of the constants, one number each.
(
    WIDTH, HEIGHT, ROBOT_RADIUS, ITEM_RADIUS, OBSTACLE_RADIUS, RANGER_RANGE, RADIO_RANGE,
    PICKUP_RANGE, MAX_SPEED, TIMER_LIMIT, CONTROL_PERIOD, STORAGE_WIDTH, GOSSIP,
    ROBOT_CELL, ITEM_CELL, SIDEWAYS, RANGER_NOISE, POSITION_NOISE, SENSOR_DROPOUT, RADIO_LOSS,
    VIEW_RANGE, PHYSICS_PERIOD, N_SUBSTEPS, N_CONSTANTS,
) = range(24)  # fmt: skip


def constants_of(scenario: Scenario, robot_cell: float, item_cell: float) -> NDArray[np.float64]:
    """Return the numbers that the kernels need of a scenario, (N_CONSTANTS,)."""
    constants = np.zeros(N_CONSTANTS)
    constants[WIDTH] = scenario.warehouse_width
    constants[HEIGHT] = scenario.warehouse_height
    constants[ROBOT_RADIUS] = scenario.robot_radius
    constants[ITEM_RADIUS] = scenario.item_radius
    constants[OBSTACLE_RADIUS] = scenario.obstacle_radius
    constants[RANGER_RANGE] = scenario.ranger_range
    constants[RADIO_RANGE] = scenario.radio_range
    constants[PICKUP_RANGE] = scenario.pickup_range
    constants[MAX_SPEED] = scenario.max_speed
    constants[TIMER_LIMIT] = scenario.timer_limit
    constants[CONTROL_PERIOD] = scenario.control_period
    constants[STORAGE_WIDTH] = scenario.storage_width
    constants[GOSSIP] = scenario.relay == "gossip"
    constants[ROBOT_CELL], constants[ITEM_CELL] = robot_cell, item_cell
    constants[SIDEWAYS] = scenario.drive == "holonomic"
    constants[RANGER_NOISE] = scenario.ranger_noise
    constants[POSITION_NOISE] = scenario.position_noise
    constants[SENSOR_DROPOUT] = scenario.sensor_dropout
    constants[RADIO_LOSS] = scenario.radio_loss
    constants[VIEW_RANGE] = scenario.view_range
    constants[PHYSICS_PERIOD] = scenario.physics_period
    constants[N_SUBSTEPS] = scenario.n_substeps
    return constants


# Places of the arrays that a step works on, in the order of `Warehouse`'s tables.
(
    ENGINE, BODIES, VELOCITIES, CLAIM, CLAIM_SQUARE, EVENTS, CONSTANTS, POSITION, VELOCITY,
    NUMBERS, FLAGS, LINKS, MEMORY, ITEM_POSITION, ITEM_LINKS, OBSTACLE_POSITION, ROBOT_SIZE,
    ROBOT_START, ROBOT_MEMBERS, ROBOT_PLACES, ITEM_SIZE, ITEM_START, ITEM_MEMBERS, ITEM_PLACES,
    KEYS, MESSAGE,
) = range(26)  # fmt: skip

_FIRST_OF_MESSAGE = 4  # column of a command row, where there are any
# What `step` returns instead of a number of robots.
NOT_FINITE, TO_BE_PERCEIVED = -1, -2


@kernel
def step(
    tables: NDArray[np.int64],
    commands: NDArray[np.float64],
    step: int,
    requested: int,
    pauses: bool,
    rows: NDArray[np.float32],
) -> int:
    """Take control step number `step` and fill the observation rows.

    Returns how many robots are anchored; `NOT_FINITE`, with the world as it was, if a command is
    not finite; or `TO_BE_PERCEIVED`, with the rows still to be filled by `perceive`, if the
    requested item can now be delivered or if it `pauses` anyway.
    """
    constants, flags = number_row_in(tables, CONSTANTS), flags_in(tables, FLAGS)
    engine, bodies = count_row_in(tables, ENGINE), numbers_in(tables, BODIES)
    velocities, numbers = numbers_in(tables, VELOCITIES), numbers_in(tables, NUMBERS)
    if not set_out(commands, constants, numbers, flags, bodies, velocities):
        return NOT_FINITE
    links, item_links = counts_in(tables, LINKS), counts_in(tables, ITEM_LINKS)
    uncover(
        engine, constants[ROBOT_RADIUS] + constants[ITEM_RADIUS], flags[at.PRESENT],
        links[at.ITEM], item_links[at.COVERED], count_row_in(tables, ITEM_START),
        count_row_in(tables, ITEM_MEMBERS), numbers_in(tables, ITEM_PLACES),
        constants[ROBOT_CELL], count_row_in(tables, ROBOT_SIZE), count_row_in(tables, ROBOT_START),
        count_row_in(tables, ROBOT_MEMBERS), numbers_in(tables, ROBOT_PLACES),
    )  # fmt: skip
    pile = largest(links[at.PILE])
    advance(engine, pile, int(constants[N_SUBSTEPS]), constants[PHYSICS_PERIOD])
    send(commands, flags, numbers_in(tables, MESSAGE))
    is_due = handle_items(
        commands, requested, constants, engine, bodies,
        numbers_in(tables, POSITION), numbers_in(tables, VELOCITY), flags,
        links, counts_in(tables, MEMORY), numbers_in(tables, ITEM_POSITION), item_links,
        count_row_in(tables, CLAIM), number_row_in(tables, CLAIM_SQUARE),
        count_row_in(tables, ITEM_SIZE), count_row_in(tables, ITEM_START),
        count_row_in(tables, ITEM_MEMBERS), counts_in(tables, EVENTS),
    )  # fmt: skip
    if is_due or pauses:
        return TO_BE_PERCEIVED
    return perceive(tables, step, requested, rows)


@kernel
def send(
    commands: NDArray[np.float64], flags: NDArray[np.bool_], message: NDArray[np.float64]
) -> None:
    """Broadcast the rest of the commands of those who obey, cut to [-1, 1]; of others, zeros."""
    first = commands.shape[1] - message.shape[1]
    for robot in range(message.shape[0]):
        sends = first == _FIRST_OF_MESSAGE and flags[at.PRESENT, robot] and flags[at.OBEYS, robot]
        for place in range(message.shape[1]):
            given = commands[robot, first + place] if sends else 0.0
            message[robot, place] = min(max(given, -1.0), 1.0)


@kernel
def set_out(
    commands: NDArray[np.float64],
    constants: NDArray[np.float64],
    numbers: NDArray[np.float64],
    flags: NDArray[np.bool_],
    bodies: NDArray[np.float64],
    velocities: NDArray[np.float64],
) -> bool:
    """Turn commands into the velocities to be written to the bodies; False if one is not finite.

    `bodies` (2N + 1, 4) is what was read of them, `velocities` (2N + 1, 2) what will be written.
    """
    n = len(commands)
    able = flags[at.PRESENT] & flags[at.OBEYS]
    # What was just read, so that writing it back changes nothing for the robots themselves.
    velocities[:n] = bodies[:n, 2:4]
    return drive(
        commands, able, numbers[at.MAX_SPEED], numbers[at.MAX_TURN_RATE],
        constants[CONTROL_PERIOD], numbers[at.HEADING], velocities[n : 2 * n],
        constants[SIDEWAYS] > 0.0,
    )  # fmt: skip


@kernel
def handle_items(
    commands: NDArray[np.float64],
    requested: int,
    constants: NDArray[np.float64],
    engine: NDArray[np.int64],
    bodies: NDArray[np.float64],
    position: NDArray[np.float64],
    velocity: NDArray[np.float64],
    flags: NDArray[np.bool_],
    links: NDArray[np.int64],
    memory: NDArray[np.int64],
    item_position: NDArray[np.float64],
    item_links: NDArray[np.int64],
    claim: NDArray[np.int64],
    claim_square: NDArray[np.float64],
    size: NDArray[np.int64],
    start: NDArray[np.int64],
    members: NDArray[np.int64],
    events: NDArray[np.int64],
) -> bool:
    """Take over where the bodies are, then let go and lift.

    Returns whether the requested item can now be delivered.
    """
    for robot in range(len(position)):
        is_there = 1.0 if flags[at.PRESENT, robot] else 0.0
        for axis in range(2):
            position[robot, axis] = bodies[robot, axis] * is_there
            velocity[robot, axis] = bodies[robot, 2 + axis] * is_there
    carry_along(
        position, flags[at.PRESENT], constants[STORAGE_WIDTH],
        links[at.ITEM], item_position, flags[at.IN_DELIVERY],
    )  # fmt: skip
    able = flags[at.PRESENT] & flags[at.OBEYS]
    n_events = open_grippers(
        commands[:, 3], able, flags[at.IN_DELIVERY], requested, links[at.ITEM], memory,
        item_links[at.STATUS], item_links[at.CARRIER], item_links[at.COVERED], events,
    )  # fmt: skip
    n_events = close_grippers(
        commands[:, 3], able & flags[at.LIFTS], position, requested, constants[PICKUP_RANGE],
        links[at.ITEM], memory, item_position, item_links[at.STATUS], item_links[at.CARRIER],
        item_links[at.COVERED], claim, claim_square, constants[ITEM_CELL], size, start, members,
        events, n_events,
    )  # fmt: skip
    cover(
        engine, events, n_events, constants[ROBOT_RADIUS] + constants[ITEM_RADIUS], position,
        item_position, item_links[at.STATUS], item_links[at.COVERED],
        constants[ITEM_CELL], size, start, members,
    )  # fmt: skip
    follow(engine, events, n_events, len(position), item_position)
    carrier = item_links[at.CARRIER, requested] if requested != at.NOBODY else at.NOBODY
    return bool(
        carrier != at.NOBODY and flags[at.IN_DELIVERY, carrier] and flags[at.DELIVERS, carrier]
    )


@kernel
def deliver_requested(
    requested: int,
    flags: NDArray[np.bool_],
    links: NDArray[np.int64],
    memory: NDArray[np.int64],
    item_links: NDArray[np.int64],
) -> int:
    """Deliver the requested item if its carrier can; returns that robot, or NOBODY."""
    return deliver(
        requested, flags[at.IN_DELIVERY], flags[at.DELIVERS], links[at.ITEM], memory,
        item_links[at.STATUS], item_links[at.CARRIER],
    )  # fmt: skip


@kernel
def perceive(
    tables: NDArray[np.int64], step: int, requested: int, rows: NDArray[np.float32]
) -> int:
    """Run the timers and fill the observation rows; returns how many robots are anchored."""
    constants, keys = number_row_in(tables, CONSTANTS), keys_in(tables, KEYS)
    numbers, flags = numbers_in(tables, NUMBERS), flags_in(tables, FLAGS)
    links, item_links = counts_in(tables, LINKS), counts_in(tables, ITEM_LINKS)
    position, velocity = numbers_in(tables, POSITION), numbers_in(tables, VELOCITY)
    memory, message = counts_in(tables, MEMORY), numbers_in(tables, MESSAGE)
    item_position = numbers_in(tables, ITEM_POSITION)
    obstacle_position = numbers_in(tables, OBSTACLE_POSITION)
    robot_size, item_size = count_row_in(tables, ROBOT_SIZE), count_row_in(tables, ITEM_SIZE)
    robot_start, item_start = count_row_in(tables, ROBOT_START), count_row_in(tables, ITEM_START)
    robot_members = count_row_in(tables, ROBOT_MEMBERS)
    item_members = count_row_in(tables, ITEM_MEMBERS)
    robot_places, item_places = numbers_in(tables, ROBOT_PLACES), numbers_in(tables, ITEM_PLACES)
    run_timers(
        step, constants[CONTROL_PERIOD], constants[TIMER_LIMIT], constants[GOSSIP] > 0.0,
        flags[at.IN_DELIVERY], flags[at.PRESENT], flags[at.HONEST], numbers[at.HEARD],
        links[at.LAST_IN_DELIVERY], numbers[at.TIMER], numbers[at.TOLD],
    )  # fmt: skip
    fill(
        position, flags[at.PRESENT],
        constants[ROBOT_CELL], robot_size, robot_start, robot_members, robot_places,
    )  # fmt: skip
    fill(
        item_position, item_links[at.STATUS] == at.STORED,
        constants[ITEM_CELL], item_size, item_start, item_members, item_places,
    )  # fmt: skip
    anchored = sense(
        constants[WIDTH], constants[HEIGHT], constants[ROBOT_RADIUS], constants[ITEM_RADIUS],
        constants[OBSTACLE_RADIUS], constants[RADIO_RANGE], constants[MAX_SPEED],
        constants[TIMER_LIMIT], requested, flags[at.PRESENT], position, velocity,
        numbers[at.HEADING], links[at.ITEM], memory, numbers[at.TIMER], numbers[at.TOLD],
        flags[at.IN_DELIVERY], item_position, item_links[at.COVERED], obstacle_position,
        numbers[at.RANGER_RANGE], numbers[at.VIEW_RANGE],
        flags[at.SENDS], flags[at.HEARS], flags[at.FAILED],
        constants[ROBOT_CELL], robot_size, robot_start, robot_members, robot_places,
        constants[ITEM_CELL], item_size, item_start, item_members, item_places,
        constants[RANGER_RANGE], flags[at.CONTACT], links[at.PILE], numbers[at.HEARD], keys, step,
        constants[RADIO_LOSS], constants[SENSOR_DROPOUT], message, rows,
    )  # fmt: skip
    is_exact = constants[RANGER_NOISE] == 0.0 and constants[POSITION_NOISE] == 0.0
    if not is_exact or constants[SENSOR_DROPOUT] > 0.0:
        disturb(
            flags[at.PRESENT], keys, step, constants[RANGER_NOISE], constants[POSITION_NOISE],
            constants[SENSOR_DROPOUT], numbers[at.RANGER_RANGE], constants[RANGER_RANGE],
            constants[VIEW_RANGE],
            max(constants[VIEW_RANGE], constants[RADIO_RANGE]), rows,
        )  # fmt: skip
    return anchored
