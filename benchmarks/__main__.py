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
    args = parser.parse_args()
    timed = contestants()
    in_turns(timed, 1)  # compiles and warms
    for contestant in timed:
        contestant.seconds.clear()
    in_turns(timed, args.repeats)
    print(f"Medians of {args.repeats} interleaved runs; N = 25 unless said\n{shown(rows(timed))}")
    seconds = {**start_up(), **judge_answers()}
    for what, took in seconds.items():
        print(f"{what}: {took:.2f} s")
    if args.out:
        save(args.out, rows(timed), seconds)
        print(f"written to {args.out}")
