"""The paper's tables through the same functions as any study, and its claims in words."""

from __future__ import annotations

from itertools import pairwise

import pytest

from swarm_logistics_env import spi

SIZES = [5, 10, 20, 30, 40, 50, 60, 100, 150]
TABLE_I = dict(zip(SIZES, [9, 18, 29, 33, 45, 56, 65, 74, 69], strict=True))
P_O, P_S = 39, {1: 39, 2: 35, 3: 36}
P_F = {
    "FM1": {1: 41, 2: 38, 3: 35},
    "FM2": {1: 40, 2: 41, 3: 35},
    "FM3": {1: 40, 2: 41, 3: 40},
    "FM4": {1: 39, 2: 15, 3: 12},
}


S = [1.000, 0.611, 0.276, 1.091, 0.978, 0.804, 0.208, -0.135]
FT = {
    "FM1": [0.051, 0.077, -0.026],
    "FM2": [0.026, 0.154, -0.026],
    "FM3": [0.026, 0.154, 0.103],
    "FM4": [0.0, -0.513, -0.615],
}
R = {
    "FM1": [0.091, 0.054, 0.017],
    "FM2": [0.066, 0.131, 0.017],
    "FM3": [0.066, 0.131, 0.146],
    "FM4": [0.040, -0.535, -0.572],
}


def test_scalability_of_table_1() -> None:
    found = [
        spi.scalability([TABLE_I[n]], [TABLE_I[larger]], n=n, m=larger - n).value
        for n, larger in pairwise(SIZES)
    ]
    assert [round(s, 3) for s in found] == S
    # Claims follow from strict inequalities: S = 1 at 5 -> 10 is not superlinear.
    assert [n for n, s in zip(SIZES, found) if s > 1] == [30]


@pytest.mark.parametrize("mode", P_F)
def test_fault_tolerance_and_robustness_of_table_2(mode: str) -> None:
    faulty = P_F[mode].items()
    ft = [spi.fault_tolerance([P_O], [p], [P_S[m]], n=25, m=m).value for m, p in faulty]
    assert [round(value, 3) for value in ft] == FT[mode]
    # FT = 0 of FM4 at m = 1 is not tolerant.
    assert [value > 0 for value in ft] == [value > 0 for value in FT[mode]]
    robust = [spi.robustness([P_O], [p], n=25, m=m).value for m, p in faulty]
    assert [round(value, 3) for value in robust] == R[mode]


@pytest.mark.parametrize(
    ("x_o", "x_new", "p_o", "p_new", "expected"),
    [
        (0.5, 1.0, 47, 41, 0.872),
        (0.5, 1.5, 47, 21, 0.723),
        (0.5, 2.0, 47, 8, 0.723),
        (0.2, 0.15, 41, 37, 0.610),
        (0.2, 0.10, 41, 26, 0.268),
        (0.2, 0.05, 41, 16, 0.187),
        (60, 70, 44, 31, -0.773),
    ],
)
def test_adaptability_of_table_3(
    x_o: float, x_new: float, p_o: int, p_new: int, expected: float
) -> None:
    assert round(spi.adaptability([p_o], [p_new], x_o=x_o, x_new=x_new).value, 3) == expected


def test_the_ways_of_reading_widths_agree() -> None:
    # Multiples, metres and fractions of the arena differ by a factor, and A is a ratio in x.
    in_metres = spi.adaptability([47], [21], x_o=5.0, x_new=15.0)
    assert in_metres.value == pytest.approx(spi.adaptability([47], [21], x_o=0.5, x_new=1.5).value)
