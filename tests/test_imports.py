"""The import rules: one direction, no cycles, one physics file, nothing heavy by default."""

from __future__ import annotations

import ast
import graphlib
import subprocess
import sys
from collections.abc import Iterator
from importlib.util import resolve_name
from pathlib import Path
from typing import NamedTuple

import pytest

PACKAGE = "swarm_logistics_env"
ROOT = Path(__file__).parents[1]

FOUNDATION = {"errors", "records", "streams", "kernels", "scenario"}
WORLD = FOUNDATION | {"warehouse", "observations"}
RUNS = WORLD | {"motion", "policies", "episode"}
ENVIRONMENT = WORLD | {"environment", "rendering", "swarm_logistics_v0"}

# What each part of the package (a module or folder of its top level) may import besides itself.
# A new part gets a row here; a row that had to grow is a change of the design.
MAY_IMPORT: dict[str, set[str]] = {
    "errors": set(),
    "streams": {"errors"},
    "progress_bar": set(),
    "kernels": {"errors"},
    "records": {"errors"},
    "scenario": {"errors", "records", "streams"},
    "observations": FOUNDATION,
    "warehouse": FOUNDATION | {"observations"},
    "rendering": FOUNDATION | {"warehouse"},
    "environment": WORLD | {"rendering"},
    "swarm_logistics_v0": WORLD | {"environment"},
    "motion": FOUNDATION | {"observations"},
    "wrappers": ENVIRONMENT | {"motion", "spi"},
    "policies": WORLD | {"motion"},
    "adapters": ENVIRONMENT | {"motion", "policies", "wrappers"},
    "episode": WORLD | {"policies"},
    "spi": set(),
    "watch": RUNS | {"rendering", "spi"},
    "tasks": RUNS,
    "studies": RUNS | {"progress_bar", "spi", "tasks"},
    "report": {"errors", "records", "warehouse", "spi", "tasks", "studies"},
    "attack": RUNS | {"spi", "tasks", "studies"},
    "train": RUNS
    | ENVIRONMENT
    | {"progress_bar", "wrappers", "adapters", "spi", "tasks", "studies"},
    "testing": RUNS | ENVIRONMENT | {"spi"},
}
# A Study offers its report, so it stands above both; the other modules of studies stand below.
MAY_IMPORT["Study"] = MAY_IMPORT["report"] | {"report"}
MAY_IMPORT["train"] |= {"Study", "report", "progress_bar"}
# The front doors import whatever they offer.
MAY_IMPORT["cli"] = set(MAY_IMPORT)
MAY_IMPORT["__init__"] = set(MAY_IMPORT)
MAY_IMPORT["__main__"] = {"cli"}

HEAVY = {"torch", "pandas", "matplotlib", "pygame", "scipy.stats"}


class Import(NamedTuple):
    """One import statement: the module it stands in, the module it loads, and when."""

    importer: str
    imported: str
    line: int
    at_import_time: bool


def module_name(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_name(path): path for path in sorted((ROOT / PACKAGE).rglob("*.py"))}


def imports_in(tree: ast.AST, *, at_import_time: bool = True) -> Iterator[tuple[ast.stmt, bool]]:
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            yield node, at_import_time
        else:
            runs_later = isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)
            for_types = isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
            now = at_import_time and not runs_later and not for_types
            yield from imports_in(node, at_import_time=now)


def all_imports() -> list[Import]:
    found = []
    for importer, path in MODULES.items():
        for node, now in imports_in(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                targets = [alias.name for alias in node.names]
            else:
                assert isinstance(node, ast.ImportFrom)
                folder = importer if path.name == "__init__.py" else importer.rpartition(".")[0]
                base = resolve_name("." * node.level + (node.module or ""), folder)
                members = [f"{base}.{alias.name}" for alias in node.names]
                targets = [member if member in MODULES else base for member in members]
            found += [Import(importer, target, node.lineno, now) for target in targets]
    return found


IMPORTS = all_imports()
OWN_IMPORTS = [i for i in IMPORTS if i.imported.split(".")[0] == PACKAGE]


def part(module: str) -> str:
    """The part of the package a module belongs to: `warehouse` for `….warehouse.physics`."""
    if module in {f"{PACKAGE}.studies", f"{PACKAGE}.studies.study"}:
        return "Study"
    return module.split(".")[1] if "." in module else "__init__"


def test_table_has_every_part_and_points_one_way() -> None:
    assert MODULES, f"no module found in {ROOT / PACKAGE}"
    assert {part(module) for module in MODULES} - set(MAY_IMPORT) == set()
    graph = {p: allowed for p, allowed in MAY_IMPORT.items() if p not in {"cli", "__init__"}}
    graphlib.TopologicalSorter(graph).prepare()  # raises CycleError


def test_imports_point_one_way() -> None:
    uphill = [
        f"{i.importer}:{i.line} imports {i.imported}"
        for i in OWN_IMPORTS
        if part(i.imported) not in MAY_IMPORT.get(part(i.importer), set()) | {part(i.importer)}
    ]
    assert uphill == []


def test_no_module_waits_for_itself() -> None:
    graph: dict[str, set[str]] = {module: set() for module in MODULES}
    for i in OWN_IMPORTS:
        if i.at_import_time:
            graph[i.importer].add(i.imported)
    graphlib.TopologicalSorter(graph).prepare()  # raises CycleError, which names the modules


def test_only_physics_knows_pymunk() -> None:
    users = {i.importer for i in IMPORTS if i.imported.split(".")[0] == "pymunk"}
    assert users <= {f"{PACKAGE}.warehouse.physics"}


@pytest.mark.parametrize("module", [PACKAGE, f"{PACKAGE}.swarm_logistics_v0", f"{PACKAGE}.spi"])
def test_importing_loads_nothing_heavy(module: str) -> None:
    script = f"import sys, {module}; print(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    loaded = set(done.stdout.split())
    assert loaded & (HEAVY | {f"{PACKAGE}.rendering"}) == set()
