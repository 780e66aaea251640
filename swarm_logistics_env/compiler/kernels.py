"""Compilation of the package's kernels, and the random numbers they draw.

`numba_fence` says which way they are compiled; both ways give the same bits.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.compiler.numba_fence import IS_MISSING, IS_PLAIN, numba

P = ParamSpec("P")
R = TypeVar("R")

# The array at a pointer (`addresses.pointer_at`), of a shape and a type; worlds alone need it.
carray: Callable[..., NDArray[Any]] = getattr(numba, "carray", None)  # type: ignore[assignment]


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile `function` with numba; where that is missing it stays as it is.

    To have the same bits there, a float32 that meets a plain float is made np.float64 in the code:
    numba does so by itself, numpy does not.

    Without the interpreter's lock, so that several worlds step in threads; cached on disk, so
    that a second process starts at once; without fast-math, so that results are the same bits
    wherever they run; and with numpy's division, which needs no check for zero.
    """
    return _compile(function, is_inlined=False)


def inlined_kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile `function` with numba as a part of the kernels that call it.

    For small ones that are called in loops: every caller is larger by it.
    """
    return _compile(function, is_inlined=True)


def engine_kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile `function`, which calls C or reads a world by its address, in the fast way alone.

    The plain way leaves it to the interpreter.
    """
    return function if IS_PLAIN else kernel(function)


def _compile(function: Callable[P, R], *, is_inlined: bool) -> Callable[P, R]:
    if IS_MISSING:
        return function
    if IS_PLAIN:
        # Not kept on disk: numba looks at the kernel's own file alone, not at what it takes from
        # others, so that code of older sources would run.
        compiled = numba.njit(function, nogil=True, error_model="numpy", cache=False)
        return cast("Callable[P, R]", compiled)
    from swarm_logistics_env.compiler.fast_kernels import compile_fast

    return compile_fast(function, is_inlined=is_inlined)


@kernel
def pair_key(key: np.uint64, other: int) -> np.uint64:
    """Return the key of a stream of its own for each `other`."""
    return np.uint64(key) ^ (np.uint64(other + 1) * np.uint64(0xD1342543DE82EF95))


@kernel
def gaussian(key: np.uint64, counter: int) -> float:
    """Return a standard normal number from numbers 2 `counter` and the next of stream `key`."""
    radius = math.sqrt(-2.0 * math.log(1.0 - uniform(key, 2 * counter)))
    return radius * math.cos(2.0 * math.pi * uniform(key, 2 * counter + 1))


@kernel
def uniform(key: np.uint64, counter: int) -> float:
    """Return number `counter` of the stream `key`, in [0, 1) (SplitMix64).

    Counter-based: a kernel needs no generator's state, so a stream depends on nothing but its
    key and the count. `core.streams.row_keys` makes the keys.
    """
    value = np.uint64(key) + np.uint64(counter + 1) * np.uint64(0x9E3779B97F4A7C15)
    value = (value ^ (value >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    value = (value ^ (value >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    value = value ^ (value >> np.uint64(31))
    return float(value >> np.uint64(11)) * 1.1102230246251565e-16
