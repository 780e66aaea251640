"""Homing: a scripted swarm whose robots remember in which direction the delivery area lies.

SEARCH: straight ahead, away from neighbours; lifts nothing but the requested item. DELIVER: in the
direction in which the robot itself entered the delivery area before, and towards the lowest timer
heard as long as it has entered rarely; of 32 directions it takes the one that fits best and is
free. A robot that stands still drives in a random direction for a moment. One that has met a
failure of its own leaves requested items to others, and lets go inside the area.

What it leans on: the remembered direction is kept in the robot's own frame, which drifts, so the
memory fades within ten seconds. Swarm D-T remembers no direction and does not need it. This policy
commands no turn; a robot of the differential drive turns to where it wants to go, see
`motion.memory.steer`.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import observations as row
from swarm_logistics_env.kernels import kernel
from swarm_logistics_env.motion import memory as column
from swarm_logistics_env.motion.frame import MotionView, random_heading
from swarm_logistics_env.motion.memory import drive, length_of
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.streams import row_keys

# All values are fitted: they were tried for the most deliveries. Gains in top speeds, ranges in m.
SPREAD_GAIN, SPREAD_RANGE = 0.8, 2.0  # away from neighbours, while searching
AVOID_GAIN, AVOID_RANGE = 2.0, 0.5  # away from near neighbours, always
WALL_GAIN, WALL_RANGE, MIRROR_RANGE = 1.5, 0.6, 0.2
GRIP_RANGE = 0.4
HOME_SHARE = 0.8  # of a laden robot's direction; the rest is its heading
SURE = 3.0  # after so many entries, it no longer listens to timers
CLEARANCE, OBSTACLE_RANGE = 0.28, 0.5
N_DIRECTIONS = 32


@kernel
def decide_homing(
    rows: NDArray[np.float32],
    memory: NDArray[np.float64],
    keys: NDArray[np.uint64],
    random_headings: NDArray[np.int64],
    period: float,
    commands: NDArray[np.float64],
) -> None:
    """Fill the commands (N, 4), in the robots' own frames, from rows (N, D) and memories.

    `random_headings` (N,) are the numbers of the random directions whose turn it is.
    """
    for robot in range(rows.shape[0]):
        sensed, own = rows[robot], memory[robot]
        is_inside = sensed[row.IN_DELIVERY_AREA] > 0.5
        x, y = own[column.HEADING_X], own[column.HEADING_Y]
        push_x, push_y = away_from_neighbours(sensed, AVOID_RANGE, AVOID_GAIN)
        speed, gripper = 1.0, -1.0
        if sensed[row.CARRYING_REQUESTED] > 0.5:
            # Inside it stands, and lets go only once it takes its delivery for broken.
            if not is_inside or own[column.FAILED] < 0.5:
                gripper = 1.0
            speed = 0.0 if is_inside and gripper > 0.0 else 1.0
            if own[column.STUCK] > 0.0:
                angle = random_heading(keys[robot], random_headings[robot])
                x, y = math.cos(angle), math.sin(angle)
            elif not is_inside:
                x, y = home_direction(sensed, own, x, y)
            x, y = freest_direction(sensed, own, x + push_x, y + push_y)
        else:
            item = requested_item(sensed, own, is_inside)
            if item >= 0 and sensed[row.CARRYING] < 0.5:
                x, y, speed, gripper = fetch(sensed, item, push_x, push_y, period)
            else:
                x, y = search_direction(sensed, own, x, y, is_inside)
                x, y = x + push_x, y + push_y
                speed = min(1.0, max(length_of(x, y), 0.3))
        drive(x, y, speed, gripper, commands[robot])


@kernel
def away_from_neighbours(
    sensed: NDArray[np.float32], reach: float, gain: float
) -> tuple[float, float]:
    """Return the sum of directions away from neighbours, `gain` .. 0 at distance 0 .. `reach`."""
    push_x, push_y = 0.0, 0.0
    for place in range(row.N_NEIGHBOURS):
        there = row.NEIGHBOURS + row.NEIGHBOUR_WIDTH * place
        x, y = sensed[there + 1], sensed[there + 2]
        away = length_of(x, y)
        if 0.0 < away < reach:
            push_x -= (1.0 - away / reach) * x / away
            push_y -= (1.0 - away / reach) * y / away
    return gain * push_x, gain * push_y


@kernel
def requested_item(sensed: NDArray[np.float32], own: NDArray[np.float64], is_inside: bool) -> int:
    """Return the column of the nearest requested item for a robot that has not failed; -1: none.

    Not one that a robot inside held itself a moment ago.
    """
    if own[column.FAILED] > 0.5:
        return -1
    for place in range(row.N_ITEMS_IN_VIEW):
        there = row.ITEMS + row.ITEM_WIDTH * place
        left_here = is_inside and sensed[there + 4] > 0.5
        if sensed[there] > 0.5 and sensed[there + 3] > 0.5 and not left_here:
            return there
    return -1


@kernel
def fetch(
    sensed: NDArray[np.float32], item: int, push_x: float, push_y: float, period: float
) -> tuple[float, float, float, float]:
    """Return the direction, speed and gripper of a robot on its way to the item in a column."""
    x, y = sensed[item + 1], sensed[item + 2]
    away = max(length_of(x, y), 1e-6)
    speed, gripper = min(1.0, away / (2.0 * period)), 1.0 if away < GRIP_RANGE else -1.0
    return x / away + 0.5 * push_x, y / away + 0.5 * push_y, speed, gripper


@kernel
def search_direction(
    sensed: NDArray[np.float32], own: NDArray[np.float64], x: float, y: float, is_inside: bool
) -> tuple[float, float]:
    """Return the direction in which a robot searches that drives in direction (x, y)."""
    walls = sensed[row.RANGE_WALLS : row.RANGE_WALLS + row.N_BEAMS]
    nearest = np.argmin(walls)
    wall_x, wall_y = 0.0, 0.0
    if walls[nearest] < WALL_RANGE:
        angle = 2.0 * math.pi * nearest / row.N_BEAMS
        towards_x, towards_y = math.cos(angle), math.sin(angle)
        approach = x * towards_x + y * towards_y
        if walls[nearest] < MIRROR_RANGE and approach > 0.0:
            x -= 2.0 * approach * towards_x
            y -= 2.0 * approach * towards_y
        push = WALL_GAIN * (1.0 - walls[nearest] / WALL_RANGE)
        wall_x, wall_y = -push * towards_x, -push * towards_y
    spread_x, spread_y = away_from_neighbours(sensed, SPREAD_RANGE, SPREAD_GAIN)
    x += wall_x + spread_x
    y += wall_y + spread_y
    home = length_of(own[column.HOME_X], own[column.HOME_Y])
    if is_inside and home > 0.5:
        x -= own[column.HOME_X] / home
        y -= own[column.HOME_Y] / home
    return x, y


@kernel
def home_direction(
    sensed: NDArray[np.float32], own: NDArray[np.float64], x: float, y: float
) -> tuple[float, float]:
    """Return the direction in which a laden robot goes that drives in direction (x, y)."""
    home = length_of(own[column.HOME_X], own[column.HOME_Y])
    trust = 1.0
    if home > 0.5:
        x = HOME_SHARE * own[column.HOME_X] / home + (1.0 - HOME_SHARE) * x
        y = HOME_SHARE * own[column.HOME_Y] / home + (1.0 - HOME_SHARE) * y
        trust = 1.0 / home if home < SURE else 0.0
    if sensed[row.LOWEST_TIMER] > 0.5:
        lead_x, lead_y = sensed[row.LOWEST_TIMER + 1], sensed[row.LOWEST_TIMER + 2]
        away = length_of(lead_x, lead_y)
        if away > 0.0:
            x += trust * lead_x / away
            y += trust * lead_y / away
    return x, y


@kernel
def freest_direction(
    sensed: NDArray[np.float32], own: NDArray[np.float64], x: float, y: float
) -> tuple[float, float]:
    """Return the direction that is nearest to the wanted (x, y) and meets no item or wall."""
    length = max(length_of(x, y), 1e-9)
    x, y = x / length, y / length
    most, best_x, best_y = -1e9, x, y
    for number in range(N_DIRECTIONS):
        angle = 2.0 * math.pi * number / N_DIRECTIONS
        go_x, go_y = math.cos(angle), math.sin(angle)
        worth = go_x * x + go_y * y
        worth += 0.3 * (go_x * own[column.HEADING_X] + go_y * own[column.HEADING_Y])
        for place in range(row.N_ITEMS_IN_VIEW):
            there = row.ITEMS + row.ITEM_WIDTH * place
            if sensed[there] < 0.5:
                break
            along = sensed[there + 1] * go_x + sensed[there + 2] * go_y
            aside = abs(sensed[there + 1] * go_y - sensed[there + 2] * go_x)
            if aside < CLEARANCE and 0.0 < along < OBSTACLE_RANGE + 0.25:
                near = 1.0 - max(0.0, along - 0.25) / OBSTACLE_RANGE
                worth -= 2.0 * near * min(1.0, (CLEARANCE - aside) / 0.05)
        wall = sensed[row.RANGE_WALLS + number // 2]
        if number % 2:
            wall = min(wall, sensed[row.RANGE_WALLS + (number // 2 + 1) % row.N_BEAMS])
        if wall < 0.35:
            worth -= 2.0 * (1.0 - max(0.0, wall - 0.13) / 0.22)
        if worth > most:
            most, best_x, best_y = worth, go_x, go_y
    return best_x, best_y


class Homing:
    """Every robot remembers for some ten seconds where it last entered the delivery area.

    Example:
        >>> policy = Homing()
        >>> policy.reset(n_robots=3, seed=0)
        >>> policy.act(np.zeros((3, row.N_COLUMNS), np.float32)).shape
        (3, 4)
    """

    _decide = staticmethod(decide_homing)

    def __init__(self) -> None:
        self.configure(Scenario())
        self.reset(0, 0)

    def configure(self, scenario: Scenario) -> None:
        """Take what a robot's maker knows: the control period."""
        self._period = scenario.control_period
        self._frame = MotionView(scenario)

    def reset(self, n_robots: int, seed: int) -> None:
        """Begin an episode with random headings and empty memories."""
        self._frame.begin(row_keys(seed, "homing", n_robots))

    def act(self, observations: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return commands (N, 4) for observation rows (N, D).

        Raises:
            PolicyError: there are more or fewer rows than robots at `reset`.
        """
        frame = self._frame
        numbers = frame.random_headings()
        frame.read(observations)
        commands = np.zeros((len(observations), 4))
        self._decide(observations, frame.memory, frame.keys, numbers, self._period, commands)
        return frame.command(frame.outputs_for(commands))
