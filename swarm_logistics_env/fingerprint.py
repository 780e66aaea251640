"""Fingerprints: text that changes when a controller, a function or this package's code does.

Stored runs count again for what is shown to be the same; what cannot be shown is played again.
"""

from __future__ import annotations

import functools
import hashlib
import importlib.util
import json
import re
import site
import sys
import sysconfig
import types
import uuid
from ast import AsyncFunctionDef, ClassDef, FunctionDef, Module, get_docstring, parse, walk
from collections import deque
from collections.abc import Iterable, Iterator
from importlib.machinery import EXTENSION_SUFFIXES, PathFinder
from pathlib import Path
from typing import Any

import numpy as np

PACKAGE = Path(__file__).parent
# What decides an episode. The other files hold messages, validation, statistics and pictures.
EPISODE_CODE = (
    "episode.py", "kernels.py", "observations.py", "scenario.py", "streams.py",
    "motion/*.py", "policies/*.py", "warehouse/*.py",
)  # fmt: skip
_WRAPPERS: dict[type, str] = {
    classmethod: "__func__",
    staticmethod: "__func__",
    functools.cached_property: "func",
    type(functools.lru_cache(len)): "__wrapped__",
}  # kinds that hold a function, and where
UNSTABLE = "unstable "  # begins the fingerprint of a value that is another one each time


@functools.cache
def package_code(*patterns: str) -> str:
    """Return 16 hexadecimal digits that change with files of this package.

    Docstrings, comments on lines of their own and blank lines do not count.

    Args:
        patterns: of paths in the package, as "warehouse/*.py".
    """
    paths = sorted({path for pattern in patterns for path in PACKAGE.glob(pattern)})
    return _digest(*(f"{path.relative_to(PACKAGE).as_posix()}\0{_text(path)}" for path in paths))


def fingerprint(value: object, files: Iterable[Path] = ()) -> dict[str, Any]:
    """Return what identifies a value: its content, and the code that it uses.

    Content is attributes, arrays, closures, and the functions and classes that are reached from it,
    by the code that is in memory. Python's own modules, this package and installed ones count by
    their names and versions.

    Args:
        files: that the value came from, of the user's own code.

    Returns:
        "value": 16 hexadecimal digits, or `UNSTABLE` and something that is never met again, where a
        part cannot be compared. "files": the digest of each file of the user's own code by its
        name, with those beside it which its text names.
    """
    content = _Content()
    try:
        digest = content.digest(value)
    except (TypeError, ValueError, AttributeError, RecursionError, RuntimeError):
        digest = UNSTABLE + uuid.uuid4().hex
    return {"value": digest, "files": source_digests([*content.files, *files])}


def changes(before: str, now: str) -> str:
    """Return in words how two identities of one policy differ; empty: they are of the same policy.

    Values that are others each time (`UNSTABLE`) are not compared.
    """
    old, new = _parts_of(before), _parts_of(now)
    if any(str(parts.get("value")).startswith(UNSTABLE) for parts in (old, new)):
        old, new = old | {"value": None}, new | {"value": None}
    if old == new:
        return ""
    old_files, new_files = old.get("files", {}), new.get("files", {})
    names = sorted(old_files.keys() | new_files.keys())
    changed = [name for name in names if old_files.get(name) != new_files.get(name)]
    return f"{', '.join(changed) or 'its parameters, attributes or functions'} changed"


def _parts_of(identity: str) -> dict[str, Any]:
    try:
        parts = json.loads(identity)
    except ValueError:
        parts = None
    return parts if isinstance(parts, dict) else {"identity": identity}


def changed_files(before: str, now: str) -> list[str]:
    """Return the files that two identities both name, with other digests."""
    old, new = (_parts_of(text).get("files", {}) for text in (before, now))
    return sorted(name for name in old.keys() & new.keys() if old[name] != new[name])


