"""The arrays of one world: what each holds, its shape and its unit.

Lengths are numbers or names, see `lengths_of`: N robots, I items, C columns of a command. The row
of a robot that is absent holds zeros and `NOBODY`.
"""

# ruff: noqa: N815 - the engine's functions have their names in C

from __future__ import annotations

from typing import Annotated, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.world.observations import N_BEAMS
from swarm_logistics_env.world.scenario import Scenario

from .failure_modes import FAILURE_MODES, Capabilities

STORED = 0
CARRIED = 1
DELIVERED = 2
N_ACCELERATIONS = 1024  # bins that accelerations are counted in
MOST_WAITING = 1000  # orders; more are turned away
NOBODY = -1

Numbers: TypeAlias = NDArray[np.float64]
Integers: TypeAlias = NDArray[np.int64]
Flags: TypeAlias = NDArray[np.bool_]
Bytes: TypeAlias = NDArray[np.int8]
Keys: TypeAlias = NDArray[np.uint64]
Sensed: TypeAlias = NDArray[np.float32]  # observations: rows (N, D), one row or its scan


class Parameters(NamedTuple):
    """What compiled code reads of a scenario: its fields and properties, by their names."""

    warehouse_width: float
    warehouse_height: float
    storage_width: float
    robot_radius: float  # of the largest
    has_smaller_robots: bool
    item_radius: float
    obstacle_radius: float
    highest_speed: float
    highest_turn_rate: float
    ranger_reach: float
    view_reach: float
    radio_range: float
    pickup_range: float
    timer_limit: float
    ranger_noise: float
    position_noise: float
    sensor_dropout: float
    radio_loss: float
    control_period: float
    physics_period: float
    n_substeps: int
    handling_steps: int
    dock_period: float
    popularity_exponent: float
    longest_request: float
    request_delay: float
    request_loss: float
    order_rate: float
    order_cycle: float
    due_after: float
    is_independent: bool
    draws_docks: bool
    names_docks: bool
    has_orders: bool
    is_urgent_first: bool
    tells_all: bool
    restock: bool
    is_gossip: bool
    has_batteries: bool
    idle_power: float
    driving_energy: float
    lifting_energy: float
    charging_power: float


class Robots(NamedTuple):
    """The robots; a row is one robot for good."""

    kind: Annotated[Integers, "N"]  # number of its kind, from 0 on; 0 if all are alike
    radius: Annotated[Numbers, "N"]  # [m]
    mass: Annotated[Numbers, "N"]  # [kg]
    position: Annotated[Numbers, "N", 2]  # [m]
    velocity: Annotated[Numbers, "N", 2]  # [m/s]
    heading: Annotated[Numbers, "N"]  # [rad] from +x to the left, within +-pi
    heading_drift: Annotated[Numbers, "N"]  # [rad/s] at which its body turns unasked
    turn_rate: Annotated[Numbers, "N"]  # [rad/s] as its gyro tells, which misses the drift
    present: Annotated[Flags, "N"]  # False once it was removed, and while it is away
    away: Annotated[Flags, "N"]  # out of the arena, and comes back
    left_at: Annotated[Numbers, "N", 3]  # x, y [m] and heading [rad] when it was taken out
    failed: Annotated[Flags, "N"]  # any failure mode holds
    in_delivery: Annotated[Flags, "N"]  # its centre is in a dock that takes what it carries
    last_in_delivery: Annotated[Integers, "N"]  # the last step in which it was, or NOBODY
    contact: Annotated[Flags, "N"]  # touches something solid to it
    item: Annotated[Integers, "N"]  # item carried, or NOBODY
    handling: Annotated[Integers, "N", 3]  # kind, item and last step, see `logistics`
    memory: Annotated[Integers, "N", "memory_size"]  # items put down, newest first, or NOBODY
    timer: Annotated[Numbers, "N"]  # [s] since the delivery area, NaN when silent
    told: Annotated[Numbers, "N"]  # [s] the timer it broadcasts, NaN when silent
    heard: Annotated[Numbers, "N"]  # [s] the lowest timer it heard, NaN when none
    message: Annotated[Numbers, "N", "message_size"]  # in [-1, 1], broadcast
    told_before: Annotated[Numbers, "K", "N"]  # [s] timers of K steps, of step s in row s % K
    message_before: Annotated[Numbers, "K N", "message_size"]  # of the same steps
    frozen_beams: Annotated[Numbers, "N", "beams"]  # [m] that frozen rangers repeat, or NaN
    sensor_key: Annotated[Keys, "N"]  # of the streams of its sensors' noise
    hearing_key: Annotated[Keys, "N"]  # of the streams of the requests that it is not told of
    is_empty: Annotated[Flags, "N"]  # its battery is, so that it stands and ignores its commands


