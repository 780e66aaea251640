"""The check that robots do not overlap."""

from __future__ import annotations

import numpy as np

from swarm_logistics_env.policies.policy import Policy
from swarm_logistics_env.testing.conformance_errors import OverlapError
from swarm_logistics_env.testing.playing import Make, played
from swarm_logistics_env.warehouse import Warehouse


def check_overlap(
    make: Make, policy: Policy | str = "swarm-dt", seed: int = 0, steps: int = 500
) -> None:
    """Check that two robots overlap by no more than they close in one physics step.

    Args:
        make: returns a new parallel environment.
        policy: who steers, by name, path or as an object.
        seed: of the episode.
        steps: at most so many.

    Raises:
        OverlapError: names the robots, the step and the depth.
    """
    speed = 0.0
    for moment in played(make, policy, seed, steps):
        world = moment.world
        # A step may begin before a change of the speed limit and end after it.
        allowed = max(speed, world.scenario.max_speed) * 2.0
        _check(world, allowed * world.scenario.physics_period, moment.step)
        speed = world.scenario.max_speed


def _check(world: Warehouse, allowed: float, step: int) -> None:
    here = np.flatnonzero(world.state.robot_present)
    position = world.state.robot_position[here]
    gaps = np.linalg.norm(position[:, None] - position[None], axis=2)
    np.fill_diagonal(gaps, np.inf)
    if not len(here):
        return
    depth = 2.0 * world.scenario.robot_radius - gaps
    deepest = np.unravel_index(int(np.argmax(depth)), depth.shape)
    # Negated, so that a position that is NaN fails too.
    if not depth[deepest] <= allowed:
        one, other = (int(here[place]) for place in deepest)
        raise OverlapError(
            f"robots {one} and {other} overlap by {depth[deepest]:.4f} m at step {step}: should "
            f"be at most {allowed:.4f} m, what two robots close in one physics step"
        )
