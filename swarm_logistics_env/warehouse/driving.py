"""From commands to wanted velocities: the drive of a holonomic or differential robot."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.kernels import kernel


@kernel
def drive(
    commands: NDArray[np.float64],
    able: NDArray[np.bool_],
    max_speed: NDArray[np.float64],
    max_turn_rate: NDArray[np.float64],
    period: float,
    heading: NDArray[np.float64],
    wanted_velocity: NDArray[np.float64],
    sideways: bool = True,
) -> bool:
    """Turn the robots and fill their wanted velocities (N, 2) [m/s] for one control period.

    Commands beyond [-1, 1] are cut, and the speed to the top speed whatever the direction. A robot
    that turns drives along its mean direction; one that cannot go `sideways` ignores `left`.
    Rows of robots that are not able are ignored. Returns False, with nothing changed, if any other
    command is not finite.
    """
    for robot in range(commands.shape[0]):
        for column in range(commands.shape[1]):
            if able[robot] and not math.isfinite(commands[robot, column]):
                return False
    for robot in range(commands.shape[0]):
        wanted_velocity[robot, 0] = 0.0
        wanted_velocity[robot, 1] = 0.0
        if not able[robot]:
            continue
        forward = min(max(commands[robot, 0], -1.0), 1.0)
        left = min(max(commands[robot, 1], -1.0), 1.0) if sideways else 0.0
        norm = math.sqrt(forward * forward + left * left)
        speed = max_speed[robot] / max(norm, 1.0)
        turn = min(max(commands[robot, 2], -1.0), 1.0) * max_turn_rate[robot] * period
        cosine = math.cos(heading[robot] + 0.5 * turn)
        sine = math.sin(heading[robot] + 0.5 * turn)
        wanted_velocity[robot, 0] = speed * (forward * cosine - left * sine)
        wanted_velocity[robot, 1] = speed * (forward * sine + left * cosine)
        if turn != 0.0:
            turned = heading[robot] + turn
            heading[robot] = turned - 2.0 * math.pi * round(turned / (2.0 * math.pi))
    return True
