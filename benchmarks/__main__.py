"""Measure the package beside the bare physics, in one run.

python -m benchmarks --out results/benchmark
"""

from __future__ import annotations

import argparse
from pathlib import Path

from benchmarks.ours import contestants
from benchmarks.results import in_turns, rows, save, shown
from benchmarks.start_up import start_up


def main() -> None:
    """Measure, print and save."""
    parser = argparse.ArgumentParser(prog="benchmarks", description=__doc__)
    parser.add_argument("--repeats", type=int, default=15, help="turns of everybody")
    parser.add_argument("--out", type=Path, help="folder for benchmark.json")
    given = parser.parse_args()

    found = contestants()
    in_turns(found, 1)  # compiles and warms
    for contestant in found:
        contestant.seconds.clear()
    in_turns(found, given.repeats)
    print(f"Medians of {given.repeats} interleaved runs; N = 25 unless said\n{shown(rows(found))}")
    seconds = start_up()
    for what, took in seconds.items():
        print(f"{what}: {took:.2f} s")
    if given.out:
        save(given.out, rows(found), seconds)
        print(f"written to {given.out}")


if __name__ == "__main__":
    main()
