"""Functions of Python as functions of C: they compute the same."""

from __future__ import annotations

import ctypes
import math
import re
import runpy
import shutil
import subprocess
from collections.abc import Callable
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from swarm_logistics_env.core.errors import PolicyError
from swarm_logistics_env.robots.c_parts import Parts
from swarm_logistics_env.robots.c_program import Program
from swarm_logistics_env.robots.c_sizes import WARNINGS
from swarm_logistics_env.robots.c_values import DOUBLE, FLOAT, INT, ArrayOf, Known, Value

TABLE = np.array([0.5, -1.5, 2.5, 4.0])
ROWS = np.array([[0.5, 0.1], [2.0, 3.0]])
SHARES = (0.5, -1.5, 2.5, 4.0)
_LEAST = -0.5
_STEP = 0.25
WIDE = 0.1


class Body(NamedTuple):
    speed: float
    arms: int
    is_round: bool
    beams: tuple[float, ...]


class Columns(NamedTuple):
    first: int
    second: int


COLUMN = Columns(1, 2)


def whole_numbers(x: float, n: int) -> float:
    return float(n // 3) + 10.0 * float(n % 3) + 100.0 * round(x) + 1000.0 * int(x)


def rest(x: float, n: int) -> float:
    return x % 0.75 - (x - (n - (2 - n)) * _STEP) / -2.0


def choices(x: float, n: int) -> float:
    # The same name in two branches is two variables.
    if (x > 0.5 and not (n == 2 or n > 7)) or x < -2.0:
        part = 3  # an integer
        y = x * part
    elif 0.0 < x <= 0.5:
        part = 2.5  # type: ignore[assignment]  # the other one
        y = x - part
    else:
        y = 7.0 if n % 2 else max(x, -1.0)
    for index in range(4):
        if TABLE[index] < x:
            continue
        y += TABLE[index - 1]
        break
    return min(y, 5.0)


def swapped(x: float, y: float) -> tuple[float, float]:
    return y - _STEP, x**2


def tuples(x: float, n: int) -> float:
    pair = swapped(x, 1.0)
    first, second = pair
    if n > 1:
        pair = 2.0, 3.0
    for column in (COLUMN.first, COLUMN.second):
        first -= column * second
    return first + SHARES[n] + pair[1] * math.copysign(abs(x), second - 1.0)


def arrays(x: float, n: int) -> float:
    numbers = np.empty(4, np.float32)
    numbers[0:4] = x * n  # C counts by another name
    numbers[n] += 1.0
    part = numbers[COLUMN.first : COLUMN.second + 1]
    part[1] -= 4.0
    is_odd = False
    is_odd |= n % 2 == 1
    rest = part.max() + np.argmin(part) + (1.0 if is_odd else 0.0)
    return float(numbers[2] * 10.0 + rest)


def exchanging(x: float, n: int) -> float:
    y = 1.0
    x, y = y, x + 1.0
    return x + n


def exchanging_items(x: float, n: int) -> float:
    pair = np.empty(2, np.float32)
    pair[0], pair[1] = pair[1], pair[0]
    return x + n


def ordered(x: float, n: int) -> tuple[float, float]:
    return (x, 1.0) if x > 1.0 else (n, n)


def settled(x: float, n: int) -> float:
    numbers = np.empty(3, np.float32)
    numbers[0:3] = x
    first, second, third = numbers
    numbers[1] += 1.0
    unread = x * 3.0  # noqa: F841
    low, high = ordered(x, n)
    if n > 2:
        low -= 1.0
    elif COLUMN.second < COLUMN.first:
        low = high
    else:
        low += 3.0 if COLUMN.second > 1 else float(first)
    return float(low * 10.0 + high + second * third - first)


def described(x: float, n: int, body: Body) -> float:
    """Say `what`.

    Args:
        x: a number.
    """
    # First
    # this.
    if n > COLUMN.second and body.is_round:
        return _LEAST + _STEP
    # Then that.
    return float(ROWS[n, 1] * swapped(x, 1.0)[0] - WIDE * body.speed)


def stepping(numbers: Any, n: int) -> None:
    numbers[n] = math.sqrt(numbers[0] * _STEP) + (1.5 if n else numbers[1])


def failing(x: float, n: int) -> float:
    assert n > 0
    return x


def of_integers(x: float, n: int) -> float:
    return x + min(n, 2)


def of_any_length(x: float, n: int) -> float:
    numbers = np.empty(4, np.float32)
    return float(numbers[0:n].max())


def as_c(function: Callable[..., Any], folder: Path) -> Any:
    """Return the function compiled, of a float and an integer."""
    program = Program()
    program.function(function, [Value("x", FLOAT), Value("n", INT)])
    source = folder / "function.c"
    name = function.__name__
    source.write_text(
        "#include <math.h>\n#include <stdbool.h>\n#include <stdint.h>\n\n"
        f"{program.text()}\n\nfloat run(float x, int32_t n);\n\n"
        f"float run(float x, int32_t n) {{\n    return {name}(x, n);\n}}\n"
    )
    library = folder / "function.so"
    flags = (*WARNINGS, "-O2", "-shared", "-fPIC")
    subprocess.run(["gcc", *flags, str(source), "-lm", "-o", str(library)], check=True)
    run = ctypes.CDLL(str(library)).run
    run.argtypes = ctypes.c_float, ctypes.c_int32
    run.restype = ctypes.c_float
    return run


@pytest.mark.skipif(not shutil.which("gcc"), reason="needs gcc")
@pytest.mark.parametrize(
    "function",
    [whole_numbers, rest, choices, tuples, arrays, settled],
    ids=lambda f: f.__name__,
)
def test_c_computes_what_python_computes(function: Callable[..., Any], tmp_path: Path) -> None:
    run = as_c(function, tmp_path)
    places = range(4)
    for x, n in product((-2.5, -1.75, -0.5, -0.25, 0.0, 0.5, 0.75, 1.5, 2.5, 3.25), places):
        assert run(x, n) == pytest.approx(float(function(x, n)), abs=1e-5), (x, n)


def test_a_branch_that_is_never_taken_is_not_written() -> None:
    in_c = Program().function(settled, [Value("x", FLOAT), Value("n", INT)]).text
    assert "    } else {\n        low += 3.0f;\n    }\n" in in_c
    assert "low = high" not in in_c


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (
            exchanging,
            r"test_c_program.exchanging: no C for `.*x, y.* = .*y, x \+ 1.0.*`: an exchange",
        ),
        (exchanging_items, r"no C for `pair\[0\], .*: an exchange"),
        (of_integers, r"no C for `return x \+ min\(n, 2\)`: min of integers"),
        (of_any_length, r"no C for `return .*`: numbers\[0:n\]$"),
        (failing, "no C for `assert n > 0`: Assert"),
        (math.sqrt, "sqrt is no function of Python's"),
    ],
)
def test_what_has_no_c_is_told_with_its_line(function: Callable[..., Any], message: str) -> None:
    with pytest.raises(PolicyError, match=message):
        Program().function(function, [Value("x", FLOAT), Value("n", INT)])


