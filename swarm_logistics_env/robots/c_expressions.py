"""Expressions of kernels in C: what Python computes, with `float` for its numbers."""

from __future__ import annotations

import ast
import builtins
import inspect
import math
import operator
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from .c_operators import Operators, connected
from .c_parts import Parts
from .c_values import (
    AND,
    ATOM,
    BOOL,
    CHOICE,
    COMPARISON,
    DOUBLE,
    FLOAT,
    INT,
    REAL,
    UNARY,
    WORD,
    ArrayOf,
    Function,
    Known,
    NoCError,
    Scalar,
    TupleOf,
    Value,
    common_kind,
    constant,
    converted,
    stored,
    tuple_of,
    widened,
)

FunctionOf: TypeAlias = Callable[[Any, Sequence[Value | Known]], Function]

_COMPARISONS = {
    ast.Eq: "==",
    ast.NotEq: "!=",
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
}
_COMPARED: dict[type, Callable[[Any, Any], bool]] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}
# Functions of math.h, which have an f at the end for floats.
_MATH = {
    getattr(math, name): name
    for name in ("atan2", "copysign", "cos", "exp", "log", "sin", "sqrt", "tanh")
} | {np.sqrt: "sqrt"}


class Expressions(Operators):
    """Writes the expressions of one kernel.

    Args:
        parts: where what expressions need is collected.
        function_of: returns the function of C for a kernel and its arguments.
        names: what the kernel's names stand for, beside those of its variables.
        real: the kind of its numbers.
    """

    def __init__(
        self,
        parts: Parts,
        function_of: FunctionOf,
        names: Mapping[str, Any],
        real: Scalar = REAL,
    ) -> None:
        super().__init__(parts, real)
        self._function_of = function_of
        self._names = names
        self._variables: dict[str, Value | Known] = {}
        self._used: set[str] = set()  # variables and parameters
        self._written: set[str] = set()  # arrays

    def value_of(self, node: ast.expr) -> Value:
        """Return an expression as a value of C."""
        result = self.evaluate(node)
        return result if isinstance(result, Value) else self._as_value(result)

    def evaluate(self, node: ast.expr) -> Value | Known:
        """Return an expression as a value of C, or what of Python it stands for."""
        match node:
            case ast.Constant(value=bool() | int() | float()):
                return constant(node.value, self.kind_of_number(node.value))
            case ast.Name(id=name):
                return self._named(name)
            case ast.Attribute(value=owner, attr=name):
                return self._attribute(self.evaluate(owner), name)
            case ast.Tuple(elts=parts):
                return tuple_of(tuple(map(self.value_of, parts)))
            case ast.Subscript():
                item = self.item_of(node)
                if isinstance(item, Value) and item.kind is DOUBLE:
                    return Value(f"(real){item.text}", REAL, UNARY)
                return item
            case ast.BinOp():
                return self.operation(node.op, self.value_of(node.left), self.value_of(node.right))
            case ast.UnaryOp(op=ast.USub()):
                return self.negative(self.value_of(node.operand))
            case ast.UnaryOp(op=ast.Not()):
                operand = converted(self.value_of(node.operand), BOOL)
                if operand.constant is not None:
                    return constant(not operand.constant)
                return Value(f"!{operand.within(UNARY)}", BOOL, UNARY)
            case ast.BoolOp():
                return self._joined(node)
            case ast.Compare():
                return self._comparison(node)
            case ast.IfExp():
                return self._choice(node)
            case ast.Call():
                return self._call(node)
        raise NoCError(type(node).__name__)

    def item_of(self, node: ast.Subscript) -> Value | Known:
        """Return an element or a part of an array or a tuple, as it is stored."""
        return self._item(self.evaluate(node.value), node.slice)

    def _named(self, name: str) -> Value | Known:
        if name in self._variables:
            self._used.add(name)
            return self._variables[name]
        if name in self._names:
            return Known(self._names[name], name)
        return Known(getattr(builtins, name), name)

    def _as_value(self, known: Known) -> Value:
        """Return a number of Python by its name; the file defines it."""
        number = known.value
        if isinstance(number, tuple) and not hasattr(number, "_fields"):
            return tuple_of(tuple(constant(part) for part in number))
        if not isinstance(number, bool | int | float | np.generic):
            raise NoCError(f"{known.name or number} as a number")
        value = constant(number, self.kind_of_number(number))
        if not known.name or self._real is DOUBLE or value.kind is BOOL:
            return value
        name = self._parts.define(known.name, number, value.text)
        return Value(name, value.kind, constant=number)

    def _attribute(self, owner: Value | Known, name: str) -> Value | Known:
        if isinstance(owner, Value):
            if name == "shape" and isinstance(owner.kind, ArrayOf):
                return Known(owner.kind.shape)
            raise NoCError(f"{owner.text}.{name}")
        part = getattr(owner.value, name)
        if owner.is_fixed and isinstance(part, bool | int | float):
            return Value(f"{self._parts.record(owner)}.{name}", constant(part).kind)
        if owner.is_fixed:
            return Known(part, f"{owner.name}_{name}", is_fixed=True)
        if owner.value is math:
            return Known(part)
        is_module = inspect.ismodule(owner.value)
        return Known(part, name if is_module else f"{owner.name}_{name}")

    def _item(self, owner: Value | Known, index: ast.expr) -> Value | Known:
        if isinstance(owner, Known):
            return self._known_item(owner, index)
        kind = owner.kind
        if isinstance(kind, TupleOf):
            number = self.value_of(index).constant
            if owner.parts is not None:
                part: Value = owner.parts[number]
                return part
            return Value(f"{owner.text}.at[{number}]", kind.element)
        if not isinstance(kind, ArrayOf):
            raise NoCError(f"{owner.text}[..]")
        if isinstance(index, ast.Slice):
            return self._slice(owner, kind, index)
        indices = index.elts if isinstance(index, ast.Tuple) else [index]
        first = self.value_of(indices[0])
        if len(indices) == 1 and len(kind.shape) == 1:
            text = self._index(first, indices[0], kind.shape[0])
            return Value(f"{owner.within(ATOM)}[{text}]", kind.element, root=owner.root)
        if first.constant != 0 or kind.shape[0] != 1:
            raise NoCError(f"{owner.text}: more rows than one")
        inner = Value(owner.text, ArrayOf(kind.element, kind.shape[1:]), root=owner.root)
        return inner if len(indices) == 1 else self._item(inner, indices[1])

    def _index(self, index: Value, node: ast.expr, length: int) -> str:
        if index.kind is not INT:
            raise NoCError(f"the index {index.text}")
        # Python counts from the end below 0; only differences get there.
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Sub):
            return f"{self._parts.use('wrapped_index')}({index.text}, {length})"
        return index.text

    def _slice(self, owner: Value, kind: ArrayOf, index: ast.Slice) -> Value:
        if index.lower is None or index.upper is None or index.step is not None:
            raise NoCError(f"a slice of {owner.text} without its first and last column")
        first = self.value_of(index.lower)
        last = self.value_of(index.upper)
        if first.constant is None or last.constant is None:
            raise NoCError(f"{owner.text}[{first.text}:{last.text}]")
        part = ArrayOf(kind.element, (last.constant - first.constant,))
        return Value(f"&{owner.text}[{first.text}]", part, UNARY, root=owner.root)

    def _known_item(self, owner: Known, index: ast.expr) -> Value | Known:
        nodes = index.elts if isinstance(index, ast.Tuple) else [index]
        indices = [self.value_of(node) for node in nodes]
        numbers = tuple(value.constant for value in indices)
        if None not in numbers:
            return Known(owner.value[numbers[0] if len(numbers) == 1 else numbers])
        lengths = np.shape(owner.value)
        if len(indices) < len(lengths):
            raise NoCError(f"a row of {owner.name}")
        table = self._parts.table(owner.name, np.asarray(owner.value))
        texts = [self._index(*which) for which in zip(indices, nodes, lengths, strict=True)]
        return Value(table + "".join(f"[{text}]" for text in texts), REAL)

    def _joined(self, node: ast.BoolOp) -> Value:
        operands = [converted(self.value_of(operand), BOOL) for operand in node.values]
        is_and = isinstance(node.op, ast.And)
        numbers = [operand.constant for operand in operands]
        if None not in numbers:
            return constant(all(numbers) if is_and else any(numbers))
        return connected("&&" if is_and else "||", operands)

    def _comparison(self, node: ast.Compare) -> Value:
        for symbol in node.ops:
            if type(symbol) not in _COMPARISONS:
                raise NoCError(type(symbol).__name__)
        values = [self.value_of(operand) for operand in (node.left, *node.comparators)]
        numbers = [value.constant for value in values]
        if None not in numbers:
            pairs = zip(node.ops, numbers, numbers[1:])
            return constant(all(_COMPARED[type(symbol)](a, b) for symbol, a, b in pairs))
        texts = []
        for symbol, left, right in zip(node.ops, values, values[1:]):
            kind = common_kind(left, right)
            sides = (converted(side, kind).within(COMPARISON + 1) for side in (left, right))
            texts.append(f" {_COMPARISONS[type(symbol)]} ".join(sides))
        return Value(" && ".join(texts), BOOL, COMPARISON if len(texts) == 1 else AND)

    def _choice(self, node: ast.IfExp) -> Value:
        condition = converted(self.value_of(node.test), BOOL)
        branches = self.value_of(node.body), self.value_of(node.orelse)
        if condition.constant is not None:
            return branches[0 if condition.constant else 1]
        kind = common_kind(*branches)
        first, second = (converted(branch, kind).within(CHOICE + 1) for branch in branches)
        return Value(f"{condition.within(CHOICE + 1)} ? {first} : {second}", kind, CHOICE)

    def _call(self, node: ast.Call) -> Value | Known:
        if node.keywords:
            raise NoCError("a call with named arguments")
        match node.func:
            case ast.Attribute(value=owner, attr="max"):
                return self._of_array("largest_of", FLOAT, self.value_of(owner))
        called = self.evaluate(node.func)
        if isinstance(called, Value):
            raise NoCError(f"a call of {called.text}")
        function = called.value
        if len(node.args) == 1 and isinstance(node.args[0], ast.Starred):
            values = self.evaluate(node.args[0].value)
            if not isinstance(values, Known):
                raise NoCError(f"{called.name}(*..) of what is not known")
            return Known(function(*values.value), "parameters", is_fixed=True)
        arguments = [self.evaluate(argument) for argument in node.args]
        if not arguments and called.is_fixed:
            return Known(function())
        if inspect.isfunction(python_function(function)):
            return self._kernel_call(function, arguments)
        return self._call_of_library(function, arguments)

    def _call_of_library(self, function: Any, arguments: list[Value | Known]) -> Value | Known:
        if function is len:
            (argument,) = arguments
            return Known(
                len(argument.value) if isinstance(argument, Known) else self._length(argument)
            )
        values = [a if isinstance(a, Value) else self._as_value(a) for a in arguments]
        if function in _MATH:
            is_float = function is np.sqrt and values[0].kind is FLOAT
            return self._math_call(_MATH[function], values, FLOAT if is_float else self._real)
        if function is math.isnan:
            return Value(f"isnan({values[0].text})", BOOL)
        if function is abs:
            return self._math_call("fabs", values, FLOAT if values[0].kind is FLOAT else self._real)
        if function in (min, max):
            kind = common_kind(*values)
            if kind not in (FLOAT, REAL):
                raise NoCError(f"{function.__name__} of integers")
            chosen = self.helped("smaller_of" if function is min else "larger_of", REAL, *values)
            return stored(chosen, FLOAT) if kind is FLOAT else chosen
        if function is np.argmin:
            return self._of_array("place_of_smallest", INT, values[0])
        return self._converted_by(function, values[0])

    def _converted_by(self, function: Any, value: Value) -> Value:
        """Return a number as the kind of Python or numpy that a call names."""
        if function is round:
            nearest = self._math_call("rint", [value], REAL)
            return Value(f"{self._parts.use('whole_number')}({nearest.text})", INT)
        if function is int:
            if value.kind is DOUBLE:
                return Value(f"(int32_t){value.within(UNARY)}", INT, UNARY)
            return Value(f"{self._parts.use('whole_number')}({converted(value, REAL).text})", INT)
        if function is bool:
            return converted(value, BOOL)
        kinds = {float: self._real, np.float32: FLOAT, np.float64: self._real, np.uint64: WORD}
        if function not in kinds:
            raise NoCError(f"a call of {getattr(function, '__name__', function)}")
        kind = kinds[function]
        if value.constant is not None:
            return constant(value.constant, kind)
        if kind is FLOAT:
            return stored(value, FLOAT)
        return widened(value) if kind is REAL else converted(value, kind)

    def _math_call(self, name: str, values: list[Value], kind: Scalar) -> Value:
        """Return a call of a function of math.h, which has an f at the end for floats."""
        called = {DOUBLE: name, REAL: f"REAL({name})", FLOAT: f"{name}f"}[kind]
        texts = ", ".join(converted(value, kind).text for value in values)
        return Value(f"{called}({texts})", kind)

    def _length(self, array: Value) -> int:
        if not isinstance(array.kind, ArrayOf):
            raise NoCError(f"the length of {array.text}")
        return array.kind.shape[0]

    def _of_array(self, name: str, kind: Scalar, array: Value) -> Value:
        return Value(f"{self._parts.use(name)}({array.text}, {self._length(array)})", kind)

    def _kernel_call(self, function: Any, arguments: list[Value | Known]) -> Value:
        """Return a call of another kernel, which is written before this one."""
        plain = [
            a if isinstance(a, Value) or self._stays_known(a) else self._as_value(a)
            for a in arguments
        ]
        callee = self._function_of(function, plain)
        texts = []
        for number, kind in callee.parameters:
            argument = plain[number]
            assert isinstance(argument, Value)
            texts.append(converted(argument, kind).text)
            if number in callee.written:
                self._written.add(argument.root)
        return Value(f"{callee.name}({', '.join(texts)})", callee.kind or INT)

    def _stays_known(self, known: Known) -> bool:
        return known.is_fixed or isinstance(known.value, np.ndarray)


def python_function(kernel: Any) -> Callable[..., Any]:
    """Return the Python function of a kernel, compiled or not."""
    function: Callable[..., Any] = getattr(kernel, "py_func", kernel)
    return function
