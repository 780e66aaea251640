"""A robot's memory, made of its own observations and commands alone.

Directions are in the robot's own frame, which drifts; so what it remembers of them fades.

A heading is held against the walls, so that a drifting gyro does not spoil the way home.
Three neighbouring beams that meet one wall tell how the robot stands to it, up to quarter turns.
That tells how fast the gyro drifts, so that a direction is remembered for minutes. It holds in
rooms with walls at right angles; where a robot sees no wall it reckons on with the drift it found.

Its gyro tells how its body turned, so that its memory turns with it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.compiler.kernels import inlined_kernel, kernel, uniform
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.scenario import Scenario, of_first_robots

BEAM_ANGLE = 2.0 * math.pi / row.N_BEAMS
QUARTER = 0.5 * math.pi
STRAIGHT = 0.05  # [m] that the middle one of three points on a wall may lie aside
LEAST_GAIN = 0.15  # the share of a deviation that is corrected after the first sightings
SETTLING_TIME = 1.0  # [s], so that the drift is not judged by the noise of the first sightings


def _directions(aside: float) -> NDArray[np.float64]:
    """Return cosine and sine of each beam's angle plus `aside` [rad], (N_BEAMS, 2)."""
    angles = [BEAM_ANGLE * beam + aside for beam in range(row.N_BEAMS)]
    return np.array([(math.cos(angle), math.sin(angle)) for angle in angles])


_BEFORE, _ALONG, _AFTER = map(_directions, (-BEAM_ANGLE, 0.0, BEAM_ANGLE))


@kernel
def wall_angle(sensed: NDArray[np.float32]) -> float:
    """Return the direction of the nearest wall in the robot's frame, 0 to pi/2 [rad]; -1: none."""
    walls = sensed[row.RANGE_WALLS : row.RANGE_WALLS + row.N_BEAMS]
    nearest = np.argmin(walls)
    a = walls[nearest - 1]
    b = walls[nearest]
    c = walls[(nearest + 1) % row.N_BEAMS]
    # In a room every robot has a beam that meets nothing, or too long a one to be used.
    if max(a, c) >= walls.max():
        return -1.0
    ax = a * _BEFORE[nearest, 0]
    ay = a * _BEFORE[nearest, 1]
    bx = b * _ALONG[nearest, 0]
    by = b * _ALONG[nearest, 1]
    cx = c * _AFTER[nearest, 0]
    cy = c * _AFTER[nearest, 1]
    x = cx - ax
    y = cy - ay
    length = max(length_of(x, y), 1e-6)
    if abs((bx - ax) * y - (by - ay) * x) / length > STRAIGHT:
        return -1.0
    return math.atan2(y, x) % QUARTER


class MemoryColumns(NamedTuple):
    """The columns of memories (N, N_COLUMNS) of N robots."""

    heading_x: int  # of its last motion, length 1
    heading_y: int
    home_x: int  # fading sum of its directions into the delivery area, less those out
    home_y: int
    was_inside: int  # the delivery area: OUTSIDE or INSIDE
    failed: int  # 1: it just met its own failure; fades over FAILURE_TIME
    stuck: int  # 1: it just stood still with the requested item; falls to 0 in STUCK_TIME
    held: int  # the last gripper command: OPEN, HOLDING or HOLDING_REQUESTED
    standing: int  # [s] that it stood still with the requested item, less those that it moved
    clearing: int  # [s] that are left to clear its way out of a cage; see `clear_the_way`
    wall: int  # direction of a wall in its frame [rad], always the same one of the four
    sightings: int  # number of times it saw how a wall stands
    watched: int  # [s] since the first of them
    turned: int  # of that direction since then [rad]
    drift: int  # of that direction [rad/s]
    kept_x: int  # as `home_x`, from `wall` on and fading in KEPT_TIME
    kept_y: int
    away: int  # from the border of the delivery area as far as it reckons, negative inside [m]
    cannot_deliver: int  # 1: it takes its delivery for broken; falls to 0 in RETRY_TIME
    cannot_lift: int  # 1: it takes its gripper for broken; falls to 0 in RETRY_TIME
    in_vain: int  # [s] that it held on to items in vain; fades in FADING_TIME, a lift clears it
    delivering: int  # [s] that it held the requested item inside the area; fades as `in_vain`
    tried: int  # [s] that it carried the requested item outside; below 0: leaves it to others
    # What its maker knows of its body, see `body_of`; they stay for the whole episode.
    top_speed: int
    handling_time: int
    widest_turn: int
    acceleration: int


