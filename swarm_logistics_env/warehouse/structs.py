"""The arrays of one world: what each holds, its shape and its unit.

N robots, I items. The row of a robot that is absent holds zeros and `NOBODY`.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.observations import N_BEAMS
from swarm_logistics_env.scenario import Scenario

STORED, CARRIED, DELIVERED = 0, 1, 2
LONGEST_RADIO_DELAY = 2.0  # [s] for which broadcasts are kept
NOBODY = -1

# Arrays of one and of two dimensions, as the annotation tells compiled code.
Numbers: TypeAlias = Annotated[NDArray[np.float64], 1]
NumberRows: TypeAlias = Annotated[NDArray[np.float64], 2]
Integers: TypeAlias = Annotated[NDArray[np.int64], 1]
IntegerRows: TypeAlias = Annotated[NDArray[np.int64], 2]
Flags: TypeAlias = Annotated[NDArray[np.bool_], 1]
Keys: TypeAlias = Annotated[NDArray[np.uint64], 1]


class Parameters(NamedTuple):
    """What compiled code reads of a scenario: its fields and properties, by their names."""

    warehouse_width: float
    warehouse_height: float
    storage_width: float
    robot_radius: float
    robot_mass: float
    item_radius: float
    obstacle_radius: float
    max_speed: float
    max_acceleration: float
    ranger_range: float
    view_range: float
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
    restock: bool
    is_gossip: bool
    is_holonomic: bool


class Robots(NamedTuple):
    """The robots; a row is one robot for good."""

    position: NumberRows  # (N, 2) [m]
    velocity: NumberRows  # (N, 2) [m/s]
    heading: Numbers  # (N,) [rad] from +x to the left, within +-pi
    heading_drift: Numbers  # (N,) [rad/s] at which its body turns, whatever is commanded
    present: Flags  # (N,) False once it was removed
    failed: Flags  # (N,) any failure mode holds
    in_delivery: Flags  # (N,) its centre is in the delivery area
    last_in_delivery: Integers  # (N,) the last control step in which it was, or NOBODY
    contact: Flags  # (N,) touches something solid to it
    item: Integers  # (N,) item carried, or NOBODY
    memory: IntegerRows  # (N, memory_size) items put down, newest first, or NOBODY
    timer: Numbers  # (N,) [s] since the delivery area, NaN when silent
    told: Numbers  # (N,) [s] the timer it broadcasts, NaN when silent
    heard: Numbers  # (N,) [s] the lowest timer it heard, NaN when none
    message: NumberRows  # (N, message_size) in [-1, 1], broadcast
    told_before: NumberRows  # (L, N) [s] timers of the last L steps, that of step s in row s % L
    message_before: NumberRows  # (L N, message_size) of the last L steps, step after step
    frozen_beams: NumberRows  # (N, 3 N_BEAMS) [m] what frozen rangers repeat, NaN when they work
    sensor_key: Keys  # (N,) of the streams of its sensors' noise


class Capabilities(NamedTuple):
    """What each robot can do now; failures take from it."""

    max_speed: Numbers  # (N,) [m/s]
    max_turn_rate: Numbers  # (N,) [rad/s]
    ranger_range: Numbers  # (N,) [m], 0 when blind
    view_range: Numbers  # (N,) [m]
    lifts: Flags  # (N,)
    delivers: Flags  # (N,)
    sends: Flags  # (N,)
    hears: Flags  # (N,)
    honest: Flags  # (N,) False: tells timer 0 always
    obeys: Flags  # (N,) False: ignores its commands, the gripper's too
    releases_inside: Flags  # (N,) False: lets nothing go inside the delivery area
    rangers_refresh: Flags  # (N,) False: its rangers repeat one reading
    ranger_bias: Numbers  # (N,) [m] that its rangers read too far
    radio_delay: Integers  # (N,) control steps that its broadcasts come too late


class Items(NamedTuple):
    """The items, and in which order they are asked for."""

    position: NumberRows  # (I, 2) [m], its carrier's while carried
    status: Integers  # (I,) STORED, CARRIED or DELIVERED
    carrier: Integers  # (I,) robot, or NOBODY
    covered: Integers  # (I,) 1: stored, yet no obstacle; or 0
    order: Integers  # (I,) items in the order of this cycle's requests
    request_key: Keys  # (I,) of the streams that decide the order of every cycle
    restock_key: Keys  # (1,) of the streams that decide where delivered items come back


class Progress(NamedTuple):
    """How far the episode is; each an array of one number that a step changes."""

    step: Integers  # control steps since the start
    time: Numbers  # [s] since the start
    requested: Integers  # the item asked for now, or NOBODY when all are delivered
    n_asked: Integers  # requests before this one
    n_delivered: Integers  # items delivered
    anchoring_seconds: Numbers  # robot-seconds of working robots touching failed ones
    last_step: Integers  # the step in which the time is up
    pause_step: Integers  # the step that ends before anything is sensed, as faults begin or end
    is_changed: Flags  # faults or conditions changed since the step before


class Grid(NamedTuple):
    """The square cells over the warehouse and which points stand in each, see `grid.fill`."""

    cell: float  # side of a cell [m]
    n_columns: int  # cells along x
    n_rows: int  # cells along y
    start: Integers  # (n_columns * n_rows + 1,) where each cell's points begin in `members`
    members: Integers  # (n,) point numbers, cell by cell, row by row of cells
    places: NumberRows  # (n, 2) [m], in the same order


class Nearby(NamedTuple):
    """What stands near one robot: working space, filled anew for every robot and sense."""

    place: Integers  # (n,) where it stands in `Grid.members`
    square: Numbers  # (n,) [m^2] of its distance
    is_heard: Flags  # (n,) of robots, on the radio
    chosen: Integers  # (n,) numbers of robots or items that are seen or heard
    chosen_square: Numbers  # (n,) [m^2]
    chosen_heard: Flags  # (n,) of robots, whether it is heard
    nearest: Integers  # (n,) indices into `chosen` of the nearest, nearest first
    scanned: Integers  # (n,) indices into `place` of what the rangers may meet
    forward: Numbers  # (n,) [m] of what is scanned, in the robot's frame
    left: Numbers  # (n,) [m]
    scanned_square: Numbers  # (n,) [m^2]
    beam: Integers  # (n,) that looks nearest to its centre
    distance: Numbers  # (n,) [m] where that beam meets it, infinite if it does not


class Claims(NamedTuple):
    """Working space of the logistics."""

    robot: Integers  # (I,) who is going to lift the item, NOBODY before and after
    square: Numbers  # (I,) [m^2] of the distance between the two
    events: IntegerRows  # (4 N, 3) kind, robot, item: what the bodies must be told
    delivered_by: Integers  # (N,) robots that delivered in this step


class Functions(NamedTuple):
    """Addresses of the engine's functions; `physics` has their names in C."""

    step: int
    set_iterations: int
    each_body: int
    read_body: int
    write_body: int
    set_filter: int
    set_offset: int
    reindex: int
    new_space: int
    static_body: int
    set_slop: int
    set_bias: int
    new_body: int
    set_position: int
    set_velocity: int
    new_circle: int
    new_segment: int
    add_body: int
    add_shape: int
    free_space: int
    free_body: int
    free_shape: int


