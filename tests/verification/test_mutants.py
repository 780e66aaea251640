"""The mutants in the lists still fit the code; `make mutants` runs the tests on them."""

from __future__ import annotations

import ast

import pytest

from verification.mutants.mutation import PACKAGE, ROOT, Mutant, mutated, read_mutants


@pytest.mark.parametrize("mutant", read_mutants(), ids=lambda mutant: mutant.name)
def test_a_mutant_changes_one_place_of_the_code(mutant: Mutant) -> None:
    source = (ROOT / PACKAGE / mutant.file).read_text(encoding="utf-8")
    before = ast.unparse(ast.parse(source)) if mutant.file.endswith(".py") else source
    assert mutated(mutant, source) != before
    for tests in mutant.tests:
        assert (ROOT / tests.partition("::")[0]).exists()
