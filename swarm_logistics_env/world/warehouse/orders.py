"""Orders that come by themselves and wait, and requests that are put back when they last too long.

With `Scenario.orders` "next" nothing comes by itself: `demand` asks for an item when one was
delivered. Else an order comes at its time, drawn or listed in a file, and waits until one of the
`n_requests` open requests is free: the oldest comes first, or the most urgent.

Times are drawn as a Poisson process whose rate changes: at the highest rate, of which each is kept
with the probability of the rate at that time (thinning; Lewis and Shedler 1979).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from pydantic import NonNegativeFloat, NonNegativeInt

from swarm_logistics_env.compiler.kernels import inlined_kernel, kernel, uniform

from .demand import ask, close_request, drawn_item, is_ordered, next_dock, next_item
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
    Orders,
    World,
)


@dataclass(frozen=True)
class OrderMeasures:
    """How the orders of an episode were served; None: nothing to count.

    An outcome of a study's run has these fields, too: they become columns of its runs. Orders count
    that were delivered and those that were overdue at the end; the latter as if served then.

    Attributes:
        on_time: orders with a due time that were served by then.
        share_on_time: their share of all that have one.
        mean_tardiness: mean time by which these were late, 0 for those on time [s].
        p95_tardiness: 95th percentile of the same [s].
        longest_queue: most orders that were open or waited at a time; None: none came by itself.
        turned_away: orders that found no item or no room to wait; None: none came by itself.
        put_back: requests that were not served within `request_timeout`; None: there is none.
        all_served: whether nothing was asked for at the end, so that P is capped by the orders;
            None: none came by itself.
    """

    on_time: NonNegativeInt | None = None
    share_on_time: NonNegativeFloat | None = None
    mean_tardiness: NonNegativeFloat | None = None
    p95_tardiness: NonNegativeFloat | None = None
    longest_queue: NonNegativeInt | None = None
    turned_away: NonNegativeInt | None = None
    put_back: NonNegativeInt | None = None
    all_served: bool | None = None


_GRACE = 1e-6  # [s]; times are sums of periods


@kernel
def receive_orders(world: World) -> None:
    """Let the orders come whose time it is, and ask for items where requests are free."""
    if not world.parameters.has_orders:
        return
    orders = world.orders
    if len(orders.listed) > 0:
        read_listed(world)
    else:
        draw_orders(world)
    ask(world)
    n_open = 0
    for item in world.progress.requested:
        n_open += int(item != NOBODY)
    orders.longest_queue[0] = max(orders.longest_queue[0], n_open + orders.n_waiting[0])


@kernel
def read_listed(world: World) -> None:
    """Let the orders of the file come whose time it is."""
    orders = world.orders
    latest = world.progress.time[0] + _GRACE
    while orders.n_listed[0] < len(orders.listed):
        order = orders.listed[orders.n_listed[0]]
        if order[CAME] > latest:
            return
        orders.n_listed[0] += 1
        item = int(order[ITEM_ORDERED])
        if item == NOBODY:
            item = drawn_item(world, int(order[NUMBER]), orders.n_classes[0])
        elif not world.parameters.restock and is_gone(world, item):
            item = NOBODY
        dock = int(order[DOCK])
        if dock == NOBODY:
            dock = next_dock(world)
        let_wait(world, item, dock, order)


@kernel
def is_gone(world: World, item: int) -> bool:
    """Return whether an item was delivered for good, or is on order."""
    return bool(world.items.status[item] == DELIVERED or is_ordered(world, item))


@kernel
def draw_orders(world: World) -> None:
    """Let the orders come that were drawn for the time since the step before.

    Draws are a mean of 1 apart in the number of draws to be expected, so that another rate holds
    from the next step on.
    """
    orders = world.orders
    parameters = world.parameters
    key = world.items.order_key[0]
    n_parts = len(orders.shape)
    highest = orders.shape[0]
    for part in range(n_parts):
        highest = max(highest, orders.shape[part])
    rate = parameters.order_rate * highest  # of draws, the most at any time [1/s]
    if world.progress.step[0] > 0:
        orders.n_expected[0] += rate * parameters.control_period
    order = world.claims.order
    while orders.next_draw[0] <= orders.n_expected[0]:
        came = world.progress.time[0] - (orders.n_expected[0] - orders.next_draw[0]) / rate
        count = 2 * orders.n_drawn[0]
        part = int(came / parameters.order_cycle * n_parts) % n_parts
        comes = count > 0 and uniform(key, count + 1) * highest < orders.shape[part]
        orders.next_draw[0] -= math.log(1.0 - uniform(key, count))
        orders.n_drawn[0] += 1
        if comes:  # the first draw, at the start, is that of the first gap alone
            order[CAME] = came
            order[DUE] = came + parameters.due_after
            order[PRIORITY] = 0.0
            let_wait(world, next_item(world), next_dock(world), order)


@kernel
def let_wait(world: World, item: int, dock: int, order: Numbers) -> None:
    """Let an order wait behind the others, or turn it away."""
    orders = world.orders
    last = orders.n_waiting[0]
    if item == NOBODY or last == len(orders.waiting):
        orders.n_turned_away[0] += 1
        return
    orders.waiting[last, :] = order
    orders.waiting[last, ITEM_ORDERED] = item
    orders.waiting[last, DOCK] = dock
    orders.n_waiting[0] += 1


@kernel
def put_back_late(world: World) -> None:
    """Put back the requests that were open for too long, and ask for the next ones.

    One that is put back waits behind the others; without orders that wait, the item is asked for
    anew as others are.
    """
    longest = world.parameters.longest_request
    if longest == math.inf:
        return
    orders = world.orders
    orders.is_timed[0] = True
    requested = world.progress.requested
    order = world.claims.order
    index = 0
    while index < len(requested) and requested[index] != NOBODY:
        if world.progress.time[0] - orders.open[index, ASKED] < longest - _GRACE:
            index += 1
            continue
        order[:] = orders.open[index, :]
        close_request(world, index)
        ask(world)
        orders.n_put_back[0] += 1
        if world.parameters.has_orders:
            let_wait(world, int(order[ITEM_ORDERED]), int(order[DOCK]), order)
            ask(world)


@inlined_kernel
def is_all_served(world: World) -> bool:
    """Return whether nothing is asked for, and no order is to come."""
    if world.progress.requested[0] != NOBODY:
        return False
    orders = world.orders
    if not world.parameters.has_orders:
        return True
    if len(orders.listed) > 0:
        return bool(orders.n_listed[0] == len(orders.listed))
    is_empty = world.progress.n_delivered[0] == len(world.items.status)
    return bool(is_empty and not world.parameters.restock)


def order_measures(
    orders: Orders, time: float, delivery_times: Sequence[float], due_times: Sequence[float]
) -> OrderMeasures:
    """Return how the orders were served until `time` [s].

    Args:
        delivery_times: [s] of the orders that were served.
        due_times: [s] when each of these was due; infinite: never.
    """
    rows = np.concatenate([orders.open, orders.waiting[: orders.n_waiting.item()]])
    is_overdue = (rows[:, ITEM_ORDERED] != NOBODY) & (rows[:, DUE] < time)
    due = np.concatenate([due_times, rows[is_overdue, DUE]])
    served = np.concatenate([delivery_times, np.full(is_overdue.sum(), time)])
    tardiness = np.maximum(served - due, 0.0)[np.isfinite(due)]
    counts = OrderMeasures(put_back=orders.n_put_back.item() if orders.is_timed.item() else None)
    if orders.longest_queue.item() > 0:
        counts = replace(
            counts,
            longest_queue=orders.longest_queue.item(),
            turned_away=orders.n_turned_away.item(),
            all_served=bool((rows[:, ITEM_ORDERED] == NOBODY).all()),
        )
    if not tardiness.size:
        return counts
    n_on_time = int((tardiness <= _GRACE).sum())
    return replace(
        counts,
        on_time=n_on_time,
        share_on_time=round(n_on_time / tardiness.size, 9),
        mean_tardiness=round(float(tardiness.mean()), 9),
        p95_tardiness=round(float(np.quantile(tardiness, 0.95)), 9),
    )
