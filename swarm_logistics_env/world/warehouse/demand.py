"""What is asked for: the open requests, and which item the next one is for.

`n_requests` of them are open at a time, oldest first. A delivery closes one, and the next is drawn:
in cycles of all items, or each by itself from a keyed stream of its own; or it is one of the
orders that wait, see `orders`. An item may be asked for
twice at a time where delivered items come back; else it is asked for once, as it leaves for good.
With `request_docks` "random" each request names the dock that takes its item, from a stream.
"""

from __future__ import annotations

import math

from swarm_logistics_env.compiler.kernels import inlined_kernel, kernel, uniform

from .structs import (
    ASKED,
    CAME,
    DELIVERED,
    DOCK,
    DUE,
    ITEM_ORDERED,
    NOBODY,
    NUMBER,
    PRIORITY,
    Numbers,
    World,
)

_GRACE = 1e-6  # [s]; times are sums of periods


@inlined_kernel
def is_requested(world: World, item: int) -> bool:
    """Return whether a request for `item` is open."""
    requested = world.progress.requested
    is_open = False
    for index in range(len(requested)):
        is_open |= requested[index] == item
    return is_open


@kernel
def was_told(world: World, robot: int, item: int) -> bool:
    """Return whether word of a request for `item` reached a robot: it may be late or lost."""
    parameters = world.parameters
    requested = world.progress.requested
    key = world.robots.hearing_key[robot]
    is_told = False
    for index in range(len(requested)):
        order = world.orders.open[index]
        since = world.progress.time[0] - order[ASKED]
        is_here = requested[index] == item and since >= parameters.request_delay - _GRACE
        is_told |= is_here and uniform(key, int(order[NUMBER])) >= parameters.request_loss
    return is_told


@inlined_kernel
def is_known_request(world: World, robot: int, item: int) -> bool:
    """Return whether `robot` was told of an open request for `item`."""
    is_open = bool(world.able.hears_requests[robot] and is_requested(world, item))
    return is_open and (world.parameters.tells_all or was_told(world, robot, item))


@kernel
def is_ordered(world: World, item: int) -> bool:
    """Return whether `item` is asked for, or an order for it waits, or will come by its number."""
    orders = world.orders
    is_on_order = is_requested(world, item)
    for index in range(orders.n_waiting[0]):
        is_on_order |= orders.waiting[index, ITEM_ORDERED] == item
    for index in range(orders.n_listed[0], len(orders.listed)):
        is_on_order |= orders.listed[index, ITEM_ORDERED] == item
    return is_on_order


@kernel
def ask(world: World) -> None:
    """Ask for items until `n_requests` requests are open or there is nothing to ask for."""
    requested = world.progress.requested
    orders = world.orders
    for index in range(len(requested)):
        if requested[index] != NOBODY:
            continue
        order = orders.open[index]
        if world.parameters.has_orders:
            take_waiting(world, order)
        else:
            order[ITEM_ORDERED] = next_item(world)
            order[DOCK] = next_dock(world)
            order[CAME] = world.progress.time[0]
            order[DUE] = world.progress.time[0] + world.parameters.due_after
            order[PRIORITY] = 0.0
        requested[index] = int(order[ITEM_ORDERED])
        world.progress.requested_dock[index] = int(order[DOCK])
        order[ASKED] = world.progress.time[0]
        order[NUMBER] = orders.n_asked[0]
        orders.n_asked[0] += int(requested[index] != NOBODY)


@kernel
def take_waiting(world: World, order: Numbers) -> None:
    """Fill the row `order` with the next order that waits, which no longer does; or with nobody.

    An order is turned away if its item has left for good since it came.
    """
    orders = world.orders
    while orders.n_waiting[0] > 0:
        first = next_waiting(world)
        order[:] = orders.waiting[first, :]
        orders.n_waiting[0] -= 1
        for index in range(first, orders.n_waiting[0]):
            orders.waiting[index, :] = orders.waiting[index + 1, :]
        if world.items.status[int(order[ITEM_ORDERED])] != DELIVERED:
            return
        orders.n_turned_away[0] += 1
    order[ITEM_ORDERED] = NOBODY
    order[DOCK] = NOBODY


