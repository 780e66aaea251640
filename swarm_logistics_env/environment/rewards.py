"""Named reward terms; an environment gives them their weights."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.core.code_files import import_callable
from swarm_logistics_env.core.errors import SetupError, suggest
from swarm_logistics_env.world.floor.floor_plan import NO_DOCK
from swarm_logistics_env.world.warehouse import Warehouse
from swarm_logistics_env.world.warehouse.state import NOBODY, WarehouseState

DEFAULT_WEIGHTS: Mapping[str, float] = {"delivery": 1.0}


class RewardTerms:
    """The weighted sum of named terms, one value per robot and step.

    Args:
        weights: term -> weight; see `REWARD_TERMS` for the terms. "my.py:term" or
            "package.module:term" is one of your own, whose module is imported, and so executed:
            a function of (world, before, after), see `Moment`, that returns what each robot earned
            in the step (N,), or one number for all.

    Attributes:
        pays_steadily: whether a step without a delivery may pay.

    Raises:
        SetupError: `weights` is not a dict, a term is unknown, or a weight is not a finite number.
    """

    def __init__(self, weights: Mapping[str, float] | None = None) -> None:
        if weights is not None and not isinstance(weights, Mapping):
            raise SetupError(
                f'rewards = {weights!r}: should be None or a dict, as {{"delivery": 1.0}}'
            )
        weights = DEFAULT_WEIGHTS if weights is None else weights
        for name, weight in weights.items():
            term_of(name)
            finite_number(f"rewards[{name!r}]", weight)
        self.reweigh(weights)

    def reweigh(self, weights: Mapping[str, float]) -> None:
        """Pay by other terms or weights from the next step on."""
        self._weights = dict(weights)
        self._terms = [(name, term_of(name), weight) for name, weight in weights.items()]
        self.pays_steadily = not _AT_DELIVERIES.issuperset(weights)

    def __getstate__(self) -> dict[str, Any]:
        # A function of the user's file is imported anew.
        return {name: value for name, value in vars(self).items() if name != "_terms"}

    def __setstate__(self, saved: dict[str, Any]) -> None:
        self.__dict__.update(saved)
        self.reweigh(self._weights)

    def begin(self, world: Warehouse) -> None:
        """Store the state at the start of an episode."""
        self._before = Moment(world)

    def pay(self, world: Warehouse) -> NDArray[np.float64]:
        """Return the reward of the step just taken, (N,): one number for each robot.

        Raises:
            SetupError: a term of one's own returned what is not finite.
        """
        before = self._before
        after = Moment(world)
        total = np.zeros(world.state.n_robots)
        for name, term, weight in self._terms:
            earned = term(world, before, after)
            if earned is not None:
                if name not in REWARD_TERMS:
                    _check_finite(name, earned)
                total += weight * earned
        self._before = after
        return total


class Moment:
    """The state between two steps: the terms compare that before a step with that after it.

    Args:
        world: the world in that state.

    Attributes:
        delivered: the number of items delivered so far.
        requested: which items are asked for (I,).
        carriers: the robot that carries each item (I,), or NOBODY.
        item_position, robot_position: (I, 2) and (N, 2) [m].
    """

    def __init__(self, world: Warehouse) -> None:
        state = world.state
        self.delivered = len(state.delivery_times)
        self.requested = state.item_requested
        self.carriers = state.item_carrier.copy()
        self.item_position = state.item_position.copy()
        self.robot_position = state.robot_position.copy()

    def carries_requested(self, state: WarehouseState) -> NDArray[np.bool_]:
        """Return which robots carry an item that is asked for (N,), as `state` does."""
        items = state.robot_item
        carries: NDArray[np.bool_] = (items != NOBODY) & self.requested[items]
        return carries

    def keeps(self, state: WarehouseState, robots: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Return which of these robots carried what they carry already, and it was requested."""
        items = state.robot_item[robots]
        keeps: NDArray[np.bool_] = self.requested[items] & (self.carriers[items] == robots)
        return keeps


Earned = NDArray[np.float64] | float | None  # per robot, the same for all, or nothing


def delivery(world: Warehouse, before: Moment, after: Moment) -> Earned:
    """Items delivered in this step, to every robot of the team."""
    return float(after.delivered - before.delivered) or None


def own_delivery(world: Warehouse, before: Moment, after: Moment) -> Earned:
    """Items that the robot itself delivered in this step."""
    if after.delivered == before.delivered:
        return None
    deliverers = world.state.delivered_by[before.delivered :]
    return np.bincount(deliverers, minlength=world.state.n_robots).astype(np.float64)


def on_time(world: Warehouse, before: Moment, after: Moment) -> Earned:
    """Items delivered in this step before their orders were due, to every robot of the team."""
    state = world.state
    due = state.delivered_due[before.delivered :]
    n_on_time = sum(time + _GRACE >= state.time for time in due)
    return float(n_on_time) or None


def lift_requested(world: Warehouse, before: Moment, after: Moment) -> Earned:
    """1 to the robot that took up a requested item, -1 to the one that let go of it.

    Nothing to one that cannot deliver (privileged: as `approach`).
    """
    state = world.state
    carriers = after.carriers
    items = np.flatnonzero(before.requested & after.requested & (carriers != before.carriers))
    if not items.size:
        return None
    reward = np.zeros(state.n_robots)
    delivers = state.delivers
    for item in items.tolist():
        carrier = int(carriers[item])
        previous_carrier = int(before.carriers[item])
        # One that was delivered and is asked for again does not lie where its carrier stands.
        is_back = after.delivered != before.delivered and carrier == NOBODY
        if is_back and (state.item_position[item] != state.robot_position[previous_carrier]).any():
            continue
        if carrier != NOBODY and delivers[carrier]:
            reward[carrier] += 1.0
        if previous_carrier != NOBODY and delivers[previous_carrier]:
            reward[previous_carrier] -= 1.0
    return reward


