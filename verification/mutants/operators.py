"""Operators that make faults: what may stand in place of a node of a syntax tree.

Numbers change, comparisons turn, terms and arguments are dropped, calls and checks are skipped,
conditions are negated, functions return another value.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Collection, Mapping
from typing import TypeVar

T = TypeVar("T")
Nodes = list[ast.expr | ast.stmt]
# By the name of a function, the parameters that every call has to give.
Required = Mapping[str, Collection[str]]

_TURNED: dict[type[ast.cmpop], tuple[type[ast.cmpop], ...]] = {
    ast.Lt: (ast.LtE, ast.GtE),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.LtE),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
}
_ANOTHER_OPERATION: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
}
_ANOTHER_FUNCTION = {
    "min": "max",
    "max": "min",
    "minimum": "maximum",
    "maximum": "minimum",
    "any": "all",
    "all": "any",
    "floor": "ceil",
    "ceil": "floor",
    "sin": "cos",
    "cos": "sin",
}
# A call with so many arguments may be replaced by each of them.
_N_ARGUMENTS = {
    "min": 2,
    "max": 2,
    "minimum": 2,
    "maximum": 2,
    "abs": 1,
    "round": 1,
    "sorted": 1,
    "reversed": 1,
    "deepcopy": 1,
}
# Arguments that people read.
TEXTS = {"help", "metavar", "rich_help_panel", "stacklevel", "prog"}


def replace_statement(node: ast.stmt, return_type: str) -> Nodes:
    """Return what may stand in place of a statement of a function.

    `return_type`: the annotation of what the function returns.
    """
    match node:
        case ast.Expr(ast.Call() | ast.Await()) | ast.AugAssign():
            return [ast.Pass()]
        case ast.Assign([ast.Subscript()]):
            return [ast.Pass()]
        case ast.Raise(exc=ast.Call(), cause=None):
            return [ast.Pass()]
        case ast.Return(None):
            return [ast.Pass()]
        case ast.Return():
            return _another_value(node, return_type)
        case ast.Continue():
            return [ast.Pass(), ast.Break()]
        case ast.Break():
            return [ast.Continue()]
        case ast.If():
            return [ast.If(_negated(node.test), node.body, node.orelse)]
    return []


def replace_expression(node: ast.expr, required: Required) -> Nodes:
    """Return what may stand in place of an expression."""
    if isinstance(node, ast.Call):
        return _for_call(node, required.get(name_of_call(node), ()))
    make = _FOR_EXPRESSION.get(type(node))
    return [] if make is None else make(node)


def name_of_call(node: ast.Call) -> str:
    """Return the last name of the function that is called; empty: it has none."""
    if isinstance(node.func, ast.Attribute):
        return node.func.attr
    return node.func.id if isinstance(node.func, ast.Name) else ""


def _another_value(node: ast.Return, return_type: str) -> Nodes:
    value = node.value
    assert value is not None
    is_none = isinstance(value, ast.Constant) and value.value is None
    if return_type == "bool":
        return [ast.Return(_negated(value))]
    if return_type in ("int", "float"):
        return [ast.Return(ast.BinOp(value, ast.Add(), ast.Constant(1)))]
    if return_type.endswith(" | None") and not is_none:
        return [ast.Return(ast.Constant(None))]
    return []


def _negated(test: ast.expr) -> ast.expr:
    if isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not):
        return test.operand
    return ast.UnaryOp(ast.Not(), test)


def _for_call(node: ast.Call, required: Collection[str]) -> Nodes:
    results: Nodes = []
    for index, keyword in enumerate(node.keywords):
        if keyword.arg not in required and keyword.arg not in TEXTS:
            rest = _without(node.keywords, index)
            results.append(ast.Call(node.func, node.args, rest))
    name = name_of_call(node)
    if name in _ANOTHER_FUNCTION:
        results.append(ast.Call(_renamed(node.func), node.args, node.keywords))
    if len(node.args) == _N_ARGUMENTS.get(name):
        results.extend(node.args)
    return results


def _for_constant(node: ast.Constant) -> Nodes:
    value = node.value
    if isinstance(value, bool):
        return [ast.Constant(not value)]
    if isinstance(value, int):
        return [ast.Constant(value + 1), ast.Constant(value - 1)]
    if isinstance(value, float) and value == 0.0:
        return [ast.Constant(1.0)]
    if isinstance(value, float):
        return [ast.Constant(2.0 * value), ast.Constant(0.5 * value)]
    return []


def _for_comparison(node: ast.Compare) -> Nodes:
    results: Nodes = []
    for index, operation in enumerate(node.ops):
        for turned in _TURNED[type(operation)]:
            operations = [*node.ops[:index], turned(), *node.ops[index + 1 :]]
            results.append(ast.Compare(node.left, operations, node.comparators))
    return results


def _for_binary(node: ast.BinOp) -> Nodes:
    if _is_text(node.left) or _is_text(node.right):
        return []
    results: Nodes = [node.left, node.right]
    another = _ANOTHER_OPERATION.get(type(node.op))
    if another is not None:
        results.append(ast.BinOp(node.left, another(), node.right))
    return results


def _for_boolean(node: ast.BoolOp) -> Nodes:
    another = ast.Or() if isinstance(node.op, ast.And) else ast.And()
    results: Nodes = [ast.BoolOp(another, node.values)]
    for index in range(len(node.values)):
        rest = _without(node.values, index)
        results.append(rest[0] if len(rest) == 1 else ast.BoolOp(node.op, rest))
    return results


def _for_unary(node: ast.UnaryOp) -> Nodes:
    return [node.operand]


def _for_condition(node: ast.IfExp) -> Nodes:
    return [ast.IfExp(_negated(node.test), node.body, node.orelse), node.body, node.orelse]


def _for_comprehension(node: ast.ListComp | ast.SetComp | ast.GeneratorExp) -> Nodes:
    results: Nodes = []
    for index, loop in enumerate(node.generators):
        if loop.ifs:
            bare = ast.comprehension(loop.target, loop.iter, [], loop.is_async)
            loops = [*node.generators[:index], bare, *node.generators[index + 1 :]]
            results.append(type(node)(node.elt, loops))
    return results


def _for_dict(node: ast.Dict) -> Nodes:
    unpacked = [index for index, key in enumerate(node.keys) if key is None]
    return [ast.Dict(_without(node.keys, i), _without(node.values, i)) for i in unpacked]


def _for_sequence(node: ast.List | ast.Tuple) -> Nodes:
    results: Nodes = []
    for index, element in enumerate(node.elts):
        if isinstance(element, ast.Starred):
            results.append(type(node)(_without(node.elts, index), node.ctx))
    return results


_FOR_EXPRESSION: dict[type[ast.expr], Callable[..., Nodes]] = {
    ast.Constant: _for_constant,
    ast.Compare: _for_comparison,
    ast.BinOp: _for_binary,
    ast.BoolOp: _for_boolean,
    ast.UnaryOp: _for_unary,
    ast.IfExp: _for_condition,
    ast.ListComp: _for_comprehension,
    ast.SetComp: _for_comprehension,
    ast.GeneratorExp: _for_comprehension,
    ast.Dict: _for_dict,
    ast.List: _for_sequence,
    ast.Tuple: _for_sequence,
}


def _without(items: list[T], index: int) -> list[T]:
    return items[:index] + items[index + 1 :]


def _renamed(function: ast.expr) -> ast.expr:
    if isinstance(function, ast.Attribute):
        return ast.Attribute(function.value, _ANOTHER_FUNCTION[function.attr], ast.Load())
    assert isinstance(function, ast.Name)
    return ast.Name(_ANOTHER_FUNCTION[function.id], ast.Load())


def _is_text(node: ast.expr) -> bool:
    if isinstance(node, ast.BinOp):
        return _is_text(node.left) or _is_text(node.right)
    is_constant = isinstance(node, ast.Constant) and isinstance(node.value, str | bytes)
    return is_constant or isinstance(node, ast.JoinedStr)
