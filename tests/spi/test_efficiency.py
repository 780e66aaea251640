from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm_logistics_env import spi
from swarm_logistics_env.spi import IndicatorError


def test_values_of_table_1() -> None:
    assert spi.per_robot_efficiency(39, 25) == 1.56
    assert spi.marginal_gain(33, 45, n_1=30, n_2=40) == pytest.approx(1.0)
    assert spi.marginal_gain(18, 29, n_1=10, n_2=20) == pytest.approx(-7.0)
    assert spi.karp_flatt(18, 29, n_1=10, n_2=20) == pytest.approx(2 * (18 / 29 - 0.5))


def test_limits_of_karp_flatt() -> None:
    assert spi.karp_flatt(9, 18, n_1=5, n_2=10) == 0.0
    assert spi.karp_flatt(9, 9, n_1=5, n_2=10) == 1.0
    assert spi.karp_flatt(9, 27, n_1=5, n_2=10) < 0
    # Amdahl's law with serial fraction .1 gives it back at any size.
    for n in (2, 8, 30):
        assert spi.karp_flatt(1, 1 / (0.1 + 0.9 / n), n_1=1, n_2=n) == pytest.approx(0.1)


@given(st.integers(1, 99), st.integers(0, 99), st.integers(1, 50), st.integers(1, 50))
def test_marginal_gain_is_positive_exactly_where_s_exceeds_1(
    p_1: int, p_2: int, n: int, m: int
) -> None:
    gain = spi.marginal_gain(p_1, p_2, n_1=n, n_2=n + m)
    s = spi.scalability([p_1], [p_2], n=n, m=m).value
    if abs(gain) > 1e-9:
        assert (gain > 0) == (s > 1)
    else:
        assert s == pytest.approx(1)


def test_bad_input_is_named() -> None:
    with pytest.raises(IndicatorError, match="n = 0: should be positive"):
        spi.per_robot_efficiency(3, 0)
    with pytest.raises(IndicatorError, match="p = -3"):
        spi.per_robot_efficiency(-3, 5)
    with pytest.raises(IndicatorError, match="p_2 = nan: should be finite"):
        spi.marginal_gain(3, float("nan"), n_1=5, n_2=10)
    with pytest.raises(IndicatorError, match="n_2 = 5: should be larger than n_1 = 5"):
        spi.marginal_gain(3, 3, n_1=5, n_2=5)
    for p_1, p_2, name in ((0, 3, "p_1"), (3, 0, "p_2")):
        with pytest.raises(IndicatorError, match=f"{name} = 0"):
            spi.karp_flatt(p_1, p_2, n_1=5, n_2=10)
