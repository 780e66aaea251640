"""Functions and files are small enough to be read."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

import swarm_logistics_env

MOST_LINES, MOST_PARAMETERS = 80, 12
PACKAGE = Path(swarm_logistics_env.__file__).parent
RESEARCH = sorted((Path(__file__).parents[1] / "research").glob("*.py"))
FILES = [*sorted(PACKAGE.rglob("*.py")), *RESEARCH]


@pytest.mark.parametrize("path", FILES, ids=lambda path: "/".join(path.parts[-2:]))
def test_functions_are_short_and_take_few_parameters(path: Path) -> None:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    too_big = []
    for function in functions:
        arguments = function.args
        n_parameters = len(arguments.posonlyargs) + len(arguments.args) + len(arguments.kwonlyargs)
        n_lines = (function.end_lineno or function.lineno) - function.lineno + 1
        if path.parent.name == "cli" and function.name.endswith("_command"):
            n_parameters = 0  # they are the options of a command line
        if n_parameters > MOST_PARAMETERS or n_lines > MOST_LINES:
            too_big.append(f"{function.name}: {n_parameters} parameters, {n_lines} lines")
    assert too_big == []


def test_no_two_modules_have_one_name() -> None:
    names = [path.stem for path in PACKAGE.rglob("*.py") if not path.stem.startswith("__")]
    assert {name for name in names if names.count(name) > 1} == set()


def test_no_file_of_the_package_is_too_long_to_be_read() -> None:
    files = [*PACKAGE.rglob("*.py"), *RESEARCH]
    lengths = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in files}
    assert {name: n for name, n in lengths.items() if n > 400} == {}
