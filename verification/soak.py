"""Random worlds for as long as one likes, every invariant checked at every step.

    python -m verification.soak --minutes 10
    python -m verification.soak --first 4711 --worlds 1    # that world again

Ends with 1 at the first broken promise, naming the world that shows it.
"""

from __future__ import annotations

import argparse
import random
import resource
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import Scenario, Warehouse, policies
from swarm_logistics_env.errors import ScenarioError
from swarm_logistics_env.policies.policy import decide, start
from verification.invariants import BrokenPromiseError, Watch
from verification.jams import SIZES, TARGETS, overlaps
from verification.scenarios import drawn_change, drawn_faults, some_scenario

Steer = Callable[[Warehouse, NDArray[np.float32]], NDArray[np.float64]]

POLICIES = ("swarm-dt", "swarm-dt-follow", "random-walk", "central", "anything", "crowd")


@dataclass
class Tally:
    """What was played.

    Attributes:
        worlds: how many.
        steps: control steps in all.
        delivered: items in all.
        deepest: the greatest overlap of two bodies [m].
        no_room: scenarios whose things found no room at the reset.
    """

    worlds: int = 0
    steps: int = 0
    delivered: int = 0
    deepest: float = 0.0
    no_room: int = 0

    def __str__(self) -> str:
        return (
            f"{self.steps} steps of {self.worlds} worlds, {self.delivered} items delivered, "
            f"greatest overlap {1000 * self.deepest:.1f} mm, {self.no_room} without room"
        )


def play(source: random.Random, steps: int, tally: Tally) -> None:
    """Play one random world and look at it after every step.

    Raises:
        BrokenPromiseError: an invariant does not hold.
    """
    scenario = some_scenario(source)
    seconds = steps * scenario.control_period
    seed = source.randrange(2**32)
    world = Warehouse(scenario)
    tally.worlds += 1
    try:
        observations = world.reset(seed, drawn_faults(source, scenario, seconds))
    except ScenarioError:
        tally.no_room += 1
        return
    watch = Watch(world)
    watch.look()
    steer = _steered(source.choice(POLICIES), scenario, seed)
    try:
        for _ in range(steps):
            if source.random() < 3.0 / steps:
                _disturb(source, world, seconds)
                watch.faults_changed()
            observations = world.step(steer(world, observations))
            watch.look()
            tally.steps += 1
            if world.all_delivered:
                break
    except ScenarioError:  # an item that comes back finds no room
        tally.no_room += 1
    tally.delivered += world.state.delivered
    tally.deepest = max(tally.deepest, watch.deepest)


def broken_jam() -> str | None:
    """Press swarms to one point, to a wall and into a corner; returns what overlaps too much."""
    for n_robots in SIZES:
        for target in TARGETS:
            problem = overlaps(n_robots, target, seed=0).problem(Scenario())
            if problem:
                return f"{n_robots} robots driven to a {target}: {problem}"
    return None


def _disturb(source: random.Random, world: Warehouse, seconds: float) -> None:
    if source.random() < 0.5:
        try:
            world.change(**drawn_change(source, world.scenario))
        except ScenarioError:
            return
    else:
        world.set_faults(drawn_faults(source, world.scenario, seconds))


def _steered(name: str, scenario: Scenario, seed: int) -> Steer:
    width = 4 + scenario.message_size
    rng = np.random.default_rng(seed)
    if name == "anything":
        return lambda world, _: rng.uniform(-1.5, 1.5, (world.state.n_robots, width))
    if name == "crowd":
        target = rng.uniform([0, 0], [scenario.warehouse_width, scenario.warehouse_height])
        return lambda world, _: _towards(world, target, width)
    policy = policies.load(name)
    start(policy, scenario, seed)
    return lambda world, rows: decide(policy, rows, world.state)


def _towards(world: Warehouse, target: NDArray[np.float64], width: int) -> NDArray[np.float64]:
    away = target - world.state.robot_position
    angle = np.arctan2(away[:, 1], away[:, 0]) - world.state.robot_heading
    commands = np.zeros((len(away), width))
    commands[:, 0], commands[:, 1] = np.cos(angle), np.sin(angle)
    commands[:, 2] = np.clip(angle, -1.0, 1.0)
    commands[:, 3] = 1.0
    return commands


def peak_memory() -> int:
    """Return the most memory that this process has held [KiB on Linux]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def main() -> int:
    """Play worlds until the time is over."""
    parser = argparse.ArgumentParser(description="Random worlds, every invariant at every step.")
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--first", type=int, default=0, help="number of the first world")
    parser.add_argument("--worlds", type=int, default=sys.maxsize, help="at most so many")
    parser.add_argument("--steps", type=int, default=400, help="of each world")
    asked = parser.parse_args()
    if asked.first == 0:
        problem = broken_jam()
        if problem:
            print(problem)
            return 1
    until = time.monotonic() + 60.0 * asked.minutes
    said, tally = time.monotonic(), Tally()
    for number in range(asked.first, asked.first + asked.worlds):
        try:
            play(random.Random(number), asked.steps, tally)
        except BrokenPromiseError as error:
            print(
                f"world {number}: {error} (python -m verification.soak --first {number} --worlds 1)"
            )
            return 1
        if time.monotonic() - said > 60.0:
            said = time.monotonic()
            print(f"{tally}, peak {peak_memory()} KiB", flush=True)
        if time.monotonic() > until:
            break
    print(f"no promise broken: {tally}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
