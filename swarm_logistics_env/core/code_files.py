"""Python files of the user's own, by path or by a module's name.

A path is that file, whatever else has its name. What such a file imports from its own folder is
found there, and is kept apart from modules of the same names that others imported. The folder is
never on Python's path. A module's name may also be that of a file in the folder in which a command
runs, see `current_folder`.
"""

from __future__ import annotations

import builtins
import contextlib
import functools
import hashlib
import importlib.util
import operator
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

from swarm_logistics_env.core.current_folder import allow_import
from swarm_logistics_env.core.errors import RAISED_BY_OTHERS, SwarmLogisticsError, suggest

PACKAGE = Path(__file__).parents[1]
_lock = threading.RLock()
_loaded: dict[Path, tuple[Mapping[Path, object], ModuleType]] = {}  # by file, with its sources


class MissingNameError(LookupError):
    """A module that lacks what a text names in it."""


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


def import_named(text: str) -> Any:
    """Return what "package.module:NAME" or "my.py:NAME" names, in a module that is executed for it.

    Raises:
        MissingNameError: the module has no such name.
        Exception: what its code raises.
    """
    module, _, attribute = text.rpartition(":")
    if not module.endswith(".py"):
        allow_import(module)
    file = file_of_name(text)
    code = importlib.import_module(module) if file is None else import_file(file)
    try:
        return operator.attrgetter(attribute)(code)
    except AttributeError:
        hint = suggest(attribute, [name for name in vars(code) if not name.startswith("_")])
        raise MissingNameError(f"{module} has no {attribute}{hint}") from None


def import_callable(kind: str, name: str, error_type: type[SwarmLogisticsError]) -> Any:
    """Return the class or function of a name; raise `error_type` if it cannot be had."""
    try:
        maker = import_named(name)
    except MissingNameError as error:
        raise error_type(f"{kind} {name!r}: {error}") from None
    except RAISED_BY_OTHERS as error:  # of code that is not ours, too
        reason = f"{type(error).__name__}: {error}"
        raise error_type(f"{kind} {name!r} cannot be imported: {reason}") from error
    if not callable(maker):
        raise error_type(f"{kind} {name!r} is a {type(maker).__name__}: should be a class")
    return maker


def file_of_name(text: str) -> Path | None:
    """Return the user's own Python file that "my.py:NAME" or "package.module:NAME" names."""
    module, colon, _ = text.rpartition(":")
    if not colon:
        return None
    return Path(module) if module.endswith(".py") else file_of_module(module)


def file_of_module(name: str) -> Path | None:
    """Return the file of a module that Python would import, if it is the user's own Python file.

    None: another kind of module, or none.
    """
    top, *submodules = name.split(".")
    try:
        spec = importlib.util.find_spec(top)
    except ValueError:  # a module that no file made
        return None
    stems = [Path(spec.origin.removesuffix(".py"))] if spec and spec.origin else []
    if submodules:
        folders = spec.submodule_search_locations if spec else None
        stems = [Path(folder, *submodules) for folder in folders or ()]
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
    queue = deque(paths)
    while queue:
        path = queue.popleft()
        if path not in sources and path.is_file():
            sources[path] = content = path.read_bytes()
            with contextlib.suppress(SyntaxError, ValueError):  # it cannot be imported either
                sources[path] = code = compile(content, path.name, "exec", dont_inherit=True)
                names = {part for name in names_in(code) for part in name.split(".")}
                queue += (file for name, file in _neighbours(path) if name in names)
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
    is_installed = any(path.is_relative_to(folder) for folder in _installed_folders())
    return not is_package and not is_installed


@functools.cache
def _is_installed(name: str) -> bool:
    """Return whether Python or an installed package has a module of that name."""
    folders = [str(folder) for folder in _installed_folders()]
    return name in sys.stdlib_module_names or PathFinder.find_spec(name, folders) is not None


@functools.cache
def _installed_folders() -> tuple[Path, ...]:
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
        self._top_module: str | None = None
        self._changed_at = 0  # [ns]
        self._module_names: set[str] = set()  # as they were then

    def execute(self, path: Path) -> ModuleType:
        """Return the module of a file in the folder, or in a package in it."""
        parts = [*path.relative_to(self._path).with_suffix("").parts]
        if len(parts) > 1:
            with self._enable_import(parts[0]):
                return importlib.import_module(".".join(parts).removesuffix(".__init__"))
        # No other file has this name, and no module of Python's or of an installed package.
        stem = path.stem.replace(".", "_")
        name = f"{stem}@{hashlib.sha256(str(self._path).encode()).hexdigest()[:8]}"
        spec = spec_from_file_location(name, path, loader=_Loader(self, name, str(path)))
        assert spec is not None
        assert spec.loader is not None
        module = sys.modules[name] = module_from_spec(spec)
        with self._enable_import(None):
            spec.loader.exec_module(module)
        import cloudpickle  # a command that names no file starts sooner without

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
        with self._enable_import(top if top in self._names() else None):
            module = builtins.__import__(name, globals, locals, fromlist or (), level)
        return self._importlib_for(importer) if module is importlib else module

    def _importlib_for(self, importer: Mapping[str, object]) -> ModuleType:
        """Return Python's `importlib`, whose `import_module` looks into this folder, too."""

        def import_module(name: str, package: str | None = None) -> ModuleType:
            absolute_name = importlib.util.resolve_name(name, package)
            # With a name from it, the import statement gives the module, not its package.
            return self.import_for(importer, absolute_name, fromlist=["__name__"])

        own_importlib = ModuleType(importlib.__name__)
        vars(own_importlib).update(vars(importlib), import_module=import_module)
        return own_importlib

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Find a module of this folder, as finders on `sys.meta_path` do."""
        if name.partition(".")[0] != self._top_module:
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
        changed_at = self._path.stat().st_mtime_ns
        if changed_at != self._changed_at:
            names = {file.stem for file in self._path.glob("*.py") if file.stem.isidentifier()}
            names |= {file.parent.name for file in self._path.glob("*/__init__.py")}
            self._module_names = {name for name in names if not _is_installed(name)}
            self._changed_at = changed_at
        return self._module_names

    @contextmanager
    def _enable_import(self, top_module: str | None) -> Iterator[None]:
        """Let a module be found in this folder; None: nothing, as for an installed module."""
        with _lock:
            outer = self._top_module
            self._top_module = top_module
            self._depth += 1
            if self._depth == 1:
                displaced_modules = self._exchange(self._modules)
                sys.meta_path.insert(0, self)
            try:
                yield
            finally:
                self._top_module = outer
                self._depth -= 1
                if self._depth == 0:
                    sys.meta_path.remove(self)
                    self._modules = self._exchange(displaced_modules)

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
