"""The rules of the warehouse: from grippers to loads, deliveries and the next request.

Items are no obstacles until no laden robot stands above them: the item collision mask.

An unladen robot may stand above items. Were those solid to it from the moment it lifts another,
they would shove it off, through its neighbours and walls where there is no room. So what it stands
above is masked (`Items.covered`), as is an item that is put down, and is solid again when laden
robots have left it.

To handle an item takes time: a robot stands for `handling_time` before what it does to it. It
lifts, puts down or delivers once the time is over, if it is able to then; else it has stood in
vain. Until then nothing has changed: the item that it lifts lies where it was, but nobody else can
lift it, and it carries what it puts down. With `dock_capacity` a delivery begins, and so is
counted, at least 1 / dock_capacity seconds after the one before, the oldest request first; robots
that wait for it drive as commanded.
"""

from __future__ import annotations

import math

from swarm_logistics_env.compiler.kernels import engine_kernel, inlined_kernel, kernel

from .batteries import use
from .commands import (
    DELIVERING,
    GRIPPER,
    IDLE,
    ITEM,
    KIND,
    LAST_STEP,
    LIFTING,
    PUTTING_DOWN,
    acts,
)
from .demand import ask, close_request, is_known_request, is_requested, takes
from .floor_cells import dock_at, is_in_sight
from .grid import look_around
from .layout import place_restocked
from .physics import EMPTY_ROBOT, FREE_ITEM, LADEN_ROBOT, NO_ONE, collide_with, put_item
from .structs import CARRIED, DELIVERED, NOBODY, STORED, Integers, World

_GRACE = 1e-6  # [s]; times are sums of periods


@inlined_kernel
def gripper_of(world: World, robot: int, command: float) -> float:
    """Return the gripper's command, or what it does by itself while a robot handles an item."""
    kind = world.robots.handling[robot, KIND]
    if kind == IDLE:
        return command
    if kind == LIFTING:
        return 1.0
    return -1.0 if kind == PUTTING_DOWN else 0.0


@inlined_kernel
def is_done(world: World, robot: int, kind: int, item: int) -> bool:
    """Return whether a robot has done this to an item; let it begin if it is idle."""
    if world.parameters.handling_steps == 0:
        return True
    handling = world.robots.handling
    step = world.progress.step[0]
    if handling[robot, KIND] == IDLE:
        handling[robot, KIND] = kind
        handling[robot, ITEM] = item
        handling[robot, LAST_STEP] = step + world.parameters.handling_steps
    is_same = handling[robot, KIND] == kind and handling[robot, ITEM] == item
    return bool(is_same and step >= handling[robot, LAST_STEP])


@inlined_kernel
def may_deliver(world: World, robot: int) -> bool:
    """Return whether a robot delivers already, or may begin; the dock is taken then."""
    progress = world.progress
    parameters = world.parameters
    if parameters.dock_period == 0.0 or world.robots.handling[robot, KIND] != IDLE:
        return True
    if progress.time[0] < progress.dock_free[0] - _GRACE:
        return False
    progress.dock_free[0] = progress.time[0] + parameters.dock_period
    return True


@kernel
def is_being_lifted(world: World, item: int) -> bool:
    """Return whether a robot is about to lift an item."""
    if world.parameters.handling_steps == 0:
        return False
    handling = world.robots.handling
    is_lifted = False
    for robot in range(len(handling)):
        is_lifted |= handling[robot, KIND] == LIFTING and handling[robot, ITEM] == item
    return is_lifted


@kernel
def item_lifted(world: World, robot: int) -> tuple[int, float]:
    """Return the item that a robot has lifted now, or NOBODY, and the square of its distance.

    It lifts nothing if it was shoved out of its reach.
    """
    item = world.robots.handling[robot, ITEM]
    dx = world.items.position[item, 0] - world.robots.position[robot, 0]
    dy = world.items.position[item, 1] - world.robots.position[robot, 1]
    square = dx * dx + dy * dy
    is_over = world.progress.step[0] >= world.robots.handling[robot, LAST_STEP]
    if is_over and square <= world.parameters.pickup_range**2:
        return item, square
    return NOBODY, math.inf


@kernel
def end_handling(world: World) -> None:
    """Make those robots idle whose handling time is over."""
    handling = world.robots.handling
    for robot in range(len(handling)):
        if handling[robot, LAST_STEP] <= world.progress.step[0]:
            handling[robot, KIND] = IDLE


_HOLD = 0.5
_OPEN = -0.5