def source_digests(paths: Iterable[Path]) -> dict[str, str]:
    """Return the digest of Python files by their names, and of neighbours which their text names.

    A neighbour lies in the folder of a file, or in one of its package. So a module that is imported
    only while a function runs counts too.
    """
    digests: dict[str, list[str]] = {}
    waiting, met = deque(paths), set[Path]()
    while waiting:
        path = waiting.popleft()
        if path in met or not path.is_file():
            continue
        met.add(path)
        text = _text(path)
        digests.setdefault(path.name, []).append(_digest(text))
        words = set(re.findall(r"\w+", text)) if path.suffix == ".py" else set()
        waiting += (file for name, file in _neighbours(path) if name in words)
    return {name: _digest(*sorted(each)) for name, each in sorted(digests.items())}


def import_root(path: Path) -> Path:
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
    return not any(path.is_relative_to(folder) for folder in _installed())


@functools.cache
def is_installed(name: str) -> bool:
    """Return whether Python or an installed package has a module of that name."""
    folders = [str(folder) for folder in _installed()]
    return name in sys.stdlib_module_names or PathFinder.find_spec(name, folders) is not None


@functools.cache
def _installed() -> tuple[Path, ...]:
    names = ("stdlib", "platstdlib", "purelib", "platlib")
    folders = [sysconfig.get_path(name) for name in names]
    folders += [*site.getsitepackages(), site.getusersitepackages()]
    return (PACKAGE, *map(Path, folders))


def _neighbours(path: Path) -> Iterator[tuple[str, Path]]:
    """Yield the name and file of all modules that may be imported from where a file lies."""
    folder, root = path.parent, import_root(path)
    while True:
        for file in sorted(folder.iterdir()):
            if file.name.endswith((".py", *EXTENSION_SUFFIXES)):
                yield file.name.partition(".")[0], file
            elif (file / "__init__.py").is_file():
                yield from ((file.name, module) for module in sorted(file.rglob("*.py")))
        if folder == root:
            return
        folder = folder.parent


def _text(path: Path) -> str:
    """Return the code of a file, without prose if it is Python."""
    content = path.read_bytes()
    if path.suffix != ".py":
        return content.hex()
    try:
        return without_prose(importlib.util.decode_source(content))
    except (SyntaxError, ValueError):  # it cannot be imported either
        return content.hex()


def without_prose(source: str) -> str:
    """Return Python source without docstrings, lines that only comment, and blank lines."""
    prose: set[int] = set()
    for node in walk(parse(source)):
        if not isinstance(node, Module | ClassDef | FunctionDef | AsyncFunctionDef):
            continue
        if get_docstring(node, clean=False) is not None:
            first = node.body[0]
            prose.update(range(first.lineno, (first.end_lineno or first.lineno) + 1))
    lines = enumerate(source.splitlines(), start=1)
    return "\n".join(
        line.rstrip()
        for number, line in lines
        if number not in prose and line.strip() and not line.lstrip().startswith("#")
    )


def _digest(*parts: str) -> str:
    digest = hashlib.sha256()
    for part in parts:
        digest.update(f"{len(part)}:".encode() + part.encode("utf-8", "surrogatepass"))
    return digest.hexdigest()[:16]


