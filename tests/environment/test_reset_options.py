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
    {"mode": "motor_slow", "robots": [0, 3], "onset": 1.0, "duration": 2.0, "factor": 0.25},
]
AS_FAULTS = (Fault("FM1", 2), Fault("motor_slow", (0, 3), 1.0, 2.0, 0.25))


def test_a_dict_is_the_fault_of_its_arguments() -> None:
    read = json.loads(json.dumps(AS_DICTS))
    env = SwarmLogisticsEnv(n_robots=4, faults=read)
    assert env.faults == AS_FAULTS
    env = SwarmLogisticsEnv(n_robots=4)
    env.reset(seed=0, options={"faults": read})
    assert env.warehouse.faults == AS_FAULTS
    _, infos = env.reset(seed=0, options={"faults": [AS_DICTS[0]]})
    assert sum(info["failed"] for info in infos.values()) == 2


def test_wrappers_add_to_dicts() -> None:
    env = FaultInjection(SwarmSize(SwarmLogisticsEnv(n_robots=4), [4]), "FM2", [1])
    env.reset(seed=0, options={"faults": AS_DICTS})
    assert env.warehouse.faults == (*AS_FAULTS, Fault("FM2", (1,)))


def test_a_text_is_the_fault_that_it_describes_wherever_faults_are_given() -> None:
    texts = ["FM1:2@0.1+3"]
    faults: tuple[Fault, ...] = (Fault("FM1", 2, 0.1, 3.0),)
    scenario = Scenario(n_robots=4, duration=0.3)
    world = Warehouse(scenario)
    world.reset(0, texts)
    assert world.faults == faults
    world.set_faults([*texts, {"mode": "FM2"}])
    assert world.faults == (*faults, Fault("FM2"))
    env = SwarmLogisticsEnv(scenario, faults=texts)
    assert env.faults == faults
    wrapped = FaultInjection(SwarmSize(env, [4]), "FM2", [1])
    wrapped.reset(seed=0, options={"faults": texts})
    assert env.warehouse.faults == (*faults, Fault("FM2", (1,)))
    policy = policies.load("homing")
    played = run_episode(scenario, policy, 0, texts)
    assert len(played.failed_robots) == 2
    assert played.digest == run_episode(scenario, policy, 0, faults).digest


@pytest.mark.parametrize(
    ("faults", "said"),
    [
        ([{"mode": "FM1", "robot": 2}], "a fault has no 'robot'; did you mean 'robots'"),
        ([{"robots": 2}], r"{'robots': 2} has no \"mode\": should name one, as \"FM1\""),
        ([{"mode": "FM9"}], "no failure mode 'FM9'"),
        ([{"mode": "FM1", "robots": 0}], "Fault.robots = 0"),
        ([{1: "FM1"}], "a fault has no 1"),
        (["FM1:0"], "Fault.robots = 0"),
        (["FM1 2"], r"fault 'FM1 2': should be MODE\["),
    ],
)
def test_a_dict_that_is_no_fault_is_refused(faults: list[Any], said: str) -> None:
    with pytest.raises(FaultError, match=said):
        SwarmLogisticsEnv(faults=faults)
    env = SwarmLogisticsEnv(n_robots=2)
    with pytest.raises(FaultError, match=said):
        env.reset(options={"faults": faults})


@pytest.mark.parametrize("faults", [{"mode": "FM1"}, "FM1", [3], 3, None])
def test_what_is_no_list_of_faults_is_refused(faults: Any) -> None:
    with pytest.raises(SetupError, match=r"should be a list of faults, .*\"mode\": \"FM1\""):
        SwarmLogisticsEnv(faults=faults)


def test_a_gymnasium_spec_with_faults_goes_through_json() -> None:
    made = gymnasium.make("SwarmLogistics-v0", n_robots=4, flat=True, faults=AS_DICTS)
    assert made.spec is not None
    again = gymnasium.make(EnvSpec.from_json(made.spec.to_json()))
    first, info = made.reset(seed=0)
    second, other = again.reset(seed=0)
    assert first.tobytes() == second.tobytes()
    assert info["failed"].tolist() == other["failed"].tolist()
    assert info["failed"].sum() == 2
