"""Lines of kernels and the lines of C that are made of them, without a compiler."""

from __future__ import annotations

import runpy
from pathlib import Path
from textwrap import indent
from typing import Any

from swarm_logistics_env.robots.c_program import Program
from swarm_logistics_env.robots.c_values import BOOL, DOUBLE, FLOAT, INT, WORD, ArrayOf, Value

# What stands around kernels.
MODULE = """\
import math
import stat
from typing import NamedTuple
import numpy as np
GAP = 0.75
WIDE = 0.1
COUNT = 3
WHITE = False
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
kernels = []
"""
ARGUMENTS = (
    Value("x", FLOAT),
    Value("n", INT),
    Value("numbers", ArrayOf(FLOAT, (4,))),
    Value("memory", ArrayOf(DOUBLE, (1, 3))),
    Value("key", WORD),
    Value("is_on", BOOL),
)
EXPRESSIONS = """
x + 0.1
WIDE * x - GAP
-(x + GAP) * -WIDE
x - (n - 1) - n
(x + n) / COUNT
n / COUNT
n // COUNT + n % COUNT
x % 2.0 + n
x ** 2 + 3 ** 2 + 1.5 ** 2
2 * 3 + COUNT
not is_on
not x
x - (x + x) / (x * x) * (x / x) - -n
not (n and is_on)
not WHITE
is_on and (x > 1.0 or n == 2)
is_on or x > 1.0 and n != 2
WHITE or x < 1.0
1 < COUNT <= 3
0.0 < x <= n
(x < 1.0) == is_on
(1.0 if is_on else x) + 2.0
1.0 if (x if is_on else n) else (2.0 if n else 3.0)
1.0 if COUNT > 2 else x
1.0 if (is_on if n else x > 2.0) else 2.0
n + stat.ST_SIZE
entry_of(TABLE, n)
numbers.max() + np.argmin(numbers) + len(numbers)
abs(x) + abs(n) + abs(-1.5)
min(x, 1.0) + max(x, n, 2.5)
round(x) + int(x) + int(n) + int(memory[0, 1])
bool(n) or bool(x)
float(n) + np.float32(x) + np.float64(x) + float(x)
np.float32(WIDE)
np.uint64(3) ^ key
math.sqrt(x) + np.sqrt(x) + np.sqrt(n) + math.atan2(x, n) + math.tanh(0.5)
math.isnan(x) and math.pi > x
numbers[n] + numbers[n - 1] + numbers[n + 1]
TABLE[n, 1] + TABLE[n - 1, n] + TABLE[0, 1]
TABLE.shape[0] + numbers.shape[0] + memory.shape[1]
memory[0, n] + memory[0, 2]
numbers[1:3].max() + numbers[AT.first : AT.last + 1].max()
BODY.speed + BODY.arms + SIZES[1]
math.inf if is_on else -math.inf
abs(-GAP) + np.sqrt(COUNT) + -COUNT
2.0 * WIDE * x + COUNT * (n + 1)
numbers[COUNT] + TABLE[0, COUNT - 2] + numbers[AT.last]
GAP if BODY.is_round else x
math.cos(x) * math.exp(x) / math.log(x) + math.copysign(x, -1.0) + math.sin(n)
"""
STATEMENTS = """
pair = pair_of(x)
return pair[1] + pair_of(n)[0]

first, last = pair_of(twice(x))
return first - last

fill(numbers, x)
fill(memory[0], n)
return first_of(memory[0]) + first_of(numbers[1:3])

part = numbers[1:3]
part[0] = 1
rest = memory[0]
return part[1] + rest[n]

numbers[1:3] = x
numbers[0] = n
numbers[n] += x
numbers[2] *= 2.0
memory[0, 1] = x
memory[0, 2] -= WIDE

total = 0.0
for k in range(n):
    if k == 2:
        continue
    total += k
for k in range(1, COUNT):
    total -= numbers[k]
return total

total = 0
for k in (1, 2):
    total += k * n
for k in range(1):
    total += k
return total

total = x
if n > 1:
    total = WIDE
# one
# two
return total  # three

if is_on:
    y = 1.0
elif n:
    y = x
else:
    y = 2.0
return y

own = np.empty(3, np.float32)
own[0:3] = x
a, b, c = own
return a + b * c

wide: float = n * WIDE
return wide

pair = (x, 1.0)
if n:
    pair = 2.0, x
return pair[0]

return

is_on |= n > 2
return is_on

n ^= 3
return n

pair = pair_of(x)
first, last = pair
return first * last

part = numbers
fill(part, 1.0)
return part.max()

if COUNT < 2:
    return x
elif n:
    return 2.0
return n

if n:
    return 1.0
elif WHITE:
    return 2.0
else:
    return 3.0

y = 0.0
while_not = 3
if n:
    z = x
    y = z * z
for k in range(n):
    z = 2.0
    y += z
return y

numbers[0] += 1
numbers[1] -= n
x += 1
n += 2
n *= n
return x + n
"""


def test_c_of_lines_of_python_is_as_recorded(tmp_path: Path, check_recorded: Any) -> None:
    bodies = [f"return {expression}" for expression in EXPRESSIONS.strip().splitlines()]
    bodies += STATEMENTS.strip().split("\n\n")
    path = tmp_path / "kernels.py"
    head = f"def kernel({', '.join(argument.text for argument in ARGUMENTS)}):\n"
    kernels = (f"{head}{indent(body, '    ')}\nkernels.append(kernel)\n" for body in bodies)
    path.write_text(MODULE + "".join(kernels))
    lines = []
    for body, kernel in zip(bodies, runpy.run_path(str(path))["kernels"], strict=True):
        in_c = Program().function(kernel, ARGUMENTS).text
        lines += ["", *(f"// {line}" for line in body.splitlines()), *in_c.splitlines()]
    check_recorded("lines.c", lines[1:])
