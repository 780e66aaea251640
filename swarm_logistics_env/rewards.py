"""Named reward terms; how much each counts is configuration."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.errors import SetupError, suggest
from swarm_logistics_env.warehouse import Warehouse
from swarm_logistics_env.warehouse.state import NOBODY

DEFAULT_WEIGHTS: Mapping[str, float] = {"delivery": 1.0}


class RewardTerms:
    """The weighted sum of named terms, one value per robot and step.

    Args:
        weights: term -> weight; see `REWARD_TERMS` for the terms.

    Raises:
        SetupError: a term is unknown or its weight is not a finite number.
    """

    def __init__(self, weights: Mapping[str, float] | None = None) -> None:
        self.weights = dict(DEFAULT_WEIGHTS if weights is None else weights)
        for name, weight in self.weights.items():
            if name not in REWARD_TERMS:
                raise SetupError(f"no reward term {name!r}{suggest(name, REWARD_TERMS)}")
            if isinstance(weight, str) or not np.isfinite(weight):
                raise SetupError(f"rewards[{name!r}] = {weight!r}: should be a finite number")

    def begin(self, world: Warehouse) -> None:
        """Note how an episode starts."""
        self._note(world)

    def pay(self, world: Warehouse) -> NDArray[np.float64]:
        """Return what the step just taken earns each robot, (N,); an absent robot earns 0."""
        total = np.zeros(world.state.n_robots)
        for name, weight in self.weights.items():
            total += weight * REWARD_TERMS[name](self, world)
        self._note(world)
        return np.where(self._was_present, total, 0.0)

    def _note(self, world: Warehouse) -> None:
        state = world.state
        self._delivered = state.delivered
        self._carrier = carrier_of_requested(world)
        self._requested = state.requested
        self._carrier_x = state.robot_position[self._carrier, 0] if self._carrier >= 0 else 0.0
        self._was_present = state.robot_present.copy()

    def delivery(self, world: Warehouse) -> NDArray[np.float64]:
        """Items delivered in this step, to every robot of the team."""
        new = world.state.delivered - self._delivered
        return np.full(world.state.n_robots, float(new))

    def own_delivery(self, world: Warehouse) -> NDArray[np.float64]:
        """Items that the robot itself delivered in this step."""
        new = world.state.delivered_by[self._delivered :]
        return np.bincount(new, minlength=world.state.n_robots).astype(np.float64)

    def lift_requested(self, world: Warehouse) -> NDArray[np.float64]:
        """1 to the robot that took up the requested item, -1 to the one that let go of it."""
        paid = np.zeros(world.state.n_robots)
        carrier = carrier_of_requested(world)
        if world.state.requested == self._requested and carrier != self._carrier:
            if carrier != NOBODY:
                paid[carrier] += 1.0
            if self._carrier != NOBODY:
                paid[self._carrier] -= 1.0
        return paid

    def approach(self, world: Warehouse) -> NDArray[np.float64]:
        """Metres that the requested item's carrier came nearer to the delivery area.

        Privileged: no robot can sense it, so it may shape a reward but not an observation.
        """
        paid = np.zeros(world.state.n_robots)
        carrier = carrier_of_requested(world)
        if carrier != NOBODY and carrier == self._carrier:
            edge = world.scenario.storage_width
            x = world.state.robot_position[carrier, 0]
            paid[carrier] = min(x, edge) - min(self._carrier_x, edge)
        return paid

    def contact(self, world: Warehouse) -> NDArray[np.float64]:
        """Seconds that the robot touched a robot, a wall or an obstacle; weigh it negatively."""
        return world.state.robot_contact.astype(np.float64) * world.scenario.control_period


REWARD_TERMS: dict[str, Callable[[RewardTerms, Warehouse], NDArray[np.float64]]] = {
    "delivery": RewardTerms.delivery,
    "own_delivery": RewardTerms.own_delivery,
    "lift_requested": RewardTerms.lift_requested,
    "approach": RewardTerms.approach,
    "contact": RewardTerms.contact,
}


def carrier_of_requested(world: Warehouse) -> int:
    """Return the robot that carries the requested item, or NOBODY."""
    requested = world.state.requested
    return NOBODY if requested == NOBODY else int(world.state.item_carrier[requested])