class Batch(NamedTuple):
    """Numbers of all bodies, the static one last, that one call of the engine reads or writes."""

    address: int  # of the engine's structure
    count_address: int  # of how many numbers it has read or written
    numbers: NumberRows  # (bodies, columns)


class Engine(NamedTuple):
    """The engine's things of one world, by their addresses, and what it reads and writes."""

    functions: Functions
    space: Integers  # (1,)
    robot_bodies: Integers  # (N,)
    robot_shapes: Integers  # (N,)
    item_shapes: Integers  # (I,)
    solid_shapes: Integers  # (4 + n_obstacles,) walls, then obstacles
    bodies: Batch  # (N + 1, 4) x, y [m] and velocity [m/s]
    velocities: Batch  # (N + 1, 2) [m/s]
    forces: Batch  # (N + 1, 2) [N], written to the bodies for one substep
    wanted_velocity: NumberRows  # (N, 2) [m/s] what the drives aim at


class Commands(NamedTuple):
    """The commands of the next step, and of those that a pickle replays; C columns."""

    now: NumberRows  # (N, C)
    log: NumberRows  # (L N, C) of the last steps, step after step
    n_logged: Integers  # (1,) steps in `log`


class Outcome(NamedTuple):
    """What the last step has to tell beside the state; each an array of one."""

    refused: Integers  # place, row by row, of the command that is not finite; NOBODY: step taken
    n_delivered: Integers  # deliveries in this step, by `Claims.delivered_by`
    is_paused: Flags  # nothing was sensed yet, as faults begin or end now
    is_room: Flags  # all items that came back to the storage found room


class World(NamedTuple):
    """Everything that a step reads and writes."""

    parameters: Parameters
    commands: Commands
    robots: Robots
    able: Capabilities
    items: Items
    obstacles: NumberRows  # (n_obstacles, 2) [m]
    progress: Progress
    outcome: Outcome
    robot_grid: Grid
    item_grid: Grid
    nearby: Nearby
    claims: Claims
    engine: Engine