@engine_kernel
def mask_below(world: World, robot: int) -> None:
    """Mask what stands below a robot that lifts."""
    items = world.items
    grid = world.item_grid
    nearby = world.nearby
    x = world.robots.position[robot, 0]
    y = world.robots.position[robot, 1]
    n_found = look_around(grid, x, y, reach_above(world, robot), NOBODY, nearby)
    for index in range(n_found):
        item = grid.members[nearby.slot[index]]
        if items.status[item] == STORED:
            items.covered[item] = 1
            collide_with(world.engine, world.engine.item_shapes[item], NO_ONE)


@engine_kernel
def unmask_left(world: World) -> None:
    """Make those masked items solid that no laden robot stands above any more.

    Both grids hold where things stand now. An item that is in none yet waits for the next step.
    """
    grid = world.item_grid
    nearby = world.nearby
    farthest = world.parameters.robot_radius + world.parameters.item_radius
    for slot in range(grid.start[-1]):
        item = grid.members[slot]
        if world.items.covered[item] == 0:
            continue
        x = grid.position[0, slot]
        y = grid.position[1, slot]
        n_found = look_around(world.robot_grid, x, y, farthest, NOBODY, nearby)
        is_below_laden = False
        for index in range(n_found):
            robot = world.robot_grid.members[nearby.slot[index]]
            is_above = nearby.square[index] <= reach_above(world, robot) ** 2
            is_below_laden |= is_above and world.robots.item[robot] != NOBODY
        if not is_below_laden:
            world.items.covered[item] = 0
            collide_with(world.engine, world.engine.item_shapes[item], FREE_ITEM)


@kernel
def reach_above(world: World, robot: int) -> float:
    """Return the distance [m] between centres up to which a robot stands above an item."""
    return float(world.robots.radius[robot] + world.parameters.item_radius)


@kernel
def carry_along(world: World) -> None:
    """Bring carried items to where their carriers are and note who is in the delivery area."""
    robots = world.robots
    items = world.items
    for robot in range(len(robots.item)):
        x = robots.position[robot, 0]
        y = robots.position[robot, 1]
        item = robots.item[robot]
        dock = dock_at(world, x, y)
        is_there = robots.present[robot] and dock != NOBODY
        robots.in_delivery[robot] = is_there and takes(world, dock, item)
        if item != NOBODY:
            items.position[item, 0] = x
            items.position[item, 1] = y


@engine_kernel
def open_grippers(world: World) -> None:
    """Put down what robots let go of.

    A requested item is let go of anywhere, another one only outside the delivery area.
    """
    robots = world.robots
    able = world.able
    commands = world.commands.now
    for robot in range(len(commands)):
        item = robots.item[robot]
        command = gripper_of(world, robot, commands[robot, GRIPPER])
        if item == NOBODY or not acts(world, robot) or command >= _OPEN:
            continue
        may_release = able.releases_inside[robot] and is_requested(world, item)
        if robots.in_delivery[robot] and not may_release:
            continue
        if is_done(world, robot, PUTTING_DOWN, item):
            remember(robots.memory, robot, item)
            put_down(world, robot)


@engine_kernel
def put_down(world: World, robot: int) -> None:
    """Let a robot's item lie where it is, covered."""
    robots = world.robots
    items = world.items
    engine = world.engine
    item = robots.item[robot]
    robots.item[robot] = NOBODY
    items.status[item] = STORED
    items.carrier[item] = NOBODY
    items.covered[item] = 1
    collide_with(engine, engine.robot_shapes[robot], EMPTY_ROBOT)
    put_item(engine, item, items.position)


@inlined_kernel
def remember(memory: Integers, robot: int, item: int) -> None:
    """Put `item` in front of a robot's memory, which forgets its oldest."""
    for index in range(memory.shape[1] - 1, 0, -1):
        memory[robot, index] = memory[robot, index - 1]
    if memory.shape[1] > 0:
        memory[robot, 0] = item


@inlined_kernel
def is_remembered(memory: Integers, robot: int, item: int) -> bool:
    """Return whether `item` is in a robot's memory."""
    is_in_memory = False
    for index in range(memory.shape[1]):
        is_in_memory |= memory[robot, index] == item
    return is_in_memory


