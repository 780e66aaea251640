"""The mutants in the lists still fit the code; `make mutants` runs the tests on them."""

from __future__ import annotations

import ast
from functools import cache

from verification.mutants.mutation import PACKAGE, ROOT, MutantError, mutated, read_mutants


@cache
def source_of(file: str) -> tuple[str, str]:
    """Return the text of a file, and the same as a mutant is written without a change."""
    source = (ROOT / PACKAGE / file).read_text(encoding="utf-8")
    return source, ast.unparse(ast.parse(source)) if file.endswith(".py") else source


def test_each_mutant_changes_one_place_of_the_code_and_has_tests() -> None:
    problems = []
    for mutant in read_mutants():
        source, unchanged = source_of(mutant.file)
        try:
            if mutated(mutant, source) == unchanged:
                problems.append(f"{mutant.name}: changes nothing")
        except MutantError as error:
            problems.append(str(error))
        missing = [test for test in mutant.tests if not (ROOT / test.partition("::")[0]).exists()]
        problems += [f"{mutant.name}: no file {test}" for test in missing]
    assert problems == []