def parameters_of(scenario: Scenario) -> Parameters:
    """Return what compiled code reads of a scenario."""
    return Parameters(*(getattr(scenario, name) for name in Parameters._fields))


def blank_robots(scenario: Scenario) -> Robots:
    """Return robots without places, sound, silent and with empty hands."""
    n = scenario.n_robots
    n_kept = round(LONGEST_RADIO_DELAY / scenario.control_period) + 1
    return Robots(
        position=np.zeros((n, 2)),
        velocity=np.zeros((n, 2)),
        heading=np.zeros(n),
        heading_drift=np.zeros(n),
        present=np.ones(n, np.bool_),
        failed=np.zeros(n, np.bool_),
        in_delivery=np.zeros(n, np.bool_),
        last_in_delivery=np.full(n, NOBODY),
        contact=np.zeros(n, np.bool_),
        item=np.full(n, NOBODY),
        memory=np.full((n, scenario.memory_size), NOBODY),
        timer=np.full(n, np.nan),
        told=np.full(n, np.nan),
        heard=np.full(n, np.nan),
        message=np.zeros((n, scenario.message_size)),
        told_before=np.full((n_kept, n), np.nan),
        message_before=np.zeros((n_kept * n, scenario.message_size)),
        frozen_beams=np.full((n, 3 * N_BEAMS), np.nan),
        sensor_key=np.zeros(n, np.uint64),
    )


def blank_capabilities(scenario: Scenario) -> Capabilities:
    """Return full capabilities but for speeds and ranges, which `faults` fills."""
    n = scenario.n_robots
    return Capabilities(
        max_speed=np.zeros(n),
        max_turn_rate=np.zeros(n),
        ranger_range=np.zeros(n),
        view_range=np.zeros(n),
        lifts=np.ones(n, np.bool_),
        delivers=np.ones(n, np.bool_),
        sends=np.ones(n, np.bool_),
        hears=np.ones(n, np.bool_),
        honest=np.ones(n, np.bool_),
        obeys=np.ones(n, np.bool_),
        releases_inside=np.ones(n, np.bool_),
        rangers_refresh=np.ones(n, np.bool_),
        ranger_bias=np.zeros(n),
        radio_delay=np.zeros(n, np.int64),
    )


def blank_items(scenario: Scenario) -> Items:
    """Return stored items without places."""
    n = scenario.n_items
    return Items(
        position=np.zeros((n, 2)),
        status=np.full(n, STORED),
        carrier=np.full(n, NOBODY),
        covered=np.zeros(n, np.int64),
        order=np.arange(n),
        request_key=np.zeros(n, np.uint64),
        restock_key=np.zeros(1, np.uint64),
    )


def blank_progress() -> Progress:
    """Return an episode before its first step, in which item 0 is asked for."""
    return Progress(
        step=np.zeros(1, np.int64),
        time=np.zeros(1),
        requested=np.zeros(1, np.int64),
        n_asked=np.zeros(1, np.int64),
        n_delivered=np.zeros(1, np.int64),
        anchoring_seconds=np.zeros(1),
        last_step=np.zeros(1, np.int64),
        pause_step=np.full(1, NOBODY),
        is_changed=np.zeros(1, np.bool_),
    )


def blank_outcome() -> Outcome:
    """Return what an uneventful step tells."""
    return Outcome(
        refused=np.full(1, NOBODY),
        n_delivered=np.zeros(1, np.int64),
        is_paused=np.zeros(1, np.bool_),
        is_room=np.ones(1, np.bool_),
    )


def blank_nearby(scenario: Scenario) -> Nearby:
    """Return working space for as many things as there may be near a robot."""
    n = max(scenario.n_robots, scenario.n_items) + 1
    return Nearby(
        place=np.zeros(n, np.int64),
        square=np.zeros(n),
        is_heard=np.zeros(n, np.bool_),
        chosen=np.zeros(n, np.int64),
        chosen_square=np.zeros(n),
        chosen_heard=np.zeros(n, np.bool_),
        nearest=np.zeros(n, np.int64),
        scanned=np.zeros(n, np.int64),
        forward=np.zeros(n),
        left=np.zeros(n),
        scanned_square=np.zeros(n),
        beam=np.zeros(n, np.int64),
        distance=np.zeros(n),
    )


def blank_claims(scenario: Scenario) -> Claims:
    """Return working space in which nobody claims anything."""
    n, n_items = scenario.n_robots, scenario.n_items
    return Claims(
        robot=np.full(n_items, NOBODY),
        square=np.zeros(n_items),
        events=np.zeros((4 * n, 3), np.int64),
        delivered_by=np.zeros(n, np.int64),
    )
