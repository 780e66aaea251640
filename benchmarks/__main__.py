"""Measure the package beside the bare physics, in one run.

python -m benchmarks --out results/benchmark
"""

from __future__ import annotations

import argparse
from pathlib import Path

from rich.console import Console

from benchmarks import ours
from benchmarks.floor import record
from benchmarks.instructions import instructions_of_a_step
from benchmarks.results import Contestant, as_json, in_turns, save, show
from benchmarks.start_up import (
    compile_seconds,
    first_step_seconds,
    import_seconds,
)
from swarm_logistics_env import Scenario

_STEPS, _MANY = 1000, (1_000, 10_000)


def contestants_of_ours() -> list[Contestant]:
    """Return everything of this package that is timed, compiled and warm."""
    recording = record(Scenario(restock=True), _STEPS)
    found = [*ours.paths(recording)]
    found += [ours.vec_env(threads) for threads in (1, 2)]
    found[-1].base = found[-2].name
    for n_robots in _MANY:
        found += ours.many_robots(n_robots)
    in_turns(found, 1)
    for contestant in found:
        contestant.seconds.clear()
    return found


def main() -> None:
    """Measure, print and save."""
    parser = argparse.ArgumentParser(prog="benchmarks", description=__doc__)
    parser.add_argument("--repeats", type=int, default=15, help="turns of everybody")
    parser.add_argument("--out", type=Path, help="folder for benchmark.json")
    given = parser.parse_args()

    console = Console(width=150)
    found = contestants_of_ours()
    in_turns(found, given.repeats)
    title = (
        f"Medians of {given.repeats} interleaved runs, processor time; N = 25 unless said; "
        "cost: per agent-step"
    )
    show(console, found, title)

    package, needed = import_seconds(5)
    first_step = first_step_seconds(3)
    compiling = compile_seconds()
    counts = instructions_of_a_step()
    console.print(
        f"import swarm_logistics_env: {package:.2f} s, {package / needed:.2f} times pettingzoo, "
        f"pymunk and numba ({needed:.2f} s)\n"
        f"second process, warm cache: first step after {first_step:.2f} s of wall time"
    )
    for what, seconds in compiling.items():
        console.print(f"{what}: {seconds:.1f} s of the processor")
    if counts is None:
        console.print("valgrind is not installed: no instructions counted")
    for name, count in (counts or {}).items():
        console.print(f"{name}: {count:,.0f} instructions a control step")
    if given.out:
        start_up = {"import": package, "import_of_needed": needed, "first_step": first_step}
        start_up |= compiling
        save(
            given.out,
            as_json(
                found,
                seconds=start_up,
                instructions=counts,
            ),
        )
        console.print(f"written to {given.out}")


if __name__ == "__main__":
    main()
