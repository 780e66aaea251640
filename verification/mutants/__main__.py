"""Make mutants and run the tests that should catch them.

python -m verification.mutants             # all listed ones; ends with 1 if more survive than told
python -m verification.mutants gate train  # those whose names, files or lists hold one of these
python -m verification.mutants --sample 200 --seed 1      # faults drawn over the whole package;
                                           # after an interruption, the rest of them
python -m verification.mutants --sample 50 --seed 1 spi/  # of files whose paths hold this
"""

import argparse
import sys
import time
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from .copies import COPIES, Copies, run_tests, written
from .mutation import EQUAL, PACKAGE, ROOT, Mutant, mutated, read_mutants
from .reached import Reached, digest_of
from .sampling import Made, Package, measure_sample

LONGEST = 240.0  # [s]; what takes longer hangs, so it is caught


def caught_by(mutant: Mutant, copy: Path) -> str:
    """Return the first test that fails on the mutant, made in a copy; empty: none does."""
    file = copy / PACKAGE / mutant.file
    with written(file, mutated(mutant, file.read_text(encoding="utf-8"))):
        return run_tests(copy, mutant.tests, interpreted=mutant.interpreted, limit=LONGEST)


def guilty(copy: Path, caught: Sequence[tuple[Mutant, str]]) -> str:
    """Return one of the tests that caught mutants if it fails without any; empty: none does."""
    for mode in (False, True):
        tests = {test for mutant, test in caught if mutant.interpreted is mode and "::" in test}
        if tests and (test := run_tests(copy, sorted(tests), interpreted=mode, limit=1800.0)):
            return test
    return ""


def make_listed(words: Sequence[str], n_workers: int) -> int:
    """Make the mutants that hold one of these words; print each as it comes, then a table."""
    chosen = [
        mutant
        for mutant in read_mutants()
        if not words or any(word in f"{mutant.room} {mutant.file} {mutant.name}" for word in words)
    ]
    start = time.monotonic()
    copies = Copies(n_workers)

    def made(mutant: Mutant) -> str:
        with copies.borrow() as copy:
            began = time.monotonic()
            test = caught_by(mutant, copy)
        took = f"{time.monotonic() - began:4.0f} s"
        print(f"{took}  {mutant.room}: {mutant.name}: {test or 'SURVIVES'}", flush=True)
        return test

    with ThreadPoolExecutor(n_workers) as pool:
        results = list(zip(chosen, pool.map(made, chosen)))
    survivors = [mutant for mutant, test in results if not test]
    rooms = Counter(mutant.room for mutant in survivors)
    for room, count in Counter(mutant.room for mutant in chosen).items():
        print(f"{room}: {count - rooms[room]} of {count} caught")
    print(f"{len(survivors)} of {len(chosen)} survive, {(time.monotonic() - start) / 60:.0f} min")
    for mutant in survivors:
        print(f"SURVIVES {mutant.name}: {mutant.survives or 'should be caught'}")
    with copies.borrow() as copy:
        if test := guilty(copy, [(mutant, test) for mutant, test in results if test]):
            print(f"{test} fails without any mutant, so it catches none")
            return 2
    return int(any(not mutant.survives for mutant in survivors))


def main(arguments: Sequence[str]) -> int:
    """Make the mutants that the command line asks for."""
    parser = argparse.ArgumentParser(prog="python -m verification.mutants")
    parser.add_argument("words", nargs="*", help="parts of names, files or lists; none: all")
    parser.add_argument("--sample", type=int, metavar="N", help="draw N faults; no listed ones")
    parser.add_argument("--seed", type=int, default=0, help="of the drawn faults")
    parser.add_argument("--workers", type=int, default=2, help="copies of the tree to work in")
    parser.add_argument(
        "--seconds", type=float, default=60.0, help="of a core for the tests of a drawn fault"
    )
    options = parser.parse_args(arguments)
    if options.sample is None:
        return make_listed(options.words, options.workers)
    copies = Copies(options.workers, folder=COPIES / "sample")
    with copies.borrow() as copy:
        reached = Reached(copy, copy.parent, options.workers)
    package = Package(ROOT, options.words, reached)
    folders = PACKAGE, "tests", "examples", "verification"
    paths = (path for name in folders for path in (ROOT / name).rglob("*.*"))
    # Which faults count says nothing of what catches the others.
    sources = [path for path in paths if path.is_file() and path.suffix != ".pyc" and path != EQUAL]
    tree = f"{digest_of(ROOT, [*sources, ROOT / 'pyproject.toml'])} {options.seconds}"
    record = Made(COPIES / "sample" / "made.jsonl", tree)
    return measure_sample(
        options.sample, options.seed, package, copies, options.workers, options.seconds, record
    )


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
