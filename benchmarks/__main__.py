"""Measure the package beside the bare physics, in one run.

python -m benchmarks --out results/benchmark
"""

import argparse
from pathlib import Path

from benchmarks.ours import contestants, start_up
from benchmarks.policies import judge_answers
from benchmarks.results import in_turns, rows, save, shown

if __name__ == "__main__":
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
    seconds = {**start_up(), **judge_answers()}
    for what, took in seconds.items():
        print(f"{what}: {took:.2f} s")
    if given.out:
        save(given.out, rows(found), seconds)
        print(f"written to {given.out}")
