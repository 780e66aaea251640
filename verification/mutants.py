"""Ten faults made on purpose, one at a time in a scratch copy, and the tests that catch each.

python -m verification.mutants             # all of them; ends with 1 if one survives
python -m verification.mutants "FM2"       # those whose name holds this
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
WORKERS = 2  # test runs at once
LEFT_OUT = shutil.ignore_patterns(
    ".git", ".venv*", "results", "build", "dist", "*.egg-info", "__pycache__", ".*_cache",
    ".hypothesis",
)  # fmt: skip


@dataclass(frozen=True)
class Mutant:
    """A fault: `old` in `file` becomes `new`; `tests` are those that stand nearest to it."""

    name: str
    file: str
    old: str
    new: str
    tests: tuple[str, ...]


WAREHOUSE, LOGISTICS = "tests/warehouse", "swarm_logistics_env/warehouse/logistics.py"
MUTANTS = (
    Mutant(
        "sign of R",
        "swarm_logistics_env/spi/indicators.py",
        '"p_f": (p_f, 1.0, 0.0),\n            "p_o": (p_o, -1.0, 1.0),',
        '"p_f": (p_f, -1.0, 0.0),\n            "p_o": (p_o, 1.0, 1.0),',
        ("tests/spi",),
    ),
    Mutant(
        "m/N dropped from R",
        "swarm_logistics_env/spi/indicators.py",
        "offset=faulty / robots",
        "offset=0.0",
        ("tests/spi",),
    ),
    Mutant(
        "FM2 ignored",
        LOGISTICS,
        " and able.lifts[robot]",
        "",
        (WAREHOUSE, "tests/verification/test_invariants.py", "tests/testing"),
    ),
    Mutant(
        "timers never expire",
        "swarm_logistics_env/warehouse/radio.py",
        "timer = elapsed if elapsed < limit else timer",
        "timer = elapsed",
        (WAREHOUSE, "tests/verification/test_invariants.py"),
    ),
    Mutant(
        "drop inside the delivery area",
        LOGISTICS,
        "if robots.in_delivery[robot] and item != requested:",
        "if False:",
        (WAREHOUSE,),
    ),
    Mutant(
        "unpaired seeds",
        "swarm_logistics_env/studies/plan.py",
        "yield condition.run(self.code, seed)",
        "yield condition.run(self.code, seed + 100 * self.conditions.index(condition))",
        ("tests/studies/test_plan.py", "tests/studies/test_study.py"),
    ),
    Mutant(
        "off by one in the last request",
        LOGISTICS,
        "if np.all(items.status == DELIVERED):",
        "if np.sum(items.status == DELIVERED) >= len(items.status) - 1:",
        (WAREHOUSE, "tests/verification/test_invariants.py"),
    ),
    Mutant(
        "item duplicated on drop",
        LOGISTICS,
        "        robots.item[robot] = NOBODY\n        items.status[item] = STORED",
        "        items.status[item] = STORED",
        (WAREHOUSE, "tests/verification/test_invariants.py", "tests/testing"),
    ),
    Mutant(
        "wrong robot removed in P_S",
        "swarm_logistics_env/warehouse/faults.py",
        "return np.sort(order[: fault.robots]).astype(np.int64)",
        'order = order[::-1] if fault.mode == "removed" else order\n'
        "    return np.sort(order[: fault.robots]).astype(np.int64)",
        (WAREHOUSE, "tests/studies/test_plan.py"),
    ),
    Mutant(
        "laden robots drive through items",
        "swarm_logistics_env/warehouse/engine.py",
        "(_ROBOT | _SOLID | _ITEM) << _MASK",
        "(_ROBOT | _SOLID) << _MASK",
        (WAREHOUSE, "tests/verification/test_invariants.py"),
    ),
)


@contextmanager
def scratch_copy() -> Iterator[Path]:
    """Yield a copy of the repository that is gone afterwards."""
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        copy = Path(folder) / "copy"
        shutil.copytree(ROOT, copy, symlinks=True, ignore=LEFT_OUT)
        yield copy


def apply(mutant: Mutant, copy: Path) -> None:
    """Make the fault.

    Raises:
        ValueError: the code is not what the mutant was written for.
    """
    path = copy / mutant.file
    source = path.read_text(encoding="utf-8")
    if source.count(mutant.old) != 1:
        raise ValueError(f"{mutant.name}: {mutant.file} holds {mutant.old!r} not once")
    path.write_text(source.replace(mutant.old, mutant.new), encoding="utf-8")


def caught_by(mutant: Mutant) -> list[str]:
    """Return the tests that fail on the mutant, as pytest names them."""
    with scratch_copy() as copy:
        apply(mutant, copy)
        environment = {
            **os.environ,
            "NUMBA_CACHE_DIR": str(copy / "numba"),
            "PYTHONPATH": str(copy),
        }
        done = subprocess.run(
            [sys.executable, "-m", "pytest", "-q", "--no-header", "--tb=no", "-p", "no:xdist",
             "-p", "no:cacheprovider", *mutant.tests],
            cwd=copy, env=environment, capture_output=True, text=True, check=False,
        )  # fmt: skip
    if done.returncode not in (0, 1):
        raise RuntimeError(f"{mutant.name}: pytest ended with {done.returncode}\n{done.stdout}")
    lines = done.stdout.splitlines()
    failed = [line.split(" ", 1)[1] for line in lines if line.startswith(("FAILED ", "ERROR "))]
    return [name.split(" - ")[0] for name in failed]


def main() -> int:
    """Make every mutant, print what caught it."""
    wanted = sys.argv[1] if len(sys.argv) > 1 else ""
    chosen = [mutant for mutant in MUTANTS if wanted in mutant.name]
    survivors = 0
    with ThreadPoolExecutor(WORKERS) as pool:
        for mutant, tests in zip(chosen, pool.map(caught_by, chosen), strict=True):
            survivors += not tests
            print(f"{mutant.name}: {len(tests)} tests" if tests else f"{mutant.name}: SURVIVES")
            for test in tests:
                print(f"    {test}")
    return 1 if survivors else 0


if __name__ == "__main__":
    sys.exit(main())
