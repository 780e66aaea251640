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

FIELDS: dict[str, Any] = {"seeds": 20, "first_seed": 3, "sizes": [{"values": [2, 4]}]}
STANDSTILL = "longest_standstill:9"


@pytest.mark.parametrize(
    ("declared_fields", "planned_fields", "is_covered"),
    [
        ({}, {}, True),
        ({}, {"seeds": 10}, False),
        ({}, {"seeds": 30}, False),
        ({}, {"first_seed": 4}, False),
        ({}, {"performance": STANDSTILL}, False),
        ({"performance": STANDSTILL}, {"performance": STANDSTILL}, True),
        ({"performance": STANDSTILL}, {"performance": "longest_standstill:8"}, False),
        ({"performance": STANDSTILL}, {}, False),
        ({"until_clear": True}, {"until_clear": True}, True),
        ({"until_clear": True}, {}, False),
        ({}, {"until_clear": True}, True),  # fewer looks than were declared
        ({}, {"margin": 0.2}, True),
    ],
)
def test_verdicts_are_declared_over_the_same_seeds_looks_and_p(
    declared_fields: dict[str, Any], planned_fields: dict[str, Any], is_covered: bool
) -> None:
    declaration = Declaration.model_validate(Specification(**{**FIELDS, **declared_fields}))
    assert declaration.covers(Study(**{**FIELDS, **planned_fields}).plan()) == is_covered
    assert Declaration.model_validate_json(declaration.model_dump_json()) == declaration


def test_a_declaration_holds_seeds_looks_margin_and_p() -> None:
    fields = {**FIELDS, "margin": 0.2, "performance": STANDSTILL, "until_clear": True}
    assert Declaration.model_validate(Specification(**fields)).model_dump() == {
        "first_seed": 3, "seeds": 20, "looks": (10, 20), "margin": 0.2, "performance": STANDSTILL,
    }  # fmt: skip
    for name, value in (
        ("seeds", 0), ("seeds", 2.0), ("first_seed", -1), ("looks", [0]), ("margin", 1.0),
    ):  # fmt: skip
        with pytest.raises(ValidationError):
            Declaration.model_validate({"first_seed": 0, "seeds": 2, name: value})


def test_all_that_was_imported_is_declared(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text("robots,P\n4,1\n8,2\n")
    plan = RecordedStudy.of(read_trials(tmp_path / "t.csv")).plan
    assert Declaration(first_seed=7, seeds=9).covers(plan)
