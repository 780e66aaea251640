"""A failed robot cannot do what its failure mode took from it."""

from __future__ import annotations

import numpy as np

from swarm_logistics_env.policies.policy import Policy
from swarm_logistics_env.testing.conformance_errors import FaultsError
from swarm_logistics_env.testing.playing import Make, Moment, played, robot_of
from swarm_logistics_env.warehouse.faults import FAILURE_MODES
from swarm_logistics_env.warehouse.state import NOBODY


def check_faults(
    make: Make, policy: Policy | str = "swarm-dt", seed: int = 0, steps: int = 500
) -> None:
    """Check that failed robots do not do what their failure modes exclude.

    Robots in FM2 (and dead) lift nothing anew, those in FM4 (and dead) deliver nothing, those
    removed are gone from the arena and from `agents` for good.

    Args:
        make: returns a new parallel environment in which robots fail.
        policy: who steers, by name, path or as an object.
        seed: of the episode.
        steps: at most so many.

    Raises:
        FaultsError: names the robot, its failure mode and the step; or nobody failed in so many
            steps, so that nothing was checked.
    """
    did_anybody_fail = False
    held: tuple[tuple[str, ...], ...] = ()
    carried, delivered, gone = np.zeros(0, np.int64), 0, set[int]()
    for moment in played(make, policy, seed, steps):
        state = moment.world.state
        did_anybody_fail |= any(state.failure_modes)
        gone |= {robot for robot, modes in enumerate(state.failure_modes) if "removed" in modes}
        _check_gone(moment, gone)
        for robot, before in enumerate(held):
            # A mode that holds before and after a step held throughout it.
            modes = [FAILURE_MODES[m] for m in before if m in state.failure_modes[robot]]
            took = state.robot_item[robot] not in (carried[robot], NOBODY)
            if took and not all(mode.lifts for mode in modes):
                _complain(moment, robot, before, f"lifts item {state.robot_item[robot]}")
            if robot in state.delivered_by[delivered:] and not all(m.delivers for m in modes):
                _complain(moment, robot, before, "delivers")
        held, carried, delivered = state.failure_modes, state.robot_item.copy(), state.delivered
    if not did_anybody_fail:
        raise FaultsError(
            f"nobody failed in {steps} steps of seed {seed}, so nothing was checked: should be an "
            "environment with faults, as FaultInjection(env, mode)"
        )


def _check_gone(moment: Moment, gone: set[int]) -> None:
    present = {robot for robot in gone if moment.world.state.robot_present[robot]}
    acting = gone & {robot_of(agent) for agent in moment.env.agents}
    for robot in sorted(present | acting):
        _complain(moment, robot, ("removed",), "is still there")


def _complain(moment: Moment, robot: int, modes: tuple[str, ...], what: str) -> None:
    raise FaultsError(f"robot {robot}, failed in {', '.join(modes)}, {what} at step {moment.step}")
