"""Lines of kernels and the lines of C that are made of them, without a compiler."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

from swarm_logistics_env.core.errors import PolicyError
from swarm_logistics_env.robots.c_program import Program
from swarm_logistics_env.robots.c_values import (
    BOOL,
    DOUBLE,
    FLOAT,
    INT,
    WORD,
    ArrayOf,
    Function,
    Value,
)

KERNELS = """\
import math
import stat
from typing import NamedTuple
import numpy as np
GAP = 0.75
WIDE = 0.1
COUNT = 3
WHITE = False
_LEAST = -0.1
SIZES = (2.0, 3.0)
TABLE = np.array([[0.5, 0.1], [2.0, 3.0]])
class Body(NamedTuple):
    speed: float
    arms: int
    is_round: bool
    beams: tuple
BODY = Body(0.1, 2, True, (1.0, 2.0))
class Place(NamedTuple):
    first: int
    last: int
AT = Place(1, 3)
def pair_of(number):
    return number, 2.0
def twice(number):
    return 2.0 * number
def fill(numbers, value):
    numbers[0] = value
def entry_of(table, index):
    return table[index, 1]
def first_of(row):
    return row[0]
def kernel(x, n, numbers, memory, key, is_on):
"""
ARGUMENTS = (
    Value("x", FLOAT),
    Value("n", INT),
    Value("numbers", ArrayOf(FLOAT, (4,))),
    Value("memory", ArrayOf(DOUBLE, (1, 3))),
    Value("key", WORD),
    Value("is_on", BOOL),
)


def written(lines: str, folder: Path, program: Program) -> Function:
    """Return the function of C of a kernel with these lines."""
    path = folder / "kernel.py"
    path.write_text(KERNELS + "".join(f"    {line}\n" for line in lines.splitlines()))
    return program.function(runpy.run_path(str(path))["kernel"], ARGUMENTS)


# Expressions of Python, and of C.
EXPRESSIONS = """
x + 0.1 => (real)x + REAL(0.1)
WIDE * x - GAP => WIDE * (real)x - GAP
-(x + GAP) * -WIDE => -((real)x + GAP) * -WIDE
x - (n - 1) - n => x - (float)(n - 1) - (float)n
(x + n) / COUNT => (x + (float)n) / (float)COUNT
n / COUNT => (real)n / (real)COUNT
n // COUNT + n % COUNT => quotient_of(n, COUNT) + remainder_of(n, COUNT)
x % 2.0 + n => modulo(x, 2.0f) + (real)n
x ** 2 + 3 ** 2 + 1.5 ** 2 => squared(x) + 9.0f + 2.25f
2 * 3 + COUNT => 2 * 3 + COUNT
not is_on => !is_on
not x => !(x != 0)
x - (x + x) / (x * x) * (x / x) - -n => x - (x + x) / (x * x) * (x / x) - (float)-n
not (n and is_on) => !(n != 0 && is_on)
not WHITE => true
is_on and (x > 1.0 or n == 2) => is_on && (x > 1.0f || n == 2)
is_on or x > 1.0 and n != 2 => is_on || (x > 1.0f && n != 2)
WHITE or x < 1.0 => false || x < 1.0f
1 < COUNT <= 3 => true
0.0 < x <= n => 0.0f < x && x <= (float)n
(x < 1.0) == is_on => (x < 1.0f) == is_on
(1.0 if is_on else x) + 2.0 => (is_on ? 1.0f : x) + 2.0f
1.0 if (x if is_on else n) else (2.0 if n else 3.0)
=> (is_on ? x : (float)n) != 0 ? 1.0f : (n != 0 ? 2.0f : 3.0f)
1.0 if COUNT > 2 else x => 1.0f
1.0 if (is_on if n else x > 2.0) else 2.0 => (n != 0 ? is_on : x > 2.0f) ? 1.0f : 2.0f
n + stat.ST_SIZE => n + ST_SIZE
entry_of(TABLE, n) => entry_of(n)
numbers.max() + np.argmin(numbers) + len(numbers)
=> largest_of(numbers, 4) + (float)place_of_smallest(numbers, 4) + 4.0f
abs(x) + abs(n) + abs(-1.5) => fabsf(x) + REAL(fabs)((real)n) + REAL(fabs)(-1.5f)
min(x, 1.0) + max(x, n, 2.5) => smaller_of(x, 1.0f) + larger_of(x, (real)n, 2.5f)
round(x) + int(x) + int(n) + int(memory[0, 1])
=> whole_number(REAL(rint)(x)) + whole_number(x) + whole_number((real)n)
 + whole_number((real)memory[1])
