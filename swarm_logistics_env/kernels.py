"""Compilation of the package's kernels, and the random numbers they draw."""

from __future__ import annotations

import functools
import hashlib
import math
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast

import numba
import numpy as np
from numba.core import config, types

P = ParamSpec("P")
R = TypeVar("R")


def _digest_of_sources() -> str:
    here = Path(__file__).parent
    digest = hashlib.blake2b(digest_size=6)
    for pattern in ("*.py", "warehouse/*.py", "motion/*.py", "policies/*.py"):
        for path in sorted(here.glob(pattern)):
            source = path.read_bytes()
            # Kernels, what they are made of, and the files whose constants and arrays they use.
            marks = (b"swarm_logistics_env.kernels import", b"import intrinsic")
            others = ("kernels.py", "observations.py", "structs.py")
            if any(mark in source for mark in marks) or path.name in others:
                digest.update(source)
    return digest.hexdigest()


_SOURCES = _digest_of_sources()


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile `function` with numba.

    Without the interpreter's lock, so that several worlds step in threads; cached on disk, so
    that a second process starts at once; without fast-math, so that results are the same bits
    wherever they run; and with numpy's division, which needs no check for zero.
    """
    return _compiled(function, is_inlined=False)


def inlined_kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile `function` with numba as a part of the kernels that call it.

    A structure of arrays costs nothing then, where a call would copy hundreds of words.
    """
    return _compiled(function, is_inlined=True)


def _compiled(function: Callable[P, R], *, is_inlined: bool) -> Callable[P, R]:
    # numba notices a change of a kernel's own file only, not of the kernels and constants from
    # other files that were compiled into it. So their digest goes into the name of the cache.
    name = function.__qualname__
    function.__qualname__ = f"{name}-{_SOURCES}"
    options: dict[str, Any] = {"nogil": True, "error_model": "numpy", "forceinline": is_inlined}
    options["no_cfunc_wrapper"] = True  # nobody calls a kernel from C
    try:
        compiled = numba.njit(function, cache=True, **options)
    except RuntimeError:
        # Neither the installation nor the user's own folder can be written.
        _warn_of_no_cache()
        compiled = numba.njit(function, **options)
    function.__qualname__ = name
    if not config.DISABLE_JIT:
        compiled.get_call_template = functools.partial(_call_template, compiled)
    return cast("Callable[P, R]", compiled)


def _call_template(compiled: Any, args: tuple[Any, ...], named: dict[str, Any]) -> Any:
    # A number that stands in the code is no type of its own, or each would be compiled for.
    plain = tuple(types.unliteral(kind) for kind in args)
    return type(compiled).get_call_template(compiled, plain, named)


@functools.cache
def _warn_of_no_cache() -> None:
    warnings.warn(
        "compiled code can be kept nowhere, so every process compiles for itself, which takes "
        "half a minute: set NUMBA_CACHE_DIR to a folder that can be written",
        stacklevel=5,
    )


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
    key and the count. `streams.row_keys` makes the keys.
    """
    value = np.uint64(key) + np.uint64(counter + 1) * np.uint64(0x9E3779B97F4A7C15)
    value = (value ^ (value >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    value = (value ^ (value >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    value = value ^ (value >> np.uint64(31))
    return float(value >> np.uint64(11)) * 1.1102230246251565e-16
