"""Python files of the user's own: a path is that file, whatever else has its name.

What such a file imports from its own folder is found there, and is kept apart from modules of the
same names that others imported. The folder is never on Python's path.
"""

from __future__ import annotations

import builtins
import contextlib
import functools
import hashlib
import importlib.util
import site
import sys
import sysconfig
import threading
from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib.machinery import (
    EXTENSION_SUFFIXES,
    SOURCE_SUFFIXES,
    ExtensionFileLoader,
    FileFinder,
    ModuleSpec,
    PathFinder,
    SourceFileLoader,
)
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any

import cloudpickle

PACKAGE = Path(__file__).parent
_lock = threading.RLock()
_loaded: dict[Path, tuple[Mapping[Path, object], ModuleType]] = {}  # by file, with its sources


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
        sources = source_files([path])
        if path not in _loaded or _loaded[path][0] != sources:
            _loaded[path] = sources, _Folder(_import_root(path)).execute(path)
        return _loaded[path][1]


def file_of_module(name: str) -> Path | None:
    """Return the file of a module that Python would import, if it is the user's own Python file.

    None: another kind of module, or none.
    """
    top, *rest = name.split(".")
    try:
        spec = importlib.util.find_spec(top)
    except ValueError:  # a module that no file made
        return None
    stems = [Path(spec.origin.removesuffix(".py"))] if spec and spec.origin else []
    if rest:
        folders = spec.submodule_search_locations if spec else None
        stems = [Path(folder, *rest) for folder in folders or ()]
    for stem in stems:
        for path in (stem.with_suffix(".py"), stem / "__init__.py"):
            if path.is_file() and is_users_own(str(path.resolve())):
                return path
    return None


def source_files(paths: Iterable[Path]) -> dict[Path, CodeType | bytes]:
    """Return the code of Python files, and of the neighbours which they name.

    A neighbour lies in the folder of a file, or in one of its package. So a module that is imported
    only while a function runs is among them. What is no Python that can be compiled is bytes.
    """
    sources: dict[Path, CodeType | bytes] = {}
    waiting = deque(paths)
    while waiting:
        path = waiting.popleft()
        if path not in sources and path.is_file():
            sources[path] = content = path.read_bytes()
            with contextlib.suppress(SyntaxError, ValueError):  # it cannot be imported either
                sources[path] = code = compile(content, path.name, "exec", dont_inherit=True)
                names = {part for name in names_in(code) for part in name.split(".")}
                waiting += (file for name, file in _neighbours(path) if name in names)
    return sources


def names_in(code: CodeType) -> set[str]:
    """Return the names that code and the functions within it use, and its texts."""
    inner = (part for part in code.co_consts if isinstance(part, CodeType))
    texts = (part for part in code.co_consts if isinstance(part, str))
    return {*code.co_names, *texts}.union(*map(names_in, inner))


def _neighbours(path: Path) -> Iterator[tuple[str, Path]]:
    """Yield the name and file of all modules that may be imported from where a file lies."""
    folder, root = path.parent, _import_root(path)
    while True:
        for file in sorted(folder.iterdir()):
            if file.name.endswith((".py", *EXTENSION_SUFFIXES)):
                yield file.name.partition(".")[0], file
            elif (file / "__init__.py").is_file():
                yield from ((file.name, module) for module in sorted(file.rglob("*.py")))
        if folder == root:
            return
        folder = folder.parent


def _import_root(path: Path) -> Path:
    """Return the folder from which the module in a file is imported, above all of its packages."""
    folder = path.parent
    while (folder / "__init__.py").is_file() and folder != folder.parent:
        folder = folder.parent
    return folder


def is_users_own(file: str | None) -> bool:
    """Return whether a module's file is neither Python's nor of this or an installed package."""
    if file is None:
        return True  # typed into an interpreter or a notebook
    path = Path(file).absolute()
    # Another environment's packages may be on the path, too.
    is_package = not {"site-packages", "dist-packages"}.isdisjoint(path.parts)
    return not is_package and not any(path.is_relative_to(folder) for folder in _installed())


@functools.cache
def _is_installed(name: str) -> bool:
    """Return whether Python or an installed package has a module of that name."""
    folders = [str(folder) for folder in _installed()]
    return name in sys.stdlib_module_names or PathFinder.find_spec(name, folders) is not None


@functools.cache
def _installed() -> tuple[Path, ...]:
    names = ("stdlib", "platstdlib", "purelib", "platlib")
    folders = [sysconfig.get_path(name) for name in names]
    return (PACKAGE, *map(Path, [*folders, *site.getsitepackages(), site.getusersitepackages()]))


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
        import_for = functools.partial(self._folder.import_for, vars(module))
        vars(module)["__builtins__"] = {**vars(builtins), "__import__": import_for}
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
            self._changed, self._known = (
                changed,
                {name for name in files if not _is_installed(name)},
            )
        return self._known

    @contextmanager
    def _importing(self, wanted: str | None) -> Iterator[None]:
        """Let `wanted` be found in this folder; None: nothing, as for an installed module."""
        with _lock:
            outer, self._wanted = self._wanted, wanted
            self._depth += 1
            if self._depth == 1:
                displaced = self._exchange(self._modules)
                sys.meta_path.insert(0, self)
            try:
                yield
            finally:
                self._wanted = outer
                self._depth -= 1
                if self._depth == 0:
                    sys.meta_path.remove(self)
                    self._modules = self._exchange(displaced)

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
