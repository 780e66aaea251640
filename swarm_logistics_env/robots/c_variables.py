"""Variables of kernels in C: each is declared where all of its uses see it."""

from __future__ import annotations

import ast
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from typing import TypeAlias


@dataclass
class Home:
    """Where a variable lives: the first statement of the smallest block that has all of its uses.

    Attributes:
        statement: that one; the variable is declared in or before it.
        is_declared_there: whether it gives the variable its first value.
    """

    statement: ast.stmt
    is_declared_there: bool


# Of a use of a variable, from the outermost block in: which block, and the statement in it.
_Path: TypeAlias = tuple[tuple[int, ast.stmt], ...]


def homes_of(definition: ast.FunctionDef) -> dict[str, list[Home]]:
    """Return where the variables of a function live, without its parameters and loops' ones.

    A name that is given a first value in several blocks is a variable of its own in each.
    """
    paths: dict[str, list[_Path]] = {}
    names: set[str] = set()
    loops: set[str] = set()

    def visit(statements: Sequence[ast.stmt], path: _Path) -> None:
        for statement in statements:
            inner = (*path, (id(statements), statement))
            if isinstance(statement, ast.For) and isinstance(statement.target, ast.Name):
                loops.add(statement.target.id)
            parts = [c for c in ast.iter_child_nodes(statement) if not isinstance(c, ast.stmt)]
            for node in chain.from_iterable(map(ast.walk, parts)):
                if isinstance(node, ast.Name):
                    paths.setdefault(node.id, []).append(inner)
                    if isinstance(node.ctx, ast.Store):
                        names.add(node.id)
            visit(getattr(statement, "body", []), inner)
            visit(getattr(statement, "orelse", []), inner)

    visit(definition.body, ())
    names -= loops.union(argument.arg for argument in definition.args.args)
    return {name: _homes(name, paths[name], 0) for name in names}


def _homes(name: str, uses: list[_Path], depth: int) -> list[Home]:
    """Return where a variable lives whose uses share a block at a depth."""
    while (
        all(len(use) > depth + 1 for use in uses) and len({use[depth + 1][0] for use in uses}) == 1
    ):
        depth += 1
    statement = uses[0][depth][1]
    if _is_target(name, statement):
        return [Home(statement, is_declared_there=True)]
    groups: dict[object, list[_Path]] = {}
    for use in uses:
        block = use[depth + 1][0] if len(use) > depth + 1 else None
        groups.setdefault((use[depth][1], block), []).append(use)
    if len(groups) > 1:
        homes = [home for group in groups.values() for home in _homes(name, group, depth)]
        if all(home.is_declared_there for home in homes):
            return homes
    return [Home(statement, is_declared_there=False)]


def _is_target(name: str, statement: ast.stmt) -> bool:
    """Return whether a statement assigns to a variable, alone or among others."""
    match statement:
        case ast.Assign(targets=[ast.Tuple(elts=targets)]):
            return any(isinstance(node, ast.Name) and node.id == name for node in targets)
        case ast.Assign(targets=[ast.Name(id=target)]) | ast.AnnAssign(target=ast.Name(id=target)):
            return target == name
    return False
