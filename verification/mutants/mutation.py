"""A fault made on purpose: where it is, what it changes, and the source with it."""

import ast
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
PACKAGE = "swarm_logistics_env"
EQUAL = Path(__file__).with_name("equal.toml")


class Mutant(NamedTuple):
    """A fault: one node of a syntax tree becomes another; elsewhere than in Python a text does."""

    name: str  # what goes wrong with it
    room: str  # the list that it stands in
    file: str  # in the package
    where: str  # function, method (`Class.method`) or constant that holds the node
    node: str  # expression or statement, as Python source; its layout does not matter
    becomes: str  # what replaces it; an expression replaces an expression
    tests: list[str]  # those that stand nearest to the fault, the likely killer first
    interpreted: bool = False  # whether kernels run in the interpreter, as it changes one
    survives: str = ""  # why no test catches it; empty: one should


class MutantError(ValueError):
    """A mutant whose place in the code is gone."""


def read_mutants() -> tuple[Mutant, ...]:
    """Return the mutants of all lists."""
    paths = sorted(Path(__file__).parent.glob("*.toml"))
    return tuple(mutant for path in paths if path != EQUAL for mutant in _read_list(path))


def read_equal() -> tuple[Mutant, ...]:
    """Return the faults that change no behaviour: `survives` tells why. They have no tests."""
    return tuple(_read_list(EQUAL))


def _read_list(path: Path) -> Iterator[Mutant]:
    listed = tomllib.loads(path.read_text(encoding="utf-8"))
    common = {key: listed.pop(key) for key in ("tests", "interpreted") if key in listed}
    for name, fields in listed.items():
        file, _, where = fields.pop("at").partition(" ")
        node = fields.pop("was")
        yield Mutant(name, path.stem, file, where, node, **{**common, **fields})


def mutated(mutant: Mutant, source: str) -> str:
    """Return the source of `mutant.file` with the fault in it, of Python without comments."""
    if not mutant.file.endswith(".py"):
        _check_once(mutant, source.count(mutant.node))
        return source.replace(mutant.node, mutant.becomes)
    tree = ast.parse(source)
    return replaced(tree, *change(mutant, tree))


def change(mutant: Mutant, tree: ast.Module) -> tuple[ast.AST, ast.AST]:
    """Return the node of the file's tree that a mutant replaces, and what stands there then."""
    definition = _definition(tree, mutant)
    old, new = _node(mutant.node), _node(mutant.becomes)
    wanted = ast.dump(old)
    # Of its kind alone, as the text of a node is as long as all that is in it.
    alike = (node for node in ast.walk(definition) if type(node) is type(old))
    matches = [node for node in alike if ast.dump(node) == wanted]
    _check_once(mutant, len(matches))
    if isinstance(matches[0], ast.expr) and isinstance(new, ast.Pass):
        new = ast.Constant(None)
    if isinstance(matches[0], ast.stmt) and isinstance(new, ast.expr):
        new = ast.Expr(new)
    return matches[0], new


def replaced(tree: ast.Module, old: ast.AST, new: ast.AST) -> str:
    """Return the source of a module with one node replaced, without comments."""
    changed = ast.unparse(ast.fix_missing_locations(_Replace(old, new).visit(tree)))
    compile(changed, "mutant", "exec")
    return changed


def _check_once(mutant: Mutant, times: int) -> None:
    if times != 1:
        raise MutantError(
            f"{mutant.name}: {mutant.node!r} is {times} times in `{mutant.where}` of "
            f"{mutant.file}: should be there once, so adapt the mutant to the code"
        )


class _Replace(ast.NodeTransformer):
    def __init__(self, old: ast.AST, new: ast.AST) -> None:
        self._old, self._new = old, new

    def visit(self, node: ast.AST) -> ast.AST:
        return self._new if node is self._old else super().visit(node)


def _node(source: str) -> ast.AST:
    (statement,) = ast.parse(source).body
    return statement.value if isinstance(statement, ast.Expr) else statement


def _definition(tree: ast.Module, mutant: Mutant) -> ast.AST:
    definition: ast.Module | ast.ClassDef = tree
    for name in mutant.where.split("."):
        matches = [node for node in definition.body if name in _names(node)]
        if len(matches) != 1:
            raise MutantError(
                f"{mutant.name}: {mutant.file} defines `{mutant.where}` {len(matches)} times: "
                "should be once, so adapt the mutant to the code"
            )
        definition = matches[0]  # type: ignore[assignment]  # a name that is no class ends the path
    return definition


def _names(node: ast.stmt) -> list[str]:
    """Return the names that a statement defines."""
    if isinstance(node, ast.Assign):
        return [target.id for target in node.targets if isinstance(target, ast.Name)]
    definitions = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef
    return [node.name] if isinstance(node, definitions) else []
