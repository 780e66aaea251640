from __future__ import annotations

import pytest

from swarm_logistics_env import Fault
from swarm_logistics_env.errors import FaultError
from swarm_logistics_env.warehouse.fault_text import fault_of, text_of


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("FM4:1", Fault("FM4")),
        ("FM1:2@200", Fault("FM1", 2, onset=200.0)),
        ("FM1:2@1234.567", Fault("FM1", 2, onset=1234.567)),
        ("FM4_jam:2:carrier@100+50", Fault("FM4_jam", 2, 100.0, 50.0, role="carrier")),
        ("dead:3@0+2.5", Fault("dead", 3, 0.0, 2.5)),
    ],
)
def test_a_fault_is_written_as_text_and_read_back(text: str, fault: Fault) -> None:
    assert fault_of(text) == fault
    assert text_of(fault) == text
    assert fault_of("FM4@.5") == Fault("FM4", onset=0.5)  # parts may be left out


@pytest.mark.parametrize(
    "fault", [Fault("motor_slow", 2, factor=0.3), Fault("FM4", [1, 2]), Fault("FM4", onset=1e-13)]
)
def test_what_no_text_describes_has_none(fault: Fault) -> None:
    assert text_of(fault) is None


@pytest.mark.parametrize("text", ["FM4:carrier", "FM4:2:@9", "FM4+5", "FM4:2@9+", "FM4@-1", ""])
def test_what_does_not_read_so_is_refused_with_the_form(text: str) -> None:
    with pytest.raises(FaultError, match=r"should be MODE\[:ROBOTS\[:ROLE\]\]\[@ONSET"):
        fault_of(text)
