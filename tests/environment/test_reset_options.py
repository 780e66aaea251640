"""Faults as dicts, as JSON and YAML have them, and as texts."""

from __future__ import annotations

from typing import Any

import gymnasium
import pytest
from gymnasium.envs.registration import EnvSpec

from swarm_logistics_env import Fault, Scenario, Warehouse, policies, run_episode
from swarm_logistics_env.core.errors import FaultError, SetupError
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.wrappers import FaultInjection, SwarmSize

GIVEN: list[Any] = [
    "FM1:2@0.1+3",
    {"mode": "motor_slow", "robots": [0, 3], "onset": 0.1, "duration": 2.0, "factor": 0.25},
]
FAULTS: tuple[Fault, ...] = (Fault("FM1", 2, 0.1, 3.0), Fault("motor_slow", (0, 3), 0.1, 2.0, 0.25))


def test_dicts_and_texts_are_the_faults_they_describe_wherever_faults_are_given() -> None:
    scenario = Scenario(n_robots=4, duration=0.3)
    world = Warehouse(scenario)
    world.reset(0, GIVEN)
    assert world.faults == FAULTS
    world.set_faults([*GIVEN, {"mode": "FM2"}])
    assert world.faults == (*FAULTS, Fault("FM2"))
    env = SwarmLogisticsEnv(scenario, faults=GIVEN)
    assert env.faults == FAULTS
    wrapped = FaultInjection(SwarmSize(env, [4]), "FM2", [1])
    wrapped.reset(seed=0, options={"faults": GIVEN[:1]})
    assert env.warehouse.faults == (*FAULTS[:1], Fault("FM2", (1,)))
    first, second = (run_episode(scenario, policies.load("homing"), 0, f) for f in (GIVEN, FAULTS))
    assert first.digest == second.digest
    assert len(first.failed_robots) >= 2


@pytest.mark.parametrize(
    ("faults", "reason"),
    [
        ([{"mode": "FM1", "robot": 2}], "argument 'robot'.*; known: mode, robots"),
        ([{"robots": 2}], "missing .*: 'mode'"),
        (["FM1 2"], "fault 'FM1 2'"),
        ({"mode": "FM1"}, "should be a list of faults"),
        ([3], "should be a list of faults"),
    ],
)
def test_what_is_no_fault_or_no_list_of_them_is_refused(faults: Any, reason: str) -> None:
    with pytest.raises((FaultError, SetupError), match=reason):
        SwarmLogisticsEnv(faults=faults)
    with pytest.raises((FaultError, SetupError), match=reason):
        SwarmLogisticsEnv(n_robots=2).reset(options={"faults": faults})


def test_a_gymnasium_spec_with_faults_goes_through_json() -> None:
    made = gymnasium.make("SwarmLogistics-v0", n_robots=4, flat=True, faults=[{"mode": "FM1"}])
    assert made.spec is not None
    again = gymnasium.make(EnvSpec.from_json(made.spec.to_json()))
    (first, info), (second, other) = made.reset(seed=0), again.reset(seed=0)
    assert first.tobytes() == second.tobytes()
    assert info["failed"].tolist() == other["failed"].tolist()
    assert info["failed"].sum() == 1
