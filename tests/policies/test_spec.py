from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from swarm_logistics_env import Scenario, policies, run_episode
from swarm_logistics_env.errors import PolicyError
from swarm_logistics_env.policies import NAMES, Policy, load


@pytest.mark.parametrize("name", NAMES)
def test_a_named_policy_loads_and_runs(name: str) -> None:
    policy = load(name)
    assert isinstance(policy, Policy)
    assert run_episode(Scenario(n_robots=3, duration=2.0), policy, seed=0).ended_at == 2.0


def test_the_names_that_are_promised_are_there() -> None:
    assert {"swarm-dt", "swarm-dt-follow", "random-walk"} <= set(policies.NAMES)


def test_a_class_is_loaded_by_module_and_name(own_module: Path) -> None:
    policy = load("own_policies:Still", gripper=0.25)
    policy.reset(2, 0)
    assert policy.act(np.zeros((2, 140), np.float32))[0, 3] == 0.25
    assert isinstance(load("own_policies:Still.Inner"), Policy)


@pytest.mark.parametrize(
    ("name", "complaint"),
    [
        ("swarm-td", r"no policy 'swarm-td' \(.* or a file\); did you mean 'swarm-dt'\?$"),
        ("random_walk", "no policy 'random_walk' .*; did you mean 'random-walk'"),
        ("", "no policy ''"),
        ("no_such_module:Class", "cannot be imported: No module named 'no_such_module'"),
        ("own_policies:Stil", "cannot be imported: .* no attribute 'Stil'"),
        ("own_policies:number", "is a int: should be a class"),
        ("own_policies:NoPolicy", "is no policy: it should have the methods reset and act"),
        (":Class", "cannot be imported"),
        ("own_policies:", "cannot be imported"),
    ],
)
def test_what_is_no_policy_is_refused_with_the_reason(
    own_module: Path, name: str, complaint: str
) -> None:
    with pytest.raises(PolicyError, match=complaint):
        load(name)


def test_parameters_are_validated(own_module: Path) -> None:
    with pytest.raises(PolicyError, match="no field 'taxis_gian'; did you mean 'taxis_gain'"):
        load("swarm-dt", taxis_gian=1.0)
    with pytest.raises(PolicyError, match=r"drop_rate = -1.0: should be greater than or equal"):
        load("swarm-dt", drop_rate=-1.0)
    with pytest.raises(PolicyError, match=r"cannot be made: .*'grip'"):
        load("own_policies:Still", grip=1.0)


def test_each_load_is_a_policy_of_its_own() -> None:
    assert load("swarm-dt") is not load("swarm-dt")
