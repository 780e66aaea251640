"""What is asked for: the open requests, and which item the next one is for.

`n_requests` of them are open at a time, oldest first. A delivery closes one, and the next is drawn:
in cycles of all items, or each by itself from a keyed stream of its own. An item may be asked for
twice at a time where delivered items come back; else it is asked for once, as it leaves for good.
"""

from __future__ import annotations

import math

from swarm_logistics_env.kernels import inlined_kernel, kernel, uniform

from .structs import DELIVERED, NOBODY, World


@inlined_kernel
def is_requested(world: World, item: int) -> bool:
    """Return whether a request for `item` is open."""
    requested = world.progress.requested
    is_open = False
    for index in range(len(requested)):
        is_open |= requested[index] == item
    return is_open


@kernel
def ask(world: World) -> None:
    """Ask for items until `n_requests` requests are open or there is nothing to ask for."""
    requested = world.progress.requested
    for index in range(len(requested)):
        if requested[index] == NOBODY:
            requested[index] = next_item(world)


@kernel
def close_request(world: World, item: int) -> None:
    """Close the oldest request for an item that was delivered; all of them if it left for good."""
    requested = world.progress.requested
    n_kept = 0
    n_closed = 0
    n_to_close = len(requested) if world.items.status[item] == DELIVERED else 1
    for index in range(len(requested)):
        open_item = requested[index]
        if open_item == item and n_closed < n_to_close:
            n_closed += 1
        else:
            requested[n_kept] = open_item
            n_kept += 1
    requested[n_kept:] = NOBODY


@kernel
def next_item(world: World) -> int:
    """Return the item of the next request, or NOBODY if there is none to ask for."""
    items = world.items
    progress = world.progress
    total = 0.0
    for item in range(len(items.status)):
        total += weight_of(world, item)
    if total == 0.0:
        return NOBODY
    chosen_item = NOBODY
    if world.parameters.is_independent:
        remaining = total * uniform(items.demand_key[0], progress.n_drawn[0])
        progress.n_drawn[0] += 1
        for item in range(len(items.status)):
            weight = weight_of(world, item)
            if weight > 0.0 and remaining >= 0.0:  # of equal numbers by rounding, the last one
                chosen_item = item
            remaining -= weight
        return chosen_item
    while chosen_item == NOBODY:
        chosen_item = next_of_cycle(world)
        if chosen_item == NOBODY:
            progress.cycle[0] += 1
        progress.asked_last[0] = chosen_item
    return chosen_item


@kernel
def next_of_cycle(world: World) -> int:
    """Return the item that this cycle asks for after its last one, or NOBODY.

    Each item draws a number in every cycle; the lowest comes first, of equal ones the first item.
    """
    keys, cycle, last_item = (
        world.items.request_key,
        world.progress.cycle[0],
        world.progress.asked_last[0],
    )
    last_number = uniform(keys[last_item], cycle) if last_item != NOBODY else -1.0
    chosen_item, lowest_number = NOBODY, math.inf
    for item in range(len(keys)):
        number = uniform(keys[item], cycle)
        is_next = number > last_number or (number == last_number and item > last_item)
        if is_next and number < lowest_number and weight_of(world, item) > 0.0:
            chosen_item, lowest_number = item, number
    return chosen_item


@kernel
def weight_of(world: World, item: int) -> float:
    """Return how often an item is asked for beside item 0; 0: it cannot be, now."""
    parameters = world.parameters
    is_away = world.items.status[item] == DELIVERED
    if is_away or (not parameters.restock and is_requested(world, item)):
        return 0.0
    return float(1.0 / (item + 1.0) ** parameters.popularity_exponent)
