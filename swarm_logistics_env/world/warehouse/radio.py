"""Radio: every robot broadcasts its timer and a message to those in range that hear."""

from __future__ import annotations

import math

from swarm_logistics_env.compiler.kernels import inlined_kernel, kernel, pair_key, uniform

from .commands import MESSAGE, acts
from .sensor_errors import RADIO, is_missed
from .structs import NOBODY, World


@kernel
def send_messages(world: World) -> None:
    """Broadcast the rest of the commands of those who obey, cut to [-1, 1]; of others, zeros.

    A channel that has failed repeats what it was handed last, or hands on random numbers from the
    robot's own stream, or the opposite.
    """
    robots = world.robots
    able = world.able
    step = world.progress.step[0]
    message = robots.message
    before = robots.message_before
    n = len(message)
    n_kept = len(robots.told_before)
    for robot in range(n):
        sends = acts(world, robot)
        for part in range(message.shape[1]):
            number = world.commands.now[robot, MESSAGE + part] if sends else 0.0
            number = min(max(number, -1.0), 1.0)
            if sends and not able.messages_true[robot]:
                number = -number
            if sends and not able.messages_mean[robot]:
                # Beside the streams of the losses between robots, which the numbers 0 to n - 1 key.
                number = 2.0 * uniform(pair_key(robots.sensor_key[robot], n + part), step) - 1.0
            if sends and not able.messages_refresh[robot]:
                number = before[((step - 1) % n_kept) * n + robot, part]
            before[(step % n_kept) * n + robot, part] = number
            if able.radio_delay[robot] > 0:
                sent_step = step - able.radio_delay[robot]
                number = before[(sent_step % n_kept) * n + robot, part] if sent_step >= 0 else 0.0
            message[robot, part] = number


@kernel
def run_timers(world: World) -> None:
    """Advance every robot's timer and what it tells (NaN: silent) [s].

    Counted in steps, so that rounding never adds up. With gossip a robot tells the lowest of its
    own timer and of what it heard one period ago, aged. If the radio is delayed, the broadcast
    comes late. One that is not honest tells 0.
    """
    robots = world.robots
    able = world.able
    step = world.progress.step[0]
    parameters = world.parameters
    period = parameters.control_period
    limit = parameters.timer_limit - 1e-9
    n_kept = len(robots.told_before)
    for robot in range(len(robots.timer)):
        if robots.in_delivery[robot]:
            robots.last_in_delivery[robot] = step
        timer = math.nan
        is_present = robots.present[robot]
        if is_present and robots.last_in_delivery[robot] >= 0:
            elapsed = (step - robots.last_in_delivery[robot]) * period
            timer = elapsed if elapsed < limit else timer
        robots.timer[robot] = timer
        broadcast = timer
        aged_timer = robots.heard[robot] + period
        if parameters.is_gossip and is_present and aged_timer < limit:
            broadcast = aged_timer if math.isnan(broadcast) else min(broadcast, aged_timer)
        robots.told_before[step % n_kept, robot] = broadcast
        if is_present and able.radio_delay[robot] > 0:
            sent_step = step - able.radio_delay[robot]
            broadcast = (
                robots.told_before[sent_step % n_kept, robot] if sent_step >= 0 else math.nan
            )
            # The limit may have fallen since it was told.
            broadcast = broadcast if broadcast < limit else math.nan
        robots.told[robot] = 0.0 if is_present and not able.honest[robot] else broadcast


@inlined_kernel
def listen(me: int, world: World, n_found: int) -> tuple[int, float]:
    """Note in `nearby.is_heard` which of the robots found nearby `me` hears.

    Returns who of them tells the lowest timer, or NOBODY, and it [s]. If several broadcast the same
    timer, it is the nearest of them.
    """
    robots = world.robots
    able = world.able
    nearby = world.nearby
    limit = world.parameters.radio_range**2
    loss = world.parameters.radio_loss
    lowest = NOBODY
    lowest_square = 0.0
    lowest_timer = math.inf
    for index in range(n_found):
        other = world.robot_grid.members[nearby.slot[index]]
        square = nearby.square[index]
        is_heard = (square <= limit) & able.sends[other] & able.hears[me]
        is_heard &= not robots.is_empty[other]
        if loss > 0.0 and is_heard:
            step = world.progress.step[0]
            is_heard = not is_missed(robots.sensor_key[me], other, step, RADIO, loss)
        nearby.is_heard[index] = is_heard
        # Without branches, as what they hang on cannot be predicted.
        timer = robots.told[other]
        is_lower = (timer < lowest_timer) | ((timer == lowest_timer) & (square < lowest_square))
        is_lower &= is_heard
        lowest = other if is_lower else lowest
        lowest_square = square if is_lower else lowest_square
        lowest_timer = timer if is_lower else lowest_timer
    return lowest, lowest_timer