N_COLUMNS = len(MemoryColumns._fields)
MEMORY = MemoryColumns(*range(N_COLUMNS))
BODY = slice(MEMORY.top_speed, N_COLUMNS)

# The last gripper command.
OPEN = 0.0
HOLDING = 1.0
HOLDING_REQUESTED = 2.0  # the requested item, which it carried

# Where it was.
OUTSIDE = 0.0
INSIDE = 1.0

FAILURE_TIME = 60.0  # [s]
RETRY_TIME = 120.0  # [s], after which it tries again: it may have been repaired
SURELY_IN_VAIN = 1.0  # [s] beyond its handling time; less may be a reading that came late
FADING_TIME = 60.0  # [s], in which evidence of a failure fades
HOME_TIME = 10.0  # [s], in which a remembered direction fades: by then a gyro may have drifted
KEPT_TIME = 60.0  # [s], in which a direction fades that is held against the walls
STUCK_TIME = 1.5  # [s]
CAGED_TIME = 5.0  # [s] of standing, after which a robot takes itself for caged
CLEARING_TIME = 6.0  # [s]
SURELY_IN_REACH = 0.24  # [m]; such an item is lifted by a gripper that works
STANDS = 0.2  # [m/s] and less
MOVES = 0.1  # [m/s] and more: its velocity has a direction


def bodies_of(scenario: Scenario) -> NDArray[np.float64]:
    """Return what their maker knows of the first robots, which repeats (P, 4); see `body_of`.

    P is 1 unless robots are of several kinds.
    """
    return np.array([body_of(of_robot) for of_robot in of_first_robots(scenario)])


def body_of(scenario: Scenario) -> NDArray[np.float64]:
    """Return what its maker knows of a robot (4,) of a scenario whose robots are alike.

    Top speed [m/s], handling time [s], widest turn in a period [rad], and acceleration [m/s2]. The
    widest turn is 0 of a robot that drives in every direction and never has to turn.
    """
    turns = scenario.drive == "differential"
    widest = scenario.max_turn_rate * scenario.control_period if turns else 0.0
    return np.array([scenario.max_speed, scenario.handling_time, widest, scenario.max_acceleration])


@kernel
def face_anywhere(keys: NDArray[np.uint64], memories: NDArray[np.float64]) -> None:
    """Fill the headings in memories (N, N_COLUMNS) with random ones."""
    for robot in range(memories.shape[0]):
        angle = 2.0 * math.pi * uniform(keys[robot], 0)
        memories[robot, MEMORY.heading_x] = math.cos(angle)
        memories[robot, MEMORY.heading_y] = math.sin(angle)


@kernel
def remember_observation(
    rows: NDArray[np.float32], period: float, memories: NDArray[np.float64]
) -> None:
    """Take what the rows (N, D) tell into the memories, once a control period [s]."""
    fades = fading(period)
    for robot in range(rows.shape[0]):
        remember_row(rows[robot], period, fades, memories[robot])


@inlined_kernel
def fading(period: float) -> tuple[float, float]:
    """Return the shares of HOME and of KEPT that a control period [s] leaves."""
    return math.exp(-period / HOME_TIME), math.exp(-period / KEPT_TIME)


