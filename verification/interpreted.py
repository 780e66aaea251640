"""A pytest plugin: kernels run by the interpreter, so that coverage sees their lines.

    NUMBA_DISABLE_JIT=1 python -m pytest -p verification.interpreted tests/warehouse

What only compiled code can do, calling C by address and changing integers that threads share, is
done by ctypes meanwhile.
"""

import ctypes
import os
import threading
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env.warehouse import physics, stepping, thread_pool
from swarm_logistics_env.warehouse.packing import field_kinds


class _Words(ctypes.Structure):
    _fields_ = (("first", ctypes.c_int64), ("second", ctypes.c_int64))


class _Doubles(ctypes.Structure):
    _fields_ = (("first", ctypes.c_double), ("second", ctypes.c_double))


def _call_at(address: int, arguments: tuple[Any, ...], returned: Any = None) -> Any:
    given = [_passed(argument) for argument in arguments]
    function = ctypes.CFUNCTYPE(returned, *map(type, given))
    return function(int(address))(*given)


def _passed(argument: Any) -> Any:
    if isinstance(argument, tuple):
        is_real = isinstance(argument[0], float)
        return _Doubles(*argument) if is_real else _Words(*map(int, argument))
    is_real = isinstance(argument, float)
    return ctypes.c_double(argument) if is_real else ctypes.c_int64(int(argument))


def _unpacked_at(structure: type, address: int) -> Any:
    words = iter(range(int(address), 2**63, 8))

    def loaded(kind: Any) -> Any:
        if isinstance(kind, tuple):
            where = _load(next(words))
            shape = tuple(_load(next(words)) for _ in kind[1])
            size = int(np.prod(shape)) * kind[0].itemsize
            memory = (ctypes.c_char * size).from_address(where)
            return np.frombuffer(memory, kind[0]).reshape(shape)
        if kind is float:
            return ctypes.c_double.from_address(next(words)).value
        if kind in (int, bool):
            return kind(_load(next(words)))
        return kind(*map(loaded, field_kinds(kind).values()))

    return loaded(structure)


def _word_at(address: int, place: int = 0) -> ctypes.c_int64:
    return ctypes.c_int64.from_address(int(address) + 8 * int(place))


def _load(address: int, place: int = 0) -> int:
    return _word_at(address, place).value


_ONE_AT_A_TIME = threading.Lock()


def _changed(address: int, place: int, new: Callable[[int], int]) -> int:
    """Change a word without anybody in between; return what it was."""
    with _ONE_AT_A_TIME:
        word = _word_at(address, place)
        before = word.value
        word.value = int(new(before))
    return before


def interpret_kernels() -> None:
    """Replace what only compiled code can do by functions of the interpreter."""
    if os.environ.get("NUMBA_DISABLE_JIT") != "1":
        raise pytest.UsageError("verification.interpreted needs NUMBA_DISABLE_JIT=1")
    made_at = partial(_call_at, returned=ctypes.c_int64)
    vars(physics).update(call_at=_call_at, made_at=made_at)
    for module in (physics, stepping, thread_pool):
        vars(module).update(unpacked_at=_unpacked_at)
    vars(thread_pool).update(
        pointer_at=lambda address: ctypes.c_void_p(int(address)),
        load=_load,
        exchange=lambda address, place, value: _changed(address, place, lambda _: value),
        add=lambda address, place, value: _changed(address, place, lambda old: old + value),
        replace=lambda address, place, old, new: (
            _changed(address, place, lambda found: new if found == old else found) == old
        ),
        _PATIENCE=40,  # a look takes a thousand times as long
    )


def pytest_configure(config: pytest.Config) -> None:
    """Run kernels by the interpreter in all tests."""
    interpret_kernels()
    # Streams count modulo 2**64, and kernels divide as IEEE 754 says.
    for what in ("overflow", "divide by zero"):
        config.addinivalue_line("filterwarnings", f"ignore:{what} encountered:RuntimeWarning")
