"""A heading held against the walls: the way home that a drifting gyro does not spoil.

Three neighbouring beams that meet one wall tell how the robot stands to it, up to quarter turns.
That tells how fast the gyro drifts, so that a direction is remembered for minutes. It holds in
rooms with walls at right angles; where a robot sees no wall it reckons on with the drift it found.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import observations as row
from swarm_logistics_env.kernels import kernel

BEAM_ANGLE = 2.0 * math.pi / row.N_BEAMS
QUARTER = 0.5 * math.pi
STRAIGHT = 0.05  # [m] that the middle one of three points on a wall may lie aside
LEAST_GAIN = 0.15  # the share of a deviation that is corrected after the first sightings
SETTLING_TIME = 1.0  # [s], so that the drift is not judged by the noise of the first sightings


@kernel
def wall_angle(sensed: NDArray[np.float32]) -> float:
    """Return the direction of the nearest wall in the robot's frame, 0 to pi/2 [rad]; -1: none."""
    first = row.RANGE_WALLS
    nearest, farthest = 0, sensed[first]
    for beam in range(row.N_BEAMS):
        if sensed[first + beam] < sensed[first + nearest]:
            nearest = beam
        farthest = max(farthest, sensed[first + beam])
    before, after = (nearest - 1) % row.N_BEAMS, (nearest + 1) % row.N_BEAMS
    a, b, c = sensed[first + before], sensed[first + nearest], sensed[first + after]
    # In a room every robot has a beam that meets nothing, or too long a one to be used.
    if max(a, c) >= farthest:
        return -1.0
    angle = BEAM_ANGLE * nearest
    ax, ay = a * math.cos(angle - BEAM_ANGLE), a * math.sin(angle - BEAM_ANGLE)
    bx, by = b * math.cos(angle), b * math.sin(angle)
    cx, cy = c * math.cos(angle + BEAM_ANGLE), c * math.sin(angle + BEAM_ANGLE)
    x, y = cx - ax, cy - ay
    length = max(math.sqrt(x * x + y * y), 1e-6)
    if abs((bx - ax) * y - (by - ay) * x) / length > STRAIGHT:
        return -1.0
    return math.atan2(y, x) % QUARTER