# Kernels of x, a float, and n, an integer.
KERNELS = """\
import math
from typing import NamedTuple
import numpy as np
TABLE = np.arange(4.0)
ROWS = np.ones((2, 2))
class Pair(NamedTuple):
    first: float
    second: float
def pair_of(x):
    return x, x
def kernel(x, n):
    numbers = np.empty(4, np.float32)
"""


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("return [x]", "List"),
        ("return n << 1", "LShift"),
        ("return x + TABLE", "TABLE as a number"),
        ("return x.real", "x.real"),
        ("return n in (1, 2)", "In"),
        ("return x[0]", "x[..]"),
        ("return TABLE[x]", "the index x"),
        ("return ROWS[n]", "a row of ROWS"),
        ("return numbers[:2].max()", "a slice of numbers without its first and last column"),
        ("return numbers[0:2:1].max()", "a slice of numbers without its first and last column"),
        ("return round(x, ndigits=1)", "a call with named arguments"),
        ("return x(1.0)", "a call of x"),
        ("return Pair(*pair_of(x))", "Pair(*..) of what is not known"),
        ("return math.floor(x)", "a call of floor"),
        ("return len(x)", "the length of x"),
        ("return x + numbers", "x and numbers as numbers"),
        ("return pair_of(x) * n", "pair_of(x) * n"),
        ("return x, (x, x)", "a tuple of tuples"),
        ("return not (x, n)", "a tuple as bool"),
        ("return not pair_of(x)", "pair_of(x) as bool"),
        ("n = x", "x, of kind float, as int32_t"),
        ("for a, b in TABLE: pass", "a loop of several variables"),
        ("for k in range(0, n, 2): pass", "a loop by steps"),
        ("for entry in TABLE: pass", "a loop over TABLE"),
        ("others = np.empty(n, np.float32)", "an array whose length is not constant"),
        ("numbers[:] = np.empty(4, np.float32)", "an array whose length is not constant"),
        ("numbers.flat = x", "an assignment to numbers.flat"),
        ("numbers += x", "a change of all of numbers"),
    ],
)
def test_a_line_that_has_no_c_is_told_with_what_has_none(
    line: str, message: str, tmp_path: Path
) -> None:
    path = tmp_path / "kernel.py"
    path.write_text(f"{KERNELS}    {line}\n    return n")
    kernel = runpy.run_path(str(path))["kernel"]
    with pytest.raises(PolicyError, match=f": no C for `.*`: {re.escape(message)}$"):
        Program().function(kernel, [Value("x", FLOAT), Value("n", INT)])


