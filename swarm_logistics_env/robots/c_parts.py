"""What functions of C need around them: constants, tables, records, and helpers."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.core.errors import PolicyError

from .c_values import BOOL, FLOAT, REAL, Known, Scalar, number_text

# What Python's operators and functions do, where C's do something else.
HELPERS = {
    "whole_number": """\
/* Of a number that is none, and of one that is too large, the nearest that there is. */
static inline int32_t whole_number(real x) {
    if (isnan(x)) {
        return 0;
    }
    return x > 1e9f ? 1000000000 : x < -1e9f ? -1000000000 : (int32_t)x;
}""",
    "smaller_of": """\
static inline real smaller_of(real a, real b) {
    return b < a ? b : a;
}""",
    "larger_of": """\
static inline real larger_of(real a, real b) {
    return b > a ? b : a;
}""",
    "squared": """\
static inline real squared(real x) {
    return x * x;
}""",
    "modulo": """\
/* In [0, by). */
static inline real modulo(real x, real by) {
    const real rest = REAL(fmod)(x, by);
    return rest < 0.0f ? rest + by : rest;
}""",
    "remainder_of": """\
/* In [0, by). */
static inline int32_t remainder_of(int32_t x, int32_t by) {
    const int32_t rest = x % by;
    return rest < 0 ? rest + by : rest;
}""",
    "quotient_of": """\
/* Rounded down. */
static inline int32_t quotient_of(int32_t x, int32_t by) {
    return x / by - (x % by < 0 ? 1 : 0);
}""",
    "wrapped_index": """\
/* Below 0 it counts from the end. */
static inline int32_t wrapped_index(int32_t index, int32_t length) {
    return index < 0 ? index + length : index;
}""",
    "place_of_smallest": """\
static inline int32_t place_of_smallest(const float *numbers, int32_t length) {
    int32_t place = 0;
    for (int32_t index = 1; index < length; index++) {
        if (numbers[index] < numbers[place]) {
            place = index;
        }
    }
    return place;
}""",
    "largest_of": """\
static inline float largest_of(const float *numbers, int32_t length) {
    float most = numbers[0];
    for (int32_t index = 1; index < length; index++) {
        if (numbers[index] > most) {
            most = numbers[index];
        }
    }
    return most;
}""",
}


class Parts:
    """Collects them, each once."""

    def __init__(self) -> None:
        self._constants: dict[str, tuple[object, str]] = {}
        self._tables: dict[str, NDArray[Any]] = {}
        self._records: dict[str, Any] = {}
        self._helpers: set[str] = set()

    def define(self, name: str, number: object, text: str) -> str:
        """Return the name in C of a constant of that name in Python."""
        name = name.lstrip("_").upper()
        base = name
        while name in self._constants and self._constants[name][0] != number:
            name = f"{base}_{len(self._constants)}"
        self._constants[name] = number, text
        return name

    def record(self, known: Known) -> str:
        """Return the name in C of a tuple with named fields."""
        if self._records.setdefault(known.name, known.value) != known.value:
            raise PolicyError(f"two records are called {known.name}")
        return known.name

    def table(self, name: str, numbers: NDArray[Any]) -> str:
        """Return the name in C of an array of constants."""
        name = name.lstrip("_").upper()
        if not np.array_equal(self._tables.setdefault(name, numbers), numbers):
            raise PolicyError(f"two tables are called {name}")
        return name

    def use(self, helper: str) -> str:
        """Return the name of a helper, which will stand in the file."""
        self._helpers.add(helper)
        return helper

    def texts(self) -> tuple[list[str], list[str]]:
        """Return definitions: of constants, and of helpers, tables and records."""
        lines = []
        for name, (_, text) in self._constants.items():
            value = f"({text})" if text.startswith("-") else text
            lines.append(f"#define {name} {value}")
        definitions = [text for name, text in HELPERS.items() if name in self._helpers]
        definitions += [table_text(name, table, REAL) for name, table in self._tables.items()]
        definitions += [_record_text(name, record) for name, record in self._records.items()]
        return ["\n".join(lines)] if lines else [], definitions


def table_text(name: str, table: NDArray[Any], kind: Scalar = FLOAT) -> str:
    """Return the definition of an array of constants of one or two dimensions."""
    lengths = "".join(f"[{length}]" for length in table.shape)
    head = f"static const {kind.name} {name}{lengths} = {{"
    rows = table if table.ndim > 1 else [*_in_lines(table, 6 if kind is FLOAT else 3)]
    lines = [", ".join(number_text(number, kind) for number in row.tolist()) for row in rows]
    lines = [f"    {{{line}}}," if table.ndim > 1 else f"    {line}," for line in lines]
    return "\n".join([head, *lines, "};"])


def _in_lines(table: NDArray[Any], length: int) -> Iterator[NDArray[Any]]:
    for start in range(0, len(table), length):
        yield table[start : start + length]


def _record_text(name: str, record: Any) -> str:
    fields = []
    values = []
    for field, value in record._asdict().items():
        if isinstance(value, bool | int | float):
            kind = BOOL if isinstance(value, bool) else REAL
            fields.append(f"    {kind.name} {field};")
            values.append(f"    .{field} = {number_text(value, kind)},")
    return "\n".join(["static const struct {", *fields, f"}} {name} = {{", *values, "};"])
