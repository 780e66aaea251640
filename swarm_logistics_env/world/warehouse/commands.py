"""Commands: which are refused, and the motion that they ask for."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swarm_logistics_env.compiler.kernels import inlined_kernel, kernel
from swarm_logistics_env.core.errors import CommandError

from .structs import NOBODY, Numbers, World

FORWARD, LEFT, TURN, GRIPPER, MESSAGE = range(5)  # columns of a command row; messages are the rest
# Columns of `Robots.handling`, and the kinds that the first one holds.
KIND, ITEM, LAST_STEP = range(3)
IDLE, LIFTING, PUTTING_DOWN, DELIVERING = range(4)


def as_array(commands: ArrayLike, shape: tuple[int, int]) -> NDArray[np.float64]:
    """Return commands as an array (N, C) of a shape; messages that are left out are zeros.

    Raises:
        CommandError: they are no real numbers, or their shape is another.
    """
    try:
        array = np.asarray(commands)
    except (TypeError, ValueError, RuntimeError) as error:  # a tensor with a gradient: the last
        raise CommandError(f"commands should be an array of numbers: {error}") from None
    if array.dtype.kind not in "fiub":  # NumPy makes numbers of texts and times, too
        raise CommandError(f"commands should be numbers: real ones, not {array.dtype}")
    n_robots, n_columns = shape
    if array.shape == shape:
        return array
    if array.shape == (n_robots, MESSAGE):
        return np.pad(array, ((0, 0), (0, n_columns - MESSAGE)))
    raise CommandError(f"commands of shape {array.shape}: should be {shape}")


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


@inlined_kernel
def acts(world: World, robot: int) -> bool:
    """Return whether a robot follows its commands: it is there, obeys, and has energy."""
    robots = world.robots
    is_able = robots.present[robot] and world.able.obeys[robot]
    return bool(is_able and not robots.is_empty[robot])


@inlined_kernel
def may_drive(world: World, robot: int) -> bool:
    """Return whether a robot drives as commanded: it acts, and handles no item."""
    return bool(acts(world, robot) and world.robots.handling[robot, KIND] == IDLE)


@inlined_kernel
def wanted_motion(world: World, robot: int) -> tuple[float, float, float, float, float]:
    """Return what a robot wants: forward, left, the speed [m/s] they scale, turn and drift [rad/s].

    Commands beyond [-1, 1] are cut, and the speed to the top speed whatever the direction. A robot
    turns as commanded and by its heading drift, unless its motor is dead; one that is not holonomic
    ignores `left`.
    """
    command = world.commands.now[robot]
    able = world.able
    forward = min(max(command[FORWARD], -1.0), 1.0)
    left = min(max(command[LEFT], -1.0), 1.0) if able.is_holonomic[robot] else 0.0
    norm = math.sqrt(forward * forward + left * left)
    speed = able.max_speed[robot] / max(norm, 1.0)
    turn = min(max(command[TURN], -1.0), 1.0)
    max_turn_rate = able.max_turn_rate[robot]
    drift = world.robots.heading_drift[robot] if max_turn_rate > 0.0 else 0.0
    return forward, left, speed, turn * max_turn_rate, drift


@kernel
def list_motions(world: World, motions: Numbers) -> None:
    """Fill rows (N, 3) of wanted forward and left velocity [m/s] and turn rate [rad/s]."""
    motions[:] = 0.0
    for robot in range(len(motions)):
        if may_drive(world, robot):
            forward, left, speed, turn_rate, drift = wanted_motion(world, robot)
            motions[robot, 0] = speed * forward
            motions[robot, 1] = speed * left
            motions[robot, 2] = turn_rate + drift


@kernel
def drive(world: World) -> None:
    """Turn the robots and fill their wanted velocities for one control period.

    A robot drives along its mean direction while it turns. One that may not drive stands.
    """
    robots = world.robots
    wanted_velocity = world.engine.wanted_velocity
    for robot in range(len(world.commands.now)):
        wanted_velocity[robot, 0] = 0.0
        wanted_velocity[robot, 1] = 0.0
        if not may_drive(world, robot):
            robots.turn_rate[robot] = -robots.heading_drift[robot]
            continue
        forward, left, speed, turn_rate, drift = wanted_motion(world, robot)
        robots.turn_rate[robot] = turn_rate + drift - robots.heading_drift[robot]
        angle = (turn_rate + drift) * world.parameters.control_period
        heading = robots.heading[robot]
        cosine = math.cos(heading + 0.5 * angle)
        sine = math.sin(heading + 0.5 * angle)
        wanted_velocity[robot, 0] = speed * (forward * cosine - left * sine)
        wanted_velocity[robot, 1] = speed * (forward * sine + left * cosine)
        if angle != 0.0:
            new_heading = heading + angle
            n_turns = round(new_heading / (2.0 * math.pi))
            robots.heading[robot] = new_heading - 2.0 * math.pi * n_turns
