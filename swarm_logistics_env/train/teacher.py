"""The scripted policy that trainings begin by imitating.

A robot searches straight ahead, away from neighbours, and lifts nothing but the requested item.
With it, it goes the way that it remembers to have entered the delivery area by, or to the lowest
timer heard, in the freest of 32 directions; stuck, it follows its whim. Where it has met a failure
of its own, it leaves requested items to others, and inside the area it lets go.

As a policy: `policies.load("swarm_logistics_env.train.teacher:Teacher")`.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import observations as row
from swarm_logistics_env.kernels import kernel
from swarm_logistics_env.policies import robot_memory as known
from swarm_logistics_env.policies.motion_frame import WHIM_TIME, MotionFrame, whim_of
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.streams import row_keys

# Chosen by trying; gains in top speeds, ranges in m.
SPREAD_GAIN, SPREAD_RANGE = 0.8, 2.0  # from neighbours, while searching
AVOID_GAIN, AVOID_RANGE = 2.0, 0.5  # from near ones, always
WALL_GAIN, WALL_RANGE, MIRROR_RANGE = 1.5, 0.6, 0.2
GRIP_RANGE = 0.4
HOME_SHARE = 0.8  # of a laden robot's direction; the rest is its heading
SURE = 3.0  # entries that make it stop listening to timers
CLEARANCE, OBSTACLE_RANGE = 0.28, 0.5
N_WAYS = 32


class Teacher:
    """The teacher as a policy; needs nothing but observation rows."""

    def __init__(self) -> None:
        self.configure(Scenario())

    def configure(self, scenario: Scenario) -> None:
        """Take what a robot's maker knows: the control period."""
        self._period = scenario.control_period
        self._frame = MotionFrame(scenario)

    def reset(self, n_robots: int, seed: int) -> None:
        """Begin an episode."""
        self._frame.begin(row_keys(seed, "teacher", n_robots))

    def act(self, observations: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return commands (N, 4) for observation rows (N, D)."""
        self._frame.read(observations)
        commands = taught(self._frame, observations, self._period)
        return self._frame.command(self._frame.outputs_for(commands))


def taught(
    frame: MotionFrame, observations: NDArray[np.float32], period: float
) -> NDArray[np.float64]:
    """Return what the teacher would command (N, 4) upon the rows that `frame` read last."""
    whims = ((frame.counts - 1) * period / WHIM_TIME + 1e-9).astype(np.int64)
    commands = np.zeros((len(observations), 4))
    teach(observations, frame.memory, frame.keys, whims, period, commands)
    return commands


@kernel
def teach(
    rows: NDArray[np.float32],
    memory: NDArray[np.float64],
    keys: NDArray[np.uint64],
    whims: NDArray[np.int64],
    period: float,
    commands: NDArray[np.float64],
) -> None:
    """Fill the teacher's commands (N, 4)."""
    for robot in range(rows.shape[0]):
        sensed, own = rows[robot], memory[robot]
        is_inside = sensed[row.IN_DELIVERY_AREA] > 0.5
        x, y = own[known.HEADING_X], own[known.HEADING_Y]
        push_x, push_y = away_from_neighbours(sensed, AVOID_RANGE)
        push_x *= AVOID_GAIN
        push_y *= AVOID_GAIN
        speed, gripper = 1.0, -1.0
        if sensed[row.CARRYING_REQUESTED] > 0.5:
            if not is_inside:
                gripper = 1.0
            if own[known.STUCK] > 0.0:
                whim = whim_of(keys[robot], whims[robot])
                x, y = math.cos(whim), math.sin(whim)
            elif not is_inside:
                x, y = homewards(sensed, own, x, y)
            x, y = freest_way(sensed, own, x + push_x, y + push_y)
        else:
            item = requested_item(sensed, own, is_inside)
            if item >= 0:
                x, y = sensed[item + 1], sensed[item + 2]
                away = max(math.sqrt(x * x + y * y), 1e-6)
                x, y = x / away + 0.5 * push_x, y / away + 0.5 * push_y
                speed = min(1.0, away / (2.0 * period))
                if away < GRIP_RANGE:
                    gripper = 1.0
            else:
                x, y = searching(sensed, own, x, y, is_inside)
                x += push_x
                y += push_y
                speed = min(1.0, max(math.sqrt(x * x + y * y), 0.3))
        length = max(math.sqrt(x * x + y * y), 1e-9)
        commands[robot, 0], commands[robot, 1] = speed * x / length, speed * y / length
        commands[robot, 2], commands[robot, 3] = 0.0, gripper


@kernel
def away_from_neighbours(sensed: NDArray[np.float32], reach: float) -> tuple[float, float]:
    """Return the sum of the directions away from neighbours, 1 .. 0 at distance 0 .. `reach`."""
    push_x, push_y = 0.0, 0.0
    for place in range(row.N_NEIGHBOURS):
        there = row.NEIGHBOURS + 5 * place
        x, y = sensed[there + 1], sensed[there + 2]
        away = math.sqrt(x * x + y * y)
        if 0.0 < away < reach:
            push_x -= (1.0 - away / reach) * x / away
            push_y -= (1.0 - away / reach) * y / away
    return push_x, push_y


@kernel
def requested_item(sensed: NDArray[np.float32], own: NDArray[np.float64], is_inside: bool) -> int:
    """Return the column of the requested item that is there to be lifted; -1: none."""
    if sensed[row.CARRYING] > 0.5 or own[known.FAILED] > 0.5:
        return -1
    for place in range(row.N_ITEMS_IN_VIEW):
        there = row.ITEMS + 5 * place
        left_here = is_inside and sensed[there + 4] > 0.5
        if sensed[there] > 0.5 and sensed[there + 3] > 0.5 and not left_here:
            return there
    return -1


@kernel
def searching(
    sensed: NDArray[np.float32], own: NDArray[np.float64], x: float, y: float, is_inside: bool
) -> tuple[float, float]:
    """Return where to search, coming from direction (x, y)."""
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
    spread_x, spread_y = away_from_neighbours(sensed, SPREAD_RANGE)
    x += wall_x + SPREAD_GAIN * spread_x
    y += wall_y + SPREAD_GAIN * spread_y
    home = math.sqrt(own[known.HOME_X] ** 2 + own[known.HOME_Y] ** 2)
    if is_inside and home > 0.5:
        x -= own[known.HOME_X] / home
        y -= own[known.HOME_Y] / home
    return x, y


@kernel
def homewards(
    sensed: NDArray[np.float32], own: NDArray[np.float64], x: float, y: float
) -> tuple[float, float]:
    """Return where the delivery area may be, coming from direction (x, y)."""
    home = math.sqrt(own[known.HOME_X] ** 2 + own[known.HOME_Y] ** 2)
    trust = 1.0
    if home > 0.5:
        x = HOME_SHARE * own[known.HOME_X] / home + (1.0 - HOME_SHARE) * x
        y = HOME_SHARE * own[known.HOME_Y] / home + (1.0 - HOME_SHARE) * y
        trust = 1.0 / home if home < SURE else 0.0
    if sensed[row.LOWEST_TIMER] > 0.5:
        lead_x, lead_y = sensed[row.LOWEST_TIMER + 1], sensed[row.LOWEST_TIMER + 2]
        away = math.sqrt(lead_x * lead_x + lead_y * lead_y)
        if away > 0.0:
            x += trust * lead_x / away
            y += trust * lead_y / away
    return x, y


@kernel
def freest_way(
    sensed: NDArray[np.float32], own: NDArray[np.float64], x: float, y: float
) -> tuple[float, float]:
    """Return the direction that goes best with the wanted (x, y) and meets no item or wall."""
    length = max(math.sqrt(x * x + y * y), 1e-9)
    x, y = x / length, y / length
    most, best_x, best_y = -1e9, x, y
    for way in range(N_WAYS):
        angle = 2.0 * math.pi * way / N_WAYS
        go_x, go_y = math.cos(angle), math.sin(angle)
        worth = go_x * x + go_y * y
        worth += 0.3 * (go_x * own[known.HEADING_X] + go_y * own[known.HEADING_Y])
        for place in range(row.N_ITEMS_IN_VIEW):
            there = row.ITEMS + 5 * place
            if sensed[there] < 0.5:
                break
            along = sensed[there + 1] * go_x + sensed[there + 2] * go_y
            aside = abs(sensed[there + 1] * go_y - sensed[there + 2] * go_x)
            if aside < CLEARANCE and 0.0 < along < OBSTACLE_RANGE + 0.25:
                near = 1.0 - max(0.0, along - 0.25) / OBSTACLE_RANGE
                worth -= 2.0 * near * min(1.0, (CLEARANCE - aside) / 0.05)
        wall = sensed[row.RANGE_WALLS + way // 2]
        if way % 2:
            wall = min(wall, sensed[row.RANGE_WALLS + (way // 2 + 1) % row.N_BEAMS])
        if wall < 0.35:
            worth -= 2.0 * (1.0 - max(0.0, wall - 0.13) / 0.22)
        if worth > most:
            most, best_x, best_y = worth, go_x, go_y
    return best_x, best_y