@kernel
def remember_row(
    sensed: NDArray[np.float32],
    period: float,
    fades: tuple[float, float],
    memory: NDArray[np.float64],
) -> tuple[float, float, float]:
    """Take what one row (D,) tells into a memory, and return its `kept_home`.

    A robot that is out of the arena forgets all but its heading and its body.
    """
    x = np.float64(sensed[row.VELOCITY_X])
    y = np.float64(sensed[row.VELOCITY_Y])
    speed = np.float64(length_of(sensed[row.VELOCITY_X], sensed[row.VELOCITY_Y]))
    is_inside = sensed[row.IN_DELIVERY_AREA] > 0.5
    delivers = sensed[row.CARRYING_REQUESTED] > 0.5

    if is_out(sensed):
        # Its gyro tells nothing of how it is turned there, so no direction would hold afterwards.
        memory[MEMORY.home_x : MEMORY.top_speed] = 0.0
    turn_back(np.float64(sensed[row.TURN_RATE]) * period, memory)
    diagnose(sensed, period, memory)

    memory[MEMORY.stuck] = max(0.0, memory[MEMORY.stuck] - period / STUCK_TIME)
    stands = delivers and memory[MEMORY.held] == HOLDING_REQUESTED and speed < STANDS
    if stands:
        memory[MEMORY.stuck] = 1.0
    memory[MEMORY.standing] = max(0.0, memory[MEMORY.standing] + (period if stands else -period))
    memory[MEMORY.clearing] = max(0.0, memory[MEMORY.clearing] - period)
    if memory[MEMORY.standing] > CAGED_TIME and not is_inside:
        memory[MEMORY.standing] = 0.0
        memory[MEMORY.clearing] = CLEARING_TIME

    watch_walls(sensed, period, memory)
    home_share, kept_share = fades
    memory[MEMORY.home_x] *= home_share
    memory[MEMORY.home_y] *= home_share
    memory[MEMORY.kept_x] *= kept_share
    memory[MEMORY.kept_y] *= kept_share
    was_inside = memory[MEMORY.was_inside] == INSIDE
    if is_inside != was_inside and speed > MOVES:
        inwards = 1.0 if is_inside else -1.0
        memory[MEMORY.home_x] += inwards * x / speed
        memory[MEMORY.home_y] += inwards * y / speed
        wall = memory[MEMORY.wall]
        along, aside = to_frame((math.cos(wall), math.sin(wall)), x, y)
        memory[MEMORY.kept_x] += inwards / speed * along
        memory[MEMORY.kept_y] += inwards / speed * aside
        memory[MEMORY.away] = 0.0
    home_x, home_y, sure = kept_home(memory)
    if sure > 0.0:
        memory[MEMORY.away] -= period * (home_x * x + home_y * y)
    memory[MEMORY.was_inside] = INSIDE if is_inside else OUTSIDE
    return home_x, home_y, sure


@kernel
def is_out(sensed: NDArray[np.float32]) -> bool:
    """Return whether a row is of a robot out of the arena: zeros, as beams in it never all are."""
    walls = sensed[row.RANGE_WALLS : row.RANGE_WALLS + row.N_BEAMS]
    return bool(walls.max() == 0.0)


@inlined_kernel
def length_of(x: float, y: float) -> float:
    """Return the length of a vector, in the precision of `x` and `y`."""
    length: float = np.sqrt(x * x + y * y)
    return length


@inlined_kernel
def to_frame(frame: tuple[float, float], x: float, y: float) -> tuple[float, float]:
    """Return a vector in a frame that is turned by an angle of that cosine and sine."""
    cos, sin = frame
    forward = np.float64(x)
    left = np.float64(y)
    return cos * forward + sin * left, cos * left - sin * forward


@kernel
def diagnose(sensed: NDArray[np.float32], period: float, memory: NDArray[np.float64]) -> None:
    """Take one robot's row into what its memory tells of failures of its own.

    It takes its gripper or its delivery for broken only after having held on in vain for longer
    than its handling time; then it tries again later. Readings may come late.
    """
    is_inside = sensed[row.IN_DELIVERY_AREA] > 0.5
    carries = sensed[row.CARRYING] > 0.5
    delivers = sensed[row.CARRYING_REQUESTED] > 0.5
    memory[MEMORY.failed] *= 1.0 - period / FAILURE_TIME
    for column in (MEMORY.cannot_lift, MEMORY.cannot_deliver):
        memory[column] = max(0.0, memory[column] - period / RETRY_TIME)
    for column in (MEMORY.in_vain, MEMORY.delivering):
        memory[column] *= 1.0 - period / FADING_TIME
    # What it brought inside and did not let go of was delivered.
    if is_inside and not carries and memory[MEMORY.held] == HOLDING_REQUESTED:
        memory[MEMORY.delivering] = 0.0
        memory[MEMORY.cannot_deliver] = 0.0
        memory[MEMORY.failed] = 0.0
    surely = memory[MEMORY.handling_time] + SURELY_IN_VAIN - 0.5 * period
    if carries:
        memory[MEMORY.in_vain] = 0.0
        memory[MEMORY.cannot_lift] = 0.0
    elif memory[MEMORY.held] == HOLDING and item_in_reach(sensed):
        memory[MEMORY.in_vain] += period
        if memory[MEMORY.in_vain] > surely:
            memory[MEMORY.in_vain] = 0.0
            memory[MEMORY.cannot_lift] = 1.0
            memory[MEMORY.failed] = 1.0
    if is_inside and delivers:
        memory[MEMORY.delivering] += period
        if memory[MEMORY.delivering] > surely:
            memory[MEMORY.cannot_deliver] = 1.0
            memory[MEMORY.failed] = 1.0


