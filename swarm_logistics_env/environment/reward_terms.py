"""The reward terms: one compiled pass over a world pays all of them, but those of one's own."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, NamedTuple

from swarm_logistics_env.compiler.addresses import unpacked_at
from swarm_logistics_env.compiler.kernels import engine_kernel
from swarm_logistics_env.world.floor.floor_plan import NO_DOCK
from swarm_logistics_env.world.floor.ways import Ways, way_along
from swarm_logistics_env.world.warehouse import Warehouse
from swarm_logistics_env.world.warehouse.demand import is_requested
from swarm_logistics_env.world.warehouse.structs import (
    DUE,
    NOBODY,
    Flags,
    Integers,
    Numbers,
    Sensed,
    World,
)

SECONDS_A_METRE = 2.0
STOCK_DISTANCE = 1.5  # [m] from the delivery area
_GRACE = 1e-6  # [s]; times are sums of periods

# Numbers of terms.
DELIVERY, OWN_DELIVERY, ON_TIME, LIFT_REQUESTED, APPROACH = range(5)
STOCKING, CONTACT, COLLISION, BLOCKED_REQUEST, HELD_INSIDE = range(5, 10)


class Moment(NamedTuple):
    """The state between two steps: the terms compare that before a step with that after it."""

    delivered: int  # items so far
    requested: Annotated[Flags, "I"]  # which items are asked for
    carriers: Annotated[Integers, "I"]  # the robot that carries each item, or NOBODY
    item_position: Annotated[Numbers, "I", 2]  # [m]
    robot_position: Annotated[Numbers, "N", 2]  # [m]


def moment_of(world: Warehouse) -> Moment:
    """Return the state of the world now, in arrays of its own."""
    state = world.state
    return Moment(
        state.delivered,
        state.item_requested,
        state.item_carrier.copy(),
        state.item_position.copy(),
        state.robot_position.copy(),
    )


class Payment(NamedTuple):
    """What the pass over a world reads and writes; T terms in the order of their weights."""

    before: Moment  # the step that is paid, but for `delivered`
    ways: Ways
    terms: Annotated[Integers, "T"]  # numbers in `REWARD_TERMS`, or NOBODY: one of one's own
    weights: Annotated[Numbers, "T"]
    earned: Annotated[Numbers, "T", "N"]  # by each term; of one's own terms filled before
    total: Annotated[Numbers, "N"]


@engine_kernel
def pay_worlds(worlds: Integers, rewards: Sensed) -> None:
    """Pay the robots of several worlds for their latest step.

    Args:
        worlds: (W, 3) addresses of world and `Payment`, and the first of the world's rows.
        rewards: (R,) filled in these rows; 0 for robots that are absent.
    """
    for index in range(len(worlds)):
        address, payment, first = worlds[index]
        pay_robots(address, payment)
        present = unpacked_at(World, address).robots.present
        total = unpacked_at(Payment, payment).total
        for robot in range(len(total)):
            rewards[first + robot] = total[robot] * present[robot]


@engine_kernel
def pay_robots(address: int, payment_address: int) -> None:
    """Fill `Payment.total` for the latest step of the world at `address`."""
    world = unpacked_at(World, address)
    payment = unpacked_at(Payment, payment_address)
    payment.total[:] = 0.0
    for row in range(len(payment.terms)):
        earned = payment.earned[row]
        fill_earned(world, payment, payment.terms[row], earned)
        for robot in range(len(earned)):
            payment.total[robot] += payment.weights[row] * earned[robot]
    before = payment.before
    before.carriers[:] = world.items.carrier
    before.item_position[:] = world.items.position
    before.robot_position[:] = world.robots.position
    for item in range(len(before.requested)):
        before.requested[item] = is_requested(world, item)


@engine_kernel
def fill_earned(world: World, payment: Payment, wanted: int, earned: Numbers) -> None:
    """Fill what a term of that number earned the robots (N,); leave it if that is NOBODY."""
    if wanted != NOBODY:
        earned[:] = 0.0
    if wanted == DELIVERY:
        delivery(world, payment, earned)
    elif wanted == OWN_DELIVERY:
        own_delivery(world, payment, earned)
    elif wanted == ON_TIME:
        on_time(world, payment, earned)
    elif wanted == LIFT_REQUESTED:
        lift_requested(world, payment, earned)
    elif wanted == APPROACH:
        approach(world, payment, earned)
    elif wanted == STOCKING:
        stocking(world, payment, earned)
    elif wanted == CONTACT:
        contact(world, payment, earned)
    elif wanted == COLLISION:
        collision(world, payment, earned)
    elif wanted == BLOCKED_REQUEST:
        blocked_request(world, payment, earned)
    elif wanted == HELD_INSIDE:
        held_inside(world, payment, earned)


@engine_kernel
def delivery(world: World, payment: Payment, earned: Numbers) -> None:
    """Items delivered in this step, to every robot of the team."""
    earned[:] = world.outcome.n_delivered[0]


@engine_kernel
def own_delivery(world: World, payment: Payment, earned: Numbers) -> None:
    """Items that the robot itself delivered in this step."""
    for delivered in range(world.outcome.n_delivered[0]):
        earned[world.claims.delivered_by[delivered]] += 1.0


@engine_kernel
def on_time(world: World, payment: Payment, earned: Numbers) -> None:
    """Items delivered in this step before their orders were due, to every robot of the team."""
    for delivered in range(world.outcome.n_delivered[0]):
        if world.claims.delivered[delivered, DUE] + _GRACE >= world.progress.time[0]:
            earned += 1.0


@engine_kernel
def lift_requested(world: World, payment: Payment, earned: Numbers) -> None:
    """1 to the robot that took up a requested item, -1 to the one that let go of it.

    Nothing to one that cannot deliver (privileged: as `approach`).
    """
    before = payment.before
    delivers = world.able.delivers
    for item in range(len(before.carriers)):
        carrier = world.items.carrier[item]
        previous = before.carriers[item]
        stays_requested = before.requested[item] and is_requested(world, item)
        if carrier == previous or not stays_requested:
            continue
        # One that was delivered and is asked for again does not lie where its carrier stands.
        if carrier == NOBODY and world.outcome.n_delivered[0] > 0:
            position = world.items.position[item]
            stand = world.robots.position[previous]
            if position[0] != stand[0] or position[1] != stand[1]:
                continue
        if carrier != NOBODY and delivers[carrier]:
            earned[carrier] += 1.0
        if previous != NOBODY and delivers[previous]:
            earned[previous] -= 1.0


@engine_kernel
def approach(world: World, payment: Payment, earned: Numbers) -> None:
    """Metres that the carrier of a requested item came nearer to the dock, on free floor.

    To the one that the request names, or else to the nearest.

    Privileged: no robot can sense it, so it may shape a reward but not an observation.
    """
    before = payment.before
    ways = payment.ways
    for robot in range(len(earned)):
        if holds_requested(world, robot) and held_requested(world, before, robot):
            dock = dock_of(world, world.robots.item[robot])
            along = way_along(ways, world.robots.position[robot], dock)
            along_before = way_along(ways, before.robot_position[robot], dock)
            earned[robot] = min(along, ways.edge) - min(along_before, ways.edge)


@engine_kernel
def stocking(world: World, payment: Payment, earned: Numbers) -> None:
    """Metres that the item a robot carries, requested or not, came nearer to the delivery area.

    The way counts from where the item lay, so no circle earns: carrying it back costs as much.
    What lies nearer is delivered sooner once it is requested; nearer than `STOCK_DISTANCE` it
    would be in the way. Privileged: as `approach`.
    """
    before = payment.before
    ways = payment.ways
    nearest = ways.edge - STOCK_DISTANCE
    for item in range(len(before.carriers)):
        # The step in which a robot lets go still moves the item; one delivered lies elsewhere.
        carrier = world.items.carrier[item]
        if carrier == NOBODY:
            carrier = before.carriers[item]
        if carrier != NOBODY and not has_delivered(world, before.carriers[item]):
            dock = dock_of(world, item)
            along = way_along(ways, world.items.position[item], dock)
            along_before = way_along(ways, before.item_position[item], dock)
            # Who lets go of one may lift another at once: both count.
            earned[carrier] += min(along, nearest) - min(along_before, nearest)


@engine_kernel
def contact(world: World, payment: Payment, earned: Numbers) -> None:
    """Seconds that the robot touched a robot, a wall or an obstacle; weigh it negatively."""
    for robot in range(len(earned)):
        if world.robots.contact[robot]:
            earned[robot] = world.parameters.control_period


@engine_kernel
def collision(world: World, payment: Payment, earned: Numbers) -> None:
    """Speed [m/s] at which the robot ran into others in this step, summed; weigh it negatively."""
    earned[:] = world.contacts.closing


@engine_kernel
def blocked_request(world: World, payment: Payment, earned: Numbers) -> None:
    """Seconds that a robot that cannot deliver held a requested item; weigh it negatively.

    A metre into the delivery area counts `SECONDS_A_METRE`, and the way out gives them back: an
    item that is let go there is found by nobody. Privileged: as `approach`.
    """
    before = payment.before
    ways = payment.ways
    for robot in range(len(earned)):
        if world.able.delivers[robot] or not holds_requested(world, robot):
            continue
        earned[robot] = world.parameters.control_period
        if held_requested(world, before, robot):
            depth = max(way_along(ways, world.robots.position[robot], NO_DOCK), ways.edge)
            depth_before = max(way_along(ways, before.robot_position[robot], NO_DOCK), ways.edge)
            earned[robot] += SECONDS_A_METRE * (depth - depth_before)


@engine_kernel
def held_inside(world: World, payment: Payment, earned: Numbers) -> None:
    """1 to the robot that brings an unrequested item into the delivery area, -1 when that ends.

    It ends where the robot leaves with it or lets go of it. That the item is asked for, and so
    delivered at once, costs nothing. Privileged: as `approach`.
    """
    before = payment.before
    ways = payment.ways
    for item in range(len(before.carriers)):
        carrier = world.items.carrier[item]
        previous = before.carriers[item]
        if is_requested(world, item) or (carrier == NOBODY and previous == NOBODY):
            continue
        along = way_along(ways, world.items.position[item], NO_DOCK)
        along_before = way_along(ways, before.item_position[item], NO_DOCK)
        is_held = carrier != NOBODY and along >= ways.edge
        was_held = previous != NOBODY and along_before >= ways.edge
        if is_held and was_held and carrier == previous:
            continue
        if is_held:
            earned[carrier] += 1.0
        is_asked_for = before.requested[item] or has_delivered(world, previous)
        if was_held and not is_asked_for:
            earned[previous] -= 1.0


@engine_kernel
def dock_of(world: World, item: int) -> int:
    """Return the dock that the oldest request for an item names, or `NO_DOCK`."""
    for request in range(len(world.progress.requested)):
        if world.progress.requested[request] == item:
            return int(world.progress.requested_dock[request])
    return NO_DOCK


@engine_kernel
def has_delivered(world: World, robot: int) -> bool:
    """Return whether a robot delivered in this step."""
    for delivered in range(world.outcome.n_delivered[0]):
        if world.claims.delivered_by[delivered] == robot:
            return True
    return False


@engine_kernel
def holds_requested(world: World, robot: int) -> bool:
    """Return whether a robot carries an item that is asked for."""
    item = world.robots.item[robot]
    return item != NOBODY and is_requested(world, item)


@engine_kernel
def held_requested(world: World, before: Moment, robot: int) -> bool:
    """Return whether a robot carried already what it carries, and that was asked for."""
    item = world.robots.item[robot]
    return bool(before.requested[item] and before.carriers[item] == robot)


Term = Callable[[World, Payment, Numbers], None]  # fills what the robots earned (N,), zeros before
# Their order is that of the numbers above.
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
    "held_inside": held_inside,
}
