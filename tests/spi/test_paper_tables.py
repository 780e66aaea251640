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


@pytest.mark.parametrize(
    ("n", "larger", "expected"),
    [
        (5, 10, 1.000),
        (10, 20, 0.611),
        (20, 30, 0.276),
        (30, 40, 1.091),
        (40, 50, 0.978),
        (50, 60, 0.804),
        (60, 100, 0.208),
        (100, 150, -0.135),
    ],
)
def test_scalability_of_table_1(n: int, larger: int, expected: float) -> None:
    s = spi.scalability([TABLE_I[n]], [TABLE_I[larger]], n=n, m=larger - n)
    assert round(s.value, 3) == expected


@pytest.mark.parametrize(
    ("mode", "expected"),
    [
        ("FM1", [0.051, 0.077, -0.026]),
        ("FM2", [0.026, 0.154, -0.026]),
        ("FM3", [0.026, 0.154, 0.103]),
        ("FM4", [0.0, -0.513, -0.615]),
    ],
)
def test_fault_tolerance_of_table_2(mode: str, expected: list[float]) -> None:
    values = [spi.fault_tolerance([P_O], [P_F[mode][m]], [P_S[m]], n=25, m=m) for m in (1, 2, 3)]
    assert [round(ft.value, 3) for ft in values] == expected


@pytest.mark.parametrize(
    ("mode", "expected"),
    [
        ("FM1", [0.091, 0.054, 0.017]),
        ("FM2", [0.066, 0.131, 0.017]),
        ("FM3", [0.066, 0.131, 0.146]),
        ("FM4", [0.040, -0.535, -0.572]),
    ],
)
def test_robustness_of_table_2(mode: str, expected: list[float]) -> None:
    values = [spi.robustness([P_O], [P_F[mode][m]], n=25, m=m) for m in (1, 2, 3)]
    assert [round(r.value, 3) for r in values] == expected


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


def test_claims_follow_from_strict_inequalities() -> None:
    s = {
        n: spi.scalability([TABLE_I[n]], [TABLE_I[larger]], n=n, m=larger - n).value
        for n, larger in pairwise(SIZES)
    }
    assert [n for n, value in s.items() if value > 0] == SIZES[:-2]
    assert [n for n, value in s.items() if value > 1] == [30]  # S = 1 at 5 -> 10 is not superlinear

    def tolerant(mode: str) -> list[int]:
        failures = P_F[mode].items()
        return [m for m, p_f in failures if spi.fault_tolerance([P_O], [p_f], [P_S[m]]).value > 0]

    assert {mode: tolerant(mode) for mode in P_F} == {
        "FM1": [1, 2],
        "FM2": [1, 2],
        "FM3": [1, 2, 3],
        "FM4": [],  # FT = 0 at m = 1 is not tolerant
    }


def test_the_ways_of_reading_widths_agree() -> None:
    # Multiples, metres and fractions of the arena differ by a factor, and A is a ratio in x.
    in_metres = spi.adaptability([47], [21], x_o=5.0, x_new=15.0)
    assert in_metres.value == pytest.approx(spi.adaptability([47], [21], x_o=0.5, x_new=1.5).value)
