"""How a differential robot drives where it wants to: its body turns, and its memory with it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.kernels import kernel
from swarm_logistics_env.motion import memory as known


@kernel
def steer(widest: float, memory: NDArray[np.float64], commands: NDArray[np.float64]) -> None:
    """Turn commands (N, 4) to drive in a direction into turns and motion ahead or back.

    Args:
        widest: the largest turn of a control period [rad].
        memory: (N, N_COLUMNS); its directions are turned back by the robot's own turn.
        commands: forward and left as if the drive were holonomic; left becomes 0.
    """
    for robot in range(commands.shape[0]):
        x, y = commands[robot, 0], commands[robot, 1]
        speed = math.sqrt(x * x + y * y)
        if speed < 1e-6:
            continue
        angle, way = math.atan2(y, x), 1.0
        if abs(angle) > 0.5 * math.pi:
            # It drives as well backwards, so that it never turns by more than a quarter.
            angle, way = angle - math.copysign(math.pi, angle), -1.0
        turn = min(max(angle, -widest), widest)
        # It drives along its mean direction in the period, and slower the more that is off.
        commands[robot, 0] = way * speed * max(0.0, math.cos(angle - 0.5 * turn))
        commands[robot, 1] = 0.0
        commands[robot, 2] = turn / widest
        turn_back(turn, memory[robot])


@kernel
def turn_back(turn: float, own: NDArray[np.float64]) -> None:
    """Turn the directions in one memory by -turn [rad], as the body turns by `turn`."""
    cos, sin = math.cos(turn), math.sin(turn)
    for column in (known.HEADING_X, known.HOME_X):
        x, y = own[column], own[column + 1]
        own[column], own[column + 1] = cos * x + sin * y, cos * y - sin * x
    own[known.WALL] -= turn
