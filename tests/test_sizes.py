"""Functions, files and rooms are small enough to be read, and do not grow unseen.

To raise a number of `MOST`, say in the commit what the lines are for and who asked for them.
"""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections.abc import Iterable
from pathlib import Path

import pytest

import swarm_logistics_env

MOST_LINES, MOST_PARAMETERS = 80, 12
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
    names = [path.stem for path in PACKAGE.rglob("*.py") if path.stem != "__init__"]
    assert {name for name in names if names.count(name) > 1} == set()


ROOT = PACKAGE.parent
MOST = {
    "lines of code of the package": 16_210,
    "tokens of the package": 147_430,
    "files of the package": 124,
    "lines of code of studies and report": 3_610,
    "lines of tests": 14_545,
    "lines of verification, benchmarks, interop and the scripts of docs": 4_700,
    "lines of studies, report and tasks with Any, cast, object or type: ignore": 25,
}
_NO_CODE = (tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT,
            tokenize.ENDMARKER)  # fmt: skip
_UNTYPED = re.compile(r"\b(Any|cast|object|type: ignore)\b")


def code_of(path: Path) -> tuple[int, int]:
    """Return the lines and tokens of a file, without blanks, comments and docstrings."""
    text = path.read_text(encoding="utf-8")
    prose: set[int] = set()
    for node in ast.walk(ast.parse(text)):
        body = getattr(node, "body", None)
        if isinstance(body, list) and body and isinstance(body[0], ast.Expr):
            first = body[0].value
            if isinstance(first, ast.Constant) and isinstance(first.value, str):
                prose |= set(range(body[0].lineno, (body[0].end_lineno or 0) + 1))
    lines: set[int] = set()
    tokens = 0
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in _NO_CODE and token.start[0] not in prose:
            tokens += 1
            lines |= set(range(token.start[0], token.end[0] + 1))
    return len(lines), tokens


def lines_in(*folders: str) -> Iterable[str]:
    for folder in folders:
        for path in (ROOT / folder).rglob("*.py"):
            yield from path.read_text(encoding="utf-8").splitlines()


@pytest.mark.skipif(not (ROOT / "tests").is_dir(), reason="the package alone is installed")
def test_rooms_do_not_grow_unseen() -> None:
    package = {path: code_of(path) for path in PACKAGE.rglob("*.py")}
    told = [sum(1 for _ in lines_in(*rooms)) for rooms in (
        ("tests",), ("verification", "benchmarks", "interop", "docs"))]  # fmt: skip
    rooms = [f"swarm_logistics_env/{room}" for room in ("studies", "report", "tasks")]
    found = (
        sum(lines for lines, _ in package.values()),
        sum(tokens for _, tokens in package.values()),
        len(package),
        sum(n for path, (n, _) in package.items() if path.parent.name in ("studies", "report")),
        *told,
        sum(_UNTYPED.search(line) is not None for line in lines_in(*rooms)),
    )
    assert {what: n for (what, most), n in zip(MOST.items(), found) if n > most} == {}


def test_no_file_of_the_package_is_too_long_to_be_read() -> None:
    files = PACKAGE.rglob("*.py")
    lengths = {path.name: len(path.read_text(encoding="utf-8").splitlines()) for path in files}
    assert {name: n for name, n in lengths.items() if n > 400} == {}