@kernel
def wanted_item(world: World, robot: int) -> tuple[int, float]:
    """Return the item that `robot` would lift now, or NOBODY, and the square of its distance.

    The nearest in reach that it knows to be requested comes first, else the nearest that is not in
    its memory. A robot that lifts goes on with its item, and nobody else takes it.
    """
    robots = world.robots
    grid = world.item_grid
    nearby = world.nearby
    if robots.handling[robot, KIND] == LIFTING:
        return item_lifted(world, robot)
    x = robots.position[robot, 0]
    y = robots.position[robot, 1]
    n_found = look_around(grid, x, y, world.parameters.pickup_range, NOBODY, nearby)
    best = NOBODY
    best_square = math.inf
    is_best_requested = False
    for index in range(n_found):
        item = grid.members[nearby.slot[index]]
        square = nearby.square[index]
        if world.items.status[item] != STORED or is_being_lifted(world, item):
            continue
        is_asked_for = is_known_request(world, robot, item)
        is_first = is_asked_for and not is_best_requested
        if not is_first and (square >= best_square or is_asked_for != is_best_requested):
            continue
        if not is_asked_for and is_remembered(robots.memory, robot, item):
            continue
        position = world.items.position[item]
        if is_in_sight(world, x, y, position[0], position[1]):
            best = item
            best_square = square
            is_best_requested = is_asked_for
    return best, best_square


@engine_kernel
def close_grippers(world: World) -> None:
    """Lift what empty robots hold on to.

    If several want the same item, the nearest able one gets it, and the others choose again.
    """
    robots = world.robots
    able = world.able
    items = world.items
    claims = world.claims
    engine = world.engine
    commands = world.commands.now
    while True:
        is_settled = True
        for robot in range(len(commands)):
            is_able = acts(world, robot) and able.lifts[robot]
            is_free = robots.item[robot] == NOBODY
            command = gripper_of(world, robot, commands[robot, GRIPPER])
            if not is_free or not is_able or command <= _HOLD:
                continue
            item, square = wanted_item(world, robot)
            if item != NOBODY and (claims.robot[item] == NOBODY or square < claims.square[item]):
                claims.robot[item] = robot
                claims.square[item] = square
        for item in range(len(claims.robot)):
            robot = claims.robot[item]
            if robot == NOBODY:
                continue
            claims.robot[item] = NOBODY
            is_settled = False
            if not is_done(world, robot, LIFTING, item):
                continue
            use(world, robot, world.parameters.lifting_energy)
            robots.item[robot] = item
            items.status[item] = CARRIED
            items.carrier[item] = robot
            items.covered[item] = 0
            items.position[item, 0] = robots.position[robot, 0]
            items.position[item, 1] = robots.position[robot, 1]
            collide_with(engine, engine.item_shapes[item], NO_ONE)
            collide_with(engine, engine.robot_shapes[robot], LADEN_ROBOT)
            mask_below(world, robot)
        if is_settled:
            return


@inlined_kernel
def is_at_named_dock(world: World, request: int, robot: int) -> bool:
    """Return whether a robot is in the dock that a request names, if it names any."""
    dock = world.progress.requested_dock[request]
    if dock == NOBODY:
        return True
    position = world.robots.position[robot]
    return bool(dock_at(world, position[0], position[1]) == dock)


@engine_kernel
def deliver(world: World) -> tuple[int, bool]:
    """Deliver the requested items whose carriers can, the oldest request first, then the next.

    It clears the memory of every robot that is told of it; with `restock` the item comes back.

    Returns how many there were, and whether all that came back found room.
    """
    robots = world.robots
    items = world.items
    progress = world.progress
    engine = world.engine
    n_delivered = 0
    is_room = True
    index = 0
    while index < len(progress.requested) and progress.requested[index] != NOBODY:
        request = index
        item = progress.requested[index]
        robot = items.carrier[item]
        index += 1
        if robot == NOBODY or not robots.in_delivery[robot] or not world.able.delivers[robot]:
            continue
        if not is_at_named_dock(world, request, robot):
            continue
        if not may_deliver(world, robot) or not is_done(world, robot, DELIVERING, item):
            continue
        robots.item[robot] = NOBODY
        collide_with(engine, engine.robot_shapes[robot], EMPTY_ROBOT)
        for hearer in range(len(robots.memory)):
            if world.able.hears_requests[hearer]:
                robots.memory[hearer, :] = NOBODY
        items.status[item] = DELIVERED
        items.carrier[item] = NOBODY
        world.claims.delivered_by[n_delivered] = robot
        world.claims.delivered[n_delivered, :] = world.orders.open[request, :]
        n_delivered += 1
        progress.n_delivered[0] += 1
        if world.parameters.restock:
            if place_restocked(world, item):
                items.status[item] = STORED
                items.covered[item] = 1
                put_item(engine, item, items.position)
            else:
                is_room = False
        close_request(world, request)
        ask(world)
        index = 0  # what is asked for now may have waited here
    return n_delivered, is_room
