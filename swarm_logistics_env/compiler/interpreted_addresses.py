"""What `compiled_addresses` does, by the interpreter: for kernels that are not compiled.

See there what each function takes and returns.
"""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable
from functools import partial
from typing import Any, TypeVar

import numpy as np

from .packing import field_kinds

S = TypeVar("S", bound=tuple[Any, ...])


class _Words(ctypes.Structure):
    _fields_ = (("first", ctypes.c_int64), ("second", ctypes.c_int64))


class _Doubles(ctypes.Structure):
    _fields_ = (("first", ctypes.c_double), ("second", ctypes.c_double))


def call_at(address: int, arguments: tuple[Any, ...], returned: Any = None) -> Any:
    """Call the C function at an address."""
    values = [_c_value(argument) for argument in arguments]
    function = ctypes.CFUNCTYPE(returned, *map(type, values))
    return function(int(address))(*values)


made_at = partial(call_at, returned=ctypes.c_int64)


def _c_value(argument: Any) -> Any:
    if isinstance(argument, tuple):
        is_real = isinstance(argument[0], float)
        return _Doubles(*argument) if is_real else _Words(*map(int, argument))
    is_real = isinstance(argument, float)
    return ctypes.c_double(argument) if is_real else ctypes.c_int64(int(argument))


def pointer_at(address: int) -> ctypes.c_void_p:
    """Return `address` as the pointer that `numba.carray` takes."""
    return ctypes.c_void_p(int(address))


def unpacked_at(structure: type[S], address: int) -> S:
    """Return the structure whose words `packed` has put at `address`."""
    words = iter(range(int(address), 2**63, 8))

    def read(kind: Any) -> Any:
        if isinstance(kind, tuple):
            dtype, dimensions = kind
            start = load_word(next(words))
            shape = tuple(load_word(next(words)) for _ in dimensions)
            size = int(np.prod(shape)) * dtype.itemsize
            memory = (ctypes.c_char * size).from_address(start)
            return np.frombuffer(memory, dtype).reshape(shape)
        if kind is float:
            return ctypes.c_double.from_address(next(words)).value
        if kind in (int, bool):
            return kind(load_word(next(words)))
        return kind(*map(read, field_kinds(kind).values()))

    value: S = read(structure)
    return value


def _word_at(address: int, index: int = 0) -> ctypes.c_int64:
    return ctypes.c_int64.from_address(int(address) + 8 * int(index))


def load_word(address: int, index: int = 0) -> int:
    """Return a word, by its index in those at `address`."""
    return _word_at(address, index).value


_ONE_AT_A_TIME = threading.Lock()


def _change(address: int, index: int, new: Callable[[int], int]) -> int:
    """Change a word without anybody in between; return what it was."""
    with _ONE_AT_A_TIME:
        word = _word_at(address, index)
        before = word.value
        word.value = int(new(before))
    return before


def exchange(address: int, index: int, value: int) -> int:
    """Store a word; return the old one."""
    return _change(address, index, lambda _: value)


def add(address: int, index: int, value: int) -> int:
    """Add to a word; return the old one."""
    return _change(address, index, lambda before: before + value)


def replace(address: int, index: int, old: int, new: int) -> bool:
    """Put `new` into a word if `old` is there; return whether it was."""
    return _change(address, index, lambda before: new if before == old else before) == old
