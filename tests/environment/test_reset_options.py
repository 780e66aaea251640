"""Faults as dicts, as JSON and YAML have them, and as texts."""

from __future__ import annotations

import json
from typing import Any

import gymnasium
import pytest
from gymnasium.envs.registration import EnvSpec

from swarm_logistics_env import Fault, Scenario, Warehouse, policies, run_episode
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.errors import FaultError, SetupError
from swarm_logistics_env.wrappers import FaultInjection, SwarmSize

AS_DICTS: list[dict[str, Any]] = [
    {"mode": "FM1", "robots": 2},
    {"mode": "motor_slow", "robots": [0, 3], "onset": 0.1, "duration": 2.0, "factor": 0.25},
]
FORMS: list[tuple[list[Any], tuple[Fault, ...]]] = [
    (
        json.loads(json.dumps(AS_DICTS)),
        (Fault("FM1", 2), Fault("motor_slow", (0, 3), 0.1, 2.0, 0.25)),
    ),
    (["FM1:2@0.1+3"], (Fault("FM1", 2, 0.1, 3.0),)),
]


@pytest.mark.parametrize(("given", "faults"), FORMS)
def test_dicts_and_texts_are_the_faults_they_describe_wherever_faults_are_given(
    given: list[Any], faults: tuple[Fault, ...]
) -> None:
    scenario = Scenario(n_robots=4, duration=0.3)
    world = Warehouse(scenario)
    world.reset(0, given)
    assert world.faults == faults
    world.set_faults([*given, {"mode": "FM2"}])
    assert world.faults == (*faults, Fault("FM2"))
    env = SwarmLogisticsEnv(scenario, faults=given)
    assert env.faults == faults
    env.reset(seed=0, options={"faults": given[:1]})
    assert env.warehouse.faults == faults[:1]
    wrapped = FaultInjection(SwarmSize(env, [4]), "FM2", [1])
    wrapped.reset(seed=0, options={"faults": given})
    assert env.warehouse.faults == (*faults, Fault("FM2", (1,)))
    episodes = [run_episode(scenario, policies.load("homing"), 0, each) for each in (given, faults)]
    assert episodes[0].digest == episodes[1].digest
    assert len(episodes[0].failed_robots) >= 2


@pytest.mark.parametrize(
    ("faults", "said"),
    [
        ([{"mode": "FM1", "robot": 2}], "a fault has no 'robot'; did you mean 'robots'"),
        ([{"robots": 2}], r"{'robots': 2} has no \"mode\": should name one, as \"FM1\""),
        ([{"mode": "FM9"}], "no failure mode 'FM9'"),
        ([{1: "FM1"}], "a fault has no 1"),
        (["FM1:0"], "Fault.robots = 0"),
        (["FM1 2"], r"fault 'FM1 2': should be MODE\["),
        *(
            (none, r"should be a list of faults, .*\"mode\": \"FM1\"")
            for none in ({"mode": "FM1"}, "FM1", [3], 3, None)
        ),
    ],
)
def test_what_is_no_fault_or_no_list_of_them_is_refused(faults: Any, said: str) -> None:
    with pytest.raises((FaultError, SetupError), match=said):
        SwarmLogisticsEnv(faults=faults)
    with pytest.raises((FaultError, SetupError), match=said):
        SwarmLogisticsEnv(n_robots=2).reset(options={"faults": faults})


def test_a_gymnasium_spec_with_faults_goes_through_json() -> None:
    made = gymnasium.make("SwarmLogistics-v0", n_robots=4, flat=True, faults=AS_DICTS)
    assert made.spec is not None
    again = gymnasium.make(EnvSpec.from_json(made.spec.to_json()))
    (first, info), (second, other) = made.reset(seed=0), again.reset(seed=0)
    assert first.tobytes() == second.tobytes()
    assert info["failed"].tolist() == other["failed"].tolist()
    assert info["failed"].sum() == 2
