"""What a robot knows of itself: its load, its timer and its odometry."""

from __future__ import annotations

import math

from swarm_logistics_env import observations as row
from swarm_logistics_env.kernels import inlined_kernel

from .rangers import Pose
from .structs import NOBODY, Sensed, World


@inlined_kernel
def feel_itself(me: int, pose: Pose, world: World, out: Sensed) -> None:
    """Fill the end of a row: load, delivery area, timer, velocity and contact."""
    robots, parameters = world.robots, world.parameters
    velocity_x, velocity_y = robots.velocity[me, 0], robots.velocity[me, 1]
    forward = velocity_x * pose.cosine + velocity_y * pose.sine
    left = velocity_y * pose.cosine - velocity_x * pose.sine
    limit = parameters.max_speed
    carried, timer, requested = robots.item[me], robots.timer[me], world.progress.requested[0]
    runs = not math.isnan(timer)
    out[row.CARRYING] = 1.0 if carried != NOBODY else 0.0
    out[row.CARRYING_REQUESTED] = 1.0 if carried != NOBODY and carried == requested else 0.0
    out[row.IN_DELIVERY_AREA] = 1.0 if robots.in_delivery[me] else 0.0
    out[row.TIMER_RUNS] = 1.0 if runs else 0.0
    out[row.TIMER] = timer if runs else parameters.timer_limit
    out[row.VELOCITY] = min(max(forward, -limit), limit)
    out[row.VELOCITY + 1] = min(max(left, -limit), limit)
    out[row.CONTACT] = 1.0 if robots.contact[me] else 0.0
