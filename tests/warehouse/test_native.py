"""C functions called by address get exactly what they were to get."""

from __future__ import annotations

from typing import Annotated, Any

import numba
import numpy as np
import pytest

from swarm_logistics_env.errors import SetupError
from swarm_logistics_env.warehouse import packing, physics
from swarm_logistics_env.warehouse.packing import hints
from swarm_logistics_env.warehouse.structs import Functions

nb: Any = numba  # typed in parts only
doubles = nb.types.CPointer(nb.double)


def test_integers_doubles_and_structures_arrive_in_their_order() -> None:
    def note(to: Any, a: int, b: int, c: int, x: float, y: float, z: float) -> None:
        noted = nb.carray(to, 6)
        noted[0], noted[1], noted[2], noted[3], noted[4], noted[5] = a, b, c, x, y, z

    def run(address: int, to: int) -> None:
        packing.call_at(address, (to, 1, (2, 2**62), 4.5, (5.5, -6.5)))

    # A structure of two words of a kind is passed as two arguments here.
    called = nb.cfunc(nb.void(doubles, *[nb.int64] * 3, *[nb.double] * 3))(note)
    seen = np.zeros(6)
    nb.njit(run)(called.address, seen.ctypes.data)
    assert seen.tolist() == [1.0, 2.0, 2.0**62, 4.5, 5.5, -6.5]


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


def test_a_stored_int_leaves_its_neighbours_alone() -> None:
    def run(address: int) -> None:
        packing.store_at(address, 7)

    numbers = np.array([-1, -1, -1], np.int32)
    nb.njit(run)(numbers[1:].ctypes.data)
    assert numbers.tolist() == [-1, 7, -1]


def test_a_pymunk_without_the_functions_is_refused_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    renamed = {**hints(Functions), "step": Annotated[int, "cpSpaceLeap"]}
    monkeypatch.setattr(physics, "hints", lambda _: renamed)
    with pytest.raises(SetupError, match=r"pymunk 7.* lacks a function: .*cpSpaceLeap"):
        physics._function_addresses()
