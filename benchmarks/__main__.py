"""Measure the package beside the bare physics, in one run.

python -m benchmarks --out results/benchmark
"""

from pathlib import Path

import typer

from benchmarks.ours import contestants, seconds_to_first_step
from benchmarks.results import in_turns, rows, save, shown


def main(repeats: int = 15, out: Path | None = None) -> None:
    """Measure in so many turns of everybody; the folder `out` gets benchmark.json."""
    found = contestants()
    in_turns(found, 1)  # compiles and warms
    for contestant in found:
        contestant.seconds.clear()
    in_turns(found, repeats)
    print(f"Medians of {repeats} interleaved runs; N = 25 unless said\n{shown(rows(found))}")
    seconds = {"first_step": seconds_to_first_step()}
    print(f"first_step: {seconds['first_step']:.2f} s")
    if out:
        save(out, rows(found), seconds)
        print(f"written to {out}")


if __name__ == "__main__":
    typer.run(main)
