"""Faults drawn over the whole package, and the share of them that the gate does not catch.

Near tests are asked: those that run the line, where a record says which do, and those of near
files; then golden trajectories; then those that compare with a recorded file, or generated pages
with the code, both only where their files run the line. Then the type checker runs; the share
without it is printed, too.
"""

from __future__ import annotations

import ast
import hashlib
import itertools
import json
import os
import time
from collections import Counter
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy import stats

from . import budget
from .copies import NO_END, NO_IMPORT, Copies, run_tests, type_errors, written
from .mutation import PACKAGE, read_equal, replaced
from .nearest import Nearest
from .places import Place, find_places, is_kernel, required_parameters
from .reached import Reached

SECONDS_OF_COMPILING = 60.0  # of a core, for kernels that are compiled anew
SECONDS_OF_REACHING = 40.0  # of the tests that run a line; the nearest follow
LONGEST = 400.0  # [s] of the clock after which the tests of a fault are stopped
# What worlds and policies do, to the bit: asked of faults in them that no other test catches.
_TRAJECTORIES = "tests/verification/test_trajectories.py"
# What every room gives, as files hold it: asked of faults that no nearer test catches.
_RECORDED = "test_recorded*.py"
# Pages hold signatures, defaults and tables that come from the code: asked of these faults, too.
_GENERATED = "tests/test_docs.py::test_generated_tables_are_current"
# Nodes of ROS 2, which the gate has not: `make ros` tests them.
_NOT_IN_GATE = ("robots/ros_robot.py", "robots/ros_world.py")
_COMPILER = ("numba", "llvmlite")  # who imports these changes how kernels are compiled
# Kernels that were compiled once serve all faults that are in none; see `fast_kernels`.
_FENCE = "fast_kernels.py"
_DIGEST = "return digest.hexdigest()"
_NO_DIGEST = 'return "the same for all faults"'
_BY_TYPES = "mypy: "  # begins what the type checker says of a fault that no test catches


class Fault(NamedTuple):
    """A change of one node, and how its tests run."""

    file: str  # in the package
    line: int
    where: str  # function, method or constant that holds it
    before: str  # the node, as Python source
    after: str
    text: str  # the line of the file
    source: str  # of the file with the fault in it
    tests: tuple[str, ...]  # the nearest
    wide: tuple[tuple[str, ...], ...]  # those asked if the nearest catch nothing, group by group
    interpreted: bool  # whether kernels run in the interpreter, as it changes one
    compiles_anew: bool  # whether it may change how kernels are compiled

    @property
    def room(self) -> str:
        """The first folder below the package; of what stands in none, the package's name."""
        first, _, rest = self.file.partition("/")
        return first if rest else PACKAGE

    @property
    def key(self) -> str:
        """A digest that no other fault has."""
        return hashlib.sha256(f"{self.file}\n{self.source}".encode()).hexdigest()

    def __str__(self) -> str:
        return f"{self.file}:{self.line} {self.before} -> {self.after}   | {self.text}"


class Made:
    """What was made of faults before, so that a sample that was stopped goes on.

    Args:
        path: of a file that a line is added to for each fault.
        tree: digest of the package and its tests; what was made of another tree does not count.
    """

    def __init__(self, path: Path, tree: str) -> None:
        self._path = path
        self._tree = tree
        lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
        rows = [row for line in lines if (row := _row_of(line)) is not None]
        self._tests = {fault: test for of_tree, fault, test in rows if of_tree == tree}

    def test_of(self, fault: Fault) -> str | None:
        """Return what caught a fault, empty if nothing did; None: it was not made."""
        return self._tests.get(fault.key)

    def add(self, fault: Fault, test: str) -> None:
        """Keep what caught a fault, if anything did."""
        with self._path.open("a", encoding="utf-8") as file:
            file.write(f"\n{json.dumps([self._tree, fault.key, test])}")