class Batteries(NamedTuple):
    """Batteries and charging stations; arrays of length 0 where robots have no batteries."""

    energy: Annotated[Numbers, "N with batteries"]  # [J]
    used: Annotated[Numbers, "N with batteries"]  # [J] since the start, and what a cell lost
    charged: Annotated[Numbers, "N with batteries"]  # [J] since the start
    station: Annotated[Integers, "N with batteries"]  # that charges it now, or NOBODY
    station_position: Annotated[Numbers, "stations", 2]  # [m]
    station_rank: Annotated[Integers, "stations"]  # those of the lowest ranks are dead first
    n_dead: Annotated[Integers, 1]  # stations


class Items(NamedTuple):
    """The items, and the streams that decide which one is asked for next."""

    position: Annotated[Numbers, "I", 2]  # [m], its carrier's while carried
    status: Annotated[Integers, "I"]  # STORED, CARRIED or DELIVERED
    carrier: Annotated[Integers, "I"]  # robot, or NOBODY
    covered: Annotated[Integers, "I"]  # 1: stored, yet no obstacle; or 0
    request_key: Annotated[Keys, "I"]  # of the streams that decide the order of every cycle
    demand_key: Annotated[Keys, 1]  # of the stream of requests that are drawn independently
    dock_key: Annotated[Keys, 1]  # of the stream of docks that requests name
    restock_key: Annotated[Keys, 1]  # of the streams that decide where delivered items come back
    order_key: Annotated[Keys, 1]  # of the stream of the times at which orders come


class Progress(NamedTuple):
    """How far the episode is: what a step changes, mostly arrays of one number."""

    step: Annotated[Integers, 1]  # control steps since the start
    time: Annotated[Numbers, 1]  # [s] since the start
    requested: Annotated[Integers, "n_requests"]  # items asked for, oldest first, then NOBODY
    requested_dock: Annotated[Integers, "n_requests"]  # docks that these name; NOBODY: any
    n_docks_drawn: Annotated[Integers, 1]  # requests so far that named one
    cycle: Annotated[Integers, 1]  # how often all items were asked for
    asked_last: Annotated[Integers, 1]  # the item that was asked for last in this cycle, or NOBODY
    n_drawn: Annotated[Integers, 1]  # requests drawn independently so far
    dock_free: Annotated[Numbers, 1]  # [s] since the start, when the next delivery may begin
    n_delivered: Annotated[Integers, 1]  # items delivered
    anchoring_seconds: Annotated[Numbers, 1]  # of working robots that touch failed ones, summed
    last_step: Annotated[Integers, 1]  # the step in which the time is up
    pause_step: Annotated[Integers, 1]  # it ends before anything is sensed, as faults change then
    is_changed: Annotated[Flags, 1]  # faults or conditions changed since the step before


# Columns of an order, whether it waits or is asked for.
ITEM_ORDERED, DOCK, CAME, DUE, PRIORITY, ASKED, NUMBER = range(7)
N_ORDER_COLUMNS = 7


class Orders(NamedTuple):
    """When what is asked for came and is due, the orders that wait, and those of a file.

    A row's columns are `ITEM_ORDERED`, `DOCK` (or NOBODY), `CAME` [s], `DUE` [s, or infinite],
    `PRIORITY`, `ASKED` [s] and `NUMBER` (of the request, from 0). An order of a file has its class
    in `NUMBER` and the item NOBODY, if it names a class.
    """

    open: Annotated[Numbers, "n_requests", N_ORDER_COLUMNS]  # beside `Progress.requested`
    waiting: Annotated[Numbers, "waiting", N_ORDER_COLUMNS]  # in the order in which they came
    listed: Annotated[Numbers, "orders of a file", N_ORDER_COLUMNS]  # by `CAME`
    shape: Annotated[Numbers, "parts of a cycle"]  # factors of `order_rate`
    n_expected: Annotated[Numbers, 1]  # draws to be expected so far, at the highest rate
    next_draw: Annotated[Numbers, 1]  # at which of these the next order may come
    n_waiting: Annotated[Integers, 1]
    n_drawn: Annotated[Integers, 1]  # times at which an order might have come so far
    n_listed: Annotated[Integers, 1]  # orders of the file that came so far
    n_classes: Annotated[Integers, 1]  # of the file's items: item i is of class i, repeating
    n_asked: Annotated[Integers, 1]  # requests so far
    n_put_back: Annotated[Integers, 1]  # requests that were not served in time
    n_turned_away: Annotated[Integers, 1]  # orders that found no item or no room to wait
    longest_queue: Annotated[Integers, 1]  # most orders that were open or waited at a time
    is_timed: Annotated[Flags, 1]  # requests were put back in time, if there were any
    is_served: Annotated[Flags, 1]  # nothing is asked for, and nothing will be


