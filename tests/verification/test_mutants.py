"""The mutants of verification.mutants still fit the code; `make mutants` runs the tests on them."""

from __future__ import annotations

import ast

import pytest

from verification.mutants import MUTANTS, ROOT, Mutant


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda mutant: mutant.name)
def test_a_mutant_changes_one_place_of_code_that_stands(mutant: Mutant) -> None:
    source = (ROOT / mutant.file).read_text(encoding="utf-8")
    assert source.count(mutant.old) == 1
    changed = source.replace(mutant.old, mutant.new)
    assert ast.dump(ast.parse(changed)) != ast.dump(ast.parse(source))
    for tests in mutant.tests:
        assert (ROOT / tests).exists()
