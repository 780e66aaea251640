"""Many arrays as one argument of a kernel: their addresses and shapes.

Each array handed to a kernel costs as much time as a robot's timers; a control step needs thirty.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.kernels import kernel
from swarm_logistics_env.warehouse.native import pointer_at

carray: Callable[..., NDArray[Any]] = numba.carray  # type: ignore[attr-defined]  # not declared


class Tables:
    """Arrays that stay where they are, and what a kernel needs to find them.

    Attributes:
        addresses: (n, 3): of each array its address, its first length, and its second or 1.
        where: the address of these.
    """

    def __init__(self, arrays: Sequence[NDArray[Any]]) -> None:
        self._kept = tuple(arrays)  # the kernels trust that they are there
        self.addresses = np.array(
            [(array.ctypes.data, *array.shape, 1)[:3] for array in arrays], np.int64
        )
        self.where: int = self.addresses.ctypes.data


@kernel
def numbers_in(tables: NDArray[np.int64], place: int) -> NDArray[np.float64]:
    """Return array number `place`, (n, k) of numbers."""
    return carray(pointer_at(tables[place, 0]), (tables[place, 1], tables[place, 2]), np.float64)


@kernel
def number_row_in(tables: NDArray[np.int64], place: int) -> NDArray[np.float64]:
    """Return array number `place`, (n,) of numbers."""
    return carray(pointer_at(tables[place, 0]), tables[place, 1], np.float64)


@kernel
def counts_in(tables: NDArray[np.int64], place: int) -> NDArray[np.int64]:
    """Return array number `place`, (n, k) of integers."""
    return carray(pointer_at(tables[place, 0]), (tables[place, 1], tables[place, 2]), np.int64)


@kernel
def count_row_in(tables: NDArray[np.int64], place: int) -> NDArray[np.int64]:
    """Return array number `place`, (n,) of integers."""
    return carray(pointer_at(tables[place, 0]), tables[place, 1], np.int64)


@kernel
def flags_in(tables: NDArray[np.int64], place: int) -> NDArray[np.bool_]:
    """Return array number `place`, (n, k) of flags."""
    return carray(pointer_at(tables[place, 0]), (tables[place, 1], tables[place, 2]), np.bool_)


@kernel
def keys_in(tables: NDArray[np.int64], place: int) -> NDArray[np.uint64]:
    """Return array number `place`, (n,) of keys."""
    return carray(pointer_at(tables[place, 0]), tables[place, 1], np.uint64)
