from __future__ import annotations

import pytest

from swarm_logistics_env import Fault, Scenario
from swarm_logistics_env.cli.options import fault_option, faults_of
from swarm_logistics_env.errors import FaultError


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("FM4", Fault("FM4")),
        ("FM1:2@200", Fault("FM1", 2, onset=200.0)),
        ("FM4_jam:2:carrier@100+50", Fault("FM4_jam", 2, 100.0, 50.0, role="carrier")),
        ("dead[move]:3@.5+2.5", Fault("dead[move]", 3, 0.5, 2.5)),
    ],
)
def test_a_fault_is_written_as_an_option_and_read_back(text: str, fault: Fault) -> None:
    assert faults_of([text], Scenario()) == [fault]
    (again,) = faults_of([fault_option(fault).removeprefix("--fault ")], Scenario())
    assert again == fault


@pytest.mark.parametrize("text", ["FM4:carrier", "FM4:2:@9", "FM4+5", "FM4:2@9+", "FM4@-1", ""])
def test_what_does_not_read_so_is_refused_with_the_form(text: str) -> None:
    with pytest.raises(FaultError, match=r"should be MODE\[:ROBOTS\[:ROLE\]\]\[@ONSET"):
        faults_of([text], Scenario())


def test_a_fault_of_no_time_is_refused() -> None:
    with pytest.raises(FaultError, match="duration"):
        faults_of(["FM4:2@9+0"], Scenario())
