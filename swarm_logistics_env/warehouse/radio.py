"""The radio: every robot broadcasts its timer and a message to those in range that hear."""

from __future__ import annotations

import math

import numpy as np

from swarm_logistics_env.kernels import inlined_kernel, kernel, pair_key, uniform

from .kinematics import MESSAGE
from .structs import NOBODY, Numbers, World

# Purposes of the streams between a robot and another thing: numbers of one step.
RADIO, ROBOT_SEEN, ITEM_SEEN, N_PURPOSES = range(4)


@inlined_kernel
def is_missed(key: np.uint64, other: int, step: int, purpose: int, probability: float) -> bool:
    """Return whether what `other` offers the robot of that key is lost in this step."""
    if probability == 0.0:
        return False
    return uniform(pair_key(key, other), N_PURPOSES * step + purpose) < probability


@kernel
def send_messages(world: World, commands: Numbers) -> None:
    """Broadcast the rest of the commands of those who obey, cut to [-1, 1]; of others, zeros."""
    robots, able, step = world.robots, world.able, world.progress.step[0]
    message, before = robots.message, robots.message_before
    n, n_kept = len(message), len(robots.told_before)
    for robot in range(n):
        sends = robots.present[robot] and able.obeys[robot]
        for place in range(message.shape[1]):
            given = commands[robot, MESSAGE + place] if sends else 0.0
            given = min(max(given, -1.0), 1.0)
            before[(step % n_kept) * n + robot, place] = given
            if able.radio_delay[robot] > 0:
                then = step - able.radio_delay[robot]
                given = before[(then % n_kept) * n + robot, place] if then >= 0 else 0.0
            message[robot, place] = given


@kernel
def run_timers(world: World) -> None:
    """Advance every robot's timer and what it tells (NaN: silent) [s].

    Counted in steps, so that rounding never adds up. With gossip a robot tells the lowest of its
    own timer and of what it heard one period ago, aged. If the radio is delayed, the broadcast
    comes late. One that is not honest tells 0.
    """
    robots, able, step = world.robots, world.able, world.progress.step[0]
    parameters = world.parameters
    period, limit = parameters.control_period, parameters.timer_limit - 1e-9
    n_kept = len(robots.told_before)
    for robot in range(len(robots.timer)):
        if robots.in_delivery[robot]:
            robots.last_in_delivery[robot] = step
        timer, is_present = math.nan, robots.present[robot]
        if is_present and robots.last_in_delivery[robot] >= 0:
            elapsed = (step - robots.last_in_delivery[robot]) * period
            timer = elapsed if elapsed < limit else timer
        robots.timer[robot] = timer
        told = timer
        aged = robots.heard[robot] + period
        if parameters.is_gossip and is_present and aged < limit:
            told = aged if math.isnan(told) else min(told, aged)
        robots.told_before[step % n_kept, robot] = told
        if is_present and able.radio_delay[robot] > 0:
            then = step - able.radio_delay[robot]
            told = robots.told_before[then % n_kept, robot] if then >= 0 else math.nan
            # The limit may have fallen since it was told.
            told = told if told < limit else math.nan
        robots.told[robot] = 0.0 if is_present and not able.honest[robot] else told


@inlined_kernel
def listen(me: int, world: World, n_found: int) -> None:
    """Note in `nearby.is_heard` which of the robots found nearby `me` hears."""
    robots, able, nearby = world.robots, world.able, world.nearby
    limit, loss = world.parameters.radio_range**2, world.parameters.radio_loss
    step = world.progress.step[0]
    for index in range(n_found):
        other = world.robot_grid.members[nearby.place[index]]
        is_heard = (nearby.square[index] <= limit) & able.sends[other] & able.hears[me]
        if loss > 0.0 and is_heard:
            is_heard = not is_missed(robots.sensor_key[me], other, step, RADIO, loss)
        nearby.is_heard[index] = is_heard


@inlined_kernel
def lowest_timer_heard(world: World, n_found: int) -> tuple[int, float]:
    """Return who tells the lowest timer of those nearby that are heard, or NOBODY, and it [s].

    If several broadcast the same timer, it is the nearest of them.
    """
    robots, grid, nearby = world.robots, world.robot_grid, world.nearby
    lowest, lowest_square, lowest_timer = NOBODY, 0.0, math.inf
    # Without branches, as what they hang on cannot be predicted.
    for index in range(n_found):
        other, square = grid.members[nearby.place[index]], nearby.square[index]
        told = robots.told[other]
        is_lower = (told < lowest_timer) | ((told == lowest_timer) & (square < lowest_square))
        is_lower &= nearby.is_heard[index]
        lowest = other if is_lower else lowest
        lowest_square = square if is_lower else lowest_square
        lowest_timer = told if is_lower else lowest_timer
    return lowest, lowest_timer
