"""Fingerprints: text that changes when a controller, a function or this package's code does.

Stored runs count again for what is shown to be the same; what cannot be shown is played again.
"""

from __future__ import annotations

import contextlib
import copy
import copyreg
import functools
import hashlib
import json
import pickle
import sys
import types
import uuid
from collections.abc import Iterable, Iterator, Mapping
from itertools import chain
from pathlib import Path
from typing import Any

from swarm_logistics_env.core.code_files import PACKAGE, is_users_own, names_in, source_files
from swarm_logistics_env.core.errors import RAISED_BY_OTHERS
from swarm_logistics_env.core.model_parts import copy_of_part, model_parts

UNSTABLE = "unstable "  # begins the fingerprint of a value that is another one each time


@functools.cache
def package_code(*patterns: str) -> str:
    """Return 16 hexadecimal digits that change with files of this package.

    Args:
        patterns: of paths in the package, as "warehouse/*.py"; one that begins with "!" excludes.
    """
    paths = sorted(
        _matching(p for p in patterns if p[0] != "!")
        - _matching(p[1:] for p in patterns if p[0] == "!")
    )
    texts = {path.relative_to(PACKAGE).as_posix(): path.read_text("utf-8") for path in paths}
    return _hash(*chain.from_iterable(texts.items()))


def _matching(patterns: Iterable[str]) -> set[Path]:
    return {path for pattern in patterns for path in PACKAGE.glob(pattern)}


def fingerprint(value: object, files: Iterable[Path] = ()) -> dict[str, Any]:
    """Return what identifies a value: its content, and the code that it uses.

    Content is attributes, arrays, tensors, layers, closures, and the functions and classes that are
    reached from it, by the code that is in memory. Python's own modules, this package and installed
    ones count by their names and versions. Comments and blank lines do not count, nor do the device
    of a tensor and whether it is learned.

    Args:
        files: that the value came from, of the user's own code.

    Returns:
        "value": 16 hexadecimal digits, or `UNSTABLE` and something that is never met again, where a
        part cannot be compared. "files": the digest of each file of the user's own code by its
        name, with those beside it which it names.
    """
    content = _Content()
    try:
        digest = content.digest(value)
    except RAISED_BY_OTHERS:  # by an object that says itself how it is taken apart, too
        digest = UNSTABLE + uuid.uuid4().hex
    digests: dict[str, list[str]] = {}
    for path, source in source_files([*content.files, *files]).items():
        digests.setdefault(path.name, []).append(content.digest(source))
    return {
        "value": digest,
        "files": {name: _hash(*sorted(d)) for name, d in sorted(digests.items())},
    }


def deep_copy(value: Any) -> Any:
    """Return a deep copy, in which models that cannot be copied are the same ones.

    Raises:
        Exception: another part of it cannot be copied.
    """
    try:
        return copy.deepcopy(value)
    except RAISED_BY_OTHERS:
        content = _Content()
        with contextlib.suppress(*RAISED_BY_OTHERS):
            content.digest(value)
        copies = {id(part): copy_of_part(part) for part in content.met}
        return copy.deepcopy(value, {key: part for key, part in copies.items() if part is not None})