def approach(world: Warehouse, before: Moment, after: Moment) -> Earned:
    """Metres that the carrier of a requested item came nearer to the dock, on free floor.

    To the one that the request names, or else to the nearest.

    Privileged: no robot can sense it, so it may shape a reward but not an observation.
    """
    state = world.state
    floor = world.floor
    robots = np.flatnonzero(after.carries_requested(state))
    robots = robots[before.keeps(state, robots)]
    if not robots.size:
        return None
    reward = np.zeros(state.n_robots)
    docks = state.item_docks[state.robot_item[robots]]
    reward[robots] = np.minimum(floor.along(state.robot_position[robots], docks), floor.edge)
    reward[robots] -= np.minimum(floor.along(before.robot_position[robots], docks), floor.edge)
    return reward


def stocking(world: Warehouse, before: Moment, after: Moment) -> Earned:
    """Metres that the item a robot carries, requested or not, came nearer to the delivery area.

    The way counts from where the item lay, so no circle earns: carrying it back costs as much.
    What lies nearer is delivered sooner once it is requested; nearer than `STOCK_DISTANCE` it
    would be in the way. Privileged: as `approach`.
    """
    state = world.state
    floor = world.floor
    # The step in which a robot lets go still moves the item; one that was delivered lies elsewhere.
    carriers = np.where(after.carriers == NOBODY, before.carriers, after.carriers)
    if after.delivered != before.delivered:
        deliverers = state.delivered_by[before.delivered :]
        carriers[np.isin(before.carriers, deliverers)] = NOBODY
    items = np.flatnonzero(carriers != NOBODY)
    if not items.size:
        return None
    names_docks = (state.requested_docks != NOBODY).any()
    docks = state.item_docks[items] if names_docks else NO_DOCK
    nearest = floor.edge - STOCK_DISTANCE
    metres = np.minimum(floor.along(after.item_position[items], docks), nearest)
    metres -= np.minimum(floor.along(before.item_position[items], docks), nearest)
    # Who lets go of one may lift another at once: both count.
    return np.asarray(np.bincount(carriers[items], metres, state.n_robots), np.float64)


def contact(world: Warehouse, before: Moment, after: Moment) -> Earned:
    """Seconds that the robot touched a robot, a wall or an obstacle; weigh it negatively."""
    return world.state.robot_contact.astype(np.float64) * world.scenario.control_period


def collision(world: Warehouse, before: Moment, after: Moment) -> Earned:
    """Speed [m/s] at which the robot ran into others in this step, summed; weigh it negatively."""
    return world.state.contacts.closing


def blocked_request(world: Warehouse, before: Moment, after: Moment) -> Earned:
    """Seconds that a robot that cannot deliver held a requested item; weigh it negatively.

    A metre into the delivery area counts `SECONDS_A_METRE`, and the way out gives them back: an
    item that is let go there is found by nobody. Privileged: as `approach`.
    """
    state = world.state
    floor = world.floor
    robots = np.flatnonzero(after.carries_requested(state) & ~state.delivers)
    if not robots.size:
        return None
    reward = np.zeros(state.n_robots)
    reward[robots] = world.scenario.control_period
    robots = robots[before.keeps(state, robots)]
    depth = np.maximum(floor.along(state.robot_position[robots]), floor.edge)
    depth_before = np.maximum(floor.along(before.robot_position[robots]), floor.edge)
    reward[robots] += SECONDS_A_METRE * (depth - depth_before)
    return reward


SECONDS_A_METRE = 2.0
STOCK_DISTANCE = 1.5  # [m] from the delivery area

Term = Callable[[Warehouse, Moment, Moment], Earned]
REWARD_TERMS: dict[str, Term] = {
    "delivery": delivery,
    "own_delivery": own_delivery,
    "on_time": on_time,
    "lift_requested": lift_requested,
    "approach": approach,
    "stocking": stocking,
    "contact": contact,
    "collision": collision,
    "blocked_request": blocked_request,
}
_AT_DELIVERIES = {"delivery", "own_delivery", "on_time"}
_GRACE = 1e-6  # [s]; times are sums of periods


def term_of(name: str) -> Term:
    """Return the reward term of that name, or the one that "my.py:term" names.

    Raises:
        SetupError: there is none.
    """
    if name in REWARD_TERMS:
        return REWARD_TERMS[name]
    if ":" not in name:
        raise SetupError(f"no reward term {name!r}{suggest(name, REWARD_TERMS)}")
    term: Term = import_callable("reward term", name, SetupError)
    return term


def _check_finite(name: str, earned: Earned) -> None:
    values = np.ravel(np.asarray(earned, np.float64))
    finite = np.isfinite(values)
    if not finite.all():
        raise SetupError(f"reward term {name!r} = {values[~finite][0]}: should be finite")


def finite_number(name: str, value: float) -> float:
    """Return the value as a float.

    Raises:
        SetupError: it is not a number, or not finite.
    """
    if not isinstance(value, int | float | np.number) or not np.isfinite(value):
        raise SetupError(f"{name} = {value!r}: should be a finite number")
    return float(value)