def _row_of(line: str) -> list[str] | None:
    """Return the row of a line; None: a kill cut it off, or it is empty."""
    try:
        row: list[str] = json.loads(line)
    except ValueError:
        return None
    return row


class Package:
    """The sources of the package, in which faults are drawn.

    Args:
        root: of the tree.
        words: a file counts if its path holds one of these; none: all files.
        reached: which tests run which lines; None: nearest are tests by their names alone.
    """

    def __init__(
        self, root: Path, words: Sequence[str] = (), reached: Reached | None = None
    ) -> None:
        self._reached = reached
        folder = root / PACKAGE
        paths = {str(path.relative_to(folder)): path for path in sorted(folder.rglob("*.py"))}
        self._sources = {file: path.read_text(encoding="utf-8") for file, path in paths.items()}
        trees = {file: ast.parse(source) for file, source in self._sources.items()}
        self._required = required_parameters(trees.values())
        self._nearest = Nearest(root)
        self._feeds_kernels = _files_of_kernels(trees, self._nearest)
        self._compiler = {file for file, tree in trees.items() if _imports_compiler(tree)}
        recorded = sorted((root / "tests").rglob(_RECORDED))
        self._recorded = [*(str(path.relative_to(root)) for path in recorded), _GENERATED]
        if reached is not None:
            self._recorded = reached.quickest_first(self._recorded)
        # File and number of each place in it.
        self.places = [
            (file, number)
            for file, tree in trees.items()
            if file not in _NOT_IN_GATE
            if not words or any(word in file for word in words)
            for number in range(len(find_places(tree, self._required)))
        ]

    def fault(self, index: int, generator: np.random.Generator) -> Fault:
        """Return a fault at a place, with one of its replacements, each as likely."""
        file, number = self.places[index]
        source = self._sources[file]
        tree = ast.parse(source)
        place = find_places(tree, self._required)[number]
        new = place.replacements[generator.integers(len(place.replacements))]
        is_read_by_kernels = place.is_in_kernel or (
            place.is_outside_functions and file in self._feeds_kernels
        )
        return Fault(
            file=file,
            line=place.node.lineno,
            where=place.where,
            before=shown(place.node),
            after=shown(new),
            text=source.splitlines()[place.node.lineno - 1].strip(),
            source=replaced(tree, place.node, new),
            tests=self._tests(file, place),
            wide=self._wide_tests(file, place),
            interpreted=is_read_by_kernels,
            compiles_anew=file in self._compiler and not is_read_by_kernels,
        )

    def _tests(self, file: str, place: Place) -> tuple[str, ...]:
        """Return the tests that run a place, the quickest first, then the nearest files."""
        nearest = self._nearest.of(file)
        if self._reached is None or place.is_outside_functions:
            return tuple(nearest)
        return (*self._reached.of(file, _lines(place), SECONDS_OF_REACHING), *nearest)

    def _wide_tests(self, file: str, place: Place) -> tuple[tuple[str, ...], ...]:
        """Return the trajectories and the recorded files that may run a place."""
        played = [_TRAJECTORIES] if self._nearest.is_played(file) else []
        is_traced = not (place.is_outside_functions or place.is_in_kernel)
        files: set[str] = set()
        if self._reached is not None and is_traced:
            files = self._reached.files_of(file, _lines(place))
        groups = (
            tuple(test for test in tests if not files or test.partition("::")[0] in files)
            for tests in (played, self._recorded)
        )
        return tuple(group for group in groups if group)


def _lines(place: Place) -> range:
    """Return the lines of a place; of a condition with its branches, those of the condition."""
    node = place.node.test if isinstance(place.node, ast.If) else place.node
    return range(node.lineno, (node.end_lineno or node.lineno) + 1)


def draw(package: Package, seed: int) -> Iterable[Fault]:
    """Yield faults at random places, each place once and each as likely; equal ones left out."""
    generator = np.random.default_rng(seed)
    equal = {(mutant.file, mutant.where, mutant.node, mutant.becomes) for mutant in read_equal()}
    for index in generator.permutation(len(package.places)):
        fault = package.fault(int(index), generator)
        if (fault.file, fault.where, fault.before, fault.after) not in equal and fault.tests:
            yield fault


