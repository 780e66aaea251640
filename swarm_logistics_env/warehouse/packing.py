"""A structure of arrays as one argument of a kernel: the address of a table of words.

Each array handed to a kernel costs as much time as a robot's timers; a control step needs sixty.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from typing import Any, TypeVar, cast, get_args, get_origin, get_type_hints

import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]  # it ships none
from numba.core import types
from numba.extending import intrinsic
from numba.np import arrayobj
from numpy.typing import NDArray

S = TypeVar("S", bound=tuple[Any, ...])

_WORD = ir.IntType(64)


def hints(structure: type) -> dict[str, Any]:
    """Return the annotation of each field."""
    return get_type_hints(structure, include_extras=True)


@functools.cache
def field_kinds(structure: type) -> dict[str, Any]:
    """Return by field `float`, `int`, `bool`, a structure, or (dtype, shape) of an array."""
    kinds: dict[str, Any] = {}
    for name, hint in hints(structure).items():
        kinds[name] = getattr(hint, "__origin__", hint)
        if get_origin(kinds[name]) is np.ndarray:
            scalar = get_args(get_args(kinds[name])[1])[0]
            kinds[name] = (np.dtype(scalar), hint.__metadata__)
    return kinds


def blank(structure: type[S], lengths: Mapping[str, int]) -> S:
    """Return a structure of arrays of zeros; its shapes name their lengths."""
    kinds = field_kinds(structure).values()
    return structure(
        *(np.zeros([lengths.get(n, n) for n in shape], dtype) for dtype, shape in kinds)
    )


def packed(value: tuple[Any, ...]) -> NDArray[np.int64]:
    """Return the words that `unpacked_at` reads: numbers, and of arrays addresses and lengths.

    The arrays have to outlive the words.

    Raises:
        TypeError: an array is not what its structure says; compiled code would read beyond it.
    """
    words: list[int] = []
    _append_words(value, words)
    return np.array(words, np.int64)


def _append_words(value: tuple[Any, ...], words: list[int]) -> None:
    for (name, kind), part in zip(field_kinds(type(value)).items(), value, strict=True):
        if isinstance(kind, tuple):
            dtype, shape = kind
            if (part.dtype, part.ndim) != (dtype, len(shape)) or not part.flags.carray:
                what = f"{type(value).__name__}.{name}"
                raise TypeError(f"{what}: should be {shape} numbers of {dtype}, without gaps")
            words.append(part.__array_interface__["data"][0])  # faster than part.ctypes
            words += part.shape
        elif kind is float:
            words.append(int(np.float64(part).view(np.int64)))
        elif kind in (int, bool):
            words.append(int(part))
        else:
            _append_words(part, words)


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
            parts.append(types.Array(dtype, len(kind[1]), "C"))
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
