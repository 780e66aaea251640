"""Where compiled code looks for the fields of a structure: where `packed` has put them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env.compiler.numba_fence import IS_INTERPRETED
from swarm_logistics_env.compiler.packing import packed
from tests.compiler.test_packing import Inner, Outer

if IS_INTERPRETED:
    pytest.skip("nothing is compiled", allow_module_level=True)

from numba import njit

from swarm_logistics_env.compiler import compiled_addresses


@njit
def place_of(array: NDArray[Any]) -> tuple[Any, ...]:
    return array.ctypes.data, array.shape, array.strides


@njit
def fields_at(address: int) -> tuple[Any, ...]:
    outer = compiled_addresses.unpacked_at(Outer, address)
    numbers = outer.total, outer.inner.share, outer.inner.is_on, outer.last
    return numbers, place_of(outer.rows), place_of(outer.inner.row), place_of(outer.flags)


def test_a_kernel_finds_each_field_behind_the_words_of_those_before_it() -> None:
    rows, row, flags = np.zeros((2, 3), np.float32), np.zeros(3), np.zeros(2, np.bool_)
    words = packed(Outer(-7, rows, Inner(0.25, True, row), flags, -1.5))
    places = map(place_of.py_func, (rows, row, flags))
    assert fields_at(words.ctypes.data) == ((-7, 0.25, True, -1.5), *places)