def measure_sample(
    count: int,
    seed: int,
    package: Package,
    copies: Copies,
    n_workers: int,
    seconds: float,
    record: Made,
) -> int:
    """Make `count` faults at places of a package; print what survives.

    `seconds`: of a core, after which no further test of a group begins; where kernels are compiled
    anew, later by `SECONDS_OF_COMPILING`. Returns 2 if a test that caught faults also fails without
    one, else 0. Golden trajectories are checked before the first fault, other tests at the end.
    """
    start = time.monotonic()
    with copies.borrow() as copy:
        if (copy / _TRAJECTORIES).exists() and _print_guilty(copy, [_TRAJECTORIES], False):
            return 2
    os.environ[budget.SECONDS] = str(seconds)
    faults = iter(draw(package, seed))
    results: list[tuple[Fault, str]] = []
    n_not_imported = 0
    ends: dict[tuple[str, ...], str] = {}

    def make(fault: Fault) -> tuple[Fault, str]:
        made_before = record.test_of(fault)
        if made_before is not None:
            return fault, made_before
        began = time.monotonic()
        with copies.borrow() as copy:
            test = _caught_by(fault, copy)
            if test == NO_END and fault.tests not in ends:
                ends[fault.tests] = _run(fault, copy)  # slow tests are no sign of a fault
            if test == NO_END and ends[fault.tests] == NO_END:
                test = ""
            test = test or _refused_by_types(fault, copy)
        record.add(fault, test)
        print(f"{time.monotonic() - began:4.0f} s  {fault}: {test or 'SURVIVES'}", flush=True)
        return fault, test

    with ThreadPoolExecutor(n_workers) as pool:
        while len(results) < count:
            drawn = list(itertools.islice(faults, count - len(results)))
            if not drawn:
                break
            made = list(pool.map(make, drawn))
            sound = [(fault, test) for fault, test in made if not _is_at_import(test)]
            n_not_imported += len(made) - len(sound)
            results += sound
    print_shares(results)
    print(f"{n_not_imported} more let no module be imported, so they are not counted")
    print(f"{(time.monotonic() - start) / 60:.0f} min")
    with copies.borrow() as copy:
        for mode in (False, True):
            of_mode = {test for fault, test in results if _is_interpreted(fault, test) is mode}
            catching_tests = sorted(test for test in of_mode if "::" in test)
            if _print_guilty(copy, catching_tests, mode):
                return 2
    return 0


def _is_interpreted(fault: Fault, test: str) -> bool:
    """Return whether the interpreter ran the kernels in the test that caught a fault."""
    wide = {name.partition("::")[0] for group in fault.wide for name in group}
    return fault.interpreted and test.partition("::")[0] not in wide


def print_shares(results: Sequence[tuple[Fault, str]]) -> None:
    """Print the share that survives, room by room, with its 95 % interval, and the survivors."""
    survivors = [fault for fault, test in results if not test]
    n_survivors = Counter(fault.room for fault in survivors)
    counts = Counter(fault.room for fault, _ in results)
    for room, count in sorted(counts.items()):
        print(f"{room}: {_share(n_survivors[room], count)}")
    print(f"all: {_share(len(survivors), len(results))}")
    n_of_types = sum(test.startswith(_BY_TYPES) for _, test in results)
    print(f"tests alone: {_share(len(survivors) + n_of_types, len(results))}")
    for fault in sorted(survivors):
        print(f"SURVIVES {fault}")


def _share(count: int, total: int) -> str:
    """Return a share in words, with Wilson's interval (Wilson 1927)."""
    low, high = stats.binomtest(count, total).proportion_ci(method="wilson")
    return f"{count} of {total} survive, {count / total:.1%} [{low:.1%}, {high:.1%}]"