def joined(parts: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the fingerprint of several things of which each has one, as `fingerprint` does."""
    values: list[str] = []
    digests: dict[str, set[str]] = {}
    for part in parts:
        values.append(str(part.get("value")))
        for name, digest in part.get("files", {}).items():
            digests.setdefault(name, set()).add(digest)
    unstable = next((value for value in values if value.startswith(UNSTABLE)), None)
    return {
        "value": unstable or _hash(*values),
        "files": {name: ", ".join(sorted(d)) for name, d in sorted(digests.items())},
    }


def changes(before: str, now: str) -> str:
    """Return in words how two identities of one policy differ; empty: they are of the same policy.

    Of what is another one each time (`UNSTABLE`), files alone are compared.
    """
    old, new = _parts_of(before), _parts_of(now)
    if UNSTABLE in before + now:
        old, new = ({"files": parts.get("files", {})} for parts in (old, new))
    if old == new:
        return ""
    names = sorted(set(old.get("files", ())) ^ set(new.get("files", ())))
    names = sorted([*names, *changed_files(before, now)])
    return f"{', '.join(names) or 'its parameters, attributes or functions'} changed"


def changed_files(before: str, now: str) -> list[str]:
    """Return the files that two identities both name, with other digests."""
    old, new = (_parts_of(text).get("files", {}) for text in (before, now))
    return sorted(name for name in old.keys() & new.keys() if old[name] != new[name])


def _parts_of(identity: str) -> dict[str, Any]:
    try:
        parts = json.loads(identity)
    except ValueError:
        parts = None
    return parts if isinstance(parts, dict) else {"identity": identity}


def _hash(*parts: str) -> str:
    digest = hashlib.sha256()
    for part in parts:
        digest.update(f"{len(part)}:".encode() + part.encode("utf-8", "surrogatepass"))
    return digest.hexdigest()[:16]


# Kinds of objects that hold functions, and the attributes where.
_HOLDERS: dict[type, tuple[str, ...]] = {
    property: ("fget", "fset", "fdel"),
    classmethod: ("__func__",),
    staticmethod: ("__func__",),
    functools.cached_property: ("func",),
    type(functools.lru_cache(len)): ("__wrapped__",),
    types.CodeType: ("co_code", "co_names", "co_varnames", "co_consts"),
}


class _Content:
    """Digests of values by their content; equal in every process.

    Attributes:
        files: of the user's own code that was met.
        met: what a value consists of.
    """

    def __init__(self) -> None:
        self.files: set[Path] = set()
        self._digests: dict[int, str] = {}  # by id; of what is being looked into, a number
        self.met: list[object] = []  # which keeps ids their own

    def digest(self, value: Any) -> str:
        """Return the digest of a value.

        Raises:
            Exception: a part of it cannot be compared.
        """
        if id(value) not in self._digests:
            self.met.append(value)
            self._digests[id(value)] = f"cycle {len(self.met)}"
            self._digests[id(value)] = _hash(type(value).__qualname__, *self._parts(value))
        return self._digests[id(value)]

    def _parts(self, value: Any) -> Iterator[str]:
        """Yield what a value consists of."""
        kind = type(value)
        model = model_parts(value)
        if model is not None:
            yield from map(self.digest, model)
        elif value is None or kind in (bool, int, float, complex, str, bytes):
            yield repr(value)
        elif kind in (list, tuple):
            yield from map(self.digest, value)
        elif kind in (set, frozenset):
            yield from sorted(map(self.digest, value))
        elif kind in (dict, types.MappingProxyType):
            yield from (self.digest(part) for pair in value.items() for part in pair)
        elif isinstance(value, types.ModuleType | types.FunctionType | type):
            yield from self._code(value)
        elif kind in _HOLDERS:
            yield from (self.digest(getattr(value, name)) for name in _HOLDERS[kind])
        elif kind.__module__.startswith("numba.") and hasattr(value, "py_func"):
            yield self.digest(value.py_func)
        else:
            # The iterators are of lists and dicts.
            for part in _reduced(value):
                yield self.digest(list(part) if isinstance(part, Iterator) else part)

    def _code(self, value: Any) -> Iterator[str]:
        """Yield the name of a module, class or function and, if it is the user's own, its code."""
        is_module = isinstance(value, types.ModuleType)
        name = str(value.__name__ if is_module else value.__module__)
        # Without the mark of the folder that a policy's file lies in.
        yield f"{name.partition('@')[0]}:{getattr(value, '__qualname__', '')}"
        members = vars(value if is_module else sys.modules.get(name, object))
        is_met_there = is_module or _is_met(members, value)
        is_function = isinstance(value, types.FunctionType)
        members = value.__globals__ if is_function else members
        file = members.get("__file__")
        top = name.partition(".")[0]
        is_known = top == PACKAGE.name or (top in sys.stdlib_module_names and file is None)
        if is_known or not is_users_own(file):
            library = {} if is_known else vars(sys.modules.get(top, object))
            yield str(members.get("__version__", library.get("__version__", "")))
            if is_met_there:
                return
            # What a library makes while it runs holds what it was made with.
            members = {}
        elif file is not None and name != "__main__" and (is_met_there or is_function):
            self.files.add(Path(file).absolute())
        if is_function:
            yield from map(self.digest, (value.__code__, value.__defaults__, value.__kwdefaults__))
            yield from (self.digest(cell.cell_contents) for cell in value.__closure__ or ())
            used = sorted(names_in(value.__code__) & members.keys())
            yield from (self.digest((name, members[name])) for name in used)
            attributes = {k: part for k, part in vars(value).items() if k != "__wrapped__"}
            yield from (self.digest(pair) for pair in sorted(attributes.items()))
        else:
            yield from map(self.digest, getattr(value, "__bases__", ()))
            yield from (self.digest(pair) for pair in sorted(_own_members(value).items()))


def _is_met(members: Mapping[str, Any], value: Any) -> bool:
    """Return whether a class or function is what its name stands for in its module."""
    first, *inner = value.__qualname__.split(".")
    met = members.get(first)
    for name in inner:
        met = getattr(met, name, None)
    return met is value


def _reduced(value: Any) -> tuple[Any, ...]:
    """Return an object as pickle and copy take it apart.

    Raises:
        TypeError: it cannot be, or is not what its name stands for.
    """
    reduce = copyreg.dispatch_table.get(type(value))
    parts = value.__reduce_ex__(4) if reduce is None else reduce(value)
    if isinstance(parts, tuple):
        return parts
    module = getattr(value, "__module__", None)
    module = module or pickle.whichmodule(value, parts)  # type: ignore[attr-defined]
    if not isinstance(parts, str) or getattr(sys.modules.get(module), parts, None) is not value:
        raise TypeError(f"{value!r} is not {module}.{parts}")
    return (module, parts)


def _own_members(value: type | types.ModuleType) -> dict[str, Any]:
    """Return the members of a class or module, without what Python keeps there."""
    callables = (types.FunctionType, classmethod, staticmethod, property)
    return {
        name: member
        for name, member in vars(value).items()
        if isinstance(member, callables) or not name.startswith(("__", "_abc_impl"))
    }
