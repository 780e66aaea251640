from __future__ import annotations

from typing import Annotated, Any, NamedTuple, TypeVar

import numpy as np
import pytest
from numpy.typing import NDArray
from typing_extensions import TypeAliasType

from swarm_logistics_env.compiler import packing

Scalar = TypeVar("Scalar", bound=np.generic)
Any_shape = tuple[Any, ...]
# As NumPy defines its own NDArray since 2.5, where Python has type aliases.
make_alias: Any = TypeAliasType
Alias = make_alias("Alias", NDArray[Scalar], type_params=(Scalar,))  # type: ignore[valid-type]


class Own(NamedTuple):
    number: float
    rows: Annotated[NDArray[np.float64], "N", 2]


class Plain(NamedTuple):
    number: float
    rows: Annotated[np.ndarray[Any_shape, np.dtype[np.float64]], "N", 2]


class Aliased(NamedTuple):
    number: float
    rows: Annotated[Alias[np.float64], "N", 2]  # type: ignore[valid-type]


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


class Arrays(NamedTuple):
    rows: Annotated[NDArray[np.float32], "N", 3]
    flags: Annotated[NDArray[np.bool_], "N"]


@pytest.mark.parametrize("structure", [Own, Plain, Aliased])
def test_an_array_is_read_however_numpy_defines_its_type(
    structure: type, monkeypatch: pytest.MonkeyPatch
) -> None:
    if structure is Aliased:
        monkeypatch.setattr(packing, "NDArray", Alias)
    kinds = packing.field_kinds.__wrapped__(structure)  # which keeps no answer
    assert kinds == {"number": float, "rows": (np.dtype(np.float64), ("N", 2))}


def test_arrays_of_zeros_have_the_lengths_that_shapes_name() -> None:
    arrays = packing.blank(Arrays, {"N": 4})
    assert [(part.shape, str(part.dtype)) for part in arrays] == [
        ((4, 3), "float32"), ((4,), "bool")
    ]  # fmt: skip
    assert not any(part.any() for part in arrays)


@pytest.mark.parametrize(
    "rows",
    [
        np.zeros((2, 3)),
        np.zeros(6, np.float32),
        np.zeros((3, 2), np.float32).T,
        np.zeros((2, 6), np.float32)[:, ::2],
    ],
)
def test_an_array_that_compiled_code_would_misread_is_refused(rows: NDArray[Any]) -> None:
    shape = r"\('N', 3\) numbers of float32, without gaps$"
    with pytest.raises(TypeError, match=rf"^Arrays.rows: should be {shape}"):
        packing.packed(Arrays(rows, np.zeros(2, np.bool_)))
