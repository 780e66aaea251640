"""Where a robot is and whither it looks: the frame in which it senses everything."""

from __future__ import annotations

from typing import NamedTuple

from swarm_logistics_env.compiler.kernels import inlined_kernel


class Pose(NamedTuple):
    """The position and the direction of a robot."""

    x: float  # [m]
    y: float  # [m]
    cosine: float  # of its heading
    sine: float


@inlined_kernel
def in_frame(pose: Pose, x: float, y: float) -> tuple[float, float]:
    """Return how far (x, y) [m] lies forward and to the left of the robot."""
    dx = x - pose.x
    dy = y - pose.y
    return dx * pose.cosine + dy * pose.sine, dy * pose.cosine - dx * pose.sine