class ContactCounts(NamedTuple):
    """What `contacts` counts since the start, and what it keeps of the step before."""

    position_before: Annotated[Numbers, "N", 2]  # [m] of the robots
    velocity_before: Annotated[Numbers, "N", 2]  # [m/s]
    closing: Annotated[Numbers, "N"]  # [m/s] of its contacts that began in this step, summed
    n_contacts: Annotated[Integers, 1]  # pairs that began to overlap
    n_fast: Annotated[Integers, 1]  # those of them that closed fast
    is_deep: Annotated[Flags, 1]  # a pair overlaps deeply in this step
    n_deep_steps: Annotated[Integers, 1]  # steps in which one did
    acceleration_sum: Annotated[Numbers, 1]  # [m/s2] over robots and steps
    accelerations: Annotated[Integers, "accelerations"]  # robots and steps by acceleration


class Grid(NamedTuple):
    """The square cells over the warehouse and which points stand in each, see `grid.fill`."""

    cell: float  # side of a cell [m]
    n_columns: int  # cells along x
    n_rows: int  # cells along y
    start: Annotated[Integers, "cells + 1"]  # where each cell's points begin in `members`
    members: Annotated[Integers, "points"]  # point numbers, cell by cell, row by row of cells
    position: Annotated[Numbers, 2, "points"]  # x and y [m], in the same order


class Floor(NamedTuple):
    """The cells of a floor plan; none in an empty room, see `floor_cells`."""

    cell: float  # side of a cell [m]
    n_columns: int  # cells along x; 0: an empty room
    n_rows: int  # cells along y
    is_solid: Annotated[Flags, "rows", "columns"]  # walls and racks
    gap: Annotated[Bytes, "rows", "columns"]  # cells to the nearest solid one, askew counts as 1
    solids_below: Annotated[Integers, "rows + 1", "columns + 1"]  # solid cells of smaller numbers
    dock: Annotated[Bytes, "rows", "columns"]  # number of the dock, or NOBODY
    storage: Annotated[Integers, "cells", 2]  # column and row of each cell where items lie
    start: Annotated[Integers, "cells", 2]  # of each cell where robots start
    n_docks: int
    corners: Annotated[Numbers, "4 boxes", 2]  # [m] of rectangles of solid cells, anticlockwise
    block: float  # side of a block of floor [m]
    n_block_columns: int  # blocks along x
    n_block_rows: int  # blocks along y
    first_near: Annotated[Integers, "blocks + 1"]  # where each block's boxes begin in `near`
    near: Annotated[Integers, "boxes near blocks"]  # boxes that beams from a block may meet


RANKED_AT_ONCE = 8  # numbers of one vector instruction; a power of 2


class Nearby(NamedTuple):
    """What stands near one robot: working space, filled anew for every robot and sense."""

    slot: Annotated[Integers, "nearby"]  # where it stands in `Grid.members`
    square: Annotated[Numbers, "nearby"]  # [m^2] of its distance
    is_heard: Annotated[Flags, "nearby"]  # of robots, on the radio
    chosen: Annotated[Integers, "nearby"]  # numbers of robots or items that are seen or heard
    chosen_square: Annotated[Numbers, "nearby"]  # [m^2]
    chosen_heard: Annotated[Flags, "nearby"]  # of robots, whether it is heard
    nearest: Annotated[Integers, "nearby"]  # indices into `chosen` of the nearest, nearest first
    is_free: Annotated[Flags, "nearby"]  # of items, by their numbers
    scanned: Annotated[Integers, "nearby"]  # indices into `slot` of what the rangers may meet
    forward: Annotated[Numbers, "nearby"]  # [m] of what is scanned, in the robot's frame
    left: Annotated[Numbers, "nearby"]  # [m]
    scanned_square: Annotated[Numbers, "nearby"]  # [m^2]
    beam: Annotated[Integers, "nearby"]  # that looks nearest to its centre
    distance: Annotated[Numbers, "nearby"]  # [m] where that beam meets it, infinite if it does not
    per_x: Annotated[Numbers, "beams"]  # how far a beam goes until it is 1 m farther along x
    per_y: Annotated[Numbers, "beams"]  # and along y
    free: Annotated[Numbers, "beams"]  # [m] of the beams until they meet a box


