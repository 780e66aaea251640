"""A control step in one compiled call, bodies' motion and all, without the interpreter's lock."""

from __future__ import annotations

from swarm_logistics_env.compiler.addresses import unpacked_at
from swarm_logistics_env.compiler.kernels import engine_kernel, kernel

from .batteries import run_batteries
from .commands import drive, list_motions, refused_command
from .contacts import count_motion, count_step
from .demand import ask
from .grid import fill
from .logistics import (
    carry_along,
    close_grippers,
    deliver,
    end_handling,
    open_grippers,
    unmask_left,
)
from .orders import is_all_served, put_back_late, receive_orders
from .physics import advance
from .radio import run_timers, send_messages
from .sensing import sense
from .structs import NOBODY, STORED, Commands, Numbers, Sensed, World


@engine_kernel
def begin(address: int) -> None:
    """Open the first requests of the world at `address`."""
    world = unpacked_at(World, address)
    receive_orders(world)
    ask(world)
    world.orders.is_served[0] = is_all_served(world)


@engine_kernel
def perceive(address: int, rows: Sensed) -> None:
    """Run the timers and fill the observation rows (N, D) of the world at `address`."""
    world = unpacked_at(World, address)
    robots = world.robots
    items = world.items
    progress = world.progress
    run_timers(world)
    fill(world.robot_grid, robots.position, robots.present)
    for item in range(len(items.status)):
        world.nearby.is_free[item] = items.status[item] == STORED
    fill(world.item_grid, items.position, world.nearby.is_free)
    n_anchored = sense(world, rows)
    count_step(world)
    progress.anchoring_seconds[0] += n_anchored * world.parameters.control_period


@engine_kernel
def step(address: int, rows: Sensed) -> bool:
    """Take a control step in the world at `address` and fill the observation rows (N, D).

    In this order: robots are driven and moved, messages sent, items carried, put down, lifted and
    delivered, then all is sensed; if faults begin or end, `Warehouse.take` senses after them.

    Returns whether there is something to tell: a delivery, faults that begin or end, no room for
    an item, a full log, the end of the time or of the requests, a change before the step, or a
    command that is refused, which leaves the world as it was.
    """
    world = unpacked_at(World, address)
    if not begin_step(world):
        return True
    drive(world)
    unmask_left(world)
    advance(world)
    return end_step(address, world, rows)


@engine_kernel
def command_bodies(address: int, motions: Numbers) -> bool:
    """Begin a control step whose bodies others move; returns whether the commands are refused.

    Args:
        motions: (N, 3) filled with forward and left velocity [m/s] and turn rate [rad/s].
    """
    world = unpacked_at(World, address)
    if not begin_step(world):
        return True
    list_motions(world, motions)
    return False


@engine_kernel
def follow_bodies(address: int, rows: Sensed) -> bool:
    """End a control step whose bodies others moved, as `step` does.

    Before, positions and velocities stand in `EngineArrays.bodies`, headings in `Robots.heading`.
    """
    return end_step(address, unpacked_at(World, address), rows)


@kernel
def begin_step(world: World) -> bool:
    """Note the commands and go on with time, unless a command is refused: then return False."""
    progress = world.progress
    outcome = world.outcome
    outcome.refused[0] = refused_command(world)
    if outcome.refused[0] != NOBODY:
        return False
    log_command(world.commands)
    progress.step[0] += 1
    progress.time[0] = progress.step[0] * world.parameters.control_period
    return True


@engine_kernel
def end_step(address: int, world: World, rows: Sensed) -> bool:
    """Do what follows the bodies' motion; returns what `step` returns."""
    commands = world.commands
    progress = world.progress
    outcome = world.outcome
    take_motion(world)
    send_messages(world)
    n_delivered, is_room = handle_items(world)
    run_batteries(world)
    is_paused = progress.step[0] == progress.pause_step[0]
    if not is_paused:
        perceive(address, rows)
    outcome.n_delivered[0] = n_delivered
    outcome.is_paused[0] = is_paused
    outcome.is_room[0] = is_room
    world.orders.is_served[0] = is_all_served(world)
    is_over = progress.step[0] >= progress.last_step[0] or world.orders.is_served[0]
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
def take_motion(world: World) -> None:
    """Take over where the bodies are after their motion, and how fast; absent robots are at 0."""
    count_motion(world)
    robots = world.robots
    bodies = world.engine.bodies
    for robot in range(len(robots.item)):
        is_there = 1.0 if robots.present[robot] else 0.0
        for axis in range(2):
            robots.position[robot, axis] = bodies[robot, axis] * is_there
            robots.velocity[robot, axis] = bodies[robot, 2 + axis] * is_there


@engine_kernel
def handle_items(world: World) -> tuple[int, bool]:
    """Carry along, let go, lift and deliver; returns how many, and whether there was room."""
    carry_along(world)
    open_grippers(world)
    close_grippers(world)
    receive_orders(world)
    n_delivered, is_room = deliver(world)
    put_back_late(world)
    end_handling(world)
    return n_delivered, is_room