def _caught_by(fault: Fault, copy: Path) -> str:
    test = _caught_by_nearest(fault, copy)
    if test:
        return test
    # Each group has time of its own, as kernels may be compiled anew for most of it.
    for group in fault.wide:
        # Kernels are compiled, as the interpreter would take minutes.
        anew = fault.interpreted or fault.compiles_anew
        wide = fault._replace(tests=group, interpreted=False, compiles_anew=anew)
        if test := _caught_by_nearest(wide, copy):
            return test
    return ""


def _refused_by_types(fault: Fault, copy: Path) -> str:
    """Return what the type checker says of a fault alone; empty: nothing."""
    file = copy / PACKAGE / fault.file
    source = file.read_text(encoding="utf-8")
    with written(file, fault.source):
        errors = type_errors(copy)
    if errors:
        # A fault is written without comments, and so without what comments ignore.
        with written(file, ast.unparse(ast.parse(source))):
            errors -= type_errors(copy)
    return "".join(f"{_BY_TYPES}{error}" for error in sorted(errors)[:1])


def _caught_by_nearest(fault: Fault, copy: Path) -> str:
    (fence,) = (copy / PACKAGE).rglob(_FENCE)
    file = copy / PACKAGE / fault.file
    with ExitStack() as changes:
        if not fault.compiles_anew:
            source = fence.read_text(encoding="utf-8")
            assert _DIGEST in source
            changes.enter_context(written(fence, source.replace(_DIGEST, _NO_DIGEST)))
        changes.enter_context(written(file, fault.source))
        return _run(fault, copy)


def _run(fault: Fault, copy: Path) -> str:
    options = ["-p", budget.__name__]
    if fault.interpreted:
        options += ["-m", "not compiled"]
    kernels = "numba-anew" if fault.compiles_anew else "numba"
    seconds = float(os.environ[budget.SECONDS]) + fault.compiles_anew * SECONDS_OF_COMPILING
    return run_tests(
        copy,
        fault.tests,
        interpreted=fault.interpreted,
        limit=LONGEST,
        kernels=kernels,
        options=options,
        variables={budget.SECONDS: str(seconds)},
    )


def _print_guilty(copy: Path, tests: Sequence[str], interpreted: bool) -> bool:
    """Print the first of the tests that fails without any fault; return whether there is one."""
    test = run_tests(copy, tests, interpreted=interpreted, limit=1800.0) if tests else ""
    if test:
        print(f"{test} fails without any fault, so it catches none", flush=True)
    return bool(test)


def _is_at_import(test: str) -> bool:
    """Return whether tests could not be read: a weak fault, which every test would catch."""
    is_by_types = test.startswith(_BY_TYPES)
    return test == NO_IMPORT or (test not in ("", NO_END) and "::" not in test and not is_by_types)


def shown(node: ast.expr | ast.stmt) -> str:
    """Return a node as Python source; of a condition with its branches, the condition alone."""
    return ast.unparse(node.test) if isinstance(node, ast.If) else ast.unparse(node)


def _imports_compiler(tree: ast.Module) -> bool:
    names = [
        alias.name if isinstance(node, ast.Import) else str(node.module)
        for node in ast.walk(tree)
        if isinstance(node, ast.Import | ast.ImportFrom)
        for alias in node.names
    ]
    return any(name.partition(".")[0] in _COMPILER for name in names)


def _files_of_kernels(trees: dict[str, ast.Module], nearest: Nearest) -> set[str]:
    """Return the files that hold kernels, and those whose names kernels read."""
    files = set()
    for file, tree in trees.items():
        kernels = [node for node in ast.walk(tree) if is_kernel(node)]
        statements = [statement for kernel in kernels for statement in kernel.body]
        nodes = [node for statement in statements for node in ast.walk(statement)]
        names = {node.id for node in nodes if isinstance(node, ast.Name)}
        if names:
            files |= {file, *nearest.sources_of(file, names)}
    return files
