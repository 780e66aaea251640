"""The mutants in the lists still fit the code; `make mutants` runs the tests on them."""

from __future__ import annotations

import ast
from functools import cache

from verification.mutants.mutation import (
    PACKAGE,
    ROOT,
    Mutant,
    MutantError,
    change,
    mutated,
    read_mutants,
)


@cache
def source_of(file: str) -> str:
    return (ROOT / PACKAGE / file).read_text(encoding="utf-8")


@cache
def tree_of(file: str) -> ast.Module:
    return ast.parse(source_of(file))


def changes_something(mutant: Mutant) -> bool:
    """Return whether the code of the file is another with it; raises if it does not fit."""
    if not mutant.file.endswith(".py"):
        source = source_of(mutant.file)
        return mutated(mutant, source) != source
    old, new = change(mutant, tree_of(mutant.file))
    return ast.dump(old) != ast.dump(new)


def test_each_mutant_changes_one_place_of_the_code_and_has_tests() -> None:
    problems = []
    for mutant in read_mutants():
        try:
            if not changes_something(mutant):
                problems.append(f"{mutant.name}: changes nothing")
        except MutantError as error:
            problems.append(str(error))
        missing = [test for test in mutant.tests if not (ROOT / test.partition("::")[0]).exists()]
        problems += [f"{mutant.name}: no file {test}" for test in missing]
    assert problems == []
