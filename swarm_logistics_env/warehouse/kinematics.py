"""From commands to wanted velocities: the kinematics of a holonomic or differential robot."""

from __future__ import annotations

import math

from swarm_logistics_env.kernels import kernel

from .structs import NOBODY, Capabilities, Numbers, Parameters, Robots

FORWARD, LEFT, TURN, GRIPPER, MESSAGE = range(5)  # columns of a command row; messages are the rest


@kernel
def first_not_finite(commands: Numbers) -> int:
    """Return the first row of commands (N, C) that is not finite; NOBODY if all are."""
    for row in range(len(commands)):
        for column in range(commands.shape[1]):
            if not math.isfinite(commands[row, column]):
                return row
    return NOBODY


@kernel
def refused_command(commands: Numbers, robots: Robots, able: Capabilities) -> int:
    """Return the place, row by row, of the first command that is not finite; NOBODY if all are.

    Rows of robots that ignore their commands may hold anything.
    """
    n_columns = commands.shape[1]
    for robot in range(len(commands)):
        if robots.present[robot] and able.obeys[robot]:
            for column in range(n_columns):
                if not math.isfinite(commands[robot, column]):
                    return int(robot * n_columns + column)
    return NOBODY


@kernel
def drive(
    commands: Numbers,
    robots: Robots,
    able: Capabilities,
    parameters: Parameters,
    wanted_velocity: Numbers,
) -> None:
    """Turn the robots and fill their wanted velocities (N, 2) [m/s] for one control period.

    Commands beyond [-1, 1] are cut, and the speed to the top speed whatever the direction. A robot
    turns as commanded and by its heading drift, unless its motor is dead, and drives along its mean
    direction; one that is not holonomic ignores `left`. Rows of robots that ignore their commands
    are ignored.
    """
    for robot in range(len(commands)):
        wanted_velocity[robot, 0] = 0.0
        wanted_velocity[robot, 1] = 0.0
        if not (robots.present[robot] and able.obeys[robot]):
            continue
        forward = min(max(commands[robot, FORWARD], -1.0), 1.0)
        left = min(max(commands[robot, LEFT], -1.0), 1.0) if parameters.is_holonomic else 0.0
        norm = math.sqrt(forward * forward + left * left)
        speed = able.max_speed[robot] / max(norm, 1.0)
        turn, most = min(max(commands[robot, TURN], -1.0), 1.0), able.max_turn_rate[robot]
        drift = robots.heading_drift[robot] if most > 0.0 else 0.0
        angle = (turn * most + drift) * parameters.control_period
        heading = robots.heading[robot]
        cosine, sine = math.cos(heading + 0.5 * angle), math.sin(heading + 0.5 * angle)
        wanted_velocity[robot, 0] = speed * (forward * cosine - left * sine)
        wanted_velocity[robot, 1] = speed * (forward * sine + left * cosine)
        if angle != 0.0:
            turned = heading + angle
            robots.heading[robot] = turned - 2.0 * math.pi * round(turned / (2.0 * math.pi))
