"""Outputs by classes: one of several directions, speeds and grips instead of three numbers.

Where several directions are good, their mean is a slow one, and slow robots jam. A network that
says classes chooses one.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

N_DIRECTIONS = 32  # 2 pi k / 32 in the frame of the robot's motion
N_SPEEDS = 5  # 0, 1/4 .. 1 of the top speed
N_GRIPS = 3  # -1: open, 0: as it is, 1: hold
GROUPS = (N_DIRECTIONS, N_SPEEDS, N_GRIPS)
N_CLASSES = sum(GROUPS)
_ANGLES = 2.0 * math.pi * np.arange(N_DIRECTIONS) / N_DIRECTIONS
DIRECTIONS_ALONG = np.array([math.cos(angle) for angle in _ANGLES])
DIRECTIONS_ASIDE = np.array([math.sin(angle) for angle in _ANGLES])


def outputs_of(classes: NDArray[np.integer]) -> NDArray[np.float32]:
    """Return the outputs (N, 3), `motion.OUTPUTS`, of classes (N, 3): direction, speed, grip."""
    directions, speeds, grips = classes.T
    speed = speeds / (N_SPEEDS - 1)
    outputs = np.stack(
        [speed * DIRECTIONS_ALONG[directions], speed * DIRECTIONS_ASIDE[directions], grips - 1.0],
        axis=1,
    )
    return outputs.astype(np.float32)


def classes_of(outputs: NDArray[np.floating]) -> NDArray[np.int64]:
    """Return the classes (N, 3) that are nearest to outputs (N, 3)."""
    along, aside, gripper = outputs.T
    directions = np.rint(np.arctan2(aside, along) * N_DIRECTIONS / (2.0 * math.pi)) % N_DIRECTIONS
    speeds = np.rint(np.minimum(np.hypot(along, aside), 1.0) * (N_SPEEDS - 1))
    grips = np.rint(np.clip(gripper, -1.0, 1.0)) + 1.0
    return np.stack([directions, speeds, grips], axis=1).astype(np.int64)
