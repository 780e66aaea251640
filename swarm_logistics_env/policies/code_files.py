"""Python files that a policy's text names: each is that file, whatever else has its name.

What such a file imports from its own folder is found there, and is kept apart from modules of the
same names that others imported. The folder is never on Python's path.
"""

from __future__ import annotations

import builtins
import functools
import hashlib
import importlib.util
import sys
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib.machinery import (
    EXTENSION_SUFFIXES,
    SOURCE_SUFFIXES,
    ExtensionFileLoader,
    FileFinder,
    ModuleSpec,
    SourceFileLoader,
)
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any

import cloudpickle

from swarm_logistics_env.fingerprint import import_root, is_installed, is_users_own, source_digests

_lock = threading.RLock()
_loaded: dict[Path, tuple[Mapping[str, str], ModuleType]] = {}  # by file, with its digests


def import_file(path: Path) -> ModuleType:
    """Return the module in a Python file; it is executed once, and again after a change.

    A change of a file that it imports from its own folder or package is one, too.

    Raises:
        FileNotFoundError: there is no such file.
        Exception: what its code raises.
    """
    path = path.resolve()
    if not path.is_file():
        raise FileNotFoundError(f"there is no file {path}")
    with _lock:
        digests = source_digests([path])
        if path not in _loaded or _loaded[path][0] != digests:
            _loaded[path] = digests, _Folder(import_root(path)).execute(path)
        return _loaded[path][1]


def file_of_module(name: str) -> Path | None:
    """Return the file of a module that Python would import, if it is the user's own Python file.

    It is looked up in the current folder last. None: another kind of module, or none.
    """
    top, *rest = name.split(".")
    try:
        spec = importlib.util.find_spec(top)
    except ValueError:  # a module that no file made
        return None
    if spec is None:
        stems = [Path(top, *rest)]
    elif rest:
        stems = [Path(folder, *rest) for folder in spec.submodule_search_locations or ()]
    else:
        stems = [Path(spec.origin.removesuffix(".py"))] if spec.origin else []
    for stem in stems:
        for path in (stem.with_suffix(".py"), stem / "__init__.py"):
            if path.is_file() and is_users_own(str(path.resolve())):
                return path
    return None


class _Loader(SourceFileLoader):
    """Executes a module whose import statements look into its folder first, whenever they run."""

    def __init__(self, folder: _Folder, name: str, path: str) -> None:
        super().__init__(name, path)
        self._folder = folder

    def get_code(self, fullname: str) -> CodeType:
        """Return the code of the file as it is; compiled files know changes by the second."""
        return self.source_to_code(self.get_data(self.path), self.path)

    def exec_module(self, module: ModuleType) -> None:
        """Execute the module."""
        own = {"__import__": functools.partial(self._folder.import_for, vars(module))}
        vars(module)["__builtins__"] = {**vars(builtins), **own}
        super().exec_module(module)


class _Folder:
    """A folder from which modules are imported, apart from those of the same names elsewhere."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._modules: dict[str, ModuleType] = {}  # by name, while nothing is imported from here
        self._depth = 0
        self._wanted: str | None = None
        self._changed = 0
        self._known: set[str] = set()

    def execute(self, path: Path) -> ModuleType:
        """Return the module of a file in the folder, or in a package in it."""
        parts = [*path.relative_to(self._path).with_suffix("").parts]
        if len(parts) > 1:
            with self._importing(parts[0]):
                return importlib.import_module(".".join(parts).removesuffix(".__init__"))
        # No other file has this name, and no module of Python's or of an installed package.
        stem = path.stem.replace(".", "_")
        name = f"{stem}@{hashlib.sha256(str(self._path).encode()).hexdigest()[:8]}"
        spec = spec_from_file_location(name, path, loader=_Loader(self, name, str(path)))
        assert spec is not None
        assert spec.loader is not None
        module = sys.modules[name] = module_from_spec(spec)
        with self._importing(None):
            spec.loader.exec_module(module)
        cloudpickle.register_pickle_by_value(module)  # no other process can import it
        return module

    def import_for(
        self,
        importer: Mapping[str, object],
        name: str,
        globals: Mapping[str, object] | None = None,
        locals: Mapping[str, object] | None = None,
        fromlist: Sequence[str] | None = (),
        level: int = 0,
    ) -> ModuleType:
        """Import a module as an import statement of a module in this folder does."""
        top = (str(importer.get("__package__")) if level else name).partition(".")[0]
        with self._importing(top if top in self._names() else None):
            return builtins.__import__(name, globals, locals, fromlist or (), level)

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Find a module of this folder, as finders on `sys.meta_path` do."""
        if name.partition(".")[0] != self._wanted:
            return None
        loader: Any = functools.partial(_Loader, self)
        kinds = (loader, SOURCE_SUFFIXES), (ExtensionFileLoader, EXTENSION_SUFFIXES)
        for folder in [str(self._path)] if path is None else path:
            spec = FileFinder(folder, *kinds).find_spec(name)
            if spec is not None and spec.loader is not None:
                return spec
        return None

    def _names(self) -> set[str]:
        """Return the modules and packages in the folder; Python's and installed ones go first."""
        changed = self._path.stat().st_mtime_ns
        if changed != self._changed:
            files = {file.stem for file in self._path.glob("*.py") if file.stem.isidentifier()}
            files |= {file.parent.name for file in self._path.glob("*/__init__.py")}
            self._changed, self._known = changed, {name for name in files if not is_installed(name)}
        return self._known

    @contextmanager
    def _importing(self, wanted: str | None) -> Iterator[None]:
        """Let `wanted` be found in this folder; None: nothing, as for an installed module."""
        with _lock:
            outer, self._wanted = self._wanted, wanted
            self._depth += 1
            if self._depth == 1:
                others = self._exchange(self._modules)
                sys.meta_path.insert(0, self)
            try:
                yield
            finally:
                self._wanted = outer
                self._depth -= 1
                if self._depth == 0:
                    sys.meta_path.remove(self)
                    self._modules = self._exchange(others)

    def _exchange(self, modules: Mapping[str, ModuleType]) -> dict[str, ModuleType]:
        """Put modules of this folder's names into Python's table; return those that were there."""
        names = self._names()
        out = {
            name: sys.modules.pop(name)
            for name in [*sys.modules]
            if name.partition(".")[0] in names
        }
        sys.modules.update(modules)
        return out
