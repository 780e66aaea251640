"""Operators of Python in C: their signs, or what C has instead."""

from __future__ import annotations

import ast
import operator
import re
from collections.abc import Callable, Sequence
from typing import Any

from .c_parts import Parts
from .c_values import (
    AND,
    ATOM,
    BITS,
    BOOL,
    COMPARISON,
    INT,
    OR,
    PRODUCT,
    REAL,
    SUM,
    UNARY,
    NoCError,
    Scalar,
    Value,
    common_kind,
    constant,
    converted,
    widened,
)

_OPERATORS: dict[type, tuple[str, int, Callable[..., Any]]] = {
    ast.Add: ("+", SUM, operator.add),
    ast.Sub: ("-", SUM, operator.sub),
    ast.Mult: ("*", PRODUCT, operator.mul),
    ast.Div: ("/", PRODUCT, operator.truediv),
    ast.BitXor: ("^", BITS, operator.xor),
}


class Operators:
    """Writes the operators of one kernel.

    Args:
        parts: where what they need is collected.
        real: the kind of its numbers.
    """

    def __init__(self, parts: Parts, real: Scalar) -> None:
        self._parts = parts
        self._real = real

    def kind_of_number(self, number: object) -> Scalar | None:
        """Return the kind of a number with a point; None: it has none."""
        return self._real if isinstance(number, float) else None

    def operation(self, symbol: ast.operator, left: Value, right: Value) -> Value:
        """Return what Python's operator makes of two values."""
        is_whole = left.kind is INT and right.kind is INT
        match symbol:
            case ast.Mod() if is_whole and None not in (left.constant, right.constant):
                # So that what a network does not read is left out.
                return constant(left.constant % right.constant)
            case ast.Mod():
                name = "remainder_of" if is_whole else "modulo"
                return self.helped(name, INT if is_whole else REAL, left, right)
            case ast.BitOr() if left.kind is right.kind is BOOL:
                return connected("||", [left, right])
            case ast.FloorDiv() if is_whole:
                return self.helped("quotient_of", INT, left, right)
            case ast.Pow() if right.constant == 2:
                if left.constant is not None:
                    return constant(left.constant**2, self.kind_of_number(left.constant))
                return self.helped("squared", REAL, left)
        if type(symbol) not in _OPERATORS:
            raise NoCError(type(symbol).__name__)
        sign, strength, compute = _OPERATORS[type(symbol)]
        kind = common_kind(left, right)
        if isinstance(symbol, ast.Div) and is_whole:
            kind = self._real
        if not isinstance(kind, Scalar):
            raise NoCError(f"{left.text} {sign} {right.text}")
        number = None
        if left.constant is not None and right.constant is not None:
            number = compute(left.constant, right.constant)
            if kind is not INT and not (_has_name(left) or _has_name(right)):
                return constant(number, kind)
        if kind is REAL and left.constant is not None:
            right = widened(right)  # as an exact constant is written as a float
        elif kind is REAL and right.constant is not None:
            left = widened(left)
        left = converted(left, kind)
        right = converted(right, kind)
        # What binds as strongly is computed from the left.
        text = f"{left.within(strength)} {sign} {right.within(strength + 1)}"
        return Value(text, kind, strength, constant=number)

    def helped(self, name: str, kind: Scalar, *operands: Value) -> Value:
        """Return a call of a function that stands in every file that needs it."""
        texts = ", ".join(converted(operand, kind).text for operand in operands)
        return Value(f"{self._parts.use(name)}({texts})", kind)

    def negative(self, operand: Value) -> Value:
        """Return what Python's minus makes of a value."""
        number = None if operand.constant is None else -operand.constant
        if number is not None and isinstance(operand.kind, Scalar) and not _has_name(operand):
            return constant(number, operand.kind)
        return Value(f"-{operand.within(ATOM)}", operand.kind, UNARY, constant=number)


def connected(sign: str, operands: Sequence[Value]) -> Value:
    """Return truth values joined by && or ||; a compiler warns of one within the other."""
    texts = (
        operand.text if operand.strength >= COMPARISON else f"({operand.text})"
        for operand in operands
    )
    return Value(f" {sign} ".join(texts), BOOL, AND if sign == "&&" else OR)


def _has_name(value: Value) -> bool:
    """Return whether a constant is called by a name, which tells a reader more than its number."""
    return re.search("[A-Z]{2}", value.text.replace("REAL(", "")) is not None
