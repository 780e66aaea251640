"""What stands in a file of C before its functions: constants, tables and records."""

from __future__ import annotations

import math

import numpy as np
import pytest

from swarm_logistics_env.robots.c_parts import Parts, table_text
from swarm_logistics_env.robots.c_values import (
    BOOL,
    DOUBLE,
    FLOAT,
    INT,
    REAL,
    WORD,
    Scalar,
    number_text,
)


@pytest.mark.parametrize(
    ("kind", "head", "lines"),
    [
        (FLOAT, "float", ["0.1f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f,", "7.0f,"]),
        (REAL, "real", ["REAL(0.1), 2.0f, 3.0f,", "4.0f, 5.0f, 6.0f,", "7.0f,"]),
    ],
)
def test_a_table_of_one_dimension_has_several_numbers_a_line(
    kind: Scalar, head: str, lines: list[str]
) -> None:
    text = table_text("STEPS", np.array([0.1, 2, 3, 4, 5, 6, 7]), kind)
    first, *rows, last = text.splitlines()
    assert (first, last) == (f"static const {head} STEPS[7] = {{", "};")
    assert rows == [f"    {line}" for line in lines]


def test_constants_of_one_name_but_not_of_one_value_have_names_of_their_own() -> None:
    parts = Parts()
    names = [parts.define(name, number, f"{number}f") for name, number in (
        ("_gap", 1.0), ("GAP", 1.0), ("gap", 2.0), ("least", -1.0)
    )]  # fmt: skip
    assert names == ["GAP", "GAP", "GAP_1", "LEAST"]
    constants, definitions = parts.texts()
    assert constants == ["#define GAP 1.0f\n#define GAP_1 2.0f\n#define LEAST (-1.0f)"]
    assert definitions == []
    assert Parts().texts() == ([], [])


@pytest.mark.parametrize(
    ("number", "kind", "text"),
    [
        (True, BOOL, "true"),
        (False, BOOL, "false"),
        (-3.0, INT, "-3"),
        (255, WORD, "0xffu"),
        (0.1, FLOAT, "0.1f"),
        (1 / 3, FLOAT, "0.33333334f"),
        (1 / 3, REAL, "REAL(0.3333333333333333)"),
        (1 / 3, DOUBLE, "0.3333333333333333"),
        (0.5, REAL, "0.5f"),
        (0.5, DOUBLE, "0.5"),
        (math.inf, FLOAT, "INFINITY"),
        (-math.inf, REAL, "-INFINITY"),
        (math.nan, REAL, "NAN"),
        (1e-7, FLOAT, "1e-07f"),
    ],
)
def test_a_number_has_as_many_digits_as_its_kind_holds(
    number: float, kind: Scalar, text: str
) -> None:
    assert number_text(number, kind) == text
