"""Where a fault can be made in a module.

Left out is what cannot change behaviour: docstrings, annotations, decorators, texts of errors and
of warnings, `__all__`, imports and what only a type checker reads.
"""

from __future__ import annotations

import ast
from collections.abc import Collection, Iterator
from typing import NamedTuple, TypeGuard

from .operators import (
    TEXTS,
    Nodes,
    Required,
    name_of_call,
    replace_expression,
    replace_statement,
)

_KERNEL_DECORATORS = {"kernel", "inlined_kernel", "engine_kernel"}
# Calls whose arguments are texts for people, or types for the checker.
_SAYS = {"warn", "warning", "cast", "TypeVar", "ParamSpec", "getLogger"}
_NEVER_TESTED = ("TYPE_CHECKING", "not TYPE_CHECKING", "__name__ == '__main__'")


class Place(NamedTuple):
    """A node that can be replaced, and all that can replace it."""

    node: ast.expr | ast.stmt
    replacements: Nodes
    where: str  # function, method (`Class.method`) or constant that holds the node
    is_in_kernel: bool  # whether compiled code holds it
    is_outside_functions: bool


class _Scope(NamedTuple):
    where: str
    is_function: bool = False
    is_in_kernel: bool = False
    return_type: str = ""


def find_places(tree: ast.Module, required: Required) -> list[Place]:
    """Return the places of faults in a module, in the order of its lines."""
    return [
        place
        for statement in tree.body
        for place in _places_in_statement(statement, _Scope(""), required)
    ]


def required_parameters(trees: Collection[ast.Module]) -> dict[str, set[str]]:
    """Return the parameters without a default, by the name of the function or class."""
    required: dict[str, set[str]] = {}
    for tree in trees:
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                required.setdefault(node.name, set()).update(_without_default(node.args))
            elif isinstance(node, ast.ClassDef):
                required.setdefault(node.name, set()).update(_fields_without_default(node))
    return required


def is_kernel(node: ast.AST) -> TypeGuard[ast.FunctionDef]:
    """Return whether a node is a function that numba compiles."""
    if not isinstance(node, ast.FunctionDef):
        return False
    return any(ast.unparse(name) in _KERNEL_DECORATORS for name in node.decorator_list)


def _places_in_statement(node: ast.stmt, scope: _Scope, required: Required) -> Iterator[Place]:
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
        yield from _places_in_function(node, scope, required)
        return
    if _changes_no_run(node):
        return
    if isinstance(node, ast.ClassDef):
        scope = _Scope(_joined(scope.where, node.name))
    elif scope.is_function:
        replacements = replace_statement(node, scope.return_type)
        if replacements:
            yield _place(node, replacements, scope)
    elif not scope.where:
        scope = _Scope(_assigned_name(node))
    if isinstance(node, ast.Raise):
        return
    for child in _children(node):
        yield from _places_below(child, scope, required)


def _places_in_function(
    node: ast.FunctionDef | ast.AsyncFunctionDef, scope: _Scope, required: Required
) -> Iterator[Place]:
    return_type = "" if node.returns is None else ast.unparse(node.returns)
    is_in_kernel = scope.is_in_kernel or is_kernel(node)
    where = _joined(scope.where, node.name)
    inner = _Scope(where, is_function=True, is_in_kernel=is_in_kernel, return_type=return_type)
    defaults = [default for default in node.args.kw_defaults if default is not None]
    for child in [*node.args.defaults, *defaults, *node.body]:
        yield from _places_below(child, inner, required)


def _places_below(node: ast.AST, scope: _Scope, required: Required) -> Iterator[Place]:
    if isinstance(node, ast.stmt):
        yield from _places_in_statement(node, scope, required)
        return
    if _is_for_readers(node):
        return
    if isinstance(node, ast.expr):
        replacements = replace_expression(node, required)
        if replacements:
            yield _place(node, replacements, scope)
    for child in _children(node):
        yield from _places_below(child, scope, required)


def _place(node: ast.expr | ast.stmt, replacements: Nodes, scope: _Scope) -> Place:
    return Place(node, replacements, scope.where, scope.is_in_kernel, not scope.is_function)


def _children(node: ast.AST) -> Iterator[ast.AST]:
    left_out = [
        *getattr(node, "decorator_list", []),
        getattr(node, "annotation", None),
        getattr(node, "format_spec", None),
    ]
    for child in ast.iter_child_nodes(node):
        if child not in left_out:
            yield child


def _changes_no_run(node: ast.stmt) -> bool:
    if isinstance(node, ast.Import | ast.ImportFrom | ast.Global | ast.Nonlocal):
        return True
    if isinstance(node, ast.Expr):
        return isinstance(node.value, ast.Constant) or _is_for_readers(node.value)
    if isinstance(node, ast.If):
        return ast.unparse(node.test) in _NEVER_TESTED
    return _assigned_name(node) == "__all__"


def _is_for_readers(node: ast.AST) -> bool:
    """Return whether what is no statement makes an error, a warning, a help text or a type."""
    if isinstance(node, ast.keyword):
        return node.arg in TEXTS
    if isinstance(node, ast.Call):
        name = name_of_call(node)
        return name in _SAYS or name.endswith(("Error", "Warning"))
    return isinstance(node, ast.MatchValue | ast.arguments)


def _joined(where: str, name: str) -> str:
    return f"{where}.{name}" if where else name


def _assigned_name(node: ast.stmt) -> str:
    target = node.targets[0] if isinstance(node, ast.Assign) else getattr(node, "target", None)
    return target.id if isinstance(target, ast.Name) else ""


def _without_default(arguments: ast.arguments) -> set[str]:
    positional = [*arguments.posonlyargs, *arguments.args]
    n_required = len(positional) - len(arguments.defaults)
    names = {argument.arg for argument in positional[:n_required]}
    pairs = zip(arguments.kwonlyargs, arguments.kw_defaults)
    return names | {argument.arg for argument, default in pairs if default is None}


def _fields_without_default(node: ast.ClassDef) -> set[str]:
    fields = [field for field in node.body if isinstance(field, ast.AnnAssign)]
    names = {ast.unparse(field.target) for field in fields if field.value is None}
    for method in node.body:
        if isinstance(method, ast.FunctionDef) and method.name == "__init__":
            names |= _without_default(method.args)
    return names
