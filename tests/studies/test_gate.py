from __future__ import annotations

import pytest

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.studies.gate import Gate


@pytest.mark.parametrize(
    ("text", "failing"),
    [
        ("R < 0", {"refuted"}),
        ("R > 0", {"supported"}),
        ("possibly R < 0", {"refuted", "inconclusive"}),
        ("possibly  change>-1e-1 at N = 5", {"supported", "inconclusive"}),
    ],
)
def test_which_verdicts_fail(text: str, failing: set[str]) -> None:
    gate = Gate.parse(text)
    assert {v for v in ("supported", "refuted", "inconclusive") if gate.fails_on(v)} == failing


def test_parts_are_read() -> None:
    gate = Gate.parse(" possibly change > -0.1 at FM1, m = 2 ")
    assert (gate.possibly, gate.subject, gate.below, gate.number, gate.at) == (
        True, "change", False, -0.1, "FM1, m = 2",
    )  # fmt: skip
    assert Gate.parse("FT<0").at == ""


@pytest.mark.parametrize(
    "text", ["", "R", "R <", "R < x", "R <= 0", "Q < 0", "R < 0 and S < 0", "R < nan", "R < inf"]
)
def test_what_is_no_gate_is_refused(text: str) -> None:
    with pytest.raises(StudyError, match="should be"):
        Gate.parse(text)
