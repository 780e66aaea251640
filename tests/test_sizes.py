"""Functions, files and rooms are small enough to be read, and do not grow unseen.

To raise `MOST_LINES_OF_CODE`, say in the commit what the lines are for and who asked for them.
"""

from __future__ import annotations

import ast
import io
import tokenize
from pathlib import Path

import pytest

import swarm_logistics_env

MOST_LINES, MOST_PARAMETERS = 80, 12
MOST_LINES_OF_CODE = 26_100
NO_CODE = (tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT,
           tokenize.ENDMARKER)  # fmt: skip
PACKAGE = Path(swarm_logistics_env.__file__).parent
# A command's parameters are the options of its command line.
FILES = sorted(path for path in PACKAGE.rglob("*.py") if path.parent.name != "cli")


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.relative_to(PACKAGE).as_posix())
def test_functions_are_short_and_take_few_parameters(path: Path) -> None:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    too_big = []
    for function in functions:
        given = function.args
        n_parameters = len(given.posonlyargs) + len(given.args) + len(given.kwonlyargs)
        n_lines = (function.end_lineno or function.lineno) - function.lineno + 1
        if n_parameters > MOST_PARAMETERS or n_lines > MOST_LINES:
            too_big.append(f"{function.name}: {n_parameters} parameters, {n_lines} lines")
    assert too_big == []


def test_no_two_modules_have_one_name() -> None:
    names = [path.stem for path in PACKAGE.rglob("*.py") if not path.stem.startswith("__")]
    assert {name for name in names if names.count(name) > 1} == set()


def lines_of_code(path: Path) -> int:
    """Return how many lines a file has without blanks, comments and docstrings."""
    text = path.read_text(encoding="utf-8")
    prose: set[int] = set()
    for node in ast.walk(ast.parse(text)):
        body = getattr(node, "body", None)
        if isinstance(body, list) and body and isinstance(body[0], ast.Expr):
            first = body[0].value
            if isinstance(first, ast.Constant) and isinstance(first.value, str):
                prose |= set(range(body[0].lineno, (body[0].end_lineno or 0) + 1))
    lines: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in NO_CODE and token.start[0] not in prose:
            lines |= set(range(token.start[0], token.end[0] + 1))
    return len(lines)


def test_the_package_does_not_grow_unseen() -> None:
    assert sum(map(lines_of_code, PACKAGE.rglob("*.py"))) <= MOST_LINES_OF_CODE


def test_no_file_of_the_package_is_too_long_to_be_read() -> None:
    files = PACKAGE.rglob("*.py")
    lengths = {path.name: len(path.read_text(encoding="utf-8").splitlines()) for path in files}
    assert {name: n for name, n in lengths.items() if n > 400} == {}
