from __future__ import annotations

from typing import Any

import numba
import pytest

from swarm_logistics_env import kernels


def test_a_kernel_compiles_where_nothing_can_be_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    compile_it = numba.njit

    def njit(function: Any, **options: Any) -> Any:
        if options.get("cache"):
            raise RuntimeError("cannot cache function: no locator available")
        return compile_it(function, **options)

    monkeypatch.setattr(numba, "njit", njit)
    kernels._warn_of_no_cache.cache_clear()

    def double(number: float) -> float:
        return 2.0 * number

    def half(number: float) -> float:
        return number / 2.0

    with pytest.warns(UserWarning, match="NUMBA_CACHE_DIR") as told:
        compiled = [kernels.kernel(function) for function in (double, half)]
    assert len(told) == 1
    assert [function(3.0) for function in compiled] == [6.0, 1.5]
    kernels._warn_of_no_cache.cache_clear()
