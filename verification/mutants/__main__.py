"""Make every mutant and run the tests that should catch it.

python -m verification.mutants             # all of them; ends with 1 if more survive than are told
python -m verification.mutants gate train  # those whose names, files or lists hold one of these
"""

import os
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import SimpleQueue

from .mutation import PACKAGE, ROOT, Mutant, mutated, read_mutants

LONGEST = 240.0  # [s]; what takes longer hangs, so it is caught
COPIES = ROOT / "build" / "mutants"  # kept, with their compiled kernels; one for each worker
LEFT_OUT = shutil.ignore_patterns(
    ".git", ".venv*", "results", "build", "dist", "*.egg-info", "__pycache__", ".*_cache",
    ".hypothesis",
)  # fmt: skip
# Those that take the interpreter a minute or more; see KERNELS in the Makefile.
SLOW = "not (fewer_items or diffuses or in_a_crowd or drop_rate or ctrl_c or in_a_run)"


def run_tests(copy: Path, tests: Iterable[str], *, interpreted: bool, limit: float) -> str:
    """Return the first test that fails in a copy, as pytest names it; empty: none does."""
    environment = {
        **os.environ,
        "NUMBA_CACHE_DIR": str(COPIES / "numba"),
        "PYTHONPATH": str(copy),
        "PYTHONDONTWRITEBYTECODE": "1",
        "HYPOTHESIS_PROFILE": "mutants",
    }
    plugin: list[str] = []
    if interpreted:
        environment["NUMBA_DISABLE_JIT"] = "1"
        plugin = ["-p", "verification.interpreted", "-k", SLOW]
    running = subprocess.Popen(
        [sys.executable, "-m", "pytest", "-x", "-q", "--no-header", "--tb=no", "-p", "no:xdist",
         "-p", "no:cacheprovider", *plugin, *tests],
        cwd=copy, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        start_new_session=True,
    )  # fmt: skip
    try:
        said, _ = running.communicate(timeout=limit)
    except subprocess.TimeoutExpired:
        os.killpg(running.pid, signal.SIGKILL)
        running.communicate()
        return "no end"
    if running.returncode == 0:
        return ""
    # 2 and 3: a module could not be imported; pytest broke. The mutant did it, if it is one.
    failed = [line for line in said.splitlines() if line.startswith(("FAILED ", "ERROR "))]
    if running.returncode not in (1, 2, 3) and not failed:
        raise RuntimeError(f"pytest {' '.join(tests)} ended with {running.returncode}\n{said}")
    return failed[0].partition(" ")[2].split(" - ")[0] if failed else "pytest itself"


def caught_by(mutant: Mutant, copy: Path) -> str:
    """Return the first test that fails on the mutant, made in a copy; empty: none does."""
    file = copy / PACKAGE / mutant.file
    original, stamp = file.read_bytes(), file.stat()
    file.write_text(mutated(mutant, original.decode("utf-8")), encoding="utf-8")
    try:
        return run_tests(copy, mutant.tests, interpreted=mutant.interpreted, limit=LONGEST)
    finally:
        file.write_bytes(original)
        # Compiled kernels are kept by this time.
        os.utime(file, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))


def guilty(copy: Path, caught: Sequence[tuple[Mutant, str]]) -> str:
    """Return one of the tests that caught mutants if it fails without any; empty: none does."""
    for mode in (False, True):
        tests = {test for mutant, test in caught if mutant.interpreted is mode and "::" in test}
        if tests and (test := run_tests(copy, sorted(tests), interpreted=mode, limit=1800.0)):
            return test
    return ""


def main(words: Sequence[str]) -> int:
    """Make the mutants that hold one of these words; print each as it comes, then a table."""
    chosen = [
        mutant
        for mutant in read_mutants()
        if not words or any(word in f"{mutant.room} {mutant.file} {mutant.name}" for word in words)
    ]
    start, copies = time.monotonic(), [COPIES / "0", COPIES / "1"]
    free: SimpleQueue[Path] = SimpleQueue()
    for copy in copies:
        shutil.rmtree(copy, ignore_errors=True)
        shutil.copytree(ROOT, copy, symlinks=True, ignore=LEFT_OUT)
        free.put(copy)

    def made(mutant: Mutant) -> str:
        copy, began = free.get(), time.monotonic()
        try:
            test = caught_by(mutant, copy)
        finally:
            free.put(copy)
        took = f"{time.monotonic() - began:4.0f} s"
        print(f"{took}  {mutant.room}: {mutant.name}: {test or 'SURVIVES'}", flush=True)
        return test

    with ThreadPoolExecutor(len(copies)) as pool:
        found = list(zip(chosen, pool.map(made, chosen)))
    survivors = [mutant for mutant, test in found if not test]
    rooms = Counter(mutant.room for mutant in survivors)
    for room, count in Counter(mutant.room for mutant in chosen).items():
        print(f"{room}: {count - rooms[room]} of {count} caught")
    print(f"{len(survivors)} of {len(chosen)} survive, {(time.monotonic() - start) / 60:.0f} min")
    for mutant in survivors:
        print(f"SURVIVES {mutant.name}: {mutant.survives or 'should be caught'}")
    if test := guilty(copies[0], [one for one in found if one[1]]):
        print(f"{test} fails without any mutant, so it catches none")
        return 2
    return int(any(not mutant.survives for mutant in survivors))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
