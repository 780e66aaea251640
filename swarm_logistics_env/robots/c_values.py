"""Values of C: the kinds that kernels need, texts of numbers, and operators as C has them."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np


class NoCError(Exception):
    """Python for which nothing is written in C; the message says which."""


@dataclass(frozen=True)
class Scalar:
    """A kind of numbers, by its name in C; a number of a higher rank is the kind of a sum."""

    name: str
    rank: int


BOOL = Scalar("bool", 0)
INT = Scalar("int32_t", 1)
WORD = Scalar("uint64_t", 2)
FLOAT = Scalar("float", 3)  # of a row or a network, in Python as well
REAL = Scalar("real", 4)  # float, or else double, where Python has double
DOUBLE = Scalar("double", 5)


@dataclass(frozen=True)
class ArrayOf:
    """An array of one or two dimensions; a first one of length 1 is left out in C."""

    element: Scalar
    shape: tuple[int, ...]


@dataclass(frozen=True)
class TupleOf:
    """A structure with an array `at`, as C returns no tuples."""

    element: Scalar
    length: int

    @property
    def name(self) -> str:
        words = {BOOL: "bools", INT: "ints", FLOAT: "floats", REAL: "reals", DOUBLE: "doubles"}
        return f"{words[self.element]}{self.length}"


Kind: TypeAlias = Scalar | ArrayOf | TupleOf

# How strongly operators bind, as in C.
ATOM = 10
UNARY = 9
PRODUCT = 8
SUM = 7
COMPARISON = 5
BITS = 4
AND = 3
OR = 2
CHOICE = 1


@dataclass(frozen=True)
class Value:
    """An expression of C.

    Attributes:
        text: the expression.
        kind: of its value.
        strength: how strongly its outermost operator binds.
        constant: the number or truth value, where it is known.
        parts: of a tuple that is written out; its text is empty.
        root: of an array, the parameter or variable that it is a part of.
    """

    text: str
    kind: Kind
    strength: int = ATOM
    constant: Any = None
    parts: tuple[Value, ...] | None = None
    root: str = ""

    def within(self, strength: int) -> str:
        """Return the text as an operand of an operator that binds that strongly."""
        return self.text if self.strength >= strength else f"({self.text})"


@dataclass(frozen=True)
class Known:
    """Something of Python that is known while C is written: a module, a function, a number.

    Attributes:
        value: it.
        name: how C calls it; empty: by its value.
        is_fixed: whether a function is written for this value, and takes no argument for it.
    """

    value: Any
    name: str = ""
    is_fixed: bool = False


def number_text(number: Any, kind: Scalar) -> str:
    """Return a number as C has it."""
    if kind is BOOL:
        return "true" if number else "false"
    if kind is INT:
        return str(int(number))
    if kind is WORD:
        return f"{int(number):#x}u"
    digits = repr(float(str(np.float32(number))) if kind is FLOAT else float(number))
    digits = {"inf": "INFINITY", "-inf": "-INFINITY", "nan": "NAN"}.get(digits, digits)
    if kind is DOUBLE or digits.endswith(("Y", "N")):
        return digits
    if kind is FLOAT or float(np.float32(number)) == number:
        return f"{digits}f"
    return f"REAL({digits})"


def constant(number: Any, kind: Scalar | None = None) -> Value:
    """Return a number or truth value."""
    if kind is None:
        kind = BOOL if isinstance(number, bool | np.bool_) else REAL
        kind = INT if isinstance(number, int | np.integer) and kind is REAL else kind
    text = number_text(number, kind)
    return Value(text, kind, UNARY if text.startswith("-") else ATOM, constant=number)


def converted(value: Value, kind: Kind) -> Value:
    """Return the value as one of another kind: an integer as a float, a number as a truth value.

    Raises:
        NoCError: Python would not do so by itself.
    """
    if value.parts is not None and isinstance(kind, TupleOf) and len(value.parts) == kind.length:
        texts = ", ".join(converted(part, kind.element).text for part in value.parts)
        return Value(f"({kind.name}){{{{{texts}}}}}", kind)
    if value.kind == kind:
        return value
    if not isinstance(kind, Scalar) or not isinstance(value.kind, Scalar):
        where = "an array" if isinstance(kind, ArrayOf) else kind.name
        raise NoCError(f"{value.text or 'a tuple'} as {where}")
    if kind is BOOL:
        return Value(f"{value.within(COMPARISON + 1)} != 0", BOOL, COMPARISON)
    if value.constant is not None and kind.rank > value.kind.rank:
        is_name = re.fullmatch("[A-Z][A-Z0-9_]*", value.text)
        text = f"({kind.name}){value.text}" if is_name else number_text(value.constant, kind)
        return Value(text, kind, UNARY, constant=value.constant)
    if kind.rank < value.kind.rank:
        raise NoCError(f"{value.text}, of kind {value.kind.name}, as {kind.name}")
    if value.kind is FLOAT and kind is REAL:  # C does so by itself
        return replace(value, kind=REAL)
    return Value(f"({kind.name}){value.within(UNARY)}", kind, UNARY)


def widened(value: Value) -> Value:
    """Return a number as a real, with which C computes as with one."""
    if value.kind is FLOAT and value.constant is None:
        return Value(f"(real){value.within(UNARY)}", REAL, UNARY)
    return converted(value, REAL)


def stored(value: Value, kind: Kind) -> Value:
    """Return a value as one of another kind, which may be a float with less digits."""
    if kind is not FLOAT or value.kind is not REAL:
        return converted(value, kind)
    if value.constant is not None:
        return constant(value.constant, FLOAT)
    return Value(f"(float){value.within(UNARY)}", FLOAT, UNARY)


def common_kind(*values: Value) -> Kind:
    """Return the kind that Python makes of values of several kinds."""
    tuples = [value.kind for value in values if isinstance(value.kind, TupleOf)]
    if tuples:
        element = max((kind.element for kind in tuples), key=lambda kind: kind.rank)
        return TupleOf(element, tuples[0].length)
    scalars = [value.kind for value in values if isinstance(value.kind, Scalar)]
    if len(scalars) < len(values):
        raise NoCError(f"{values[0].text} and {values[-1].text} as numbers")
    return max(scalars, key=lambda kind: kind.rank)


def tuple_of(parts: tuple[Value, ...]) -> Value:
    """Return a tuple that is written out."""
    element = common_kind(*parts)
    if not isinstance(element, Scalar):
        raise NoCError("a tuple of tuples")
    return Value("", TupleOf(element, len(parts)), parts=parts)


@dataclass(frozen=True)
class Function:
    """A function of C.

    Attributes:
        name: in C.
        kind: of what it returns; None: nothing.
        parameters: the kernel's arguments that it takes, by their numbers, with their kinds.
        written: the numbers of the arrays among them that it writes.
        text: its definition.
    """

    name: str
    kind: Kind | None
    parameters: tuple[tuple[int, Kind], ...]
    written: frozenset[int]
    text: str
