"""A robot's memory, made of its own observations and commands alone.

Directions are in the robot's own frame, which drifts; so what it remembers of them fades.

A heading is held against the walls, so that a drifting gyro does not spoil the way home.
Three neighbouring beams that meet one wall tell how the robot stands to it, up to quarter turns.
That tells how fast the gyro drifts, so that a direction is remembered for minutes. It holds in
rooms with walls at right angles; where a robot sees no wall it reckons on with the drift it found.

Its gyro tells how its body turned, so that its memory turns with it.

And what commands make of it: how a differential robot drives where it wants to; and the way out for
a robot that is caged by items with gaps narrower than it is. That one lets the requested item go,
lifts one of those that stand around it, and carries it away. Then the way is open for whoever lifts
the requested item next.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import observations as row
from swarm_logistics_env.kernels import inlined_kernel, kernel, uniform
from swarm_logistics_env.scenario import Scenario

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
    a, b, c = walls[nearest - 1], walls[nearest], walls[(nearest + 1) % row.N_BEAMS]
    # In a room every robot has a beam that meets nothing, or too long a one to be used.
    if max(a, c) >= walls.max():
        return -1.0
    ax, ay = a * _BEFORE[nearest, 0], a * _BEFORE[nearest, 1]
    bx, by = b * _ALONG[nearest, 0], b * _ALONG[nearest, 1]
    cx, cy = c * _AFTER[nearest, 0], c * _AFTER[nearest, 1]
    x, y = cx - ax, cy - ay
    length = max(length_of(x, y), 1e-6)
    if abs((bx - ax) * y - (by - ay) * x) / length > STRAIGHT:
        return -1.0
    return math.atan2(y, x) % QUARTER


# Columns of the memories (N, N_COLUMNS) of N robots.
(
    HEADING_X, HEADING_Y,  # of its last motion, length 1
    HOME_X, HOME_Y,  # fading sum of its directions into the delivery area, less those out
    WAS_INSIDE,  # the delivery area
    FAILED,  # 1: it just met its own failure; fades over FAILURE_TIME
    STUCK,  # 1: it just stood still with the requested item; falls to 0 in STUCK_TIME
    HELD,  # the last gripper command: 0 open, 1 hold, 2 hold the requested item it carries
    STANDING,  # [s] that it stood still with the requested item, less those that it moved
    CLEARING,  # [s] that are left to clear its way out of a cage of items; see `clear_the_way`
    WALL,  # direction of a wall in its frame [rad], always the same one of the four
    SIGHTINGS, WATCHED,  # number of times it saw how a wall stands, and for how long [s]
    TURNED, DRIFT,  # of that direction since the first sighting [rad], and per second [rad/s]
    KEPT_X, KEPT_Y,  # as HOME, from WALL on and fading in KEPT_TIME
    AWAY,  # from the border of the delivery area as far as it reckons, negative inside [m]
    CANNOT_DELIVER,  # 1: it takes its delivery for broken; falls to 0 in RETRY_TIME
    CANNOT_LIFT,  # 1: it takes its gripper for broken; falls to 0 in RETRY_TIME
    IN_VAIN,  # [s] that it held on to items in vain; fades in FADING_TIME, a lift clears it
    DELIVERING,  # [s] that it held the requested item inside the area; fades as IN_VAIN
    # What its maker knows of its body, see `body_of`; they stay for the whole episode.
    TOP_SPEED, HANDLING_TIME, WIDEST_TURN, ACCELERATION,
    N_COLUMNS,
) = range(27)  # fmt: skip
BODY = slice(TOP_SPEED, N_COLUMNS)

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


def body_of(scenario: Scenario) -> NDArray[np.float64]:
    """Return what its maker knows of a robot (4,).

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
        memories[robot, HEADING_X], memories[robot, HEADING_Y] = math.cos(angle), math.sin(angle)


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
    """Take what one row (D,) tells into a memory, and return its `kept_home`."""
    x, y = sensed[row.VELOCITY], sensed[row.VELOCITY + 1]
    speed = length_of(x, y)
    is_inside = sensed[row.IN_DELIVERY_AREA] > 0.5
    delivers = sensed[row.CARRYING_REQUESTED] > 0.5

    turn_back(sensed[row.TURN_RATE] * period, memory)
    diagnose(sensed, period, memory)

    memory[STUCK] = max(0.0, memory[STUCK] - period / STUCK_TIME)
    stands = delivers and memory[HELD] > 1.5 and speed < STANDS
    if stands:
        memory[STUCK] = 1.0
    memory[STANDING] = max(0.0, memory[STANDING] + (period if stands else -period))
    memory[CLEARING] = max(0.0, memory[CLEARING] - period)
    if memory[STANDING] > CAGED_TIME and not is_inside:
        memory[STANDING], memory[CLEARING] = 0.0, CLEARING_TIME

    watch_walls(sensed, period, memory)
    for column, share in ((HOME_X, fades[0]), (KEPT_X, fades[1])):
        memory[column] *= share
        memory[column + 1] *= share
    if is_inside != (memory[WAS_INSIDE] > 0.5) and speed > MOVES:
        inwards = 1.0 if is_inside else -1.0
        memory[HOME_X] += inwards * x / speed
        memory[HOME_Y] += inwards * y / speed
        along, aside = to_frame((math.cos(memory[WALL]), math.sin(memory[WALL])), x, y)
        memory[KEPT_X] += inwards / speed * along
        memory[KEPT_Y] += inwards / speed * aside
        memory[AWAY] = 0.0
    home_x, home_y, sure = kept_home(memory)
    if sure > 0.0:
        memory[AWAY] -= period * (home_x * x + home_y * y)
    memory[WAS_INSIDE] = 1.0 if is_inside else 0.0
    return home_x, home_y, sure


