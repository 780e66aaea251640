"""C functions called by their address from inside a kernel, without the interpreter.

An address that is a number at run time, unlike a pointer that is a constant of the compiled
code, leaves the kernel fit for the cache on disk.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any, cast

from llvmlite import ir  # type: ignore[import-untyped]  # it ships none
from numba import core
from numba.core import types
from numba.extending import intrinsic

cgutils: Any = core.cgutils  # without types
# System V on x86-64 and AAPCS64 on arm64 pass a structure of two words, all integers or all
# doubles, exactly as two arguments; Windows on x86-64 passes its address.
_BY_REFERENCE = sys.platform == "win32" and "ARM" not in sys.version.upper()


def _passed(builder: Any, kind: types.Type, value: Any, by_reference: bool) -> list[Any]:
    if not isinstance(kind, types.BaseTuple):
        return [value]
    if by_reference:
        return [cgutils.alloca_once_value(builder, value)]
    return list(cgutils.unpack_tuple(builder, value))


def _generated(function: Callable[..., Any]) -> Callable[..., None]:
    return cast("Callable[..., None]", intrinsic(function))


def _call(returned: Any) -> Callable[..., Any]:
    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        where, packed = values
        given: list[Any] = []
        for kind, value in zip(
            signature.args[1], cgutils.unpack_tuple(builder, packed), strict=True
        ):
            given += _passed(builder, kind, value, _BY_REFERENCE)
        function = ir.FunctionType(returned, [value.type for value in given])
        answer = builder.call(builder.inttoptr(where, function.as_pointer()), given)
        is_void = isinstance(returned, ir.VoidType)
        return context.get_dummy_value() if is_void else answer

    return generate


@_generated
def call_at(typing_context: Any, address: types.Type, arguments: types.Type) -> Any:
    """Call the C function at `address`, which returns nothing, with a tuple of `arguments`.

    Each is an integer (of any width up to 64 bits, or a pointer), a double, or a tuple of two of
    the same kind: a structure of 16 bytes passed by value.
    """
    arguments = cast("Any", types).unliteral(arguments)
    return types.void(types.int64, arguments), _call(ir.VoidType())


@cast("Callable[..., Callable[[int, tuple[Any, ...]], int]]", intrinsic)
def made_at(typing_context: Any, address: types.Type, arguments: types.Type) -> Any:
    """Call the C function at `address` as `call_at` does; returns the pointer that it returns."""
    arguments = cast("Any", types).unliteral(arguments)
    return types.int64(types.int64, arguments), _call(ir.IntType(64))


@cast("Callable[..., Callable[[int], Any]]", intrinsic)
def pointer_at(typing_context: Any, address: types.Type) -> Any:
    """Return `address` as the pointer that `numba.carray` takes."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return builder.inttoptr(values[0], context.get_value_type(types.voidptr))

    return types.voidptr(types.int64), generate


@_generated
def store_at(typing_context: Any, address: types.Type, value: types.Type) -> Any:
    """Write `value` as a C int (32 bits) to `address`."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        where, number = values
        builder.store(number, builder.inttoptr(where, ir.IntType(32).as_pointer()))
        return context.get_dummy_value()

    return types.void(types.int64, types.int32), generate
