"""What stands in a file of C before its functions: constants, tables and records."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import pytest

from swarm_logistics_env.robots.c_parts import Parts, table_text
from swarm_logistics_env.robots.c_program import Program
from swarm_logistics_env.robots.c_values import (
    BOOL,
    DOUBLE,
    FLOAT,
    INT,
    REAL,
    WORD,
    Known,
    Scalar,
    Value,
    number_text,
)

COUNT = 3
GAP = 0.75
WIDE = 0.1
_LEAST = -0.5
TABLE = np.array([[0.5, 0.1], [2.0, 3.0]])


class Body(NamedTuple):
    speed: float
    arms: int
    is_round: bool
    beams: tuple[float, ...]


def pair_of(number: float) -> tuple[float, float]:
    return number, 2.0


def kernel(x: float, n: int, body: Any) -> float:
    """Say `what`.

    Args:
        x: a number.
    """
    # First
    # this.
    if n > COUNT and body.is_round:
        return _LEAST + GAP
    # Then that.
    return float(TABLE[n, 1] * pair_of(x)[0] - WIDE * body.speed)


IN_C = """\
#define COUNT 3
#define LEAST (-0.5f)
#define GAP 0.75f
#define WIDE REAL(0.1)

typedef struct {
    real at[2];
} reals2;

static const real TABLE[2][2] = {
    {0.5f, REAL(0.1)},
    {2.0f, 3.0f},
};

static const struct {
    real speed;
    real arms;
    bool is_round;
} body = {
    .speed = REAL(0.1),
    .arms = 2.0f,
    .is_round = true,
};

static reals2 pair_of(float number) {
    return (reals2){{number, 2.0f}};
}

/* Say what. */
static real kernel(float x, int32_t n) {
    /* First this. */
    if (n > COUNT && body.is_round) {
        return LEAST + GAP;
    }
    /* Then that. */
    return TABLE[n][1] * pair_of(x).at[0] - WIDE * body.speed;
}"""


def test_what_a_kernel_needs_stands_before_it() -> None:
    program = Program()
    body = Known(Body(0.1, 2, True, (1.0,)), "body", is_fixed=True)
    program.function(kernel, [Value("x", FLOAT), Value("n", INT), body])
    assert program.text().partition("#endif\n\n")[2] == IN_C


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
    constants, others = parts.texts()
    assert constants == ["#define GAP 1.0f\n#define GAP_1 2.0f\n#define LEAST (-1.0f)"]
    assert others == []
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
