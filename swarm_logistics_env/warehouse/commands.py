"""Commands: which are refused, and the motion that they ask for."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.errors import CommandError
from swarm_logistics_env.kernels import kernel

from .structs import NOBODY, World

FORWARD, LEFT, TURN, GRIPPER, MESSAGE = range(5)  # columns of a command row; messages are the rest
# Columns of `Robots.handling`, and the kinds that the first one holds.
KIND, ITEM, LAST_STEP = range(3)
IDLE, LIFTING, PUTTING_DOWN, DELIVERING = range(4)


def not_finite(commands: NDArray[np.float64], index: int) -> CommandError:
    """Return the error about the command at that place, row by row."""
    row, column = divmod(index, commands.shape[1])
    return CommandError(f"commands[{row}, {column}] = {commands[row, column]}: should be finite")


@kernel
def refused_command(world: World) -> int:
    """Return the place, row by row, of the first command that is not finite; NOBODY if all are.

    Rows of robots that ignore their commands may hold anything.
    """
    commands = world.commands.now
    n_columns = commands.shape[1]
    for robot in range(len(commands)):
        if world.robots.present[robot] and world.able.obeys[robot]:
            for column in range(n_columns):
                if not math.isfinite(commands[robot, column]):
                    return int(robot * n_columns + column)
    return NOBODY


@kernel
def drive(world: World) -> None:
    """Turn the robots and fill their wanted velocities for one control period.

    Commands beyond [-1, 1] are cut, and the speed to the top speed whatever the direction. A robot
    turns as commanded and by its heading drift, unless its motor is dead, and drives along its mean
    direction; one that is not holonomic ignores `left`. Rows of robots that ignore their commands,
    or stand to handle an item, are ignored.
    """
    commands, robots, able = world.commands.now, world.robots, world.able
    parameters, wanted_velocity = world.parameters, world.engine.wanted_velocity
    for robot in range(len(commands)):
        wanted_velocity[robot, 0] = 0.0
        wanted_velocity[robot, 1] = 0.0
        if (
            not (robots.present[robot] and able.obeys[robot])
            or robots.handling[robot, KIND] != IDLE
        ):
            continue
        forward = min(max(commands[robot, FORWARD], -1.0), 1.0)
        left = min(max(commands[robot, LEFT], -1.0), 1.0) if parameters.is_holonomic else 0.0
        norm = math.sqrt(forward * forward + left * left)
        speed = able.max_speed[robot] / max(norm, 1.0)
        turn = min(max(commands[robot, TURN], -1.0), 1.0)
        max_turn_rate = able.max_turn_rate[robot]
        drift = robots.heading_drift[robot] if max_turn_rate > 0.0 else 0.0
        angle = (turn * max_turn_rate + drift) * parameters.control_period
        heading = robots.heading[robot]
        cosine, sine = math.cos(heading + 0.5 * angle), math.sin(heading + 0.5 * angle)
        wanted_velocity[robot, 0] = speed * (forward * cosine - left * sine)
        wanted_velocity[robot, 1] = speed * (forward * sine + left * cosine)
        if angle != 0.0:
            new_heading = heading + angle
            n_turns = round(new_heading / (2.0 * math.pi))
            robots.heading[robot] = new_heading - 2.0 * math.pi * n_turns
