"""Play each reading of the paper's FM1 and FM3, and print what comes near its table, and its price.

    python -m research.play_readings 40  # seeds a cell

The table goes into docs/research/readings_and_tries.md by hand. A reading that changes what sound
robots do changes all other cells, too.
"""

import cmath
import math
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from typing import Any, Literal, NamedTuple

import numpy as np
import typer

from research.tables import table
from swarm_logistics_env import FAILURE_MODES, Fault, Scenario, Warehouse
from swarm_logistics_env.policies import load
from swarm_logistics_env.policies.policy import start
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.warehouse import FailureMode

FIRST_SEED = 3_300_000  # nothing else uses these
PAPER = {"FM1": (41, 38, 35), "FM3": (40, 41, 40)}
# Cells without a fault, each with a quarter of the seeds: N, items, P of the paper.
OTHERS = ((25, 60, 39), (22, 60, 36), (10, 100, 18), (50, 100, 56))
Change = Callable[[Warehouse, Any], None]  # of the rows (N, D), in place


def lets_go(world: Warehouse, rows: Any) -> None:
    """A failed robot takes the requested item for delivered, and puts it down as any other."""
    rows[world.state.failed, row.CARRYING_REQUESTED] = 0.0


def only_lower(_: Warehouse, rows: Any) -> None:
    """A robot follows only a timer that is lower than its own."""
    timer = np.where(rows[:, row.TIMER_RUNS] > 0.5, rows[:, row.TIMER], np.inf)
    rows[rows[:, row.LOWEST_TIMER_TIME] >= timer, row.LOWEST_TIMER] = 0.0


def choose(pick: Callable[[Any], Any]) -> Change:
    """Of those that tell the lowest timer, the carrier follows `pick` of their distances."""

    def change(world: Warehouse, rows: Any) -> None:
        state = world.state
        carrier = state.carrier
        if carrier < 0 or rows[carrier, row.LOWEST_TIMER] < 0.5:
            return
        offsets = state.robot_position - state.robot_position[carrier]
        distance = np.hypot(*offsets.T)
        is_heard = state.sends & (distance <= world.scenario.radio_range) & (distance > 0.0)
        timers = np.where(is_heard, state.robot_told, np.nan)
        ties = np.flatnonzero(timers == np.nanmin(timers))
        x, y = offsets[ties[pick(distance[ties])]]
        direction = complex(x, y) * cmath.exp(-1j * float(state.robot_heading[carrier]))
        rows[carrier, [row.LOWEST_TIMER_X, row.LOWEST_TIMER_Y]] = direction.real, direction.imag

    return change


class Reading(NamedTuple):
    """What a failure mode may mean."""

    failure: str
    words: str
    mode: str
    change: Change | None = None
    relay: Literal["none", "gossip"] = "none"


THERE = FailureMode("tells 0, and hears nobody", honest=False, hears=False)
READINGS = (
    Reading("FM1", "tells 0; of equals the nearest is followed (shipped)", "FM1"),
    Reading("FM1", "all pass on the lowest timer, aged", "FM1", None, "gossip"),
    Reading("FM1", "as if it were there: follows nobody", "there"),
    Reading("FM1", "as if it were there: puts the requested item down", "FM1", lets_go),
    Reading("FM1", "of equals the farthest is followed", "FM1", choose(np.argmax)),
    Reading("FM1", "of equals the lowest number is followed", "FM1", choose(lambda _: 0)),
    Reading("FM1", "only timers below its own are followed", "FM1", only_lower),
    Reading("FM3", "neither sends nor hears (shipped)", "FM3"),
    Reading("FM3", "does not send", "FM3_send"),
    Reading("FM3", "does not hear", "FM3_hear"),
)


def delivered(number: int, n: int, n_items: int, m: int, seed: int) -> int:
    """Return how many items a swarm delivers of which `m` robots have failed."""
    _, _, mode, change, relay = READINGS[number]
    FAILURE_MODES.setdefault("there", THERE)
    world = Warehouse(Scenario(n_robots=n, n_items=n_items, relay=relay))
    policy = load("swarm-dt-2026")
    rows = world.reset(seed, [Fault(mode, m)] if m else [])
    start(policy, world.scenario, seed)
    while not (world.is_over_time or world.all_delivered):
        if change is not None:
            change(world, rows)
        rows = world.step(policy.act(rows))
    return world.state.delivered


def row_of(number: int, n_seeds: int, pool: ProcessPoolExecutor) -> tuple[str, ...]:
    """Return the row of a reading: P in each cell beside the paper's, and how far they are."""
    failure, words, _, change, relay = READINGS[number]
    is_for_all = number == 0 or relay == "gossip" or change not in (None, lets_go)
    cells = [(25, 60, m, p, n_seeds) for m, p in enumerate(PAPER[failure], 1)]
    if is_for_all:
        n_seeds_of_others = math.ceil(n_seeds / 4)
        cells += [(n, n_items, 0, p, n_seeds_of_others) for n, n_items, p in OTHERS]
    means = []
    errors = []
    for n, n_items, m, paper, count in cells:
        play = partial(delivered, number, n, n_items, m)
        mean = np.mean([*pool.map(play, range(FIRST_SEED, FIRST_SEED + count))])
        means.append(f"{mean:.1f} ({paper})")
        errors.append(abs(math.log(mean / paper)))
    price = f"{np.mean(errors[3:]):.2f}" if is_for_all else "as shipped"
    return failure, words, *means[:3], f"{np.mean(errors[:3]):.2f}", price


def main(n_seeds: int) -> None:
    """Play each reading over so many seeds a cell, and print the table."""
    with ProcessPoolExecutor(2) as pool:
        rows = [row_of(number, n_seeds, pool) for number in range(len(READINGS))]
    print(table(("mode", "reading", "m = 1", "m = 2", "m = 3", "mean |ln|", "other cells"), rows))


if __name__ == "__main__":
    typer.run(main)
