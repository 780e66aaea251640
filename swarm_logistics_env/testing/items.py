"""The check that no item is lost, doubled or created."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from swarm_logistics_env.policies.policy import Policy
from swarm_logistics_env.testing.conformance_errors import ConservationError
from swarm_logistics_env.testing.playing import Make, played
from swarm_logistics_env.warehouse import Warehouse
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
        policy: who steers, by name, path or as an object.
        seed: of the episode.
        steps: at most so many.

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