@inlined_kernel
def length_of(x: float, y: float) -> float:
    """Return the length of a vector."""
    return math.sqrt(x * x + y * y)


@inlined_kernel
def to_frame(frame: tuple[float, float], x: float, y: float) -> tuple[float, float]:
    """Return a vector in a frame that is turned by an angle of that cosine and sine."""
    cos, sin = frame
    return cos * x + sin * y, cos * y - sin * x


@kernel
def diagnose(sensed: NDArray[np.float32], period: float, memory: NDArray[np.float64]) -> None:
    """Take one robot's row into what its memory tells of failures of its own.

    It takes its gripper or its delivery for broken only after having held on in vain for longer
    than its handling time; then it tries again later. Readings may come late.
    """
    is_inside = sensed[row.IN_DELIVERY_AREA] > 0.5
    carries, delivers = sensed[row.CARRYING] > 0.5, sensed[row.CARRYING_REQUESTED] > 0.5
    memory[FAILED] *= 1.0 - period / FAILURE_TIME
    for column in (CANNOT_LIFT, CANNOT_DELIVER):
        memory[column] = max(0.0, memory[column] - period / RETRY_TIME)
    for column in (IN_VAIN, DELIVERING):
        memory[column] *= 1.0 - period / FADING_TIME
    # What it brought inside and did not let go of was delivered.
    if is_inside and not carries and memory[HELD] > 1.5:
        memory[DELIVERING], memory[CANNOT_DELIVER], memory[FAILED] = 0.0, 0.0, 0.0
    surely = memory[HANDLING_TIME] + SURELY_IN_VAIN - 0.5 * period
    if carries:
        memory[IN_VAIN], memory[CANNOT_LIFT] = 0.0, 0.0
    elif memory[HELD] > 0.5 and memory[HELD] < 1.5 and item_in_reach(sensed):
        memory[IN_VAIN] += period
        if memory[IN_VAIN] > surely:
            memory[IN_VAIN], memory[CANNOT_LIFT], memory[FAILED] = 0.0, 1.0, 1.0
    if is_inside and delivers:
        memory[DELIVERING] += period
        if memory[DELIVERING] > surely:
            memory[CANNOT_DELIVER], memory[FAILED] = 1.0, 1.0


@kernel
def item_in_reach(sensed: NDArray[np.float32]) -> bool:
    """Return whether a gripper that works lifts something here if it closes.

    It lifts no item again that it just put down, unless that is requested.
    """
    is_in_reach = False
    for index in range(row.N_ITEMS_IN_VIEW):
        item = row.ITEMS + row.ITEM_WIDTH * index
        away = length_of(sensed[item + 1], sensed[item + 2])
        may_lift = sensed[item + 3] > 0.5 or sensed[item + 4] < 0.5
        is_in_reach |= sensed[item] > 0.5 and away < SURELY_IN_REACH and may_lift
    return is_in_reach


@kernel
def watch_walls(sensed: NDArray[np.float32], period: float, memory: NDArray[np.float64]) -> None:
    """Take one robot's row into what its memory tells of a wall's direction."""
    if memory[SIGHTINGS] > 0.0:
        memory[WATCHED] += period
        memory[TURNED] += memory[DRIFT] * period
        memory[WALL] += memory[DRIFT] * period
    seen = wall_angle(sensed)
    if seen >= 0.0:
        off = seen - memory[WALL]
        off -= QUARTER * round(off / QUARTER)
        if memory[SIGHTINGS] > 0.0:
            off *= max(1.0 / memory[SIGHTINGS], LEAST_GAIN)
            memory[TURNED] += off
        memory[SIGHTINGS] += 1.0
        memory[WALL] += off
        memory[DRIFT] = memory[TURNED] / (memory[WATCHED] + SETTLING_TIME)
    memory[WALL] -= 2.0 * math.pi * round(memory[WALL] / (2.0 * math.pi))


@kernel
def kept_home(memory: NDArray[np.float64]) -> tuple[float, float, float]:
    """Return the direction home, of length 1, and how often it was taken lately; 0: never.

    The area has a straight border along a wall, so a robot that saw one goes at a right angle.
    """
    sure = length_of(memory[KEPT_X], memory[KEPT_Y])
    if sure == 0.0:
        return 0.0, 0.0, 0.0
    angle = math.atan2(memory[KEPT_Y], memory[KEPT_X])
    if memory[SIGHTINGS] > 0.0:
        angle = QUARTER * round(angle / QUARTER)
    angle += memory[WALL]
    return math.cos(angle), math.sin(angle), sure


