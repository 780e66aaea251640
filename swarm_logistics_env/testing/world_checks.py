"""Checks of the warehouse: items are conserved, robots keep apart, failed robots do not act."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from swarm_logistics_env.policies.policy import Policy
from swarm_logistics_env.testing.playing import (
    ConservationError,
    FaultsError,
    Make,
    Moment,
    OverlapError,
    played,
    robot_of,
)
from swarm_logistics_env.warehouse import Warehouse
from swarm_logistics_env.warehouse.failure_modes import failure_mode
from swarm_logistics_env.warehouse.state import CARRIED, DELIVERED, NOBODY, STORED


class Count(NamedTuple):
    """Deliveries so far, items that left with them, and whether items come back now."""

    delivered: int
    gone: int
    restock: bool


def counted(world: Warehouse) -> Count:
    """Return what is counted now."""
    gone = int(np.count_nonzero(world.state.item_status == DELIVERED))
    return Count(world.state.delivered, gone, world.scenario.restock)


def check_conservation(
    make: Make, policy: Policy | str = "swarm-dt", seed: int = 0, steps: int = 500
) -> None:
    """Check that each item is at every moment stored, delivered, or carried by one robot.

    Without `restock`, an item leaves with every delivery.

    Args:
        make: returns a new parallel environment.
        policy: the policy that plays: a name, a path, or the object.
        seed: the episode's seed.
        steps: the largest number of steps to play.

    Raises:
        ConservationError: names the item and the step.
    """
    before: Count | None = None
    for moment in played(make, policy, seed, steps):
        wrong = wrong_item(moment.world) or wrong_count(moment.world, before)
        if wrong:
            raise ConservationError(f"at step {moment.step} {wrong}")
        before = counted(moment.world)


def wrong_item(world: Warehouse) -> str | None:
    """Return in words which item is not stored, carried or delivered as it should be."""
    state = world.state
    if len(state.item_status) != world.scenario.n_items:
        return f"there are {len(state.item_status)} items: should be {world.scenario.n_items}"
    for item, status in enumerate(state.item_status.tolist()):
        hands = np.flatnonzero(state.robot_item == item).tolist()
        noted = int(state.item_carrier[item])
        if status not in (STORED, CARRIED, DELIVERED):
            return f"item {item} has status {status}: should be stored, carried or delivered"
        expected = [noted] if status == CARRIED else []
        if hands != expected or (status == CARRIED) != (noted != NOBODY):
            return (
                f"item {item} of status {status} and carrier {noted} is in the hands of robots "
                f"{hands}: should be {expected}"
            )
        if hands and not state.robot_present[hands[0]]:
            return f"item {item} is carried by robot {hands[0]}, who is not there"
        if not np.isfinite(state.item_position[item]).all():
            return f"item {item} is at {state.item_position[item]}: should be finite"
    return None


def wrong_count(world: Warehouse, before: Count | None) -> str | None:
    """Return in words what is wrong with the deliveries since `before`, None: since the reset."""
    state, now = world.state, counted(world)
    before = before or Count(0, 0, now.restock)
    if now.delivered < before.delivered:
        return f"{now.delivered} items are delivered, but {before.delivered} were a step before"
    if len(state.delivered_by) != now.delivered:
        return f"{len(state.delivered_by)} robots are noted for {now.delivered} deliveries"
    # If `restock` changed during the step, either value may have held.
    news = now.delivered - before.delivered
    expected = {before.gone + (0 if restock else news) for restock in (now.restock, before.restock)}
    if now.gone not in expected:
        return f"{now.gone} items have left for {now.delivered} deliveries"
    return None


def check_overlap(
    make: Make, policy: Policy | str = "swarm-dt", seed: int = 0, steps: int = 500
) -> None:
    """Check that two robots overlap by no more than they close in one physics step.

    Args:
        make: returns a new parallel environment.
        policy: the policy that plays: a name, a path, or the object.
        seed: the episode's seed.
        steps: the largest number of steps to play.

    Raises:
        OverlapError: names the robots, the step and the depth.
    """
    speed = 0.0
    for moment in played(make, policy, seed, steps):
        world = moment.world
        # A step may begin before a change of the speed limit and end after it.
        allowed = max(speed, world.scenario.max_speed) * 2.0
        _check_gaps(world, allowed * world.scenario.physics_period, moment.step)
        speed = world.scenario.max_speed


def _check_gaps(world: Warehouse, allowed: float, step: int) -> None:
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


def check_faults(
    make: Make, policy: Policy | str = "swarm-dt", seed: int = 0, steps: int = 500
) -> None:
    """Check that failed robots do not do what their failure modes exclude.

    Robots in FM2 (and dead) lift nothing anew, those in FM4 (and dead) deliver nothing, those
    removed are gone from the arena and from `agents` for good.

    Args:
        make: returns a new parallel environment in which robots fail.
        policy: the policy that plays: a name, a path, or the object.
        seed: the episode's seed.
        steps: the largest number of steps to play.

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
            modes = [failure_mode(m) for m in before if m in state.failure_modes[robot]]
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
