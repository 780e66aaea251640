"""The page of promises names tests that exist and are not left out."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

import verification

ROOT = Path(verification.__file__).parents[1]
PAGE = ROOT / "tests" / "README.md"
NAMED = sorted(set(re.findall(r"`(tests/[\w/]+\.py)::(\w+)`", PAGE.read_text(encoding="utf-8"))))


@pytest.mark.parametrize(("file", "name"), NAMED, ids=lambda part: part)
def test_the_test_that_holds_a_promise_exists(file: str, name: str) -> None:
    tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
    functions = {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}
    assert name in functions
    marks = [ast.unparse(mark) for mark in functions[name].decorator_list]
    assert not [mark for mark in marks if re.match(r"pytest\.mark\.(skip\b|xfail)", mark)]


def test_every_promise_names_a_test() -> None:
    assert NAMED
    promises, _, _ = PAGE.read_text(encoding="utf-8").partition("## Versions")
    rows = re.findall(r"^\|(?! Promise| Fault|-).*", promises, re.MULTILINE)
    assert [row for row in rows if "`tests/" not in row] == []
