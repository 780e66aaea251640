"""A control step in one compiled call, bodies' motion and all, without the interpreter's lock.

Items are no obstacles until no laden robot stands above them: the item collision mask.

An unladen robot may stand above items. Were those solid to it from the moment it lifts another,
they would shove it off, through its neighbours and walls where there is no room. So what it stands
above is masked (`Items.covered`), as is an item that is put down, and is solid again when laden
robots have left it.
"""

from __future__ import annotations

from swarm_logistics_env.kernels import kernel

from .demand import ask
from .grid import fill, look_around
from .logistics import (
    IDLE,
    carry_along,
    close_grippers,
    deliver,
    drive,
    end_handling,
    note_event,
    open_grippers,
    refused_command,
)
from .packing import unpacked_at
from .physics import FREE_ITEM, LIFTED, NO_ONE, PUT_DOWN, advance, collide_with, follow
from .sensing import disturb, fail_rangers, sense
from .structs import NOBODY, STORED, Commands, Numbers, Sensed, World
from .surroundings import run_timers, send_messages


@kernel
def mask_below_lifters(world: World, n_events: int) -> None:
    """Mask what stands below robots that lifted, by the events of this step."""
    events, items, grid, nearby = world.claims.events, world.items, world.item_grid, world.nearby
    for event in range(n_events):
        if events[event, 0] != LIFTED:
            continue
        position = world.robots.position[events[event, 1]]
        n_found = look_around(grid, position[0], position[1], reach_of(world), NOBODY, nearby)
        for index in range(n_found):
            item = grid.members[nearby.place[index]]
            if items.status[item] == STORED:
                items.covered[item] = 1
                collide_with(world.engine, world.engine.item_shapes[item], NO_ONE)


@kernel
def unmask_left(world: World) -> None:
    """Make those masked items solid that no laden robot stands above any more.

    Both grids hold where things stand now. An item that is in none yet waits for the next step.
    """
    grid, nearby = world.item_grid, world.nearby
    for place in range(grid.start[-1]):
        item = grid.members[place]
        if world.items.covered[item] == 0:
            continue
        x, y = grid.places[place, 0], grid.places[place, 1]
        n_found = look_around(world.robot_grid, x, y, reach_of(world), NOBODY, nearby)
        is_below_laden = False
        for index in range(n_found):
            robot = world.robot_grid.members[nearby.place[index]]
            is_below_laden |= world.robots.item[robot] != NOBODY
        if not is_below_laden:
            world.items.covered[item] = 0
            collide_with(world.engine, world.engine.item_shapes[item], FREE_ITEM)


@kernel
def reach_of(world: World) -> float:
    """Return the distance [m] between centres up to which a robot stands above an item."""
    return world.parameters.robot_radius + world.parameters.item_radius


@kernel
def begin(address: int) -> None:
    """Open the first requests of the world at `address`."""
    ask(unpacked_at(World, address))


@kernel
def perceive(address: int, rows: Sensed) -> None:
    """Run the timers and fill the observation rows (N, D) of the world at `address`."""
    world = unpacked_at(World, address)
    robots, items, progress = world.robots, world.items, world.progress
    run_timers(world)
    fill(world.robot_grid, robots.position, robots.present)
    for item in range(len(items.status)):
        world.nearby.is_free[item] = items.status[item] == STORED
    fill(world.item_grid, items.position, world.nearby.is_free)
    n_anchored = sense(world, rows)
    disturb(world, rows)
    fail_rangers(world, rows)
    progress.anchoring_seconds[0] += n_anchored * world.parameters.control_period


@kernel
def take_out(address: int, robot: int) -> None:
    """Take a robot out of the arena of the world at `address`; what it carries is put down."""
    world = unpacked_at(World, address)
    robots, items, engine = world.robots, world.items, world.engine
    item = robots.item[robot]
    if item != NOBODY:
        items.status[item] = STORED
        items.carrier[item] = NOBODY
        items.covered[item] = 1
        n_events = note_event(world.claims.events, 0, PUT_DOWN, robot, item)
        follow(engine, world.claims.events, n_events, items.position)
    collide_with(engine, engine.robot_shapes[robot], NO_ONE)
    robots.present[robot] = False
    robots.in_delivery[robot] = False
    robots.item[robot] = NOBODY
    robots.handling[robot, :] = IDLE
    robots.memory[robot, :] = NOBODY
    robots.position[robot, :] = 0.0
    robots.velocity[robot, :] = 0.0
    robots.heading[robot] = 0.0


@kernel
def step(address: int, rows: Sensed) -> bool:
    """Take a control step in the world at `address` and fill the observation rows (N, D).

    Returns whether there is something to tell: a delivery, faults that begin or end, no room for
    an item, a full log, the end of the time or of the requests, a change before the step, or a
    command that is refused, which leaves the world as it was.
    """
    world = unpacked_at(World, address)
    commands, progress, outcome = world.commands, world.progress, world.outcome
    outcome.refused[0] = refused_command(commands.now, world.robots, world.able)
    if outcome.refused[0] != NOBODY:
        return True
    log_command(commands)
    progress.step[0] += 1
    progress.time[0] = progress.step[0] * world.parameters.control_period
    move(world, commands.now)
    send_messages(world, commands.now)
    n_delivered, is_room = handle_items(world, commands.now)
    is_paused = progress.step[0] == progress.pause_step[0]
    if not is_paused:
        perceive(address, rows)
    outcome.n_delivered[0] = n_delivered
    outcome.is_paused[0] = is_paused
    outcome.is_room[0] = is_room
    is_over = progress.step[0] >= progress.last_step[0] or progress.requested[0] == NOBODY
    is_full = commands.n_logged[0] * len(commands.now) == len(commands.log)
    is_changed = progress.is_changed[0]
    progress.is_changed[0] = False
    return n_delivered > 0 or is_paused or not is_room or is_over or is_full or is_changed


@kernel
def log_command(commands: Commands) -> None:
    """Append the commands of this step to those that a pickle replays."""
    first = commands.n_logged[0] * len(commands.now)
    if first == len(commands.log):
        return  # the log was full before, and whoever takes this step over is told so again
    for robot in range(len(commands.now)):
        for column in range(commands.now.shape[1]):
            commands.log[first + robot, column] = commands.now[robot, column]
    commands.n_logged[0] += 1


@kernel
def move(world: World, commands: Numbers) -> None:
    """Turn and move the robots as commanded and as far as bodies let them."""
    robots, engine, parameters = world.robots, world.engine, world.parameters
    drive(commands, robots, world.able, parameters, engine.wanted_velocity)
    unmask_left(world)
    n_touching = 0
    for robot in range(len(robots.contact)):
        n_touching += int(robots.contact[robot])
    advance(engine, parameters, n_touching)
    bodies = engine.bodies.numbers
    for robot in range(len(robots.item)):
        is_there = 1.0 if robots.present[robot] else 0.0
        for axis in range(2):
            robots.position[robot, axis] = bodies[robot, axis] * is_there
            robots.velocity[robot, axis] = bodies[robot, 2 + axis] * is_there


@kernel
def handle_items(world: World, commands: Numbers) -> tuple[int, bool]:
    """Carry along, let go, lift and deliver; returns how many, and whether there was room."""
    carry_along(world)
    n_events = open_grippers(world, commands)
    n_events = close_grippers(world, commands, n_events)
    mask_below_lifters(world, n_events)
    n_events, n_delivered, is_room = deliver(world, n_events)
    end_handling(world)
    follow(world.engine, world.claims.events, n_events, world.items.position)
    return n_delivered, is_room
