"""The mutants in the lists still fit the code; `make mutants` runs the tests on them."""

from __future__ import annotations

import ast
from dataclasses import replace

import pytest

from verification.mutants.mutation import (
    PACKAGE,
    ROOT,
    Mutant,
    MutantError,
    mutated,
    read_mutants,
)

TIMES = Mutant("times", "file.py", "Clock.read", "a + b * 2", "a", ())
CLOCK = """
class Clock:
    def set(self): return a + b * 2
    def read(self):
        return (
            a
            + b*2  # a comment
        )
"""


@pytest.mark.parametrize("mutant", read_mutants(), ids=lambda mutant: mutant.name)
def test_a_mutant_changes_one_place_of_the_code(mutant: Mutant) -> None:
    source = (ROOT / PACKAGE / mutant.file).read_text(encoding="utf-8")
    before = ast.unparse(ast.parse(source)) if mutant.file.endswith(".py") else source
    assert mutated(mutant, source) != before
    for tests in mutant.tests:
        assert (ROOT / tests.partition("::")[0]).exists()


def test_a_mutant_does_not_depend_on_the_layout_of_the_code() -> None:
    lines = mutated(TIMES, CLOCK).split()
    assert lines[-2:] == ["return", "a"]
    assert "b" in lines  # the other method stays as it was


def test_a_statement_can_be_taken_away() -> None:
    mutant = replace(TIMES, where="read", node="x = 1", becomes="pass")
    assert "x" not in mutated(mutant, "def read(x):\n    x = 1\n    return 0").split()


@pytest.mark.parametrize(
    ("mutant", "words"),
    [
        (replace(TIMES, node="a + b * 3"), "'a . b . 3' is 0 times in `Clock.read`"),
        (replace(TIMES, where="Clock"), "is 2 times in `Clock`"),
        (replace(TIMES, where="Clock.stop"), "defines `Clock.stop` 0 times"),
    ],
)
def test_a_place_that_is_gone_or_not_unique_is_an_error(mutant: Mutant, words: str) -> None:
    with pytest.raises(MutantError, match=words):
        mutated(mutant, CLOCK)
