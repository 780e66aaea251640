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


@pytest.mark.parametrize("structure", [Own, Plain, Aliased])
def test_an_array_is_read_however_numpy_defines_its_type(
    structure: type, monkeypatch: pytest.MonkeyPatch
) -> None:
    if structure is Aliased:
        monkeypatch.setattr(packing, "NDArray", Alias)
    kinds = packing.field_kinds.__wrapped__(structure)  # which keeps no answer
    assert kinds == {"number": float, "rows": (np.dtype(np.float64), ("N", 2))}
