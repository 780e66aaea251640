"""Play what the paper's FM4, "cannot deliver", may mean, and print what single runs of each give.

`play_paper_fit` plays it, for the old constants and for the fit, on seeds from 5,394,000 on.
"""

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from research.fit_paper import Constants, policy_of
from research.tables import table
from swarm_logistics_env import Fault, Scenario, Warehouse
from swarm_logistics_env.policies.policy import start
from swarm_logistics_env.world import observations as row

FIRST_SEED = 5_394_000
PAPER = {1: 39, 2: 15, 3: 12}
Change = Callable[[Warehouse, Any, Any], None]  # of the rows (N, D) and commands (N, 4), in place


def as_it_is(_: Warehouse, __: Any, ___: Any) -> None:
    """Leave the commands as they are: Swarm D-T never puts the requested item down."""


def opens_inside(world: Warehouse, _: Any, commands: Any) -> None:
    """Let failed robots open their grippers in the delivery area, and so lift nothing there."""
    commands[world.state.failed & world.state.robot_in_delivery, 3] = -1.0


def lifts_others_alone(world: Warehouse, rows: Any, commands: Any) -> None:
    """Let failed robots hold nothing while the requested item is in reach, and put it down."""
    reach = world.scenario.pickup_range
    for robot in np.flatnonzero(world.state.failed):
        items = rows[robot, row.ITEMS : row.NEIGHBOURS].reshape(-1, row.ITEM_WIDTH)
        is_near = (items[:, 0] > 0.5) & (np.hypot(items[:, 1], items[:, 2]) <= reach + 0.05)
        if (is_near & (items[:, 3] > 0.5)).any() and rows[robot, row.CARRYING] < 0.5:
            commands[robot, 3] = 0.0
        if rows[robot, row.CARRYING_REQUESTED] > 0.5:
            commands[robot, 3] = -1.0


class Reading(NamedTuple):
    """What FM4 may mean: of its mode, with another behaviour of the failed robots."""

    words: str
    mode: str
    change: Change


READINGS = (
    # Swarm D-T never lets go of it, so FM4_jam is the same, run by run.
    Reading("keeps the requested item (`FM4`, `FM4_jam`)", "FM4", as_it_is),
    Reading("puts it down in the delivery area", "FM4", opens_inside),
    Reading("never lifts the requested item", "FM4", lifts_others_alone),
)


class Played(NamedTuple):
    """One run: of which constants and reading, and whether a failed robot has the item at last."""

    constants: str
    reading: str
    m: int
    seed: int
    p: int
    is_stuck: int


def play(name: str, constants: Constants, reading: Reading, m: int, seed: int) -> Played:
    """Return what a swarm delivers of which `m` robots have failed."""
    world = Warehouse(Scenario(radio_range=constants["radio_range"]))
    policy = policy_of(constants)
    rows = world.reset(seed, [Fault(reading.mode, m)])
    start(policy, world.scenario, seed)
    while not (world.is_over_time or world.all_delivered):
        commands = policy.act(rows)
        reading.change(world, rows, commands)
        rows = world.step(commands)
    carrier = world.state.carrier
    is_stuck = carrier >= 0 and bool(world.state.failed[carrier])
    return Played(name, reading.words, m, seed, world.state.delivered, int(is_stuck))


def runs(sets: Mapping[str, Constants], n_seeds: int) -> Iterator[Played]:
    """Yield each run."""
    for number in range(n_seeds):
        for name, constants in sets.items():
            for reading in READINGS:
                for m in PAPER:
                    yield play(name, constants, reading, m, FIRST_SEED + number)


def fm4_table(path: Path) -> str:
    """Return the table of the runs in a file: means, single runs, and who takes what is requested.

    Of the first reading, in which a failed robot keeps the requested item, the last column has the
    share of requests that a failed robot takes, per failed robot.
    """
    import pandas as pd

    rows = []
    played = pd.read_csv(path)
    for (name, words), of_reading in played.groupby(["constants", "reading"], sort=False):
        p_of = {m: of_reading["p"][of_reading["m"] == m] for m in PAPER}
        texts = [
            f"{p.mean():.1f} ({p.quantile(0.05):.0f} to {p.quantile(0.95):.0f})"
            for p in p_of.values()
        ]
        reached = [f"{(p >= PAPER[m]).mean():.0%}" for m, p in p_of.items()]
        requests = of_reading["m"] * (of_reading["p"] + of_reading["is_stuck"])
        share = of_reading["is_stuck"].sum() / requests.sum()
        taken = f"{share:.1%}" if words == READINGS[0].words else ""
        rows.append((name, words, *texts, ", ".join(reached), taken))
    papers = (f"m = {m} (paper: {p})" for m, p in PAPER.items())
    head = ("constants", "a failed robot", *papers, "runs at or above it", "requests taken")
    return table(head, rows)
