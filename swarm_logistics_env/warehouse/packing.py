"""A structure of arrays as one argument of a kernel: the address of a table of words.

Each array handed to a kernel costs as much time as a robot's timers; a control step needs sixty.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, TypeVar, cast, get_args, get_type_hints

import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]  # it ships none
from numba.core import types
from numba.extending import intrinsic
from numba.np import arrayobj
from numpy.typing import NDArray

S = TypeVar("S", bound=tuple[Any, ...])

_WORD = ir.IntType(64)


def field_kinds(structure: type) -> dict[str, Any]:
    """Return by field `float`, `int`, `bool`, a structure, or (dtype, dimensions) of an array."""
    kinds: dict[str, Any] = {}
    for name, hint in get_type_hints(structure, include_extras=True).items():
        kinds[name] = hint
        if metadata := getattr(hint, "__metadata__", None):
            scalar = get_args(get_args(get_args(hint)[0])[1])[0]
            kinds[name] = (np.dtype(scalar), metadata[0])
    return kinds


def packed(value: tuple[Any, ...]) -> NDArray[np.int64]:
    """Return the words that `unpacked_at` reads: numbers, and of arrays addresses and lengths.

    The arrays have to outlive the words.

    Raises:
        TypeError: an array is not what its structure says; compiled code would read beyond it.
    """
    return np.array(list(_words(value)), np.int64)


def _words(value: tuple[Any, ...]) -> Iterator[int]:
    for (name, kind), part in zip(field_kinds(type(value)).items(), value, strict=True):
        if isinstance(kind, tuple):
            dtype, n_dimensions = kind
            if (part.dtype, part.ndim) != (dtype, n_dimensions) or not part.flags.carray:
                raise TypeError(f"{type(value).__name__}.{name}: no {n_dimensions}-d {dtype} array")
            yield from (part.ctypes.data, *part.shape)
        elif kind is float:
            yield int(np.float64(part).view(np.int64))
        elif kind in (int, bool):
            yield int(part)
        else:
            yield from _words(part)


@cast("Callable[..., Callable[[type[S], int], S]]", intrinsic)
def unpacked_at(typing_context: Any, structure: Any, address: types.Type) -> Any:
    """Return the structure whose words `packed` has put at `address`."""
    found = _compiled_type(structure.instance_class)

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        words = builder.inttoptr(values[1], _WORD.as_pointer())
        places = iter(range(10_000))

        def word() -> Any:
            return builder.load(builder.gep(words, [ir.Constant(_WORD, next(places))]))

        return _loaded(context, builder, found, word)

    return found(structure, types.int64), generate


def _compiled_type(structure: type) -> Any:
    scalars = {float: types.float64, int: types.int64, bool: types.boolean}
    parts: list[Any] = []
    for kind in field_kinds(structure).values():
        if isinstance(kind, tuple):
            dtype = types.boolean if kind[0] == np.bool_ else getattr(types, kind[0].name)
            parts.append(types.Array(dtype, kind[1], "C"))
        else:
            parts.append(scalars.get(kind) or _compiled_type(kind))
    return cast("Any", types).NamedTuple(parts, structure)


def _loaded(context: Any, builder: Any, kind: Any, word: Callable[[], Any]) -> Any:
    if isinstance(kind, types.NamedTuple):
        parts = [_loaded(context, builder, part, word) for part in kind.types]
        return context.make_tuple(builder, kind, parts)
    if kind == types.float64:
        return builder.bitcast(word(), ir.DoubleType())
    if kind == types.boolean:
        return builder.icmp_signed("!=", word(), ir.Constant(_WORD, 0))
    if kind == types.int64:
        return word()
    array = context.make_array(kind)(context, builder)
    data = builder.inttoptr(word(), array.data.type)
    shape = [word() for _ in range(kind.ndim)]
    width = context.get_abi_sizeof(context.get_data_type(kind.dtype))
    itemsize = ir.Constant(_WORD, width)
    strides = [itemsize] if kind.ndim == 1 else [builder.mul(shape[1], itemsize), itemsize]
    cast("Any", arrayobj).populate_array(array, data, shape, strides, itemsize, meminfo=None)
    return array._getvalue()