@kernel
def item_in_reach(sensed: NDArray[np.float32]) -> bool:
    """Return whether a gripper that works lifts something here if it closes.

    It lifts no item again that it just put down, unless that is requested.
    """
    is_in_reach = False
    for index in range(row.N_ITEMS_IN_VIEW):
        item = row.ITEMS + row.ITEM_WIDTH * index
        away = length_of(sensed[item + row.ITEM.x], sensed[item + row.ITEM.y])
        is_present = sensed[item + row.ITEM.present] > 0.5
        is_requested = sensed[item + row.ITEM.requested] > 0.5
        may_lift = is_requested or sensed[item + row.ITEM.recently_held] < 0.5
        is_in_reach |= is_present and away < SURELY_IN_REACH and may_lift
    return is_in_reach


@kernel
def watch_walls(sensed: NDArray[np.float32], period: float, memory: NDArray[np.float64]) -> None:
    """Take one robot's row into what its memory tells of a wall's direction."""
    if memory[MEMORY.sightings] > 0.0:
        memory[MEMORY.watched] += period
        memory[MEMORY.turned] += memory[MEMORY.drift] * period
        memory[MEMORY.wall] += memory[MEMORY.drift] * period
    seen = wall_angle(sensed)
    if seen >= 0.0:
        off = seen - memory[MEMORY.wall]
        off -= QUARTER * round(off / QUARTER)
        if memory[MEMORY.sightings] > 0.0:
            off *= max(1.0 / memory[MEMORY.sightings], LEAST_GAIN)
            memory[MEMORY.turned] += off
        memory[MEMORY.sightings] += 1.0
        memory[MEMORY.wall] += off
        memory[MEMORY.drift] = memory[MEMORY.turned] / (memory[MEMORY.watched] + SETTLING_TIME)
    memory[MEMORY.wall] -= 2.0 * math.pi * round(memory[MEMORY.wall] / (2.0 * math.pi))


@kernel
def kept_home(memory: NDArray[np.float64]) -> tuple[float, float, float]:
    """Return the direction home, of length 1, and how often it was taken lately; 0: never.

    The area has a straight border along a wall, so a robot that saw one goes at a right angle.
    """
    sure = length_of(memory[MEMORY.kept_x], memory[MEMORY.kept_y])
    if sure == 0.0:
        return 0.0, 0.0, 0.0
    angle = math.atan2(memory[MEMORY.kept_y], memory[MEMORY.kept_x])
    if memory[MEMORY.sightings] > 0.0:
        angle = QUARTER * round(angle / QUARTER)
    angle += memory[MEMORY.wall]
    return math.cos(angle), math.sin(angle), sure


@kernel
def note_command(
    sensed: NDArray[np.float32], command: NDArray[np.float64], memory: NDArray[np.float64]
) -> None:
    """Remember the command (4,) that was given upon a row."""
    x = command[0]
    y = command[1]
    grips = command[3]
    speed = length_of(x, y)
    if speed > 0.05:
        memory[MEMORY.heading_x] = x / speed
        memory[MEMORY.heading_y] = y / speed
    memory[MEMORY.held] = HOLDING if grips > 0.5 else OPEN
    if sensed[row.CARRYING_REQUESTED] > 0.5 and grips > -0.5:
        memory[MEMORY.held] = HOLDING_REQUESTED


@inlined_kernel
def has_failed(memory: NDArray[np.float64]) -> bool:
    """Return whether a robot met a failure of its own in the last 42 s, and no success since."""
    return bool(memory[MEMORY.failed] >= 0.5)


@kernel
def turn_back(turn: float, memory: NDArray[np.float64]) -> None:
    """Turn the directions in one memory by -turn [rad], as the body turned by `turn`."""
    if turn == 0.0:
        return
    frame = math.cos(turn), math.sin(turn)
    heading_x = memory[MEMORY.heading_x]
    heading_y = memory[MEMORY.heading_y]
    home_x = memory[MEMORY.home_x]
    home_y = memory[MEMORY.home_y]
    memory[MEMORY.heading_x], memory[MEMORY.heading_y] = to_frame(frame, heading_x, heading_y)
    memory[MEMORY.home_x], memory[MEMORY.home_y] = to_frame(frame, home_x, home_y)
    memory[MEMORY.wall] -= turn
