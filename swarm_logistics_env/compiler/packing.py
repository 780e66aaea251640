"""A structure of arrays as one argument of a kernel: the address of a table of words.

Each array handed to a kernel costs as much time as a robot's timers; a control step needs sixty.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator, Mapping
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

S = TypeVar("S", bound=tuple[Any, ...])


@functools.cache
def field_kinds(structure: type) -> dict[str, Any]:
    """Return by field `float`, `int`, `bool`, a structure, or (dtype, shape) of an array."""
    kinds: dict[str, Any] = {}
    for name, hint in get_type_hints(structure, include_extras=True).items():
        kinds[name] = getattr(hint, "__origin__", hint)
        if get_origin(kinds[name]) in (np.ndarray, NDArray):  # an alias of its own since NumPy 2.5
            *_, scalar = get_args(kinds[name])  # or, before, np.dtype[scalar]
            kinds[name] = (np.dtype(*get_args(scalar) or [scalar]), hint.__metadata__)
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
    return np.array(list(_words_of(value)), np.int64)


def _words_of(value: tuple[Any, ...]) -> Iterator[int]:
    for (name, kind), part in zip(field_kinds(type(value)).items(), value, strict=True):
        if isinstance(kind, tuple):
            dtype, shape = kind
            if (part.dtype, part.ndim) != (dtype, len(shape)) or not part.flags.carray:
                what = f"{type(value).__name__}.{name}"
                raise TypeError(f"{what}: should be {shape} numbers of {dtype}, without gaps")
            yield part.__array_interface__["data"][0]  # faster than part.ctypes
            yield from part.shape
        elif kind is float:
            yield int(np.float64(part).view(np.int64))
        elif kind in (int, bool):
            yield int(part)
        else:
            yield from _words_of(part)
