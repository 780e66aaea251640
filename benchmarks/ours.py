"""What is measured of this package: the floor under it, its paths, many worlds, many robots; and
what a process pays before its first step.
"""

import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from benchmarks.floor import ForceFloor, Recording, record
from benchmarks.policies import deciders
from benchmarks.results import Contestant
from swarm_logistics_env import Scenario, Warehouse
from swarm_logistics_env.adapters import SwarmVecEnv
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv

FLOOR, WORLD, ARRAYS = "force floor", "Warehouse.step", "env.step_arrays"
SENSES = "all sensors, logistics, timers"
_STEPS, _AGENT_STEPS_OF_MANY, _WORLDS = 1000, 40_000, 8

_TIMED = "import time; began = time.{0}()\n{1}\nprint(time.{0}() - began)"
_FIRST_STEP = """
from swarm_logistics_env import swarm_logistics_v0
env = swarm_logistics_v0.parallel_env(); env.reset(seed=0)
env.step({agent: env.action_space(agent).sample() for agent in env.agents})
"""


def contestants() -> list[Contestant]:
    """Return everything of this package that is timed."""
    single, double = (vec_env(threads) for threads in (1, 2))
    double.base = single.name
    many = [each for n_robots in (1_000, 10_000) for each in many_robots(n_robots)]
    one_world = paths(record(Scenario(restock=True), _STEPS))
    return [*one_world, *on_plans(), *deciders(WORLD), single, double, *many]


def paths(recording: Recording) -> Iterator[Contestant]:
    """Yield the floor and the ways to step one world, on the same commands."""
    n, steps = recording.scenario.n_robots, len(recording.commands)
    actions = [
        {f"robot_{row}": command for row, command in enumerate(commands)}
        for commands in recording.commands.astype(np.float32)
    ]

    def floor() -> float:
        return _timed(ForceFloor(recording).step, range(steps))

    def arrays() -> float:
        env = SwarmLogisticsEnv(recording.scenario)
        env.reset_arrays(seed=0)
        return _timed(env.step_arrays, recording.commands)

    def dicts() -> float:
        env = SwarmLogisticsEnv(recording.scenario)
        env.reset(seed=0)
        return _timed(env.step, actions)

    for name, includes, run, base in (
        (FLOOR, "bodies alone, no sensing", floor, None),
        (WORLD, SENSES, partial(_seconds_of_world, recording), FLOOR),
        (ARRAYS, f"{SENSES}, rewards, ends", arrays, FLOOR),
        ("env.step", "the same, as PettingZoo's dicts", dicts, ARRAYS),
    ):
        yield Contestant(name, includes, run, n * steps, steps, base)


def on_plans() -> Iterator[Contestant]:
    """Yield worlds with racks beside the open floor, each on commands that were made for it."""
    for policy in ("swarm-dt", "homing"):
        base = f"{WORLD}, {policy}"
        for floor in (None, "aisles", "two_docks"):
            recording = record(Scenario(floor=floor, restock=True), _STEPS, policy)
            yield Contestant(
                f"{base}, {floor}" if floor else base,
                "among racks" if floor else "on the open floor",
                partial(_seconds_of_world, recording),
                recording.scenario.n_robots * _STEPS,
                _STEPS,
                base if floor else FLOOR,
            )


def _seconds_of_world(recording: Recording) -> float:
    world = Warehouse(recording.scenario)
    world.reset(seed=0)
    return _timed(world.step, recording.commands)


def many_robots(n_robots: int) -> Iterator[Contestant]:
    """Yield the floor and the world at the default density, with so many robots."""
    times = n_robots / 25
    side = 10.0 * times**0.5
    size = {"warehouse_width": side, "warehouse_height": side, "delivery_width": side / 5.0}
    scenario = Scenario(n_robots=n_robots, n_items=round(60 * times), restock=True, **size)
    recording = record(scenario, max(_AGENT_STEPS_OF_MANY // n_robots, 4))
    for entry in paths(recording):
        if entry.name in (FLOOR, ARRAYS):
            yield replace(entry, name=f"{entry.name}, N = {n_robots:,}", base=entry.name)


def vec_env(threads: int) -> Contestant:
    """Return several worlds behind stable-baselines3's VecEnv."""
    env = SwarmVecEnv(Scenario(restock=True), n_worlds=_WORLDS, threads=threads, seed=0)
    env.reset()
    rng = np.random.default_rng(0)
    actions = rng.uniform(-1.0, 1.0, (20, env.num_envs, 4)).astype(np.float32)
    commands = [actions[step % len(actions)] for step in range(_STEPS)]
    return Contestant(
        f"SwarmVecEnv, {threads} thread{'s' if threads > 1 else ''}",
        f"{_WORLDS} worlds: {SENSES}, rewards, resets; wall time",
        lambda: _timed(env.step, commands, time.perf_counter),
        env.num_envs * _STEPS,
        _STEPS,
        ARRAYS,
    )


def _timed(
    step: Callable[[Any], object],
    arguments: Iterable[Any],
    clock: Callable[[], float] = time.process_time,
) -> float:
    began = clock()
    for argument in arguments:
        step(argument)
    return clock() - began


def start_up() -> dict[str, float]:
    """Return the seconds before the first step, of the processor and in the end of the wall.

    To import the package; to the first step where all has to be compiled, and where nothing has to
    be.
    """
    with tempfile.TemporaryDirectory() as cache:
        compiling = _seconds(_FIRST_STEP, 1, NUMBA_CACHE_DIR=cache)
    _seconds(_FIRST_STEP, 1)  # warms the cache
    return {
        "import": _seconds("import swarm_logistics_env"),
        "first_step, empty cache": compiling,
        "first_step": _seconds(_FIRST_STEP, clock="perf_counter"),
    }


def _seconds(
    script: str, repeats: int = 5, clock: str = "process_time", **environment: str
) -> float:
    command = [sys.executable, "-c", _TIMED.format(clock, script)]
    printed = [
        subprocess.check_output(command, env={**os.environ, **environment}) for _ in range(repeats)
    ]
    return statistics.median(map(float, printed))