bool(n) or bool(x) => n != 0 || x != 0
float(n) + np.float32(x) + np.float64(x) + float(x) => (real)n + x + (real)x + (real)x
np.float32(WIDE) => 0.1f
np.uint64(3) ^ key => 0x3u ^ key
math.sqrt(x) + np.sqrt(x) + np.sqrt(n) + math.atan2(x, n) + math.tanh(0.5)
=> REAL(sqrt)(x) + sqrtf(x) + REAL(sqrt)((real)n) + REAL(atan2)(x, (real)n) + REAL(tanh)(0.5f)
math.isnan(x) and math.pi > x => isnan(x) && REAL(3.141592653589793) > x
numbers[n] + numbers[n - 1] + numbers[n + 1]
=> numbers[n] + numbers[wrapped_index(n - 1, 4)] + numbers[n + 1]
TABLE[n, 1] + TABLE[n - 1, n] + TABLE[0, 1]
=> TABLE[n][1] + TABLE[wrapped_index(n - 1, 2)][n] + REAL(0.1)
TABLE.shape[0] + numbers.shape[0] + memory.shape[1] => 2 + 4 + 3
memory[0, n] + memory[0, 2] => (real)memory[n] + (real)memory[2]
numbers[1:3].max() + numbers[AT.first : AT.last + 1].max()
=> largest_of(&numbers[1], 2) + largest_of(&numbers[AT_FIRST], 3)
BODY.speed + BODY.arms + SIZES[1] => BODY_SPEED + (real)BODY_ARMS + 3.0f
math.inf if is_on else -math.inf => is_on ? INFINITY : -INFINITY
abs(-GAP) + np.sqrt(COUNT) + -COUNT => REAL(fabs)(-GAP) + REAL(sqrt)((real)COUNT) + -3.0f
2.0 * WIDE * x + COUNT * (n + 1) => 2.0f * WIDE * (real)x + (real)(COUNT * (n + 1))
numbers[COUNT] + TABLE[0, COUNT - 2] + numbers[AT.last]
=> (real)numbers[COUNT] + REAL(0.1) + numbers[AT_LAST]
GAP if BODY.is_round else x => GAP
math.cos(x) * math.exp(x) / math.log(x) + math.copysign(x, -1.0) + math.sin(n)
=> REAL(cos)(x) * REAL(exp)(x) / REAL(log)(x) + REAL(copysign)(x, -1.0f) + REAL(sin)((real)n)
"""


@pytest.mark.parametrize(
    "case", EXPRESSIONS.replace("\n=>", " =>").replace("\n +", " +").strip().splitlines()
)
def test_an_expression_of_python_is_this_one_of_c(case: str, tmp_path: Path) -> None:
    expression, in_c = case.split(" => ")
    _, _, body = written(f"return {expression}", tmp_path, Program()).text.partition(" {\n")
    assert " ".join(body.split()) == f"return {in_c}; }}"


# Lines of Python, the kind of C with its parameters, and the lines of C.
STATEMENTS = """
pair = pair_of(x)
return pair[1] + pair_of(n)[0]
=> real(float x, int32_t n)
reals2 pair = pair_of(x);
return pair.at[1] + pair_of_2(n).at[0];

first, last = pair_of(twice(x))
return first - last
=> real(float x)
const reals2 result_1 = pair_of(twice(x));
real first = result_1.at[0];
real last = result_1.at[1];
return first - last;

fill(numbers, x)
fill(memory[0], n)
return first_of(memory[0]) + first_of(numbers[1:3])
=> real(float x, int32_t n, float *numbers, double *memory)
fill(numbers, x);
fill_2(memory, n);
return first_of(memory) + first_of_2(&numbers[1]);

part = numbers[1:3]
part[0] = 1
rest = memory[0]
return part[1] + rest[n]
=> real(int32_t n, float *numbers, const double *memory)
float *part = &numbers[1];
part[0] = 1.0f;
const double *rest = memory;
return part[1] + (real)rest[n];

numbers[1:3] = x
numbers[0] = n
numbers[n] += x
numbers[2] *= 2.0
memory[0, 1] = x
memory[0, 2] -= WIDE
=> void(float x, int32_t n, float *numbers, double *memory)
for (int32_t nn = 0; nn < 2; nn++) {
    (&numbers[1])[nn] = x;
}
numbers[0] = (float)n;
numbers[n] += x;
numbers[2] *= 2.0f;
memory[1] = (double)x;
memory[2] -= (double)WIDE;

