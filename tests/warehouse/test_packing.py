"""Structures of arrays arrive in compiled code as they are in the interpreter."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numba
import numpy as np
import pytest

from swarm_logistics_env.errors import SetupError
from swarm_logistics_env.kernels import kernel
from swarm_logistics_env.warehouse import packing, physics
from swarm_logistics_env.warehouse.packing import blank, hints, packed, unpacked_at
from swarm_logistics_env.warehouse.structs import Claims, Flags, Functions, Keys, Numbers


class Inner(NamedTuple):
    """A structure in a structure."""

    n_things: int
    key: Annotated[Keys, "things"]


class Outer(NamedTuple):
    """Every kind of field."""

    share: float
    is_on: bool
    rows: Annotated[Numbers, "rows", 3]
    inner: Inner
    flags: Annotated[Flags, 3]


@kernel
def read_and_write(address: int) -> tuple[float, bool, float, int, int, int]:
    """Return something of every field, and change two."""
    outer = unpacked_at(Outer, address)
    outer.rows[1, 2] += 1.0
    outer.flags[0] = True
    key = int(outer.inner.key[1] >> np.uint64(60))
    return outer.share, outer.is_on, outer.rows.sum(), outer.inner.n_things, key, len(outer.flags)


def test_every_kind_of_field_is_read_and_arrays_are_written() -> None:
    outer = Outer(
        share=-2.5,
        is_on=True,
        rows=np.arange(6.0).reshape(2, 3),
        inner=Inner(n_things=-7, key=np.array([1, 15 << 60], np.uint64)),
        flags=np.array([False, True, False]),
    )
    words = packed(outer)
    assert read_and_write(words.ctypes.data) == (-2.5, True, 16.0, -7, 15, 3)
    assert outer.rows.tolist() == [[0.0, 1.0, 2.0], [3.0, 4.0, 6.0]]
    assert outer.flags.tolist() == [True, True, False]


@pytest.mark.parametrize(
    "rows",
    [np.zeros((2, 3), np.float32), np.zeros(3), np.zeros((3, 2)).T, np.zeros((4, 2))[::2]],
)
def test_an_array_that_is_not_as_declared_is_refused(rows: Any) -> None:
    outer = Outer(0.0, False, rows, Inner(0, np.zeros(1, np.uint64)), np.zeros(1, np.bool_))
    with pytest.raises(TypeError, match=r"Outer\.rows: should be \(.rows., 3\) numbers of float64"):
        packed(outer)


def test_blank_arrays_have_the_lengths_that_their_shapes_name() -> None:
    claims = blank(Claims, {"I": 4, "4 N": 8, "N": 2})
    assert [len(each) for each in claims] == [4, 4, 8, 2]
    assert claims.events.shape == (8, 3)
    assert claims.events.dtype == np.int64
    assert packed(claims)[[1, 5, 6]].tolist() == [4, 8, 3]


nb: Any = numba  # typed in parts only
doubles = nb.types.CPointer(nb.double)


def test_a_structure_passed_by_reference_arrives(monkeypatch: pytest.MonkeyPatch) -> None:
    def note(to: Any, place: Any) -> None:
        noted, given = nb.carray(to, 2), nb.carray(place, 2)
        noted[0], noted[1] = given[0], given[1]

    def run(address: int, to: int) -> None:
        packing.call_at(address, (to, (5.5, -6.5)))

    monkeypatch.setattr(packing, "_BY_REFERENCE", True)
    called = nb.cfunc(nb.void(doubles, doubles))(note)
    seen = np.zeros(2)
    nb.njit(run)(called.address, seen.ctypes.data)
    assert seen.tolist() == [5.5, -6.5]


def test_a_pymunk_without_the_functions_is_refused_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    renamed = {**hints(Functions), "step": Annotated[int, "cpSpaceLeap"]}
    monkeypatch.setattr(physics, "hints", lambda _: renamed)
    with pytest.raises(SetupError, match=r"pymunk 7.* lacks a function: .*cpSpaceLeap"):
        physics._function_addresses()
