"""Contacts: how often and how fast robots run into each other, and what that does to them.

All is counted at the ends of control steps. A contact is the beginning of an overlap of two robots'
discs; walls, obstacles and items do not count, a failed robot does as long as it is there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydantic import NonNegativeFloat

from swarm_logistics_env.compiler.kernels import kernel

from .structs import N_ACCELERATIONS, ContactCounts, World

FAST = 1.0  # [m/s] at which a contact is fast if it closes faster
DEEP = 0.01  # [m] that an overlap has to exceed
# Accelerations are counted by their root, as a root is the same bits everywhere: 0.25 m/s2 wide
# bins at 16 m/s2, and up to 1000 m/s2 in all.
_BINS_PER_ROOT = 32.0


@dataclass(frozen=True)
class ContactMeasures:
    """What the robots of an episode met, over all that are in the arena; None: nothing to count.

    An outcome of a study's run has these fields, too: they become columns of its runs.

    Attributes:
        contacts_per_robot_minute: how often a robot begins to overlap another [1/min]; a contact
            counts for both.
        fast_contacts: share of the contacts that close faster than 1 m/s: in the step before, the
            two approach each other along the line of their centres at more than that.
        overlap_share: share of the control steps at whose end any two overlap by more than 10 mm.
        mean_acceleration: change of a robot's velocity from step to step over its duration, in
            length [m/s2].
        p95_acceleration: 95th percentile of the same [m/s2], within 0.1 at the usual 15.
    """

    contacts_per_robot_minute: NonNegativeFloat | None = None
    fast_contacts: NonNegativeFloat | None = None
    overlap_share: NonNegativeFloat | None = None
    mean_acceleration: NonNegativeFloat | None = None
    p95_acceleration: NonNegativeFloat | None = None


def contact_measures(counts: ContactCounts, n_steps: int, seconds: float) -> ContactMeasures:
    """Return what was counted in so many control steps, which took so many seconds together."""
    n_robot_steps = int(counts.accelerations.sum())
    if n_robot_steps == 0:
        return ContactMeasures()
    n_contacts = counts.n_contacts.item()
    robot_minutes = n_robot_steps * (seconds / n_steps) / 60.0
    return ContactMeasures(
        contacts_per_robot_minute=round(2 * n_contacts / robot_minutes, 9),
        fast_contacts=round(counts.n_fast.item() / n_contacts, 9) if n_contacts else None,
        overlap_share=round(counts.n_deep_steps.item() / n_steps, 9),
        mean_acceleration=round(counts.acceleration_sum.item() / n_robot_steps, 9),
        p95_acceleration=round(_percentile(counts.accelerations, 0.95), 9),
    )


def _percentile(accelerations: NDArray[np.int64], share: float) -> float:
    """Return the acceleration [m/s2] below which that share lies, evenly spread within a bin."""
    up_to = np.cumsum(accelerations)
    wanted = share * up_to[-1]
    index = int(np.searchsorted(up_to, wanted))
    low, high = ((edge / _BINS_PER_ROOT) ** 2 for edge in (index, index + 1))
    beyond = (up_to[index] - wanted) / accelerations[index]
    return float(high - beyond * (high - low))


@kernel
def count_motion(world: World) -> None:
    """Count the accelerations of a step whose bodies have moved, the robots' own numbers not yet.

    Notes where the robots were and how fast, for `count_overlap`.
    """
    counts = world.contacts
    robots = world.robots
    bodies = world.engine.bodies
    period = world.parameters.control_period
    total = counts.acceleration_sum[0]
    for robot in range(len(robots.item)):
        counts.closing[robot] = 0.0
        for axis in range(2):
            counts.position_before[robot, axis] = robots.position[robot, axis]
            counts.velocity_before[robot, axis] = robots.velocity[robot, axis]
        if robots.present[robot]:
            change_x = bodies[robot, 2] - robots.velocity[robot, 0]
            change_y = bodies[robot, 3] - robots.velocity[robot, 1]
            acceleration = math.sqrt(change_x * change_x + change_y * change_y) / period
            total += acceleration
            index = min(int(math.sqrt(acceleration) * _BINS_PER_ROOT), N_ACCELERATIONS - 1)
            counts.accelerations[index] += 1
    counts.acceleration_sum[0] = total


@kernel
def count_overlap(me: int, other: int, square: float, world: World) -> None:
    """Count what two robots that overlap add, once for both.

    `square` [m2] is of the distance between their centres.
    """
    counts = world.contacts
    apart = world.robots.radius[me] + world.robots.radius[other]  # of discs that just touch
    if apart - math.sqrt(square) > DEEP:
        counts.is_deep[0] = True
    position = counts.position_before
    velocity = counts.velocity_before
    x = position[other, 0] - position[me, 0]
    y = position[other, 1] - position[me, 1]
    square_before = x * x + y * y
    if square_before < apart * apart:
        return  # they did before; at the start of an episode, too, where nobody was anywhere
    rate_x = velocity[other, 0] - velocity[me, 0]
    rate_y = velocity[other, 1] - velocity[me, 1]
    counts.n_contacts[0] += 1
    closing = -(x * rate_x + y * rate_y)
    if closing > FAST * math.sqrt(square_before):
        counts.n_fast[0] += 1
    if closing > 0.0:
        counts.closing[me] += closing / math.sqrt(square_before)
        counts.closing[other] += closing / math.sqrt(square_before)


@kernel
def count_step(world: World) -> None:
    """Count a step after all that overlap were."""
    counts = world.contacts
    if counts.is_deep[0]:
        counts.n_deep_steps[0] += 1
    counts.is_deep[0] = False