class Claims(NamedTuple):
    """Working space of the logistics."""

    robot: Annotated[Integers, "I"]  # who is going to lift the item, NOBODY before and after
    square: Annotated[Numbers, "I"]  # [m^2] of the distance between the two
    delivered_by: Annotated[Integers, "N"]  # robots that delivered in this step
    delivered: Annotated[Numbers, "N", N_ORDER_COLUMNS]  # the orders that these served
    order: Annotated[Numbers, N_ORDER_COLUMNS]  # that is on its way from one list to another


class Functions(NamedTuple):
    """Addresses of the engine's functions, by their names in C."""

    cpSpaceStep: int
    cpSpaceSetIterations: int
    cpShapeSetFilter: int
    cpCircleShapeSetOffset: int
    cpSpaceReindexShape: int
    cpSpaceNew: int
    cpSpaceGetStaticBody: int
    cpSpaceSetCollisionSlop: int
    cpSpaceSetCollisionBias: int
    cpBodyNew: int
    cpBodySetPosition: int
    cpBodySetVelocity: int
    cpCircleShapeNew: int
    cpSegmentShapeNew: int
    cpPolyShapeNewRaw: int
    cpSpaceAddBody: int
    cpSpaceAddShape: int
    cpSpaceFree: int
    cpBodyFree: int
    cpShapeFree: int


class BodyWords(NamedTuple):
    """Which words of a body in the engine's memory hold x; y stands in the next one."""

    position: int  # [m]
    velocity: int  # [m/s]
    force: int  # [N], which the engine uses up within a substep


class EngineArrays(NamedTuple):
    """The engine's things of one world, by their addresses, and what it reads and writes."""

    functions: Functions
    space: Annotated[Integers, 1]
    robot_places: Annotated[Numbers, "N", 2]  # [m] where the bodies are made, of ghosts as well
    robot_bodies: Annotated[Integers, "N"]
    robot_shapes: Annotated[Integers, "N"]
    item_shapes: Annotated[Integers, "I"]
    solid_shapes: Annotated[Integers, "solids"]  # walls, obstacles, then racks
    body_words: BodyWords
    bodies: Annotated[Numbers, "N", 4]  # x, y [m] and velocity [m/s] after a control step
    wanted_velocity: Annotated[Numbers, "N", 2]  # [m/s] what the drives aim at


class Commands(NamedTuple):
    """The commands of the next step, and of those that a pickle replays; C columns."""

    now: Annotated[Numbers, "N", "C"]
    log: Annotated[Numbers, "L N", "C"]  # of the L last steps, step after step
    n_logged: Annotated[Integers, 1]  # steps in `log`


class StepResult(NamedTuple):
    """What the last step has to tell beside the state; each an array of one."""

    refused: Annotated[Integers, 1]  # place, row by row, of a command that is not finite; or NOBODY
    n_delivered: Annotated[Integers, 1]  # deliveries in this step, by `Claims.delivered_by`
    is_paused: Annotated[Flags, 1]  # nothing was sensed yet, as faults begin or end now
    is_room: Annotated[Flags, 1]  # all items that came back to the storage found room


class World(NamedTuple):
    """Everything that a step reads and writes."""

    parameters: Parameters
    commands: Commands
    robots: Robots
    able: Capabilities
    batteries: Batteries
    items: Items
    obstacles: Annotated[Numbers, "n_obstacles", 2]  # [m]
    floor: Floor
    progress: Progress
    orders: Orders
    contacts: ContactCounts
    outcome: StepResult
    robot_grid: Grid
    item_grid: Grid
    nearby: Nearby
    claims: Claims
    engine: EngineArrays


def lengths_of(scenario: Scenario) -> dict[str, int]:
    """Return the lengths of a world's arrays by the names that their shapes have."""
    n = scenario.n_robots
    n_items = scenario.n_items
    longest_delay = max(mode.radio_delay for mode in FAILURE_MODES.values())
    n_kept = round(longest_delay / scenario.control_period) + 1  # steps of broadcasts
    return {
        "N": n,
        "I": n_items,
        "N with batteries": 0 if scenario.battery is None else n,
        "stations": len(scenario.stations),
        "accelerations": N_ACCELERATIONS,
        "K": n_kept,
        "K N": n_kept * n,
        "beams": 3 * N_BEAMS,
        "nearby": max(n, n_items) + RANKED_AT_ONCE,
        "n_requests": scenario.n_open,
        "waiting": MOST_WAITING if scenario.has_orders else 0,
        "orders of a file": 0 if scenario.order_file is None else len(scenario.order_file.time),
        "parts of a cycle": len(scenario.order_shape),
        "memory_size": scenario.memory_size,
        "message_size": scenario.message_size,
    }