@kernel
def next_waiting(world: World) -> int:
    """Return which of the orders that wait, one or more, is the next to be asked for."""
    waiting = world.orders.waiting
    first = 0
    if world.parameters.is_urgent_first:
        for index in range(1, world.orders.n_waiting[0]):
            is_higher = waiting[index, PRIORITY] > waiting[first, PRIORITY]
            is_equal = waiting[index, PRIORITY] == waiting[first, PRIORITY]
            if is_higher or (is_equal and waiting[index, DUE] < waiting[first, DUE]):
                first = index
    return first


@kernel
def close_request(world: World, closed: int) -> None:
    """Close a request, by its place, whose item was delivered; all for it if it left for good."""
    requested = world.progress.requested
    docks = world.progress.requested_dock
    item = requested[closed]
    has_left = world.items.status[item] == DELIVERED
    n_open = 0
    for index in range(len(requested)):
        if index != closed and not (has_left and requested[index] == item):
            requested[n_open] = requested[index]
            docks[n_open] = docks[index]
            world.orders.open[n_open, :] = world.orders.open[index, :]
            n_open += 1
    requested[n_open:] = NOBODY
    docks[n_open:] = NOBODY


@kernel
def next_dock(world: World) -> int:
    """Return the dock that the next request names, or NOBODY: any takes it."""
    progress = world.progress
    if not world.parameters.draws_docks:
        return NOBODY
    number = uniform(world.items.dock_key[0], progress.n_docks_drawn[0])
    progress.n_docks_drawn[0] += 1
    return int(number * world.floor.n_docks)


@inlined_kernel
def takes(world: World, dock: int, item: int) -> bool:
    """Return whether a dock takes an item, or NOBODY: all but those that are wanted elsewhere."""
    if not world.parameters.names_docks or item == NOBODY:
        return True
    progress = world.progress
    is_taken = False
    is_wanted = False
    for index in range(len(progress.requested)):
        if progress.requested[index] == item:
            is_wanted = True
            is_taken |= progress.requested_dock[index] == dock
    return is_taken or not is_wanted


@kernel
def next_item(world: World) -> int:
    """Return the item of the next request, or NOBODY if there is none to ask for."""
    if world.parameters.is_independent:
        return drawn_item(world, 0, 1)
    progress = world.progress
    total = 0.0
    for item in range(len(world.items.status)):
        total += weight_of(world, item)
    if total == 0.0:
        return NOBODY
    chosen_item = NOBODY
    while chosen_item == NOBODY:
        chosen_item = next_of_cycle(world)
        if chosen_item == NOBODY:
            progress.cycle[0] += 1
        progress.asked_last[0] = chosen_item
    return chosen_item


@kernel
def drawn_item(world: World, kind: int, n_kinds: int) -> int:
    """Return an item drawn by popularity, of those i with i % n_kinds == kind; or NOBODY."""
    items = world.items
    progress = world.progress
    total = 0.0
    for item in range(kind, len(items.status), n_kinds):
        total += weight_of(world, item)
    if total == 0.0:
        return NOBODY
    chosen_item = NOBODY
    remaining = total * uniform(items.demand_key[0], progress.n_drawn[0])
    progress.n_drawn[0] += 1
    for item in range(kind, len(items.status), n_kinds):
        weight = weight_of(world, item)
        if weight > 0.0 and remaining >= 0.0:  # of equal numbers by rounding, the last one
            chosen_item = item
        remaining -= weight
    return chosen_item


@kernel
def next_of_cycle(world: World) -> int:
    """Return the item that this cycle asks for after its last one, or NOBODY.

    Each item draws a number in every cycle; the lowest comes first, of equal ones the first item.
    """
    keys = world.items.request_key
    cycle = world.progress.cycle[0]
    last_item = world.progress.asked_last[0]
    last_number = uniform(keys[last_item], cycle) if last_item != NOBODY else -1.0
    chosen_item = NOBODY
    lowest_number = math.inf
    for item in range(len(keys)):
        number = uniform(keys[item], cycle)
        is_next = number > last_number or (number == last_number and item > last_item)
        if is_next and number < lowest_number and weight_of(world, item) > 0.0:
            chosen_item = item
            lowest_number = number
    return chosen_item


@kernel
def weight_of(world: World, item: int) -> float:
    """Return how often an item is asked for beside item 0; 0: it cannot be, now."""
    parameters = world.parameters
    is_away = world.items.status[item] == DELIVERED
    if is_away or (not parameters.restock and is_ordered(world, item)):
        return 0.0
    return float(1.0 / (item + 1.0) ** parameters.popularity_exponent)
