"""A pytest plugin: kernels run by the interpreter, so that coverage sees their lines.

    NUMBA_DISABLE_JIT=1 python -m pytest -p verification.interpreted tests/warehouse

What only compiled code can do, calling C by address and changing integers that threads share, is
done by ctypes meanwhile.
"""

from __future__ import annotations

import ctypes
import os
import threading
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
    function = ctypes.CFUNCTYPE(returned, *(type(argument) for argument in given))
    return function(int(address))(*given)


def _made_at(address: int, arguments: tuple[Any, ...]) -> int:
    return int(_call_at(address, arguments, ctypes.c_int64))


def _passed(argument: Any) -> Any:
    if not isinstance(argument, tuple):
        is_real = isinstance(argument, float)
        return ctypes.c_double(argument) if is_real else ctypes.c_int64(int(argument))
    if isinstance(argument[0], float):
        return _Doubles(*argument)
    return _Words(*(int(word) for word in argument))


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


def _store_at(address: int, value: int) -> None:
    ctypes.c_int32.from_address(int(address)).value = int(value)


_ONE_AT_A_TIME = threading.Lock()


def _word_at(address: int, place: int = 0) -> ctypes.c_int64:
    return ctypes.c_int64.from_address(int(address) + 8 * int(place))


def _load(address: int, place: int = 0) -> int:
    return _word_at(address, place).value


def _exchange(address: int, place: int, value: int) -> int:
    with _ONE_AT_A_TIME:
        before, _word_at(address, place).value = _load(address, place), int(value)
    return before


def _add(address: int, place: int, value: int) -> int:
    with _ONE_AT_A_TIME:
        before = _load(address, place)
        _word_at(address, place).value = before + int(value)
    return before


def _replace(address: int, place: int, old: int, new: int) -> bool:
    with _ONE_AT_A_TIME:
        is_there = _load(address, place) == int(old)
        if is_there:
            _word_at(address, place).value = int(new)
    return is_there


def interpret_kernels() -> None:
    """Replace what only compiled code can do by functions of the interpreter.

    Raises:
        pytest.UsageError: kernels are compiled all the same, as NUMBA_DISABLE_JIT is not 1.
    """
    if os.environ.get("NUMBA_DISABLE_JIT") != "1":
        raise pytest.UsageError("verification.interpreted needs NUMBA_DISABLE_JIT=1")
    vars(physics).update(call_at=_call_at, made_at=_made_at, store_at=_store_at)
    for module in (physics, stepping, thread_pool):
        vars(module).update(unpacked_at=_unpacked_at)
    vars(thread_pool).update(pointer_at=lambda address: ctypes.c_void_p(int(address)))
    # A look takes a thousand times as long.
    vars(thread_pool).update(
        load=_load, exchange=_exchange, add=_add, replace=_replace, _PATIENCE=40
    )


def pytest_configure(config: pytest.Config) -> None:
    """Run kernels by the interpreter in all tests."""
    interpret_kernels()
    # Streams count modulo 2**64, and kernels divide as IEEE 754 says.
    for what in ("overflow", "divide by zero"):
        config.addinivalue_line("filterwarnings", f"ignore:{what} encountered:RuntimeWarning")
