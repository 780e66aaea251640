"""The page of promises names tests that exist, run, and can fail."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

import verification

ROOT = Path(verification.__file__).parents[1]
PAGE = ROOT / "docs" / "promises.md"
NAMED = sorted(set(re.findall(r"`(tests/[\w/]+\.py)::(\w+)`", PAGE.read_text(encoding="utf-8"))))


@pytest.mark.parametrize(("file", "name"), NAMED, ids=lambda part: part)
def test_the_test_that_holds_a_promise_exists(file: str, name: str) -> None:
    tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
    functions = {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}
    assert name in functions
    marks = [ast.unparse(mark) for mark in functions[name].decorator_list]
    assert not [mark for mark in marks if re.match(r"pytest\.mark\.(skip\b|xfail)", mark)]
    assert can_fail(functions[name], functions), f"{file}::{name} checks nothing"


# Functions of other modules that raise where a promise is broken.
CHECKS = re.compile(r"raises|assert|warns|check|complain|_test$|^play$")


def can_fail(test: ast.AST, others: dict[str, ast.FunctionDef], depth: int = 3) -> bool:
    """Return whether a function, or one of its module that it calls, asserts something."""
    for node in ast.walk(test):
        if isinstance(node, ast.Assert):
            return True
        if isinstance(node, ast.Call):
            name = ast.unparse(node.func).split(".")[-1]
            if CHECKS.search(name):
                return True
            if depth and name in others and can_fail(others[name], others, depth - 1):
                return True
    return False


def test_every_promise_names_a_test() -> None:
    assert NAMED
    promises, _, _ = PAGE.read_text(encoding="utf-8").partition("## Versions")
    rows = re.findall(r"^\|(?! Promise| Fault|-).*", promises, re.MULTILINE)
    assert [row for row in rows if "`tests/" not in row] == []
