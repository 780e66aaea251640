"""No item is lost, doubled or conjured up."""

from __future__ import annotations

import numpy as np

from swarm_logistics_env.policies.policy import Policy
from swarm_logistics_env.testing.errors import ConservationError
from swarm_logistics_env.testing.playing import Make, played
from swarm_logistics_env.warehouse import Warehouse
from swarm_logistics_env.warehouse.state import CARRIED, DELIVERED, NOBODY, STORED


def check_conservation(
    make: Make, policy: Policy | str = "swarm-dt", seed: int = 0, steps: int = 500
) -> None:
    """Check that each item is at every moment stored, delivered, or carried by one robot.

    Without `restock`, as many items are delivered as deliveries were counted.

    Args:
        make: returns a new parallel environment.
        policy: who steers, by name, path or as an object.
        seed: of the episode.
        steps: at most so many.

    Raises:
        ConservationError: names the item and the step.
    """
    delivered = 0
    for moment in played(make, policy, seed, steps):
        wrong = _wrong_item(moment.world) or _wrong_count(moment.world, delivered)
        if wrong:
            raise ConservationError(f"at step {moment.step} {wrong}")
        delivered = moment.world.state.delivered


def _wrong_item(world: Warehouse) -> str | None:
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


def _wrong_count(world: Warehouse, before: int) -> str | None:
    state = world.state
    if state.delivered < before:
        return f"{state.delivered} items are delivered, but {before} were a step before"
    if len(state.delivered_by) != state.delivered:
        return f"{len(state.delivered_by)} robots are noted for {state.delivered} deliveries"
    lying = int(np.count_nonzero(state.item_status == DELIVERED))
    expected = 0 if world.scenario.restock else state.delivered
    if not world.scenario.restock and lying != expected:
        return f"{lying} items have left for {state.delivered} deliveries"
    return None