class _Content:
    """Digests of values by their content; equal in every process.

    Attributes:
        files: of the user's own code that was met.
    """

    def __init__(self) -> None:
        self.files: set[Path] = set()
        self._digests: dict[int, str] = {}  # by id; of what is being looked into, how deep it is
        self._met: list[object] = []  # keeps ids their own

    def digest(self, value: Any) -> str:
        """Return the digest of a value.

        Raises:
            TypeError, ValueError, AttributeError, RecursionError, RuntimeError: a part of it cannot
                be compared.
        """
        if id(value) not in self._digests:
            self._met.append(value)
            self._digests[id(value)] = f"cycle {len(self._met)}"
            self._digests[id(value)] = _digest(type(value).__qualname__, *self._parts(value))
        return self._digests[id(value)]

    def _parts(self, value: Any) -> Iterator[str]:
        """Yield what a value consists of."""
        kind = type(value)
        if value is None or kind in (bool, int, float, complex, str, bytes):
            yield repr(value)
        elif kind in (list, tuple):
            yield from map(self.digest, value)
        elif kind in (set, frozenset):
            yield from sorted(map(self.digest, value))
        elif kind in (dict, types.MappingProxyType):
            yield from (self.digest(part) for pair in value.items() for part in pair)
        elif kind is np.ndarray and not value.dtype.hasobject:
            yield from (str(value.dtype), str(value.shape), value.tobytes().hex())
        elif kind is types.CodeType:
            yield from (value.co_code.hex(), repr(value.co_names), repr(value.co_varnames))
            yield from map(self.digest, value.co_consts)
        elif isinstance(value, types.ModuleType):
            yield value.__name__
            if self._is_own(value.__name__, getattr(value, "__file__", None)):
                yield from self._members(vars(value))
            else:
                yield str(getattr(value, "__version__", ""))
        elif isinstance(value, type):
            yield f"{_module_name(value)}:{value.__qualname__}"
            module = sys.modules.get(value.__module__)
            is_in_module = getattr(module, value.__qualname__, None) is value
            if self._is_own(value.__module__, getattr(module, "__file__", None), note=is_in_module):
                yield from map(self.digest, value.__bases__)
                yield from self._members(vars(value))
        elif kind is types.FunctionType:
            yield from self._function(value)
        elif kind is types.BuiltinFunctionType and isinstance(value.__self__, types.ModuleType):
            yield f"{value.__module__}:{value.__qualname__}"
        elif kind is property:
            yield from map(self.digest, (value.fget, value.fset, value.fdel))
        elif kind in _WRAPPERS:
            yield self.digest(getattr(value, _WRAPPERS[kind]))
        elif kind.__module__.startswith("numba.") and hasattr(value, "py_func"):
            yield self.digest(value.py_func)
        else:
            # As pickle and copy take it apart; the iterators are of lists and dicts.
            reduced = value.__reduce_ex__(4)
            for part in reduced if isinstance(reduced, tuple) else (reduced,):
                yield self.digest(list(part) if isinstance(part, Iterator) else part)

    def _function(self, function: types.FunctionType) -> Iterator[str]:
        yield f"{_module_name(function)}:{function.__qualname__}"
        if not self._is_own(function.__module__, function.__globals__.get("__file__")):
            return
        code = function.__code__
        has_doc = function.__doc__ is not None and function.__doc__ in code.co_consts[:1]
        yield self.digest(code.replace(co_consts=code.co_consts[1:]) if has_doc else code)
        yield from map(self.digest, (function.__defaults__, function.__kwdefaults__))
        for cell in function.__closure__ or ():
            yield self.digest(cell.cell_contents)
        for name in sorted(_names(code) & function.__globals__.keys()):
            yield from (name, self.digest(function.__globals__[name]))

    def _members(self, members: Any) -> Iterator[str]:
        """Yield the members of a module or class, without what Python keeps there."""
        callables = (types.FunctionType, classmethod, staticmethod, property)
        for name, member in sorted(members.items()):
            is_kept_by_python = name.startswith("__") and not isinstance(member, callables)
            if not is_kept_by_python and name != "_abc_impl":
                yield from (name, self.digest(member))

    def _is_own(self, module: str | None, file: str | None, *, note: bool = True) -> bool:
        """Return whether a module is the user's own code, and note its file."""
        top = str(module).partition(".")[0]
        is_known = top == PACKAGE.name or (top in sys.stdlib_module_names and file is None)
        if is_known or not is_users_own(file):
            return False
        if note and file is not None and module != "__main__":
            self.files.add(Path(file).absolute())
        return True


def _module_name(value: type | types.FunctionType) -> str:
    """Return the name of a module; without the mark of the folder that a policy's file lies in."""
    return str(value.__module__).partition("@")[0]


def _names(code: types.CodeType) -> set[str]:
    """Return the names that code and the functions within it use."""
    inner = (part for part in code.co_consts if isinstance(part, types.CodeType))
    return set(code.co_names).union(*map(_names, inner))
