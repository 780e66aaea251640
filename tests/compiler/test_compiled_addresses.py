"""Where compiled code looks for the fields of a structure: where `packed` has put them."""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env.compiler.numba_fence import IS_INTERPRETED
from swarm_logistics_env.compiler.packing import packed

if IS_INTERPRETED:
    pytest.skip("nothing is compiled", allow_module_level=True)

from swarm_logistics_env.compiler import compiled_addresses


class Inner(NamedTuple):
    share: float
    is_on: bool
    row: Annotated[NDArray[np.float64], 3]


class Outer(NamedTuple):
    total: int
    rows: Annotated[NDArray[np.float32], "N", 3]
    inner: Inner
    flags: Annotated[NDArray[np.bool_], "N"]
    last: float


def test_each_field_lies_behind_the_words_of_those_before_it() -> None:
    places = compiled_addresses._places.__wrapped__(Outer)
    assert {
        name: (str(kind).rpartition(".")[2], before) for name, (kind, before) in places.items()
    } == {
        "total": ("int64", 0),
        "rows": ("array(float32, 2d, C)", 1),
        "inner": ("Inner at an address", 4),
        "flags": ("array(bool, 1d, C)", 8),
        "last": ("float64", 10),
    }
    inner = Inner(0.5, False, np.zeros(3))
    outer = Outer(3, np.zeros((2, 3), np.float32), inner, np.zeros(2, np.bool_), 1.0)
    assert len(packed(outer)) == 11 == compiled_addresses._n_words(Outer)
