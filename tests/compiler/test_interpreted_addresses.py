"""The interpreter's way with addresses: words, structures of them, and functions of C."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np

from swarm_logistics_env.compiler import interpreted_addresses as at
from swarm_logistics_env.compiler.packing import packed
from tests.compiler.test_packing import Inner, Outer


def test_a_structure_is_read_from_its_words_and_shares_its_arrays() -> None:
    rows, flags = np.arange(6, dtype=np.float32).reshape(2, 3), np.array([True, False])
    row = np.arange(3.0)
    words = packed(Outer(-7, rows, Inner(0.25, True, row), flags, -1.5))
    assert len(words) == 1 + 3 + (1 + 1 + 2) + 2 + 1
    assert words[[0, 2, 3, 5, 7, 9]].tolist() == [-7, 2, 3, 1, 3, 2]
    outer = at.unpacked_at(Outer, words.ctypes.data)
    assert (outer.total, outer.inner.share, outer.inner.is_on, outer.last) == (-7, 0.25, True, -1.5)
    assert type(outer.inner.is_on) is bool
    for array, original in ((outer.rows, rows), (outer.inner.row, row), (outer.flags, flags)):
        np.testing.assert_array_equal(array, original)
    outer.rows[1, 2] = 9.0
    assert rows[1, 2] == 9.0


def test_words_are_read_and_changed_by_their_index() -> None:
    words = np.array([5, 6, 7], np.int64)
    address = words.ctypes.data
    assert (at.load_word(address), at.load_word(address, 2)) == (5, 7)
    assert at.exchange(address, 1, 60) == 6
    assert at.add(address, 2, -3) == 7
    assert at.replace(address, 0, 5, 50)
    assert not at.replace(address, 0, 5, 51)
    assert words.tolist() == [50, 60, 4]
    assert at.pointer_at(np.int64(address)).value == address  # type: ignore[arg-type]


def test_a_function_of_c_is_called_with_numbers_and_structures() -> None:
    calls: list[Any] = []

    @ctypes.CFUNCTYPE(  # type: ignore[untyped-decorator]  # of ctypes
        ctypes.c_int64, ctypes.c_int64, ctypes.c_double, at._Words, at._Doubles
    )
    def function(number: int, real: float, words: Any, doubles: Any) -> int:
        calls.append((number, real, words.first, words.second, doubles.first, doubles.second))
        return 2**40 + number

    address = ctypes.cast(function, ctypes.c_void_p).value or 0
    arguments = (np.int32(3), 0.5, (2**33, True), (1.5, -2.5))
    assert at.made_at(address, arguments) == 2**40 + 3
    assert at.call_at(address, arguments) is None
    assert calls == [(3, 0.5, 2**33, 1, 1.5, -2.5)] * 2