@kernel
def note_command(
    sensed: NDArray[np.float32], command: NDArray[np.float64], memory: NDArray[np.float64]
) -> None:
    """Remember the command (4,) that was given upon a row."""
    x, y, grips = command[0], command[1], command[3]
    speed = length_of(x, y)
    if speed > 0.05:
        memory[HEADING_X], memory[HEADING_Y] = x / speed, y / speed
    memory[HELD] = 1.0 if grips > 0.5 else 0.0
    if sensed[row.CARRYING_REQUESTED] > 0.5 and grips > -0.5:
        memory[HELD] = 2.0


@kernel
def steer(memory: NDArray[np.float64], command: NDArray[np.float64]) -> None:
    """Turn a command (4,) to drive in a direction into a turn and motion ahead or back.

    Of a robot that drives in every direction it stays as it is.

    Args:
        command: forward and left as if the drive were holonomic; left becomes 0.
    """
    widest, speed = memory[WIDEST_TURN], length_of(command[0], command[1])
    if widest <= 0.0 or speed < 1e-6:
        return
    angle = math.atan2(command[1], command[0])
    forwards = 1.0
    if abs(angle) > 0.5 * math.pi:
        # It drives as well backwards, so that it never turns by more than a quarter.
        angle -= math.copysign(math.pi, angle)
        forwards = -1.0
    turn = min(max(angle, -widest), widest)
    # It drives along its mean direction in the period, and slower the more that is off.
    command[0] = forwards * speed * max(0.0, math.cos(angle - 0.5 * turn))
    command[1], command[2] = 0.0, turn / widest


@kernel
def turn_back(turn: float, memory: NDArray[np.float64]) -> None:
    """Turn the directions in one memory by -turn [rad], as the body turned by `turn`."""
    if turn == 0.0:
        return
    frame = math.cos(turn), math.sin(turn)
    for column in (HEADING_X, HOME_X):
        memory[column], memory[column + 1] = to_frame(frame, memory[column], memory[column + 1])
    memory[WALL] -= turn


# Ranges in m, beside the pick-up range of 0.25: hold lifts the requested item first if in reach.
_IN_REACH, _OUT_OF_REACH = 0.2, 0.28
_PUT_DOWN_TIME = 0.5  # [s] before the end, at which the item that was in the way is put down


@kernel
def clear_the_way(
    sensed: NDArray[np.float32], memory: NDArray[np.float64], command: NDArray[np.float64]
) -> None:
    """Replace the command (4,) of a caged robot, which its memory tells."""
    if memory[CLEARING] <= 0.0:
        return
    requested, other = nearest_items(sensed)
    x, y, speed, gripper = 0.0, 0.0, 0.0, -1.0
    if sensed[row.CARRYING_REQUESTED] < 0.5 and sensed[row.CARRYING] > 0.5:
        x, y = memory[HEADING_X], memory[HEADING_Y]
        if requested >= 0:
            x, y = -sensed[requested + 1], -sensed[requested + 2]
        speed = 1.0
        gripper = 1.0 if memory[CLEARING] > _PUT_DOWN_TIME else -1.0
    elif sensed[row.CARRYING] < 0.5 and other >= 0:
        x, y = sensed[other + 1], sensed[other + 2]
        away = length_of(x, y)
        speed = min(1.0, 2.0 * away)
        alone = requested < 0 or (
            sensed[requested + 1] ** 2 + sensed[requested + 2] ** 2 > _OUT_OF_REACH**2
        )
        gripper = 1.0 if alone and away < _IN_REACH else -1.0
    set_velocity(x, y, speed, gripper, command)


@kernel
def set_velocity(
    x: float, y: float, speed: float, gripper: float, command: NDArray[np.float64]
) -> None:
    """Fill one robot's command (4,): `speed` in the direction (x, y), of any length; no turn."""
    length = max(length_of(x, y), 1e-9)
    command[0], command[1] = speed * x / length, speed * y / length
    command[2], command[3] = 0.0, gripper


@kernel
def nearest_items(sensed: NDArray[np.float32]) -> tuple[int, int]:
    """Return the columns of the nearest requested item in view and of the nearest other; -1: none.

    The nearest thing comes first in a row.
    """
    requested, other, nearest = -1, -1, math.inf
    for index in range(row.N_ITEMS_IN_VIEW):
        item = row.ITEMS + row.ITEM_WIDTH * index
        if sensed[item] < 0.5:
            continue
        if sensed[item + 3] > 0.5:
            requested = item if requested < 0 else requested
        else:
            away = sensed[item + 1] ** 2 + sensed[item + 2] ** 2
            if away < nearest:
                other, nearest = item, away
    return requested, other
