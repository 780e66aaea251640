"""Print what a control step of ours costs beside the bare physics, in one run."""

from __future__ import annotations

import os
import platform
import statistics
import time
from collections.abc import Callable

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.floor import Floor
from benchmarks.recording import Recording, record
from swarm_logistics_env import Scenario, Warehouse, policies, run_episode
from swarm_logistics_env.env import SwarmLogisticsEnv

_STEPS = 1000
_REPEATS = 15


def floor_run(recording: Recording) -> Callable[[], None]:
    """Return a run of the bare physics over the recording."""
    floor = Floor(recording)

    def run() -> None:
        for step in range(_STEPS):
            floor.step(step)

    return run


def world_run(recording: Recording) -> Callable[[], None]:
    """Return a run of the world alone, commands to observations."""
    world = Warehouse(recording.scenario)
    world.reset(seed=0)

    def run() -> None:
        for commands in recording.commands:
            world.step(commands)

    return run


def array_run(recording: Recording) -> Callable[[], None]:
    """Return a run of the environment's array path, with rewards and ends."""
    env = SwarmLogisticsEnv(recording.scenario)
    env.reset_arrays(seed=0)

    def run() -> None:
        for commands in recording.commands:
            env.step_arrays(commands)

    return run


def dict_run(recording: Recording) -> Callable[[], None]:
    """Return a run of our dict path, PettingZoo's `step`."""
    env = SwarmLogisticsEnv(recording.scenario)
    env.reset(seed=0)
    actions = [
        {f"robot_{row}": command for row, command in enumerate(commands)}
        for commands in recording.commands.astype(np.float32)
    ]

    def run() -> None:
        for action in actions:
            env.step(action)

    return run


def microseconds(recording: Recording) -> dict[str, list[float]]:
    """Return, per path, the processor time of a control step in each interleaved repeat [us]."""
    makers = {
        "pymunk floor": floor_run,
        "Warehouse.step": world_run,
        "env.step_arrays": array_run,
        "env.step": dict_run,
    }
    costs: dict[str, list[float]] = {name: [] for name in makers}
    for _ in range(_REPEATS):
        for name, make in makers.items():
            run = make(recording)
            # Processor time: on a machine that does other things too, the wall clock counts them.
            began = time.process_time()
            run()
            costs[name].append((time.process_time() - began) / _STEPS * 1e6)
    return costs


def main() -> None:
    """Measure and print."""
    console = Console()
    scenario = Scenario(restock=True)
    recording = record(scenario, _STEPS)
    dict_run(recording)  # compiles
    costs = microseconds(recording)
    floor = costs["pymunk floor"]
    n = scenario.n_robots
    table = Table(
        title=f"One control step, N = {n}, {scenario.n_items} items, {scenario.n_substeps} "
        f"substeps; medians of {_REPEATS} interleaved runs of {_STEPS} steps, processor time"
    )
    for column in ("path", "us per step", "x floor", "agent-steps per s"):
        table.add_column(column, justify="left" if column == "path" else "right")
    for name, values in costs.items():
        ratio = statistics.median(ours / bare for ours, bare in zip(values, floor, strict=True))
        middle = statistics.median(values)
        table.add_row(name, f"{middle:.0f}", f"{ratio:.2f}", f"{n / middle * 1e6:,.0f}")
    console.print(table)

    policy = policies.load("swarm-dt")
    began = time.perf_counter()
    episode = run_episode(Scenario(), policy, seed=0)
    took = time.perf_counter() - began
    console.print(
        f"One episode of swarm-dt, N = {n}: {episode.ended_at:g} s in {took:.2f} s of wall time, "
        f"{episode.ended_at / took:.0f} times real time"
    )
    console.print(
        f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, "
        f"Python {platform.python_version()}, numpy {np.__version__}"
    )


if __name__ == "__main__":
    main()
