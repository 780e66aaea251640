"""Ten faults made on purpose, one at a time in a scratch copy, and the tests that catch each.

python -m verification.mutants             # all of them; ends with 1 if one survives
python -m verification.mutants "FM2"       # those whose names hold this
"""

from __future__ import annotations

import ast
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
PACKAGE = "swarm_logistics_env"
WORKERS = 2  # test runs at once
LEFT_OUT = shutil.ignore_patterns(
    ".git", ".venv*", "results", "build", "dist", "*.egg-info", "__pycache__", ".*_cache",
    ".hypothesis",
)  # fmt: skip


@dataclass(frozen=True)
class Mutant:
    """A fault: one node of a syntax tree becomes another.

    Attributes:
        name: what is wrong with the mutant.
        file: the module, in the package.
        where: the function, method (`Class.method`) or constant that holds the node.
        node: the expression or statement, as Python source; its layout does not matter.
        becomes: what replaces it, as Python source; an expression replaces an expression.
        tests: those that stand nearest to the fault, for pytest.
    """

    name: str
    file: str
    where: str
    node: str
    becomes: str
    tests: tuple[str, ...]


WAREHOUSE, INVARIANTS = "tests/warehouse", "tests/verification/test_invariants.py"
MUTANTS = (
    Mutant(
        "sign of R",
        "spi/indicators.py",
        "robustness",
        '{"p_f": (p_f, 1.0, 0.0), "p_o": (p_o, -1.0, 1.0)}',
        '{"p_f": (p_f, -1.0, 0.0), "p_o": (p_o, 1.0, 1.0)}',
        ("tests/spi",),
    ),
    Mutant(
        "m/N dropped from R",
        "spi/indicators.py",
        "robustness",
        "faulty / robots",
        "0.0",
        ("tests/spi",),
    ),
    Mutant(
        "FM2 ignored",
        "warehouse/logistics.py",
        "close_grippers",
        "robots.present[robot] and able.obeys[robot] and able.lifts[robot]",
        "robots.present[robot] and able.obeys[robot]",
        (WAREHOUSE, INVARIANTS),
    ),
    Mutant(
        "timers never expire",
        "warehouse/radio.py",
        "run_timers",
        "elapsed if elapsed < limit else timer",
        "elapsed",
        (WAREHOUSE, INVARIANTS),
    ),
    Mutant(
        "drop inside the delivery area",
        "warehouse/logistics.py",
        "open_grippers",
        "robots.in_delivery[robot] and item != requested",
        "False",
        (WAREHOUSE,),
    ),
    Mutant(
        "unpaired seeds",
        "studies/plan.py",
        "Plan.runs",
        "condition.run(self.code, seed)",
        "condition.run(self.code, seed + 100 * self.conditions.index(condition))",
        ("tests/studies/test_plan.py", "tests/studies/test_study.py"),
    ),
    Mutant(
        "off by one in the last request",
        "warehouse/logistics.py",
        "ask_for_next",
        "np.all(items.status == DELIVERED)",
        "np.sum(items.status == DELIVERED) >= len(items.status) - 1",
        (WAREHOUSE, INVARIANTS),
    ),
    Mutant(
        "item duplicated on drop",
        "warehouse/logistics.py",
        "open_grippers",
        "robots.item[robot] = NOBODY",
        "pass",
        (WAREHOUSE, INVARIANTS),
    ),
    Mutant(
        "wrong robot removed in P_S",
        "warehouse/faults.py",
        "failed_robots",
        "order[: fault.robots]",
        '(order[::-1] if fault.mode == "removed" else order)[: fault.robots]',
        (WAREHOUSE, "tests/studies/test_plan.py"),
    ),
    Mutant(
        "laden robots drive through items",
        "warehouse/engine.py",
        "LADEN_ROBOT",
        "_ROBOT | _SOLID | _ITEM",
        "_ROBOT | _SOLID",
        (WAREHOUSE, INVARIANTS),
    ),
)


@contextmanager
def scratch_copy() -> Iterator[Path]:
    """Yield a copy of the repository that is gone afterwards."""
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        copy = Path(folder) / "copy"
        shutil.copytree(ROOT, copy, symlinks=True, ignore=LEFT_OUT)
        yield copy


def mutated(mutant: Mutant, source: str) -> str:
    """Return the source of `mutant.file` with the fault in it, without comments.

    Raises:
        MutantError: the code no longer has the place that the mutant was written for.
    """
    tree = ast.parse(source)
    place = _definition(tree, mutant)
    wanted, new = ast.dump(_node(mutant.node)), _node(mutant.becomes)
    found = [node for node in ast.walk(place) if ast.dump(node) == wanted]
    if len(found) != 1:
        raise MutantError(
            f"{mutant.name}: {mutant.node!r} is {len(found)} times in `{mutant.where}` of "
            f"{mutant.file}: should be there once, so adapt the mutant to the code"
        )
    _Replace(found[0], new).visit(place)
    return ast.unparse(ast.fix_missing_locations(tree))


class MutantError(ValueError):
    """A mutant whose place in the code is gone."""


class _Replace(ast.NodeTransformer):
    def __init__(self, old: ast.AST, new: ast.AST) -> None:
        self._old, self._new = old, new

    def visit(self, node: ast.AST) -> ast.AST:
        return self._new if node is self._old else super().visit(node)


def _node(source: str) -> ast.AST:
    (statement,) = ast.parse(source).body
    return statement.value if isinstance(statement, ast.Expr) else statement


def _definition(tree: ast.Module, mutant: Mutant) -> ast.AST:
    place: ast.Module | ast.ClassDef = tree
    for name in mutant.where.split("."):
        found = [node for node in place.body if name in _names(node)]
        if len(found) != 1:
            raise MutantError(
                f"{mutant.name}: {mutant.file} defines `{mutant.where}` {len(found)} times: "
                "should be once, so adapt the mutant to the code"
            )
        place = found[0]  # type: ignore[assignment]  # a name that is no class ends the path
    return place


def _names(node: ast.stmt) -> list[str]:
    """Return the names that a statement defines."""
    if isinstance(node, ast.Assign):
        return [target.id for target in node.targets if isinstance(target, ast.Name)]
    return [node.name] if isinstance(node, ast.FunctionDef | ast.ClassDef) else []


def caught_by(mutant: Mutant) -> list[str]:
    """Return the tests that fail on the mutant, as pytest names them."""
    with scratch_copy() as copy:
        file = copy / PACKAGE / mutant.file
        file.write_text(mutated(mutant, file.read_text(encoding="utf-8")), encoding="utf-8")
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
    """Make every mutant and print the tests that catch it."""
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