total = 0.0
for k in range(n):
    if k == 2:
        continue
    total += k
for k in range(1, COUNT):
    total -= numbers[k]
return total
=> real(int32_t n, const float *numbers)
real total = 0.0f;
for (int32_t k = 0; k < n; k++) {
    if (k == 2) {
        continue;
    }
    total += (real)k;
}
for (int32_t k = 1; k < COUNT; k++) {
    total -= numbers[k];
}
return total;

total = 0
for k in (1, 2):
    total += k * n
for k in range(1):
    total += k
return total
=> int32_t(int32_t n)
int32_t total = 0;
total += 1 * n;
total += 2 * n;
total += 0;
return total;

total = x
if n > 1:
    total = WIDE
# one
# two
return total  # three
=> real(float x, int32_t n)
real total = x;
if (n > 1) {
    total = WIDE;
}
/* one two three */
return total;

if is_on:
    y = 1.0
elif n:
    y = x
else:
    y = 2.0
return y
=> real(float x, int32_t n, bool is_on)
real y = 0;
if (is_on) {
    y = 1.0f;
} else if (n != 0) {
    y = x;
} else {
    y = 2.0f;
}
return y;

own = np.empty(3, np.float32)
own[0:3] = x
a, b, c = own
return a + b * c
=> float(float x)
float own[3];
for (int32_t nn = 0; nn < 3; nn++) {
    (&own[0])[nn] = x;
}
float a = own[0];
float b = own[1];
float c = own[2];
return a + b * c;

wide: float = n * WIDE
return wide
=> real(int32_t n)
real wide = (real)n * WIDE;
return wide;

pair = (x, 1.0)
if n:
    pair = 2.0, x
return pair[0]
=> real(float x, int32_t n)
reals2 pair = (reals2){{x, 1.0f}};
if (n != 0) {
    pair = (reals2){{2.0f, x}};
}
return pair.at[0];

return
=> void(void)
return;

is_on |= n > 2
return is_on
=> bool(int32_t n, bool is_on)
is_on = is_on || n > 2;
return is_on;

n ^= 3
return n
=> int32_t(int32_t n)
n = n ^ 3;
return n;

pair = pair_of(x)
first, last = pair
return first * last
=> real(float x)
reals2 pair = pair_of(x);
real first = pair.at[0];
real last = pair.at[1];
return first * last;

part = numbers
fill(part, 1.0)
return part.max()
=> float(float *numbers)
float *part = numbers;
fill(part, 1.0f);
return largest_of(part, 4);

if COUNT < 2:
    return x
elif n:
    return 2.0
return n
=> real(int32_t n)
if (n != 0) {
    return 2.0f;
}
return (real)n;

if n:
    return 1.0
elif WHITE:
    return 2.0
else:
    return 3.0
=> real(int32_t n)
if (n != 0) {
    return 1.0f;
} else {
    return 3.0f;
}

y = 0.0
while_not = 3
if n:
    z = x
    y = z * z
for k in range(n):
    z = 2.0
    y += z
return y
=> real(float x, int32_t n)
real y = 0.0f;
if (n != 0) {
    float z = x;
    y = z * z;
}
for (int32_t k = 0; k < n; k++) {
    real z = 2.0f;
    y += z;
}
return y;

numbers[0] += 1
numbers[1] -= n
x += 1
n += 2
n *= n
return x + n
=> float(float x, int32_t n, float *numbers)
numbers[0] += 1.0f;
numbers[1] -= (float)n;
x += 1.0f;
n += 2;
n *= n;
return x + (float)n;
"""


@pytest.mark.parametrize("case", STATEMENTS.strip().split("\n\n"))
def test_lines_of_python_are_these_lines_of_c(case: str, tmp_path: Path) -> None:
    lines, in_c = case.split("\n=> ")
    head, *expected = in_c.splitlines()
    first, *body = written(lines, tmp_path, Program()).text.splitlines()
    assert first == f"static {head.replace('(', ' kernel(')} {{"
    assert body == [*(f"    {line}" for line in expected), "}"]


def test_a_row_of_a_table_by_a_number_that_is_not_known_is_no_number(tmp_path: Path) -> None:
    with pytest.raises((PolicyError, ValueError)):
        written("return TABLE[n]", tmp_path, Program())