def test_records_and_tables_of_one_name_are_refused() -> None:
    def sum_of(record: Any, second_record: Any) -> float:
        return record.first + second_record.first  # type: ignore[no-any-return]

    def records(columns: Columns) -> list[Known]:
        return [Known(value, "columns", is_fixed=True) for value in (COLUMN, columns)]

    program = Program()
    program.function(sum_of, records(Columns(1, 2)))
    # The second record may lie where the first lay, which nobody holds.
    with pytest.raises(PolicyError, match=r"^two records are called columns"):
        program.function(sum_of, records(Columns(1, 3)))
    parts = Parts()
    assert parts.table("_steps", TABLE) == parts.table("steps", TABLE.copy()) == "STEPS"
    with pytest.raises(PolicyError, match=r"^two tables are called STEPS"):
        parts.table("STEPS", TABLE[:3])


def test_rows_of_which_there_are_several_have_no_c() -> None:
    def first_of(numbers: Any, n: int) -> float:
        first: float = numbers[n, 0]
        return first

    for count in (1, 2):
        rows = Value("numbers", ArrayOf(FLOAT, (count, 3)))
        with pytest.raises(PolicyError, match=r": numbers: more rows than one$"):
            Program().function(first_of, [rows, Value("n", INT)])


def test_what_is_fixed_is_no_argument_and_what_is_only_read_is_constant() -> None:
    def change(numbers: Any, others: Any, period: float, unused: float) -> None:
        numbers[0] = others[1] / period

    four = ArrayOf(FLOAT, (4,))
    arguments: list[Value | Known] = [
        Value("a", four), Value("b", four), Known(0.1, "PERIOD", is_fixed=True), Value("c", FLOAT),
    ]  # fmt: skip
    program = Program()
    function = program.function(change, arguments)
    assert [number for number, _ in function.parameters] == [0, 1]
    assert function.written == {0}
    assert "static void change(float *numbers, const float *others) {" in program.text()
    assert "#define PERIOD REAL(0.1)" in program.text()
    assert program.function(change, arguments) is function


def test_c_is_as_recorded(check_recorded: Any) -> None:
    """Of the functions above, and of one that is exact."""
    inexact, exact = Program(), Program(exact=(stepping,))
    for function in (whole_numbers, rest, choices, tuples, arrays):
        inexact.function(function, [Value("x", FLOAT), Value("n", INT)])
    body = Known(Body(0.1, 2, True, (1.0,)), "body", is_fixed=True)
    inexact.function(described, [Value("x", FLOAT), Value("n", INT), body])
    for program, kind in ((inexact, FLOAT), (exact, DOUBLE)):
        program.function(stepping, [Value("numbers", ArrayOf(kind, (4,))), Value("n", INT)])
    lines = [*inexact.text().splitlines(), "", "/* exact */", *exact.text().splitlines()]
    check_recorded("functions.c", lines)
