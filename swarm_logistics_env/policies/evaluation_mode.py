"""Torch modules in use: in evaluation mode while they play, and in their own mode afterwards."""

from __future__ import annotations

import contextlib
import functools
import inspect
import sys
import types
from collections.abc import Iterable, Iterator
from itertools import chain, islice
from typing import Any

from swarm_logistics_env.core.code_files import is_users_own, names_in

# A policy holds its networks near its surface; what lies deeper is a world or a store of rows.
_DEEPEST = 6
_MOST_PARTS = 1000


@contextlib.contextmanager
def in_evaluation(*values: object) -> Iterator[None]:
    """Let all torch modules that values hold or use be in evaluation mode, then in their own.

    So dropout is off and batches change no statistics. Each submodule gets back the mode that it
    had, also after an error.

    Args:
        values: policies, functions or modules, see `torch_modules_of`.
    """
    networks = torch_modules_of(values)
    parts = chain.from_iterable(network.modules() for network in networks)
    modes = [(part, bool(getattr(part, "training", False))) for part in parts]
    for part, is_training in modes:
        if is_training and part.training:  # not if one that it belongs to has switched it
            _set_mode(part, False)
    try:
        yield
    finally:
        for part, is_training in modes:  # a module comes before its submodules
            if getattr(part, "training", is_training) != is_training:
                _set_mode(part, is_training)


def _set_mode(part: Any, is_training: bool) -> None:
    """Switch a torch module and its submodules, by its own `train` if that does so."""
    if "mode" in inspect.signature(part.train).parameters:
        with contextlib.suppress(NotImplementedError):  # of an exported program, whose mode stays
            part.train(is_training)
    else:  # a method of the same name, such as a loop that learns
        part.training = is_training


def torch_modules_of(values: Iterable[object]) -> list[Any]:
    """Return the torch modules that values hold: as attributes, in containers, or by functions.

    A function holds what is bound to it, its closure, and the names of its module that it uses.
    """
    nn = getattr(sys.modules.get("torch"), "nn", None)
    if nn is None:
        return []
    networks: list[Any] = []
    met: dict[int, object] = {}
    layer = list(values)
    for _ in range(_DEEPEST):
        following: list[object] = []
        for value in layer:
            if id(value) in met or len(met) > _MOST_PARTS:
                continue
            met[id(value)] = value
            if issubclass(type(value), nn.Module):
                networks.append(value)
            else:
                following += islice(_parts_of(value), _MOST_PARTS)
        layer = following
    return networks


def _parts_of(value: Any) -> Iterator[object]:
    """Yield what a value holds, without calling code of its own.

    The walk of `fingerprint` calls such code, and ends at what it cannot compare.
    """
    kind: Any = type(value)
    if value is None or kind in (bool, int, float, complex, str, bytes):
        return
    if isinstance(value, types.ModuleType | type):
        return
    if isinstance(value, dict):
        yield from dict.values(value)
    elif isinstance(value, list | tuple | set | frozenset):
        yield from value
    elif isinstance(value, functools.partial):
        yield from (value.func, value.args, value.keywords)
    elif isinstance(value, types.MethodType):
        yield from (value.__self__, value.__func__)
    elif isinstance(value, types.FunctionType):
        yield from _parts_of_function(value)
    yield from getattr(value, "__dict__", {}).values()
    if not isinstance(value, types.FunctionType):
        for member in chain.from_iterable(vars(base).values() for base in _users_bases(kind)):
            if isinstance(member, types.MemberDescriptorType):
                with contextlib.suppress(AttributeError):  # a slot without a value yet
                    yield member.__get__(value)
            else:
                yield member


def _parts_of_function(function: types.FunctionType) -> Iterator[object]:
    yield from (function.__defaults__, function.__kwdefaults__)
    for cell in function.__closure__ or ():
        with contextlib.suppress(ValueError):  # it is empty
            yield cell.cell_contents
    members = function.__globals__
    if _is_in_users_file(members.get("__file__")):
        yield from (members[name] for name in names_in(function.__code__) & members.keys())


@functools.cache
def _users_bases(kind: type) -> tuple[type, ...]:
    """Return those of a class and its bases that are the user's own."""
    modules = [(base, sys.modules.get(base.__module__)) for base in kind.__mro__]
    return tuple(
        base
        for base, module in modules
        if base.__module__ not in sys.builtin_module_names
        and _is_in_users_file(getattr(module, "__file__", None))
    )


_is_in_users_file = functools.cache(is_users_own)
