"""The tests nearest to a module, by names alone, so that a folder that is renamed needs no edit.

First the mirror (`tests/a/test_b.py` of `a/b.py`), then tests that import the module or what it
defines, then the mirrors of the modules that import it, or where one has none those that begin as
its name does, then the tests of its folder.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from importlib.util import resolve_name
from pathlib import Path
from typing import NamedTuple

from .mutation import PACKAGE

MOST_FILES = 8
PLAYS = "verification/trajectories.py"


class _Names(NamedTuple):
    """The names of a Python file."""

    imported: list[tuple[str, str]]  # module and name of each import, wherever it stands
    defined: set[str]  # functions and classes at the top
    used: set[str]  # variables and attributes


class Nearest:
    """Which tests are nearest to each module of the package in a copy of the tree."""

    def __init__(self, root: Path) -> None:
        self._root = root
        paths = sorted((root / PACKAGE).rglob("*.py"))
        self._paths = {_dotted(path.relative_to(root)): path for path in paths}
        self._names = {module: _read(path, module) for module, path in self._paths.items()}
        # The module that defines what a package offers.
        self._exports = {
            (package, name): module
            for package, names in self._names.items()
            for module, name in names.imported
            if self._paths[package].stem == "__init__" and module in self._paths
        }
        self._imports = {module: self._modules_of(names) for module, names in self._names.items()}
        tests = sorted((root / "tests").rglob("test_*.py"))
        self._tests = {test: _read(test, "") for test in tests}
        self._imports_of_tests = {test: self._modules_of(self._tests[test]) for test in tests}
        self._played = self._reached_from(root / PLAYS)

    def of(self, file: str) -> list[str]:
        """Return the nearest files of tests, the nearest first, of a file in the package."""
        module = _dotted(Path(PACKAGE) / file)
        folder = self._folder_of_tests(Path(file).parent)
        defined = self._names[module].defined

        def rank(test: Path) -> tuple[int, bool]:
            """Order tests by what they use of the module, then by names: judging, test_judge."""
            first_letters = test.stem.removeprefix("test_")[:4]
            is_called_so = Path(file).stem.startswith(first_letters)
            return -len(defined & self._tests[test].used), not is_called_so

        ranked = sorted(self._tests, key=rank)
        importing = [test for test in ranked if module in self._imports_of_tests[test]]
        users = [user for user, modules in self._imports.items() if module in modules]
        candidates = [
            self._mirror(module),
            *sorted(importing, key=lambda test: test.parent != folder),
            *(test for user in users for test in self._mirrors(user)),
            *(test for test in ranked if test.parent == folder),
        ]
        tests = dict.fromkeys(test for test in candidates if test in self._tests)
        return [str(test.relative_to(self._root)) for test in tests][:MOST_FILES]

    def is_played(self, file: str) -> bool:
        """Return whether the golden trajectories may run code of a file in the package."""
        return _dotted(Path(PACKAGE) / file) in self._played

    def sources_of(self, file: str, names: set[str]) -> set[str]:
        """Return the files of the package that a file takes one of these names from."""
        imported = self._names[_dotted(Path(PACKAGE) / file)].imported
        modules = {module for module, name in imported if name in names and module in self._paths}
        return {str(self._paths[name].relative_to(self._root / PACKAGE)) for name in modules}

    def _folder_of_tests(self, folder: Path) -> Path | None:
        """Return the folder of tests of a folder of the package, or of the nearest above it."""
        folders = (self._root / "tests" / parent for parent in (folder, *folder.parents[:-1]))
        is_at_top = folder == Path()
        return None if is_at_top else next((path for path in folders if path.is_dir()), None)

    def _mirror(self, module: str) -> Path:
        path = self._paths[module].relative_to(self._root / PACKAGE)
        return self._root / "tests" / path.with_name(f"test_{path.name}")

    def _mirrors(self, module: str) -> list[Path]:
        """Return the mirror of a module, or else the tests of its folder that are called alike."""
        mirror = self._mirror(module)
        if mirror in self._tests:
            return [mirror]
        first_letters = mirror.stem[: len("test_") + 4]
        alike = [test for test in self._tests if test.stem.startswith(first_letters)]
        return [test for test in alike if test.parent == mirror.parent]

    def _reached_from(self, script: Path) -> set[str]:
        """Return the modules that a script imports, and those that these import, and so on."""
        reached: set[str] = set()
        following = self._modules_of(_read(script, "")) if script.exists() else set()
        while following:
            reached |= following
            following = set[str]().union(*(self._imports[name] for name in following)) - reached
        return reached

    def _modules_of(self, names: _Names) -> set[str]:
        """Return the modules that are imported: by name, or by a name that they define."""
        modules = set()
        for module, name in names.imported:
            candidates = (f"{module}.{name}", self._exports.get((module, name)), module)
            modules.update([name for name in candidates if name in self._paths][:1])
        return modules


def _read(path: Path, module: str) -> _Names:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    package = module if path.stem == "__init__" else module.rpartition(".")[0]
    names = _Names([], _defined_names(tree), set())
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            names.imported.extend(_imported_names(node, package))
        elif isinstance(node, ast.Attribute):
            names.used.add(node.attr)
        elif isinstance(node, ast.Name):
            names.used.add(node.id)
    return names


def _defined_names(tree: ast.Module) -> set[str]:
    kinds = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef
    return {node.name for node in tree.body if isinstance(node, kinds)}


def _imported_names(node: ast.Import | ast.ImportFrom, package: str) -> Iterator[tuple[str, str]]:
    for alias in node.names:
        if isinstance(node, ast.Import):
            yield alias.name, ""
        elif node.level:
            yield resolve_name("." * node.level + (node.module or ""), package), alias.name
        else:
            yield str(node.module), alias.name


def _dotted(path: Path) -> str:
    parts = path.with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
