"""The import rules: one direction, no cycles, one physics file, nothing heavy by default."""

from __future__ import annotations

import ast
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

FOUNDATION = {"errors", "records", "streams", "kernels", "numba_fence", "floor", "scenario"}
WORLD = FOUNDATION | {"bodies", "warehouse", "observations"}
RUNS = WORLD | {"motion", "policies", "episode"}
ENVIRONMENT = WORLD | {"environment", "rendering", "swarm_logistics_v0"}

# What each part of the package (a module or folder of its top level) may import besides itself.
# A new part gets a row here; a row that had to grow is a change of the design.
MAY_IMPORT: dict[str, set[str]] = {
    "errors": set(),
    "streams": {"errors"},
    "progress_bar": set(),
    "numba_fence": set(),
    "fast_kernels": {"numba_fence"},
    "kernels": {"fast_kernels", "numba_fence"},
    "csv_cells": set(),
    "records": {"csv_cells", "errors"},
    "floor": {"errors", "kernels"},
    "scenario": {"errors", "floor", "records"},
    "current_folder": set(),
    "code_files": {"current_folder", "errors"},
    "model_parts": set(),
    "fingerprint": {"code_files", "errors", "model_parts"},
    "observations": FOUNDATION,
    "bodies": FOUNDATION | {"code_files"},
    "warehouse": FOUNDATION | {"bodies", "observations"},
    "rendering": FOUNDATION | {"warehouse"},
    "environment": WORLD | {"code_files", "rendering"},  # a reward may be a function of the user's
    "swarm_logistics_v0": WORLD | {"environment"},
    "motion": FOUNDATION | {"observations"},
    "wrappers": ENVIRONMENT | {"motion", "spi"},
    "policies": WORLD | {"code_files", "current_folder", "fingerprint", "motion"},
    "adapters": ENVIRONMENT | {"motion", "policies", "wrappers"},
    "episode": WORLD | {"policies", "environment"},  # that a policy names
    "spi": {"csv_cells", "errors"},
    "watch": RUNS | {"rendering", "spi"},
    "tasks": RUNS | {"code_files", "current_folder", "fingerprint"},
    "questions": {"errors", "policies", "records", "spi", "tasks"},
    # Neither knows the other: what was played, and what it says.
    "runs": RUNS | {"current_folder", "fingerprint", "progress_bar", "questions", "spi", "tasks"},
    "verdicts": {"errors", "questions", "records", "spi", "tasks"},
    "report": {
        "errors",
        "questions",
        "records",
        "spi",
        "tasks",
        "verdicts",
    },
    "studies": {"errors", "questions", "report", "runs", "tasks", "verdicts"},
    "trial_study": {"report", "runs", "spi", "verdicts"},
    "attack": RUNS | {"questions", "runs", "spi", "tasks", "verdicts"},
    "testing": RUNS | ENVIRONMENT | {"spi"},
    "demonstrations": RUNS | ENVIRONMENT | {"progress_bar", "wrappers"},
}
MAY_IMPORT["train"] = RUNS | ENVIRONMENT | MAY_IMPORT["studies"] | MAY_IMPORT["report"]
MAY_IMPORT["train"] |= {"adapters", "fingerprint", "progress_bar", "studies", "wrappers"}
# The front doors import whatever they offer.
MAY_IMPORT["cli"] = set(MAY_IMPORT)
MAY_IMPORT["__init__"] = set(MAY_IMPORT)
MAY_IMPORT["__main__"] = {"cli"}

HEAVY = {"torch", "pandas", "matplotlib", "pygame", "scipy.stats", f"{PACKAGE}.rendering"}
MODULES = {
    ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path
    for path in sorted((ROOT / PACKAGE).rglob("*.py"))
}


def all_imports() -> Iterator[tuple[str, int, str]]:
    """Yield the module that each import stands in, its line, and the module that it loads."""
    for importer, path in MODULES.items():
        folder = importer if path.name == "__init__.py" else importer.rpartition(".")[0]
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                yield from ((importer, node.lineno, alias.name) for alias in node.names)
            elif isinstance(node, ast.ImportFrom):
                base = resolve_name("." * node.level + (node.module or ""), folder)
                for member in (f"{base}.{alias.name}" for alias in node.names):
                    yield importer, node.lineno, member if member in MODULES else base


IMPORTS = list(all_imports())


def part(module: str) -> str:
    """The part of the package a module belongs to: `warehouse` for `….warehouse.physics`."""
    return module.split(".")[1] if "." in module else "__init__"


def test_imports_point_one_way_as_the_table_has_it() -> None:
    assert {part(module) for module in MODULES} - set(MAY_IMPORT) == set()
    graph = {p: allowed for p, allowed in MAY_IMPORT.items() if p not in {"cli", "__init__"}}
    graphlib.TopologicalSorter(graph).prepare()  # raises CycleError
    uphill = [
        f"{importer}:{line} imports {imported}"
        for importer, line, imported in IMPORTS
        if imported.split(".")[0] == PACKAGE
        and part(imported) not in MAY_IMPORT[part(importer)] | {part(importer)}
    ]
    assert uphill == []


def test_only_physics_knows_pymunk() -> None:
    users = {importer for importer, _, imported in IMPORTS if imported.split(".")[0] == "pymunk"}
    assert users == {f"{PACKAGE}.warehouse.physics"}


@pytest.mark.parametrize("module", [PACKAGE, f"{PACKAGE}.swarm_logistics_v0", f"{PACKAGE}.spi"])
def test_importing_loads_nothing_heavy(module: str) -> None:
    command = [sys.executable, "-c", f"import sys, {module}; print(*sys.modules)"]
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
