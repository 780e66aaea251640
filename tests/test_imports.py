"""The import rules: one direction, no cycles, one physics file, nothing heavy by default."""

from __future__ import annotations

import ast
import functools
import graphlib
import importlib
import inspect
import subprocess
import sys
from collections.abc import Iterator
from importlib.util import resolve_name
from pathlib import Path

import pytest

PACKAGE = "swarm_logistics_env"
ROOT = Path(__file__).parents[1]

# What each room may import besides itself, from the ground up: a room sees those below it alone.
# A new room gets a row here; a row that had to grow is a change of the design.
MAY_IMPORT: dict[str, set[str]] = {
    "core": set(),
    "compiler": set(),
    "spi": {"core"},
    "world": {"compiler", "core"},
    "environment": {"compiler", "core", "world"},
    "wrappers": {"core", "environment", "spi", "world"},
    "policies": {"compiler", "core", "environment", "spi", "world", "wrappers"},
    "adapters": {"core", "environment", "policies", "world", "wrappers"},
    "robots": {"compiler", "core", "policies", "world"},
    "study": {"compiler", "core", "policies", "spi", "world"},
}
MAY_IMPORT["train"] = {*MAY_IMPORT}
MAY_IMPORT["views"] = {"core", "policies", "robots", "spi", "study", "train", "world"}
MAY_IMPORT["__main__"] = {"views"}
MAY_IMPORT["__init__"] = {*MAY_IMPORT}  # offers names of all rooms
# What was played, and what it says.
APART = {("study.runs", "study.verdicts"), ("study.verdicts", "study.runs")}

HEAVY = {"torch", "pandas", "matplotlib", "pygame", "scipy.stats", f"{PACKAGE}.world.rendering"}
MODULES = {
    ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path
    for path in sorted((ROOT / PACKAGE).rglob("*.py"))
}


@functools.cache
def all_imports() -> list[tuple[str, int, str]]:
    """Return the module that each import stands in, its line, and the module that it loads."""
    return list(_imports())


def _imports() -> Iterator[tuple[str, int, str]]:
    for importer, path in MODULES.items():
        folder = importer if path.name == "__init__.py" else importer.rpartition(".")[0]
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                yield from ((importer, node.lineno, alias.name) for alias in node.names)
            elif isinstance(node, ast.ImportFrom):
                base = resolve_name("." * node.level + (node.module or ""), folder)
                for member in (f"{base}.{alias.name}" for alias in node.names):
                    yield importer, node.lineno, member if member in MODULES else base


def room(module: str) -> str:
    """The room that a module lies in: `world` for `….world.warehouse.physics`."""
    return module.split(".")[1] if "." in module else "__init__"


def inner_room(module: str) -> str:
    """A folder or file of a room: `world.warehouse` for `….world.warehouse.physics`."""
    return ".".join(module.split(".")[1:3])


def test_imports_point_one_way_as_the_table_has_it() -> None:
    assert {room(module) for module in MODULES} - set(MAY_IMPORT) == set()
    graphlib.TopologicalSorter(MAY_IMPORT).prepare()  # raises CycleError
    uphill = [
        f"{importer}:{line} imports {imported}"
        for importer, line, imported in all_imports()
        if imported.split(".")[0] == PACKAGE
        and room(imported) not in MAY_IMPORT[room(importer)] | {room(importer)}
    ]
    assert uphill == []


def test_files_do_not_import_in_circles_not_even_for_types() -> None:
    imports: dict[str, set[str]] = {}
    for importer, _, imported in all_imports():
        # What a folder offers stands in its files.
        if imported in MODULES and MODULES[imported].name != "__init__.py":
            imports.setdefault(importer, set()).add(imported)
    graphlib.TopologicalSorter(imports).prepare()  # raises CycleError


def test_rooms_within_a_room_do_not_import_in_circles() -> None:
    below: dict[str, set[str]] = {}
    for importer, _, imported in all_imports():
        rooms = (inner_room(importer), inner_room(imported))
        if rooms[0] != rooms[1] and imported.startswith(PACKAGE):
            below.setdefault(rooms[0], set()).add(rooms[1])
    graphlib.TopologicalSorter(below).prepare()  # raises CycleError
    assert not [pair for pair in APART if pair[1] in below[pair[0]]]


def test_only_physics_knows_pymunk() -> None:
    users = {
        importer for importer, _, imported in all_imports() if imported.split(".")[0] == "pymunk"
    }
    assert users == {f"{PACKAGE}.world.warehouse.physics"}


@pytest.mark.parametrize("module", ["adapters.swarm_logistics_v0", "spi"])
def test_importing_loads_nothing_heavy(module: str) -> None:
    command = [sys.executable, "-c", f"import sys, {PACKAGE}.{module}; print(*sys.modules)"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    assert set(done.stdout.split()) & HEAVY == set()


def test_a_missing_attribute_of_a_lazy_module_is_an_attribute_error() -> None:
    names = [name for name, path in MODULES.items() if "def __getattr__(name" in path.read_text()]
    assert {PACKAGE, f"{PACKAGE}.policies", f"{PACKAGE}.adapters"} <= {*names}
    for module in map(importlib.import_module, names):
        with pytest.raises(AttributeError, match="no_such_name"):
            _ = module.no_such_name
        # What looks for any name, as doctest, copy and mocks do.
        assert not inspect.isabstract(module)
        assert not hasattr(module, "__deepcopy__")
