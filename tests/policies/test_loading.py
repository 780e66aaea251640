from __future__ import annotations

import json
import os
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest

from swarm_logistics_env import Scenario, policies, run_episode
from swarm_logistics_env.errors import PolicyError
from swarm_logistics_env.policies import NAMES, Policy, identity, load


@pytest.fixture
def own_module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A module of a user's own, with good and bad policies in it."""
    path = tmp_path / "own_policies.py"
    path.write_text(
        textwrap.dedent(
            """
            import numpy as np

            class Still:
                def __init__(self, gripper=1.0):
                    self.parameters = {"gripper": gripper}

                def reset(self, n_robots, seed):
                    pass

                def act(self, observations):
                    commands = np.zeros((len(observations), 4))
                    commands[:, 3] = self.parameters["gripper"]
                    return commands

                class Inner:
                    def reset(self, n_robots, seed): ...
                    def act(self, observations): ...

            class NoPolicy:
                pass

            class Named(Still):
                identity = "weights 1"

            number = 7
            """
        )
    )
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "own_policies", raising=False)
    return path


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
        ("swarm-td", "no policy 'swarm-td'; did you mean 'swarm-dt'"),
        ("random_walk", "no policy 'random_walk'; did you mean 'random-walk'"),
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


# -- identity -----------------------------------------------------------------------------------


def test_identity_changes_with_the_parameters_and_the_class(own_module: Path) -> None:
    identities = [
        identity(load("swarm-dt")),
        identity(load("swarm-dt", taxis_gain=0.5)),
        identity(load("swarm-dt-follow")),
        identity(load("random-walk")),
        identity(load("own_policies:Still")),
        identity(load("own_policies:Still", gripper=0.5)),
        identity(load("own_policies:Named")),
    ]
    assert len(set(identities)) == len(identities)
    assert identities[-1] == "weights 1"
    assert identity(load("swarm-dt", taxis_gain=0.75)) == identities[0]


def test_identity_does_not_change_by_use() -> None:
    policy = load("swarm-dt")
    before = identity(policy)
    run_episode(Scenario(n_robots=2, duration=1.0), policy, seed=3)
    assert identity(policy) == before


def test_identity_is_the_same_in_every_process_and_follows_the_source(own_module: Path) -> None:
    def told(hash_seed: str) -> list[str]:
        code = (
            "from swarm_logistics_env.policies import identity, load\n"
            "print(identity(load('swarm-dt-follow', drop_rate=2.0)))\n"
            "print(identity(load('own_policies:Still')))"
        )
        environment = {
            **os.environ, "PYTHONHASHSEED": hash_seed, "PYTHONPATH": str(own_module.parent)
        }  # fmt: skip
        done = subprocess.run(
            [sys.executable, "-c", code],
            env=environment,
            capture_output=True,
            text=True,
            check=True,
        )
        return done.stdout.splitlines()

    first = told("1")
    assert first[0] == identity(load("swarm-dt-follow", drop_rate=2.0))
    assert first[1] == identity(load("own_policies:Still"))
    assert json.loads(first[0])["parameters"]["heading_follows"] is True
    own_module.write_text(own_module.read_text() + "\n# changed\n")
    second = told("2")
    assert second[0] == first[0]
    assert second[1] != first[1]
