"""Integers that several threads read and change at the same time, from inside kernels."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

from llvmlite import ir  # type: ignore[import-untyped]  # it ships none
from numba.core import types
from numba.extending import intrinsic

_BYTES = 8
_IN_ORDER = "seq_cst"  # all threads see all changes in one order


def _generated(function: Callable[..., Any]) -> Callable[..., int]:
    return cast("Callable[..., int]", intrinsic(function))


def _there(builder: Any, address: Any) -> Any:
    return builder.inttoptr(address, ir.IntType(8 * _BYTES).as_pointer())


@_generated
def load(typing_context: Any, address: types.Type) -> Any:
    """Return the integer of 64 bits at `address`."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return builder.load_atomic(_there(builder, values[0]), _IN_ORDER, _BYTES)

    return types.int64(types.int64), generate


def _changed_by(operation: str) -> Callable[..., int]:
    def typed(typing_context: Any, address: types.Type, value: types.Type) -> Any:
        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            where, given = values
            return builder.atomic_rmw(operation, _there(builder, where), given, _IN_ORDER)

        return types.int64(types.int64, types.int64), generate

    return _generated(typed)


# Both take an address and an integer, which is stored or added there; they return the old value.
exchange, add = _changed_by("xchg"), _changed_by("add")


@_generated
def replace(typing_context: Any, address: types.Type, old: types.Type, new: types.Type) -> Any:
    """Put `new` at `address` if `old` is there; returns whether it was."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        where, old_value, new_value = values
        found = builder.cmpxchg(_there(builder, where), old_value, new_value, _IN_ORDER, _IN_ORDER)
        return builder.extract_value(found, 1)

    return types.boolean(types.int64, types.int64, types.int64), generate
