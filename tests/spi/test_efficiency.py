from __future__ import annotations

import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.spi import IndicatorError


def test_values_of_table_1() -> None:
    assert spi.karp_flatt(18, 29, n_1=10, n_2=20) == pytest.approx(2 * (18 / 29 - 0.5))


def test_limits_of_karp_flatt() -> None:
    assert spi.karp_flatt(9, 18, n_1=5, n_2=10) == 0.0
    assert spi.karp_flatt(9, 9, n_1=5, n_2=10) == 1.0
    assert spi.karp_flatt(9, 27, n_1=5, n_2=10) < 0
    # Amdahl's law with serial fraction .1 gives it back at any size.
    for n in (2, 8, 30):
        assert spi.karp_flatt(1, 1 / (0.1 + 0.9 / n), n_1=1, n_2=n) == pytest.approx(0.1)


def test_bad_input_is_named() -> None:
    with pytest.raises(IndicatorError, match="n_2 = nan: should be finite"):
        spi.karp_flatt(3, 3, n_1=5, n_2=float("nan"))
    with pytest.raises(IndicatorError, match="n_2 = 5: should be larger than n_1 = 5"):
        spi.karp_flatt(3, 3, n_1=5, n_2=5)
    for p_1, p_2, name in ((0, 3, "p_1"), (3, -1, "p_2")):
        with pytest.raises(IndicatorError, match=f"{name} = .*: should be positive"):
            spi.karp_flatt(p_1, p_2, n_1=5, n_2=10)
