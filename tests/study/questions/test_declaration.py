"""Which verdicts a study declared before its first run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError

from swarm_logistics_env.study.questions.declaration import Declaration
from swarm_logistics_env.study.questions.specification import Specification
from swarm_logistics_env.study.runs.recorded import RecordedStudy
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.trials import read_trials

ASKED: dict[str, Any] = {"seeds": 20, "first_seed": 3, "sizes": [{"values": [2, 4]}]}
P95 = "longest_standstill:9"


@pytest.mark.parametrize(
    ("declared", "asked", "is_covered"),
    [
        ({}, {}, True),
        ({}, {"seeds": 10}, False),
        ({}, {"seeds": 30}, False),
        ({}, {"first_seed": 4}, False),
        ({}, {"performance": P95}, False),
        ({"performance": P95}, {"performance": P95}, True),
        ({"performance": P95}, {"performance": "longest_standstill:8"}, False),
        ({"performance": P95}, {}, False),
        ({"until_clear": True}, {"until_clear": True}, True),
        ({"until_clear": True}, {}, False),
        ({}, {"until_clear": True}, True),  # fewer looks than were declared
        ({}, {"margin": 0.2}, True),
    ],
)
def test_verdicts_are_declared_over_the_same_seeds_looks_and_p(
    declared: dict[str, Any], asked: dict[str, Any], is_covered: bool
) -> None:
    declaration = Declaration.model_validate(Specification(**{**ASKED, **declared}))
    assert declaration.covers(Study(**{**ASKED, **asked}).plan()) == is_covered
    assert Declaration.model_validate_json(declaration.model_dump_json()) == declaration


def test_a_declaration_holds_what_was_asked() -> None:
    asked = {**ASKED, "margin": 0.2, "performance": P95, "until_clear": True}
    assert Declaration.model_validate(Specification(**asked)).model_dump() == {
        "first_seed": 3, "seeds": 20, "looks": (10, 20), "margin": 0.2, "performance": P95,
    }  # fmt: skip
    for wrong in (
        {"seeds": 0},
        {"seeds": 2.0},
        {"first_seed": -1},
        {"looks": [0]},
        {"margin": 1.0},
    ):
        with pytest.raises(ValidationError):
            Declaration.model_validate({"first_seed": 0, "seeds": 2, **wrong})


def test_all_that_was_imported_is_declared(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text("robots,P\n4,1\n8,2\n")
    plan = RecordedStudy.of(read_trials(tmp_path / "t.csv")).plan
    assert Declaration(first_seed=7, seeds=9).covers(plan)
